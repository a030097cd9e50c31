// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <stdexcept>
#include <string>
#include <string_view>

#include "corbot/kinematics/joint_chain.h"

namespace corbot::config {

/// A fault of a URDF.
class UrdfError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A movable joint of the URDF. Rad or m.
struct UrdfJoint {
  std::string name;
  bool is_bounded{};  ///< has a lower limit below its upper one; a continuous joint does not
  double lower_q{};
  double upper_q{};
};

/// The joints from one link to another, in order.
struct UrdfChain {
  JointChain chain;  ///< frame 0 is the base link; zero_T_n ends at the tip link
  std::array<UrdfJoint, kMaxJoints> joints{};
};

/// Reads the URDF's XML. Fixed joints become parts of their links; branches (a gripper) are ignored. Throws
/// UrdfError if the text is not a URDF or a link is missing. Throws it if no path leads from base to tip, or
/// there are more than six joints. Throws it for a joint that neither rotates nor slides, or that follows
/// another one (mimic). Not thread-safe, since a process-wide handler receives urdfdom's messages.
[[nodiscard]] UrdfChain read_urdf_chain(const std::string& xml, const std::string& base_link,
                                        const std::string& tip_link);

}  // namespace corbot::config
