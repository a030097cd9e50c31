// SPDX-License-Identifier: Apache-2.0
// Tests compare a device's outputs with the path by following(). It must accept frames that waited, and find
// outputs beside the path.
#include <gtest/gtest.h>

#include "config/load_profile.h"
#include "corbot/kinematics/tool_pose.h"
#include "support/path_log.h"

namespace corbot::test {
namespace {

constexpr std::int64_t kPeriod_ns = 4'000'000;
constexpr std::size_t kStands = 299;  ///< the machine stands still for 4 s after this cycle
constexpr double kStep_rad = 4e-4;

/// The path is a motion of joint 0 that begins again from rest after the standstill.
class FollowingTest : public testing::Test {
 protected:
  FollowingTest() {
    for (std::size_t i = 0; i < 400; ++i) {
      Snapshot now{};
      now.time_ns = static_cast<std::int64_t>(i + 1) * kPeriod_ns + (i > kStands ? 4'000'000'000 : 0);
      now.tool.position_m = tool_pose(arm_.kinematics, at(i)).position_m;
      path_.push_back(now);
    }
  }
  static Joints at(std::size_t i) { return {kStep_rad * static_cast<double>(i > kStands ? i - 1 : i)}; }
  /// The device gets the last two frames before the standstill only after it. Joint 1 is off by `off_rad`.
  void put_out(std::size_t i, double off_rad) {
    const std::size_t when = i + 1 >= kStands && i <= kStands ? kStands + 1 : i;
    for (std::size_t servo = 0; servo < arm_.dof; ++servo)
      outputs_.push_back({path_[when].time_ns + 1'000'000 + static_cast<std::int64_t>(i), servo,
                          at(i)[servo] + (servo == 1 ? off_rad : 0.0)});
  }
  [[nodiscard]] Following found() const {
    DeviceFacts facts;
    facts.takes_joints = true;
    facts.period_s = 1e-9 * kPeriod_ns;
    return following(arm_, path_, outputs_, facts, 1.0);
  }

  const ArmModel arm_ = load_profile(CORBOT_TEST_PROFILE).arm;
  std::vector<Snapshot> path_;
  std::vector<Output> outputs_;
};

TEST_F(FollowingTest, AFrameThatWaitedInAStandstillIsOnThePath) {
  for (std::size_t i = 0; i < path_.size(); ++i) put_out(i, 0.0);
  EXPECT_EQ(found().outputs, 150u);
  EXPECT_LE(found().beyond_m, 1e-9);
}

TEST_F(FollowingTest, AnOutputBesideThePathIsFound) {
  for (const std::size_t fault : {280, 298, 299, 301, 302, 350}) {
    outputs_.clear();
    for (std::size_t i = 0; i < path_.size(); ++i) put_out(i, i == fault ? 0.01 : 0.0);
    EXPECT_GT(found().beyond_m, 1e-3) << fault;
  }
}

}  // namespace
}  // namespace corbot::test
