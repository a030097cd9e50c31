// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "corbot/arm/arm_model.h"

namespace corbot {

/// A point of a drawn plane, m: right and up.
using PlanePoint = std::array<double, 2>;

/// A plane through a point of the base frame, spanned by two unit vectors, onto which positions are
/// projected.
struct DrawnPlane {
  Vector3 origin_m{};
  Vector3 right{1.0, 0.0, 0.0};
  Vector3 up{0.0, 0.0, 1.0};
  [[nodiscard]] PlanePoint along(const Vector3& v) const { return {dot(v, right), dot(v, up)}; }
  [[nodiscard]] PlanePoint operator()(const Vector3& p_m) const { return along(p_m - origin_m); }
};

/// The places that the tool centre point can reach in a plane, in square cells. Every position within the
/// joints' ranges projects into a marked cell. Every marked cell is at most four cells away from such a
/// position (the tests measure under five). If a rotary joint 1 sweeps the plane, the distance is at most
/// eight cells.
struct ReachRegion {
  PlanePoint low_m{};  ///< corner of cell (0, 0)
  double cell_m{};
  std::size_t columns{}, rows{};
  std::vector<char> marked{};  ///< row by row, from the lowest; the border stays empty

  [[nodiscard]] bool at(std::size_t column, std::size_t row) const {
    return marked[row * columns + column] != 0;
  }
  [[nodiscard]] bool contains(const PlanePoint& p_m) const;
};

/// About this number of cells covers the larger side of the reached region.
inline constexpr std::size_t kReachCells = 300;

/// Returns the reached region by halving the joints' ranges. A box of joint values projects into its image by
/// the Jacobian, a polygon, widened by a bound of the second derivatives. A box is done if marked cells
/// contain all of it. If the bound is below a cell, the box marks the cells that it touches. Else it is
/// halved. No position can therefore fall between samples. If joint 1 turns about the plane's normal, the
/// cells of one of its values are rotated, which is quicker. `joint1_q` fixes joint 1.
[[nodiscard]] ReachRegion reach_region(const ArmModel& arm, const DrawnPlane& plane,
                                       std::optional<double> joint1_q);

}  // namespace corbot
