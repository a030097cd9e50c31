// SPDX-License-Identifier: Apache-2.0
// The whole chain down to every emulated device: what a client commands arrives at the servos, along the
// planned path, and a plug that is pulled is survived.
#include <gmock/gmock.h>
#include <signal.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include <fmt/core.h>

#include "config/load_profile.h"
#include "contract/device_fixture.h"
#include "corbot/units.h"
#include "support/cases.h"
#include "support/device_jobs.h"
#include "support/path_log.h"
#include "support/paths.h"
#include "support/robot_rig.h"
#include "support/scratch.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;

class DeviceChain : public RobotRig, public ::testing::WithParamInterface<DeviceFixtureKind> {
 protected:
  void SetUp() override {
    take_name("device");
    directory_ = fmt::format("{}/{}", scratch_directory(CORBOT_SCRATCH_DIR), name_);
    fs::create_directory(directory_);
    model_ = load_profile(CORBOT_TEST_PROFILE).arm;
    fixture_ = GetParam().make(model_, directory_);
    if (const std::string missing = fixture_->missing(); !missing.empty()) GTEST_SKIP() << missing;
    fixture_->set_up();
    facts_ = fixture_->facts();
    write_profile();
    start();
    if (HasFatalFailure()) return;
    ASSERT_TRUE(wait_for(Corbot::Standby)) << servant_->errors() << rt_->errors();
  }
  void TearDown() override {
    if (rt_) RobotRig::TearDown();
    fixture_.reset();
    fs::remove_all(directory_);
  }
  /// The Lynx 5, its backend replaced. On a machine too slow for the emulated drives, frames wait for them in
  /// the kernel. The drives then tell where the arm was some 0.1 s ago, which is no following error of an
  /// arm. On the rig, a cycle of 1 ms left drives no time for their heartbeats if the host had other work.
  void write_profile() {
    profile_ = directory_ + "/arm.toml";
    std::string backend = fixture_->backend_section();
    backend.insert(backend.find('\n') + 1, "position_known_at_start = true\n");  // no slow first motion
    write_lynx5_profile(profile_, backend);
    std::ifstream from(profile_);
    std::string text;
    const bool is_slow = facts_.takes_joints && std::getenv("CORBOT_RIG_BOOT") != nullptr;
    for (std::string line; std::getline(from, line);) {
      if (is_slow && line.starts_with("period_us")) line = "period_us = 5000";
      text += line.starts_with("settle_s") ? "settle_s = 20.0\n" : line + "\n";
      if (line.starts_with("speed_deg_s")) text += "following_error_s = 10.0\n";
    }
    std::ofstream(profile_) << text;
  }
  /// The largest difference between what the device puts out and the joints that the arm reports.
  double off() {
    Corbot::JointCoord_var joints = arm_->ArtiCoord();
    const std::vector<double> now = fixture_->now();
    double worst = 0.0;
    for (std::uint32_t i = 0; i < model_.dof; ++i) {
      const ServoMap& map = model_.servos[i];
      const double joint_q = to_radians(joints[i]);
      const double wanted =
          facts_.takes_joints ? joint_q : map.zero_us + map.direction * map.us_per_q * joint_q;
      if (std::isnan(now[i])) return HUGE_VAL;
      worst = std::max(worst, std::abs(now[i] - wanted));
    }
    return worst;
  }
  /// Returns the servos' outputs: their pulses, or the positions of the shafts.
  std::vector<double> where() {
    if (!facts_.takes_joints) return fixture_->now();
    Corbot::JointCoord_var joints = arm_->ArtiCoord();
    std::vector<double> found;
    for (CORBA::ULong i = 0; i < joints->length(); ++i) found.push_back(to_radians(joints[i]));
    return found;
  }
  /// Returns the allowed difference between two of them that should be the same. A device that reports in
  /// steps may report the frame before the last, if the last did not reach it: an SSC-32 reports steps of 10
  /// us.
  [[nodiscard]] double still() const {
    const double told = GetParam().name.starts_with("ssc32") ? 10.0 : facts_.read_unit;
    return 2.0 * (facts_.unit + facts_.noise) + told + (facts_.takes_joints ? 1e-9 : 0.006);
  }
  bool arrives() {
    // If the device reads back, the arm reports the value read.
    const double half_a_unit = 0.5 * (facts_.unit + facts_.read_unit) + (facts_.takes_joints ? 1e-9 : 0.006);
    return wait_until(within(20), [&] { return off() <= half_a_unit; });
  }

  std::string directory_;
  ArmModel model_;
  DeviceFacts facts_;
  std::unique_ptr<DeviceFixture> fixture_;
};

TEST_P(DeviceChain, CarriesOutThePapersPickAndPlace) {
  ASSERT_TRUE(arrives()) << off();
  PathLog log(name_);
  pick_and_place(
      arm_, [this] { EXPECT_TRUE(arrives()) << off() << " off"; },
      [this] {
        if (facts_.takes_joints) return;
        EXPECT_NEAR(fixture_->now().at(model_.dof), model_.gripper.closed_us, 0.5 * facts_.unit + 0.006);
      });

  const Following path = following(model_, log.finish(), fixture_->outputs(), facts_, 1.0);
  fmt::print("{} outputs, TCP at most {:.3f} mm off the planned path; half a unit at each joint: {:.3f} mm\n",
             path.outputs, path.deviation_m * 1e3, path.quantisation_m * 1e3);
  EXPECT_GT(path.outputs, 50u);
  EXPECT_LE(path.beyond_m, 1e-9) << "further than its quantisation";
}

TEST_P(DeviceChain, SurvivesAPulledPlugAtRandomInstants) {
  if (!facts_.pluggable) GTEST_SKIP() << "skipped: this device cannot be unplugged";
  std::mt19937_64 random(test::drawn_seed());
  const char* times = std::getenv("CORBOT_PLUGS");
  const int rounds = times != nullptr ? std::atoi(times) : 3;
  for (int i = 0; i < rounds; ++i) {
    std::string raised;
    std::thread caller(
        [&] { raised = raised_by([&] { arm_->Move(0.20, i % 2 == 0 ? 0.10 : -0.10, 0.10, 0.0, 3.0); }); });
    EXPECT_TRUE(wait_for(Corbot::Waiting));
    const timespec pause{0, std::uniform_int_distribution<long>(0, 400'000'000)(random)};
    ::nanosleep(&pause, nullptr);
    fixture_->unplug();
    EXPECT_TRUE(wait_for(Corbot::Error)) << rt_->errors();
    caller.join();
    EXPECT_EQ(raised, "NotReady");
    EXPECT_EQ(raised_by([&] { arm_->Clear(); }), "NotReady") << "the plug is out";
    ASSERT_FALSE(alarms().empty());
    EXPECT_THAT(std::string(alarms().back().text), ::testing::HasSubstr("lost: "));
    fixture_->plug();
    ASSERT_TRUE(wait_until(within(60), [&] {
      const Corbot::DeviceInfo_var device = arm_->Device();
      return device->health == Corbot::DeviceClosed;  // until Clear
    })) << rt_->errors();
    const std::vector<double> stood = where();
    ASSERT_TRUE(wait_until(within(60), [&] { return raised_by([&] { arm_->Clear(); }).empty(); }))
        << rt_->errors();
    ASSERT_TRUE(wait_for(Corbot::Standby)) << rt_->errors();
    const std::vector<double> stands = where();
    for (std::size_t servo = 0; servo < stood.size(); ++servo) {
      if (std::isnan(stood[servo])) continue;  // it gets its first pulse with the Clear
      EXPECT_NEAR(stands[servo], stood[servo], still()) << "servo " << servo << " has moved by itself";
    }
    EXPECT_TRUE(arrives()) << off();
  }
  arm_->Ready();
  EXPECT_TRUE(arrives());
}

/// As docs/wiring/README.md has it.
TEST_P(DeviceChain, AFrozenOrKilledTaskLeavesWhatTheServosHad) {
  ASSERT_TRUE(arrives()) << off();
  rt_->signal(SIGSTOP);
  ASSERT_TRUE(wait_for(Corbot::Error)) << "nobody has noticed that its cycles stand still";
  const std::vector<double> left = fixture_->now();
  const auto is_unchanged = [&] {
    // Longer than any frame; a machine that stands still meanwhile sees less of it, and fails nothing.
    const timespec frames{0, 300'000'000};
    ::nanosleep(&frames, nullptr);
    return fixture_->now() == left;
  };
  EXPECT_TRUE(facts_.ends_with_its_program || is_unchanged()) << "frozen";
  rt_->signal(SIGKILL);
  ASSERT_TRUE(rt_->wait(within(30)));
  if (facts_.ends_with_its_program) {
    const auto is_off = [](double value) { return std::isnan(value); };
    const auto are_off = [&] {
      const std::vector<double> found = fixture_->now();
      return std::all_of(found.begin(), found.end(), is_off);
    };
    EXPECT_TRUE(wait_until(within(20), are_off));
  } else {
    EXPECT_TRUE(is_unchanged()) << "killed";
  }
  start_rt();
}

INSTANTIATE_TEST_SUITE_P(Devices, DeviceChain, ::testing::ValuesIn(outside_fixtures()),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace corbot::test
