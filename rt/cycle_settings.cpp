// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle_settings.h"

#include <algorithm>

namespace corbot::rt {
namespace {

std::int64_t to_ns(double time_s) { return static_cast<std::int64_t>(time_s * 1e9); }

}  // namespace

CycleSettings cycle_settings(const Profile& profile) {
  CycleSettings settings;
  settings.liveness = {profile.gap_fault_ns, profile.orphan_ns};
  settings.stop_category = profile.stop.category;
  settings.ramp_ns = to_ns(profile.stop.ramp_s);
  for (std::size_t i = 0; i < std::min(profile.following.size(), kMaxJoints); ++i) {
    const FollowingLimits& joint = profile.following[i];
    settings.following[i] = {joint.error_q, to_ns(joint.time_s), joint.goal_q};
  }
  settings.settle_ns = to_ns(profile.settle_s);
  return settings;
}

}  // namespace corbot::rt
