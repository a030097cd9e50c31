// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <variant>

#include "corbot/motion/path.h"

namespace corbot::numeric {

/// The tool's goal at s on a line or an arc, and its derivatives.
class PathFunction {
 public:
  explicit PathFunction(const LineMotion& line) : path_(line), turn_rad_(turn_of(line.tool)) {}
  explicit PathFunction(const ArcMotion& arc)
      : path_(arc), turn_rad_(turn_of(arc.tool)), bend_m_(arc.radius_m * arc.angle_rad * arc.angle_rad) {}

  [[nodiscard]] PathPoint point(double s) const noexcept {
    return std::visit([s](const auto& path) { return point_at(path, s); }, path_);
  }
  [[nodiscard]] Vector3 velocity_m(double s) const noexcept {
    return std::visit([s](const auto& path) { return velocity_at(path, s); }, path_);
  }
  /// Returns the second derivative of the position, which points to the centre of an arc.
  [[nodiscard]] Vector3 bend_m(double s) const noexcept {
    const auto* arc = std::get_if<ArcMotion>(&path_);
    if (arc == nullptr) return {};
    return arc->angle_rad * arc->angle_rad * (arc->centre_m - point_at(*arc, s).position_m);
  }
  /// Returns the length of that derivative, which is constant.
  [[nodiscard]] double bend_m() const noexcept { return bend_m_; }
  /// Returns the constant angular velocity of the tool, base frame. If the arm follows angles instead,
  /// returns their rates.
  [[nodiscard]] const Vector3& turn_rad() const noexcept { return turn_rad_; }

 private:
  std::variant<LineMotion, ArcMotion> path_;
  Vector3 turn_rad_{};
  double bend_m_{};
};

}  // namespace corbot::numeric
