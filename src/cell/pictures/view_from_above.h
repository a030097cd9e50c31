// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <limits>
#include <utility>

#include <Eigen/Core>

namespace corbot::cell {

// Lengths of the drawing are in units of its view box, which scales to any size.
inline constexpr double kViewWidth = 800;
inline constexpr double kViewMargin = 26;

/// Maps the cell, seen from above, to the drawing. Turns it if it is longer along y than along x.
class ViewFromAbove {
 public:
  void take(const Eigen::Vector3d& point, double around_m = 0) {
    for (int i = 0; i < 2; ++i) {
      low_m_[i] = std::min(low_m_[i], point[i] - around_m);
      high_m_[i] = std::max(high_m_[i], point[i] + around_m);
    }
  }
  void fit() {
    const Eigen::Vector2d size_m = high_m_ - low_m_;
    is_turned_ = size_m.y() > size_m.x();
    const double across_m = is_turned_ ? size_m.y() : size_m.x();
    scale_ = (kViewWidth - 2 * kViewMargin) / across_m;
    height_ = scale_ * (is_turned_ ? size_m.x() : size_m.y()) + 2 * kViewMargin;
  }
  [[nodiscard]] Eigen::Vector2d operator()(const Eigen::Vector3d& p) const {
    const double down = is_turned_ ? high_m_.x() - p.x() : high_m_.y() - p.y();
    const double right = is_turned_ ? high_m_.y() - p.y() : p.x() - low_m_.x();
    return Eigen::Vector2d(right, down) * scale_ + Eigen::Vector2d(kViewMargin, kViewMargin);
  }
  [[nodiscard]] double length(double length_m) const { return length_m * scale_; }
  [[nodiscard]] double height() const { return height_; }
  /// Returns the names of the axes that point to the right and up.
  [[nodiscard]] std::pair<const char*, const char*> axes() const {
    return is_turned_ ? std::pair("\xe2\x88\x92y", "x") : std::pair("x", "y");
  }

 private:
  Eigen::Vector2d low_m_{Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity())};
  Eigen::Vector2d high_m_{-low_m_};
  bool is_turned_{false};
  double scale_{1};
  double height_{};
};

}  // namespace corbot::cell
