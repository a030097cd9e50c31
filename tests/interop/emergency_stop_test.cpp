// SPDX-License-Identifier: Apache-2.0
// An emergency stop at an input of the servo controller, through the whole chain: emulated button, serial
// line, real-time task, servant, client.
#include <gmock/gmock.h>
#include <signal.h>

#include <algorithm>
#include <thread>

#include <fmt/core.h>

#include "support/paths.h"
#include "support/serial_robot.h"

namespace corbot::test {
namespace {

using ::testing::HasSubstr;

struct Wiring {
  std::string name;
  std::string active;  ///< stop_active
  int pressed;         ///< level of the input
};
void PrintTo(const Wiring& wiring, std::ostream* out) { *out << wiring.name; }

class EmergencyStopInput : public SerialRobot, public ::testing::WithParamInterface<Wiring> {
 protected:
  void SetUp() override {
    plug_in({"ssc32"}, "ssc32", fmt::format("stop_input = \"B\"\nstop_active = \"{}\"\n", GetParam().active));
  }
  void press(bool pressed) {
    const int level = pressed ? GetParam().pressed : 1 - GetParam().pressed;
    controller_->command(fmt::format("input B {}", level));
  }
  bool has_alarm(int code) {
    const std::vector<Corbot::AlarmInfo> list = alarms();
    return std::any_of(list.begin(), list.end(), [&](const auto& alarm) { return alarm.code == code; });
  }
  /// One that came after the first `before`.
  bool has_new_alarm(std::size_t before, int code) {
    const std::vector<Corbot::AlarmInfo> list = alarms();
    return std::any_of(list.begin() + static_cast<std::ptrdiff_t>(std::min(before, list.size())), list.end(),
                       [&](const auto& alarm) { return alarm.code == code; });
  }
  /// Cleared first as often as a machine that stands still makes a controller's answers late.
  bool moves() {
    return wait_until(within(60), [&] {
      const std::string raised = raised_by([&] { arm_->Move(0.20, 0.0, 0.10, 0.0, 1.0); });
      EXPECT_THAT(raised, ::testing::AnyOf("", "NotReady"));
      if (!raised.empty()) (void)raised_by([&] { arm_->Clear(); });
      return raised.empty();
    });
  }
  std::string last_alarm() {
    const std::vector<Corbot::AlarmInfo> list = alarms();
    return list.empty() ? "" : std::string(list.back().text);
  }

  /// A task that is to be refused; again when a pseudo-terminal's bytes have stood still, as they can on a
  /// busy machine.
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
    // Once the controller has said that its input is released.
    EXPECT_TRUE(wait_until(within(30), [&] { return raised_by([&] { arm_->Clear(); }).empty(); }))
        << rt_->errors();
    EXPECT_TRUE(wait_for(Corbot::Standby)) << rt_->errors();
    EXPECT_EQ(raised_by([&] { arm_->Move(0.20, 0.0, 0.10, 0.0, 1.0); }), "");
  }
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
  const RunResult refused = begin_in_vain();
  EXPECT_EQ(refused.code, 1);
  EXPECT_THAT(refused.errors, HasSubstr("the emergency stop is pressed"));
  start_rt();  // in Error: it moves nothing, so the next one may begin while it is pressed
  if (HasFatalFailure()) return;
  EXPECT_EQ(raised_by([&] { arm_->Clear(); }), "NotReady") << "still pressed";
  press(false);
  expect_error_until_cleared();
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

TEST_P(EmergencyStopInput, ThatIsNotHeardIsAPress) {
  press(false);
  start();
  ASSERT_TRUE(wait_for(Corbot::Standby)) << rt_->errors();
  for (const char* fault : {"deaf input", "garble input", "half input"}) {
    ASSERT_TRUE(moves()) << rt_->errors();
    const std::size_t before = alarms().size();
    std::string raised;
    std::thread caller([&] { raised = raised_by([&] { arm_->Move(0.20, 0.10, 0.10, 0.0, 10.0); }); });
    EXPECT_TRUE(wait_for(Corbot::Waiting));
    controller_->command(fmt::format("{} on", fault));  // its positions are answered
    EXPECT_TRUE(wait_for(Corbot::Error)) << fault << "\n" << rt_->errors();
    caller.join();
    EXPECT_EQ(raised, "NotReady");
    EXPECT_TRUE(wait_until(within(20), [&] { return has_new_alarm(before, 130); })) << fault;
    EXPECT_EQ(raised_by([&] { arm_->Clear(); }), "NotReady") << "still not heard";
    controller_->command(fmt::format("{} off", fault));
    ASSERT_TRUE(wait_until(within(20), [&] {
      EXPECT_EQ(arm_->Status(), Corbot::Error) << "until it is cleared";
      return raised_by([&] { arm_->Clear(); }).empty();
    })) << rt_->errors();
    EXPECT_TRUE(moves()) << rt_->errors();
  }
}

TEST_P(EmergencyStopInput, ThatIsUnpluggedIsAPress) {
  press(false);
  start();
  ASSERT_TRUE(wait_for(Corbot::Standby)) << rt_->errors();
  controller_->command("unplug");
  ASSERT_TRUE(wait_for(Corbot::Error)) << rt_->errors();
  EXPECT_TRUE(wait_until(within(20), [&] { return has_alarm(130); })) << "beside that of the device";
  EXPECT_TRUE(wait_until(within(20), [&] { return has_alarm(121); })) << rt_->errors();
  controller_->command("plug");
  ASSERT_TRUE(wait_until(within(30), [&] { return raised_by([&] { arm_->Clear(); }).empty(); }))
      << rt_->errors();
}

INSTANTIATE_TEST_SUITE_P(Wirings, EmergencyStopInput,
                         ::testing::Values(Wiring{"opens", "high", 1}, Wiring{"closes", "low", 0}),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace corbot::test
