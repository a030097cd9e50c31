// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "config/arms/description.h"
#include "config/arms/four_axis.h"
#include "config/arms/urdf_chain.h"
#include "config/driven_joint.h"
#include "config/section.h"

namespace corbot {

/// The content of `[geometry]`, `[base]`, `[tool]` and the joints' rows while a profile is read.
struct GeometryInput {
  config::GeometryForm form{config::GeometryForm::kLengths};
  bool is_complete{true};  ///< nothing is missing or refused so far
  config::FourAxisLengths lengths{};
  DhConvention convention{DhConvention::kStandard};
  config::UrdfChain urdf{};
  std::string urdf_file{};
  Pose base_T_0{}, n_T_tool{};
  std::array<DhRow, kMaxJoints> rows{};
  Joints home_q{};
  std::vector<DrivenJoint> joints{};  ///< empty if their number is wrong
};

/// Largest size of a URDF's file in bytes, so that a profile has space for its text.
inline constexpr std::size_t kMaxUrdfBytes = 1u << 19;

/// Reads `[geometry]` in one of its three forms, and `[base]` and `[tool]` with the last two. `root`: the
/// profile's root.
[[nodiscard]] GeometryInput read_geometry(Section& root, Section section, const std::string& profile_file);

/// Returns the number of joints that the profile must have; 0: any from 1 to kMaxJoints.
[[nodiscard]] std::size_t joints_of(const GeometryInput& input);

/// Reads `kind`, `dh` and `home_...` of one joint. Returns whether it rotates or slides.
JointKind read_joint_geometry(Section& joint, std::size_t index, GeometryInput& input);

/// Recognises the arm's family, stores the description in `profile`, and refuses contradictions. To be called
/// after all joints.
void recognise_geometry(Section& robot, Section& geometry, const GeometryInput& input, std::size_t joints,
                        Profile& profile);

/// Returns the text of a URDF that is in the profile itself, or in a file beside it. Throws
/// config::UrdfError.
[[nodiscard]] std::string read_urdf(const std::string& file_or_text, const std::string& profile_file);

/// Returns true if the value is the text itself.
[[nodiscard]] bool is_urdf_text(const std::string& file_or_text);

}  // namespace corbot
