// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "cli/arm/arm_line.h"
#include "cli/arm/outline.h"
#include "corbot/arm/workspace_limits.h"

namespace corbot::cli {

/// One view of the arm, as parts of an SVG. Lengths are in px, or in m if the name says so.
class Panel {
 public:
  Panel(const DrawnPlane& plane, const ReachRegion& reach, const ArmLine& arm);

  [[nodiscard]] double width_m() const { return high_m_[0] - low_m_[0]; }
  [[nodiscard]] double height_m() const { return high_m_[1] - low_m_[1]; }
  /// Sets the upper left corner and the scale.
  void place(double left, double top, double px_per_m);

  [[nodiscard]] double left() const { return left_; }
  [[nodiscard]] double right() const { return x(high_m_[0]); }
  [[nodiscard]] double bottom() const { return y(low_m_[1]); }
  /// Draws lines at round numbers, with the numbers.
  [[nodiscard]] std::string grid() const;
  [[nodiscard]] std::string reach() const;
  /// Shades where the workspace forbids parts of the arm. Faces along the view are left out, so a box shows
  /// its outline.
  [[nodiscard]] std::string forbidden(const WorkspaceLimits& limits) const;
  /// Draws a foot below the base, for the view from the side only.
  [[nodiscard]] std::string foot(double width) const;
  [[nodiscard]] std::string arm(double joint_radius) const;

 private:
  [[nodiscard]] std::string polygon(const Outline& corners_m) const;
  [[nodiscard]] double x(double right_m) const { return left_ + (right_m - low_m_[0]) * px_per_m_; }
  [[nodiscard]] double y(double up_m) const { return top_ + (high_m_[1] - up_m) * px_per_m_; }

  DrawnPlane plane_;
  std::vector<Outline> outlines_;
  ArmLine arm_;
  PlanePoint low_m_{}, high_m_{};
  double left_{}, top_{}, px_per_m_{1.0};
};

/// Draw the symbols of joints and tool, also for a legend.
[[nodiscard]] std::string joint_symbol(JointKind kind, double x, double y, double radius);
[[nodiscard]] std::string tool_symbol(double x, double y, double radius);

/// Returns 1, 2 or 5 times a power of ten, at most this long.
[[nodiscard]] double round_length(double most_m);

}  // namespace corbot::cli
