// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "corbot/arm/arm_model.h"
#include "sim/scene/capsule.h"

namespace corbot::sim {

/// Where an arm stands: its base frame turned about the vertical. World, metres, radians.
struct ArmBase {
  Eigen::Vector3d position_m{Eigen::Vector3d::Zero()};
  double yaw_rad{0};
};

/// A parallel gripper whose fingers close horizontally. World, metres.
struct Hand {
  Eigen::Vector3d tool_m{Eigen::Vector3d::Zero()};  ///< tool centre point, the middle between the finger tips
  Eigen::Vector3d direction{Eigen::Vector3d::UnitX()};  ///< along the hand, an axis of the tool frame
  Eigen::Vector3d across{
      Eigen::Vector3d::UnitY()};  ///< horizontal unit vector, along which the fingers close
  double opening_m{0};
  /// Horizontal, at right angles to `across`.
  [[nodiscard]] Eigen::Vector3d along() const { return {across.y(), -across.x(), 0}; }
};

/// An arm where its servos stand.
struct ArmBody {
  Joints q{};
  std::vector<Capsule> links;  ///< from the base to the tool centre point
  Hand hand;
};

/// `shaft_us`: where the servo of a channel stands, as a pulse width. `opening_m`: between the open fingers.
/// A link runs between the points of two successive turning axes that are nearest to each other. Between
/// parallel axes, as in a SCARA, a link is as high as the point in the profile's geometry. A sliding joint
/// lengthens its link. The hand points along the last link, also downward. The fingers close along the tool
/// frame's z axis, or along y if z is the hand's direction. They close along the third axis if that axis is
/// nearer to the horizontal.
[[nodiscard]] ArmBody arm_body(const ArmModel& model, const ArmBase& base, double opening_m,
                               const std::function<double(std::size_t channel)>& shaft_us);

/// How near arms came to each other.
class ArmClearance {
 public:
  void check(std::span<const ArmBody> arms);
  /// Least distance of two arms so far, metres; infinite where there is one arm. Negative: they overlapped.
  [[nodiscard]] double nearest_m() const { return nearest_m_; }
  /// Times that two arms which were apart came to overlap.
  [[nodiscard]] int touches() const { return touches_; }

 private:
  double nearest_m_{std::numeric_limits<double>::infinity()};
  int touches_{0};
  std::set<std::pair<std::size_t, std::size_t>> overlapping_;
};

}  // namespace corbot::sim
