// SPDX-License-Identifier: Apache-2.0
// The whole chain down to emulated CiA 402 drives on a CAN bus: what a client commands arrives at the shafts,
// and a bus that is cut is survived.
#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>

#include <fmt/core.h>

#include "config/load_profile.h"
#include "corbot/units.h"
#include "support/device_jobs.h"
#include "support/emulated_drives.h"
#include "support/ports.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr double kCountsPerDegree = 1000.0;
constexpr int kGripperClosed = 1000;
constexpr int kGripperOpen = 41'000;

class CanDrives : public RobotRig {
 protected:
  void SetUp() override {
    name_ = unique_name("can");
    port_ = free_port();
    reference_ = fmt::format("corbaloc::127.0.0.1:{}/{}", port_, name_);
    directory_ = fmt::format("{}/{}", CORBOT_SCRATCH_DIR, name_);
    fs::create_directory(directory_);
    drives_.emplace(std::string(CORBOT_BIN_DIR) + "/corbot-sim", directory_, 5);
    drives_->start();
    if (HasFatalFailure()) return;
    write_profile();
    start_rt();
    if (!HasFatalFailure()) start_servant();
    if (HasFatalFailure()) return;
    arm_ = connect();
    ASSERT_TRUE(wait_for(Corbot::Standby)) << servant_->errors() << rt_->errors();
  }
  void TearDown() override {
    RobotRig::TearDown();
    EXPECT_EQ(drives_->stop(), 0);
    fs::remove_all(directory_);
  }
  void write_profile() {
    profile_ = directory_ + "/arm.toml";
    std::string backend = fmt::format(
        "[backend]\nkind = \"socketcan\"\n[backend.socketcan]\ninterface = \"{}\"\n", drives_->bus());
    for (int i = 0; i < 4; ++i) {
      backend += fmt::format(
          "[[backend.socketcan.drive]]\nnode = {}\ncounts_per_degree = {}\nzero_count = {}\ndirection = {}\n",
          i + 1, kCountsPerDegree, zero_of(i), direction_of(i));
    }
    backend += fmt::format("[backend.socketcan.gripper]\nnode = 5\nclosed_count = {}\nopen_count = {}\n",
                           kGripperClosed, kGripperOpen);
    write_lynx5_profile(profile_, backend);
  }
  static int zero_of(int joint) { return 500 * joint; }
  static int direction_of(int joint) { return joint == 2 ? -1 : 1; }
  /// The largest difference between a shaft and the joint that the arm reports as measured, in counts.
  double off_counts() {
    Corbot::JointCoord_var joints = arm_->ArtiCoord();
    const auto now = drives_->counts();
    double worst = 0.0;
    for (int i = 0; i < 4; ++i) {
      const double wanted =
          zero_of(i) + direction_of(i) * kCountsPerDegree * joints[static_cast<CORBA::ULong>(i)];
      const auto found = now.find(i + 1);
      worst = std::max(worst, found == now.end() ? HUGE_VAL : std::abs(found->second - wanted));
    }
    return worst;
  }
  bool arrives() {
    return wait_until(within(20),
                      [&] { return off_counts() <= 1.0 && drives_->counts() == drives_->counts("targets"); });
  }
  /// The most that any target may move in one cycle, catching up after a late one: twice the fastest joint's
  /// way in a millisecond, or twice the gripper's.
  [[nodiscard]] std::int64_t largest_step() const {
    double fastest_rad_s = 0.0;
    for (const JointLimits& limits : load_profile(profile_).arm.joints) {
      fastest_rad_s = std::max(fastest_rad_s, limits.speed_rad_s);
    }
    const double joints = to_degrees(fastest_rad_s) * kCountsPerDegree;
    const double gripper = (kGripperOpen - kGripperClosed) / 0.5;
    return std::lround(2.0 * std::max(joints, gripper) * 1e-3) + 1;
  }

  std::string directory_;
  std::optional<EmulatedDrives> drives_;
};

TEST_F(CanDrives, CarryOutThePapersPickAndPlace) {
  EXPECT_TRUE(arrives()) << off_counts();
  const std::string raised = raised_by([&] {
    pick_and_place(
        arm_, [this] { EXPECT_TRUE(arrives()) << off_counts() << " counts off"; },
        [this] { EXPECT_EQ(drives_->counts("targets").at(5), kGripperClosed); });
  });
  EXPECT_EQ(raised, "") << rt_->errors();
  EXPECT_LE(drives_->largest_steps().first, largest_step());
}

TEST_F(CanDrives, TurnInTheDirectionOfTheProfile) {
  Corbot::JointCoord target;
  target.length(4);
  for (int i = 0; i < 4; ++i) target[static_cast<CORBA::ULong>(i)] = 10.0 + 5.0 * i;
  arm_->MoveJoints(target, 0.0);
  ASSERT_TRUE(arrives()) << off_counts();
  const auto now = drives_->counts();
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(now.at(i + 1), zero_of(i) + direction_of(i) * kCountsPerDegree * (10.0 + 5.0 * i), 1.0)
        << "joint " << i;
  }
}

TEST_F(CanDrives, ReportAnEmergencyInTheAlarms) {
  drives_->command("emcy 4310 3");
  EXPECT_TRUE(wait_for(Corbot::Error));
  ASSERT_FALSE(alarms().empty());
  EXPECT_THAT(std::string(alarms().back().text), HasSubstr("lost"));
  EXPECT_TRUE(wait_until(within(10), [&] {
    return rt_->errors().find("EMCY 0x4310 (drive too hot)") != std::string::npos;
  })) << rt_->errors();
  ASSERT_TRUE(wait_until(within(60), [&] { return raised_by([&] { arm_->Clear(); }).empty(); }))
      << rt_->errors();
  arm_->Move(0.20, 0.10, 0.10, 0.0, 0.0);
  EXPECT_TRUE(arrives()) << off_counts();
}

}  // namespace
}  // namespace corbot::test
