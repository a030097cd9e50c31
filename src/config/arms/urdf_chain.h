// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <stdexcept>
#include <string>
#include <string_view>

#include "corbot/kinematics/joint_chain.h"

namespace corbot::config {

/// What is wrong with a URDF.
class UrdfError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A joint that moves, as the URDF has it. Rad or m.
struct UrdfJoint {
  std::string name;
  bool is_bounded{};  ///< has a lower limit below its upper one; a continuous joint has none
  double lower_q{};
  double upper_q{};
};

/// The joints from one link to another, in their order.
struct UrdfChain {
  JointChain chain;  ///< frame 0 is the base link; zero_T_n ends at the tip link
  std::array<UrdfJoint, kMaxJoints> joints{};
};

/// Reads the URDF's XML. Fixed joints are parts of their links; what branches off (a gripper) is left out. Throws UrdfError: not a
/// URDF, a link that is missing, no way from base to tip, more than six joints, or one that is neither turning nor sliding, or
/// follows another (mimic). Not thread-safe, since urdfdom's messages are caught by a handler of the whole process.
[[nodiscard]] UrdfChain read_urdf_chain(const std::string& xml, const std::string& base_link,
                                        const std::string& tip_link);

}  // namespace corbot::config
