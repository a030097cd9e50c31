// SPDX-License-Identifier: Apache-2.0
// An emergency stop at an input of the servo controller, through the whole chain: emulated button, serial
// line, real-time task, servant, client.
#include <gmock/gmock.h>
#include <signal.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include <fmt/core.h>

#include "support/ports.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

struct Wiring {
  std::string name;
  std::string active;  ///< stop_active
  int pressed;         ///< level of the input
};
void PrintTo(const Wiring& wiring, std::ostream* out) { *out << wiring.name; }

class EmergencyStopInput : public RobotRig, public ::testing::WithParamInterface<Wiring> {
 protected:
  void SetUp() override {
    name_ = unique_name("estop");
    port_ = free_port();
    reference_ = fmt::format("corbaloc::127.0.0.1:{}/{}", port_, name_);
    directory_ = fmt::format("{}/{}", CORBOT_SCRATCH_DIR, name_);
    fs::create_directory(directory_);
    const std::string line = directory_ + "/tty";
    emulator_ = std::make_unique<Process>(
        std::vector<std::string>{std::string(CORBOT_BIN_DIR) + "/corbot-sim", "ssc32", "--pty", line});
    ASSERT_TRUE(emulator_->wait_line("ready", within(30))) << emulator_->errors();
    std::ifstream from(CORBOT_PROFILE);
    std::stringstream text;
    text << from.rdbuf();
    const std::string all = text.str();
    profile_ = directory_ + "/arm.toml";
    std::ofstream(profile_)
        << all.substr(0, all.find("[backend]"))
        << fmt::format(
               "[backend]\nkind = \"ssc32\"\nposition_known_at_start = true\n[backend.ssc32]\nport = \"{}\"\n"
               "stop_input = \"B\"\nstop_active = \"{}\"\n",
               line, GetParam().active);
  }
  void TearDown() override {
    RobotRig::TearDown();
    if (emulator_) {
      EXPECT_EQ(emulator_->terminate(), 0) << emulator_->errors();
    }
    fs::remove_all(directory_);
  }
  void press(bool pressed) {
    const int level = pressed ? GetParam().pressed : 1 - GetParam().pressed;
    emulator_->send(fmt::format("input B {}", level));
    ASSERT_TRUE(emulator_->wait_line("ok", within(30))) << emulator_->errors();
  }
  void start() {
    start_rt();
    if (!HasFatalFailure()) start_servant();
    if (!HasFatalFailure()) arm_ = connect();
  }
  std::string last_alarm() {
    const std::vector<Corbot::AlarmInfo> list = alarms();
    return list.empty() ? "" : std::string(list.back().text);
  }

  /// A task that is to be refused; again when a pseudo-terminal's bytes have stood still, as they can on a busy machine.
  RunResult begin_in_vain() {
    RunResult result{};
    for (int tries = 0; tries < 5; ++tries) {
      result = run({std::string(CORBOT_BIN_DIR) + "/corbot-rt", profile_, "--name", name_});
      if (result.errors.find("no answer: is the controller powered") == std::string::npos) break;
    }
    return result;
  }
  /// The servant keeps running.
  void kill_rt() {
    rt_->signal(SIGKILL);
    ASSERT_TRUE(rt_->wait(within(30)));
    rt_.reset();
  }
  /// Whether the servant has received an alarm of a task that found the arm in Error.
  bool has_taken_up_error() {
    return wait_until(within(20), [&] {
      Corbot::AlarmList_var alarms = arm_->Alarms();
      for (CORBA::ULong i = 0; i < alarms->length(); ++i) {
        if (alarms[i].code == 131 && alarms[i].active) return true;
      }
      return false;
    });
  }
  void expect_error_until_cleared() {
    ASSERT_TRUE(has_taken_up_error()) << rt_->errors();
    EXPECT_EQ(arm_->Status(), Corbot::Error);
    expect_no_motion_accepted();
    EXPECT_EQ(raised_by([&] { arm_->Clear(); }), "");
    EXPECT_TRUE(wait_for(Corbot::Standby)) << rt_->errors();
    EXPECT_EQ(raised_by([&] { arm_->Move(0.20, 0.0, 0.10, 0.0, 1.0); }), "");
  }

  std::string directory_;
  std::unique_ptr<Process> emulator_;
};

TEST_P(EmergencyStopInput, StopsAMotionAndWaitsForReleaseAndClear) {
  press(false);
  start();
  ASSERT_TRUE(wait_for(Corbot::Standby)) << rt_->errors();
  std::string raised;
  std::thread caller([&] { raised = raised_by([&] { arm_->Move(0.20, 0.10, 0.10, 0.0, 5.0); }); });
  EXPECT_TRUE(wait_for(Corbot::Waiting));
  press(true);
  EXPECT_TRUE(wait_for(Corbot::Error)) << rt_->errors();
  caller.join();
  EXPECT_EQ(raised, "NotReady");
  EXPECT_THAT(last_alarm(), HasSubstr("emergency stop"));
  expect_no_motion_accepted();
  EXPECT_EQ(raised_by([&] { arm_->Clear(); }), "NotReady") << "still pressed";
  EXPECT_TRUE(wait_for(Corbot::Error));
  Corbot::JointCoord_var held = arm_->ArtiCoord();

  press(false);
  ASSERT_TRUE(wait_until(within(20), [&] { return raised_by([&] { arm_->Clear(); }).empty(); }))
      << rt_->errors();
  EXPECT_TRUE(wait_for(Corbot::Standby));
  Corbot::JointCoord_var still = arm_->ArtiCoord();
  EXPECT_EQ(distance_deg(held, still), 0.0);
  EXPECT_EQ(raised_by([&] { arm_->Move(0.20, 0.0, 0.10, 0.0, 1.0); }), "");
}

TEST_P(EmergencyStopInput, IsRefusedWhenItIsPressedAtTheStart) {
  press(true);
  const RunResult refused = begin_in_vain();
  EXPECT_EQ(refused.code, 1);
  EXPECT_THAT(refused.errors, HasSubstr("the emergency stop is pressed"));
  EXPECT_FALSE(channel_exists(name_));
  press(false);
  start();
  EXPECT_TRUE(wait_for(Corbot::Standby)) << rt_->errors();
  EXPECT_EQ(raised_by([&] { arm_->Move(0.20, 0.0, 0.10, 0.0, 1.0); }), "");
}

TEST_P(EmergencyStopInput, OutlivesTheTaskThatSawIt) {
  press(false);
  start();
  ASSERT_TRUE(wait_for(Corbot::Standby)) << rt_->errors();
  press(true);
  ASSERT_TRUE(wait_for(Corbot::Error)) << rt_->errors();
  press(false);
  kill_rt();
  start_rt();
  if (!HasFatalFailure()) expect_error_until_cleared();
}

TEST_P(EmergencyStopInput, OutlivesATaskThatItKeptFromStarting) {
  press(false);
  start();
  ASSERT_TRUE(wait_for(Corbot::Standby)) << rt_->errors();
  kill_rt();
  press(true);
  for (int i = 0; i < 2; ++i) {
    const RunResult refused = begin_in_vain();
    EXPECT_EQ(refused.code, 1);
    EXPECT_THAT(refused.errors, HasSubstr("the emergency stop is pressed"));
  }
  press(false);
  start_rt();
  if (!HasFatalFailure()) expect_error_until_cleared();
}

TEST_P(EmergencyStopInput, CatchesAPressBetweenTwoFrames) {
  if (GetParam().active != "low") GTEST_SKIP() << "the controller latches a low level only";
  press(false);
  start();
  ASSERT_TRUE(wait_for(Corbot::Standby)) << rt_->errors();
  press(true);
  press(false);
  EXPECT_TRUE(wait_for(Corbot::Error)) << rt_->errors();
  EXPECT_TRUE(wait_until(within(20), [&] { return raised_by([&] { arm_->Clear(); }).empty(); }));
}

INSTANTIATE_TEST_SUITE_P(Wirings, EmergencyStopInput,
                         ::testing::Values(Wiring{"opens", "high", 1}, Wiring{"closes", "low", 0}),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace corbot::test
