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

/// What `[geometry]`, `[base]`, `[tool]` and the joints' rows say, while a profile is read.
struct GeometryInput {
  config::GeometryForm form{config::GeometryForm::kLengths};
  bool is_complete{true};  ///< nothing was missing or refused so far
  config::FourAxisLengths lengths{};
  DhConvention convention{DhConvention::kStandard};
  config::UrdfChain urdf{};
  std::string urdf_file{};
  Pose base_T_0{}, n_T_tool{};
  std::array<DhRow, kMaxJoints> rows{};
  Joints home_q{};
  std::vector<DrivenJoint> joints{};  ///< empty where their number is wrong
};

/// A URDF's file may have this many bytes, so that a profile has room for its text.
inline constexpr std::size_t kMaxUrdfBytes = 1u << 19;

/// `[geometry]` in one of its three forms, and `[base]` and `[tool]` with the last two. `root`: the profile's.
[[nodiscard]] GeometryInput read_geometry(Section& root, Section section, const std::string& profile_file);

/// How many joints the profile must have; 0: any from 1 to kMaxJoints.
[[nodiscard]] std::size_t joints_of(const GeometryInput& input);

/// `kind`, `dh` and `home_...` of one joint. Whether it turns or slides.
JointKind read_joint_geometry(Section& joint, std::size_t index, GeometryInput& input);

/// Recognises the arm's family, and says in `profile` how it was described; refuses what does not fit. After all joints.
void recognise_geometry(Section& robot, Section& geometry, const GeometryInput& input, std::size_t joints,
                        Profile& profile);

/// The text of a URDF that stands in the profile itself, or in a file beside it. Throws config::UrdfError.
[[nodiscard]] std::string read_urdf(const std::string& file_or_text, const std::string& profile_file);

/// Whether it is the text itself.
[[nodiscard]] bool is_urdf_text(const std::string& file_or_text);

}  // namespace corbot
