// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "corbot/arm/arm_model.h"

namespace corbot {

/// A point of a drawn plane, m: to the right and up.
using PlanePoint = std::array<double, 2>;

/// A plane through a point of the base frame, of two unit vectors, onto which positions are projected.
struct DrawnPlane {
  Vector3 origin_m{};
  Vector3 right{1.0, 0.0, 0.0};
  Vector3 up{0.0, 0.0, 1.0};
  [[nodiscard]] PlanePoint along(const Vector3& v) const { return {dot(v, right), dot(v, up)}; }
  [[nodiscard]] PlanePoint operator()(const Vector3& p_m) const { return along(p_m - origin_m); }
};

/// Where the tool centre point gets in a plane, in square cells. Every position within the joints' ranges
/// projects into a cell that is marked; every marked cell is at most four
/// cells away from such a position, eight where a turning joint 1 sweeps the plane (the tests measure under five).
struct ReachRegion {
  PlanePoint low_m{};  ///< the corner of cell (0, 0)
  double cell_m{};
  std::size_t columns{}, rows{};
  std::vector<char> marked{};  ///< row by row, from the lowest; the border stays empty

  [[nodiscard]] bool at(std::size_t column, std::size_t row) const {
    return marked[row * columns + column] != 0;
  }
  [[nodiscard]] bool contains(const PlanePoint& p_m) const;
};

/// The larger side of what is reached has about this many cells.
inline constexpr std::size_t kReachCells = 300;

/// The method halves the joints' ranges. The projection of a box of joint values lies in the Jacobian's image
/// of the box, a polygon, widened by a bound of the second derivatives. A box is done where marked cells hold
/// all of that. It marks the cells that it touches where the bound is below a cell. Else it is halved. So no
/// position falls between samples. A joint 1 about the plane's normal turns the cells of one of its values,
/// which costs less. With `joint1_q` joint 1 stands there.
[[nodiscard]] ReachRegion reach_region(const ArmModel& arm, const DrawnPlane& plane,
                                       std::optional<double> joint1_q);

}  // namespace corbot
