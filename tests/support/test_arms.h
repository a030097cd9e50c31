// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include "config/load_profile.h"
#include "support/paths.h"

// The arms that suites run over: each of the six kinds, and one, three, four, five and six joints, slides
// among them. Property tests take further ones.

namespace corbot::test {

inline constexpr std::array<const char*, 10> kTestArms{
    "lynx5",         "al5d_wr",         "puma560",   "scara_gx4", "stanford",
    "cartesian_ppp", "cylindrical_rpp", "polar_rrp", "turntable", "xarm6"};

/// The shipped profile of this name, or the one that only tests need: without its workspace, and for a
/// busy machine.
inline std::string profile_path(const std::string& name) { return CORBOT_TEST_PROFILES "/" + name + ".toml"; }
/// The arm in one process, with a period of 1 ms.
inline ArmModel arm_of(const std::string& name) {
  ArmModel arm = load_profile(profile_path(name)).arm;
  arm.period_ns = 1'000'000;
  return arm;
}
/// Returns true if the arm can do lines and arcs: with a closed form, or by knots. Among the arms above only
/// the turntable has neither room nor freedom for any.
inline bool has_paths(const ArmModel& arm) {
  return arm.kinematics.has_closed_form() || arm.dof == kMaxJoints;
}

}  // namespace corbot::test
