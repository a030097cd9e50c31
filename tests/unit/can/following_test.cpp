// SPDX-License-Identifier: Apache-2.0
// The limits of following error in profiles/lynx5-can.toml are such that its drives keep them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "config/load_profile.h"
#include "corbot/motion/law_evaluation.h"
#include "planner/time_law_planner.h"
#include "rt/backends/can/can_load.h"
#include "sim/devices/cia402_drive.h"
#include "support/paths.h"

namespace corbot {
namespace {

constexpr std::int64_t kMillisecond_ns = 1'000'000;
/// From the shaft to the cycle that compares it: two periods of SYNC, one of the loop, and as much once more.
constexpr std::int64_t kMeasuredLate_ns = 10 * kMillisecond_ns;

TEST(DriveFollowing, TheShippedDrivesKeepTheirLimits) {
  const Profile profile = load_profile(CORBOT_PROFILES "/lynx5-can.toml");
  const auto sync_ns = rt::sync_period_ns(profile.arm.dof + 1, profile.arm.period_ns, 1'000'000);
  ASSERT_TRUE(sync_ns);
  for (std::size_t joint = 0; joint < profile.arm.dof; ++joint) {
    const JointLimits& limits = profile.arm.joints[joint];
    const FollowingLimits& following = profile.following.at(joint);
    const double counts = profile.backend.socketcan.drives.at(joint).counts_per_q;
    // As far and as fast as the joint goes.
    const TimeLaw law = plan_law(limits.upper_q - limits.lower_q,
                                 {limits.speed_q_s, limits.acceleration_q_s2, limits.jerk_q_s3});
    sim::Cia402Drive drive{sim::Cia402DriveOptions{}};
    drive.set_mode(sim::Cia402Drive::kModeCyclicPosition);
    drive.set_interpolation_s(static_cast<double>(*sync_ns) * 1e-9);
    for (const int word : {0x06, 0x07, 0x0F}) drive.control(static_cast<std::uint16_t>(word));
    ASSERT_EQ(drive.state(), sim::Cia402Drive::State::kOperationEnabled);
    const auto end_ns = static_cast<std::int64_t>(law.duration_s() * 1e9);
    double worst_q = 0.0;
    double last_q = 0.0;
    for (std::int64_t now_ns = 0; now_ns < end_ns + 100 * kMillisecond_ns; now_ns += kMillisecond_ns) {
      drive.advance(now_ns);
      const double t_s = static_cast<double>(std::min(now_ns + kMeasuredLate_ns, end_ns)) * 1e-9;
      last_q = std::abs(evaluate(law, t_s).position - drive.position() / counts);
      worst_q = std::max(worst_q, last_q);
      if (now_ns % *sync_ns != 0) continue;
      const double set_point_q = evaluate(law, static_cast<double>(std::min(now_ns, end_ns)) * 1e-9).position;
      drive.set_target(static_cast<std::int32_t>(std::lround(set_point_q * counts)));
    }
    EXPECT_LT(worst_q, following.error_q) << "joint " << joint;
    EXPECT_GT(worst_q, 0.1 * following.error_q) << "joint " << joint << ": too wide to notice anything";
    EXPECT_LT(last_q, following.goal_q) << "joint " << joint << ", 0.1 s after the end";
  }
}

}  // namespace
}  // namespace corbot
