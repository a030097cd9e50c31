// SPDX-License-Identifier: Apache-2.0
// Joints that slide speak metres, all the way from a client to servos and drives.
#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/core.h>

#include "support/emulated_controller.h"
#include "support/emulated_drives.h"
#include "support/paths.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// A gantry of three slides, x and y of half a metre, z of 0.2 m. Without a device of its own it is
/// simulated.
class Slides : public RobotRig {
 protected:
  void SetUp() override {
    take_name("slides");
    directory_ = fmt::format("{}/{}", CORBOT_SCRATCH_DIR, name_);
    fs::create_directory(directory_);
  }
  void TearDown() override {
    RobotRig::TearDown();
    if (drives_) {
      EXPECT_EQ(drives_->stop(), 0);
    }
    if (controller_) {
      EXPECT_EQ(controller_->stop(), 0);
    }
    fs::remove_all(directory_);
  }
  /// The tests' profile with another backend; `servo(joint)`: a line more in each joint's table.
  void write_profile(const std::string& name, const std::string& backend,
                     const std::function<std::string(int)>& servo = {}) {
    std::ifstream from(std::string(CORBOT_TEST_PROFILES) + "/" + name + ".toml");
    std::ostringstream all;
    int joint = 0;
    for (std::string line; std::getline(from, line) && line != "[backend]";) {
      all << line << '\n';
      if (servo && line.starts_with("jerk_m_s3") && joint < 3) all << servo(joint++) << '\n';
      if (servo && line == "[gripper]") all << "channel = 3\nclosed_us = 1900\nopen_us = 1100\n";
    }
    profile_ = directory_ + "/arm.toml";
    std::ofstream(profile_) << all.str() << backend;
  }
  void begin() {
    start_rt({"--state-dir", directory_});
    start_servant({"--state-dir", directory_});
    arm_ = connect();
    ASSERT_TRUE(wait_for(Corbot::Standby)) << servant_->errors() << rt_->errors();
  }
  /// On drives whose scales these are; zero_count 0, 500, …, the second one mounted the other way round.
  void begin_on_drives(const std::string& name, const std::vector<std::string>& scales) {
    drives_.emplace(std::string(CORBOT_BIN_DIR) + "/corbot-sim", directory_, static_cast<int>(scales.size()));
    drives_->start();
    std::string backend = fmt::format(
        "[backend]\nkind = \"socketcan\"\n[backend.socketcan]\ninterface = \"{}\"\n", drives_->bus());
    for (std::size_t i = 0; i < scales.size(); ++i) {
      backend += fmt::format("[[backend.socketcan.drive]]\nnode = {}\n{}\nzero_count = {}\ndirection = {}\n",
                             i + 1, scales[i], 500 * i, i == 1 ? -1 : 1);
    }
    write_profile(name, backend);
    begin();
  }
  /// Whether the drives come to these counts.
  [[nodiscard]] bool stand_at(const std::map<int, std::int32_t>& wanted) {
    return wait_until(within(20), [&] { return drives_->counts() == wanted; });
  }
  [[nodiscard]] double joint(CORBA::ULong index) const {
    Corbot::JointCoord_var joints = arm_->ArtiCoord();
    return joints[index];
  }

  std::string directory_;
  std::optional<EmulatedDrives> drives_;
  std::optional<EmulatedController> controller_;
};

constexpr const char* kSimulated = "[backend]\nkind = \"loopback\"\n";

TEST_F(Slides, SayWhatTheyAre) {
  write_profile("scara_gx4", kSimulated);
  begin();
  Corbot::JointList_var joints = arm_->Joints();
  ASSERT_EQ(joints->length(), 4u);
  EXPECT_STREQ(joints[2].name, "shaft");
  EXPECT_EQ(joints[2].kind, Corbot::JointSlides);
  EXPECT_EQ(joints[2].range.lower, -0.15);
  EXPECT_EQ(joints[2].speed, 0.5);
  EXPECT_EQ(joints[0].kind, Corbot::JointTurns);
  EXPECT_EQ(joints[0].range.upper, 140.0);
  EXPECT_EQ(joints[0].speed, 180.0);
  EXPECT_NEAR(arm_->Reach(), 0.35, 1e-6) << "0.22 and 0.13 m, from axis 1";
}

TEST_F(Slides, MoveByMetres) {
  write_profile("scara_gx4", kSimulated);
  begin();
  arm_->Drive(2, -0.04, 0.5);
  EXPECT_NEAR(joint(2), -0.04, 1e-9);
  Corbot::JointCoord target;
  target.length(4);
  target[0] = 10.0;
  target[1] = -20.0;
  target[2] = -0.1;
  target[3] = 30.0;
  arm_->MoveJoints(target, 0);
  EXPECT_NEAR(joint(2), -0.1, 1e-9);
  EXPECT_NEAR(joint(3), 30.0, 1e-9);
  const Corbot::ArmState_var now = arm_->State();
  EXPECT_NEAR(now->commanded[2], -0.1, 1e-9);
  EXPECT_EQ(now->commanded.length(), 4u);
  EXPECT_NEAR(now->tool.position.z, -0.1, 1e-9);
}

TEST_F(Slides, AreRefusedInMetres) {
  write_profile("scara_gx4", kSimulated);
  begin();
  try {
    arm_->Drive(2, -0.2, 0.1);
    FAIL() << "accepted";
  } catch (const Corbot::LimitExceeded& refusal) {
    EXPECT_EQ(refusal.articulation, 2);
    EXPECT_NEAR(refusal.value, -0.2, 1e-12);
    EXPECT_EQ(refusal.lower, -0.15);
    EXPECT_EQ(refusal.upper, 0.0);
  }
  try {
    arm_->Drive(2, -0.1, 0.6);
    FAIL() << "accepted";
  } catch (const Corbot::LimitExceeded& refusal) {
    EXPECT_NEAR(refusal.value, 0.6, 1e-12);
    EXPECT_EQ(refusal.upper, 0.5);
  }
}

TEST_F(Slides, HaveSoftLimitsInMetresThatOutliveARestart) {
  write_profile("scara_gx4", kSimulated);
  begin();
  Corbot::JointRanges_var limits = arm_->SoftLimits();
  limits[2].lower = -0.08;
  arm_->SetSoftLimits(limits.in());
  EXPECT_EQ(raised_by([&] { arm_->Drive(2, -0.09, 0.1); }), "LimitExceeded");
  limits[2].lower = -0.16;
  EXPECT_EQ(raised_by([&] { arm_->SetSoftLimits(limits.in()); }), "LimitExceeded");
  arm_->Drive(2, -0.07, 0.5);
  EXPECT_EQ(servant_->terminate(), 0);
  EXPECT_EQ(rt_->terminate(), 0);
  begin();
  limits = arm_->SoftLimits();
  EXPECT_EQ(limits[2].lower, -0.08);
  EXPECT_NEAR(joint(2), -0.07, 1e-9);
  EXPECT_THAT(rt_->errors(), HasSubstr("-0.0700 m")) << "the position at the start";
}

TEST_F(Slides, AreMovedByDrives) {
  begin_on_drives("cartesian_ppp",
                  {"counts_per_m = 200000", "counts_per_m = 200000", "counts_per_m = 200000"});
  const auto stands_at = [&](double x, double y, double z) {
    const std::map<int, std::int32_t> wanted{{1, static_cast<std::int32_t>(std::lround(x * 200'000))},
                                             {2, static_cast<std::int32_t>(std::lround(500 - y * 200'000))},
                                             {3, static_cast<std::int32_t>(std::lround(1000 + z * 200'000))}};
    return wait_until(within(20), [&] { return drives_->counts() == wanted; });
  };
  EXPECT_NEAR(joint(1), 0.0025, 1e-9) << "it is held where its drive was found";
  arm_->Drive(0, 0.1, 0.3);
  EXPECT_TRUE(wait_until(within(20), [&] { return drives_->counts().at(1) == 20'000; }));
  Corbot::JointCoord target;
  target.length(3);
  target[0] = 0.2;
  target[1] = 0.15;
  target[2] = 0.05;
  arm_->MoveJoints(target, 0);
  EXPECT_TRUE(stands_at(0.2, 0.15, 0.05));
  const Corbot::CartesianCoord at = arm_->CartCoord();
  EXPECT_EQ(raised_by([&] { arm_->MoveS(at.x - 0.05, at.y, at.z, 0, 0); }), "");
  const Corbot::ArmState_var now = arm_->State();
  ASSERT_TRUE(now->measured);
  EXPECT_NEAR(now->measuredJoints[1], now->commanded[1], 1e-4);
  drives_->command("block on 1");
  EXPECT_EQ(raised_by([&] { arm_->Drive(0, joint(0) > 0.2 ? -0.1 : 0.1, 0.3); }), "NotReady");
  ASSERT_FALSE(alarms().empty());
  EXPECT_THAT(std::string(alarms().back().text),
              AllOf(HasSubstr("joint 0 is"), HasSubstr(" m from its set-point, 0.020000 are allowed")));
  drives_->command("block off 1");
}

TEST_F(Slides, OnDrivesAStopEndsThemOnTheWay) {
  begin_on_drives("cartesian_ppp",
                  {"counts_per_m = 200000", "counts_per_m = 200000", "counts_per_m = 200000"});
  const Corbot::Ticket ticket = arm_->StartDrive(0, 0.4, 0.2);
  ASSERT_TRUE(wait_until(within(20), [&] { return drives_->counts("targets").at(1) > 10'000; }));
  arm_->Stop();
  const double at_m = Corbot::ArmState_var(arm_->State())->commanded[0];
  EXPECT_GT(at_m, 0.05);
  EXPECT_LT(at_m, 0.399) << "it is on the way";
  EXPECT_EQ(Corbot::MotionInfo_var(arm_->Progress(ticket))->state, Corbot::MotionStopped);
  const auto count = static_cast<std::int32_t>(std::lround(at_m * 200'000));
  EXPECT_TRUE(wait_until(within(20), [&] { return drives_->counts().at(1) == count; }));
  EXPECT_EQ(drives_->counts("targets").at(1), count);
  double last = 0.0;
  for (const DeviceRow& row : drives_->rows()) {
    if (row.channel != 1) continue;
    EXPECT_GE(row.given, last) << "no way back";
    last = row.given;
  }
  const Corbot::ArmState_var now = arm_->State();
  EXPECT_NEAR(now->commanded[0], at_m, 1e-9);
  EXPECT_NEAR(now->measuredJoints[0], at_m, 1e-5);
  EXPECT_EQ(now->speeds[0], 0.0);
  arm_->Ready();
  EXPECT_TRUE(stand_at({{1, 0}, {2, 500}, {3, 1000}}));
}

/// Degrees and metres beside each other.
TEST_F(Slides, OfAScaraAreMovedByDrives) {
  begin_on_drives("scara_gx4", {"counts_per_degree = 1000", "counts_per_degree = 1000",
                                "counts_per_m = 200000", "counts_per_degree = 500"});
  Corbot::JointCoord target;
  target.length(4);
  target[0] = 10.0;
  target[1] = -20.0;
  target[2] = -0.05;
  target[3] = 30.0;
  arm_->MoveJoints(target, 0);
  EXPECT_TRUE(stand_at({{1, 10'000}, {2, 20'500}, {3, 1000 - 10'000}, {4, 1500 + 15'000}}));
  const Corbot::ArmState_var before = arm_->State();
  ASSERT_TRUE(before->measured);
  EXPECT_NEAR(before->measuredJoints[2], -0.05, 1e-5);
  EXPECT_NEAR(before->measuredJoints[3], 30.0, 0.01);
  // The task reads the drives' position a cycle later than this test does, or more on a busy machine.
  ASSERT_TRUE(wait_until(within(20), [&] { return std::abs(joint(2) + 0.05) < 1e-9; })) << joint(2);
  const Corbot::CartesianCoord at = arm_->CartCoord();
  arm_->MoveS(at.x - 0.02, at.y, at.z - 0.03, 0, 0);
  EXPECT_TRUE(wait_until(within(20), [&] { return drives_->counts().at(3) == 1000 - 16'000; }));
  EXPECT_TRUE(wait_until(within(20), [&] { return std::abs(joint(2) + 0.08) < 1e-9; })) << joint(2);
  EXPECT_EQ(raised_by([&] { arm_->Drive(2, -0.1, 0.1); }), "LimitExceeded");
  const Corbot::Ticket ticket = arm_->StartDrive(2, 0.07, 0.05);
  ASSERT_TRUE(wait_until(within(20), [&] { return drives_->counts("targets").at(3) > 1000 - 14'000; }));
  arm_->Stop();
  EXPECT_EQ(Corbot::MotionInfo_var(arm_->Progress(ticket))->state, Corbot::MotionStopped);
  EXPECT_GT(joint(2), -0.0751);
  EXPECT_LT(joint(2), -0.011);
  arm_->Ready();
  EXPECT_TRUE(stand_at({{1, 0}, {2, 500}, {3, 1000}, {4, 1500}}));
}

TEST_F(Slides, AreMovedByServos) {
  controller_.emplace(std::string(CORBOT_BIN_DIR) + "/corbot-sim", std::vector<std::string>{"ssc32"},
                      directory_);
  controller_->start();
  write_profile(
      "cartesian_ppp",
      fmt::format("[backend]\nkind = \"ssc32\"\nposition_known_at_start = true\n[backend.ssc32]\nport = "
                  "\"{}\"\n",
                  controller_->line()),
      [](int joint) {
        return fmt::format(
            "servo = {{ channel = {}, zero_us = 1000, us_per_mm = 2, direction = 1, pulse_range_us = "
            "[500, 2500] }}",
            joint);
      });
  begin();
  arm_->Drive(0, 0.1, 0.3);
  EXPECT_TRUE(wait_until(within(20), [&] { return controller_->values("pulses")[0] == 1200.0; }));
  arm_->Drive(2, 0.05, 0.1);
  EXPECT_TRUE(wait_until(within(20), [&] { return controller_->values("pulses")[2] == 1100.0; }));
}

}  // namespace
}  // namespace corbot::test
