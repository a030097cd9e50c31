// SPDX-License-Identifier: Apache-2.0
// Tests the output of the commands when a controller goes silent and comes back.
#include <gmock/gmock.h>

#include "cli_rig.h"
#include "support/paths.h"

namespace corbot::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class Device : public CliRig {};

TEST_F(Device, ALostDeviceIsReportedUntilAClear) {
  const std::string line = (directory_ / "tty").string();
  Process emulator({CORBOT_BIN_DIR "/corbot-sim", "ssc32", "--pty", line});
  ASSERT_TRUE(emulator.wait_line("ready", within(30))) << emulator.errors();
  up({}, put_ssc32_profile(line, "readback = true\n"));
  if (HasFatalFailure()) return;
  emulator.send("silent on");
  ASSERT_TRUE(wait_state("Error"));
  EXPECT_THAT(corbot({"status"}).output, AllOf(HasSubstr("device is lost: "), HasSubstr("fix the cause")));
  const auto log_has = [&](const std::string& text) {
    return wait_until(within(20), [&] { return supervisor_->errors().find(text) != std::string::npos; });
  };
  EXPECT_TRUE(
      log_has("[warning] alarm 120: the servo device replies late or with faults: it does not answer\n"));
  EXPECT_TRUE(
      log_has("[error] alarm 121: the servo device is lost: it does not answer; set-points are held\n"))
      << supervisor_->errors();

  emulator.send("silent off");
  std::string text;
  EXPECT_TRUE(wait_until(within(30), [&] {
    text = corbot({"status"}).output;
    return text.find("is connected again: 'corbot clear'") != std::string::npos;
  })) << text;
  EXPECT_THAT(text, AllOf(HasSubstr("121 the servo device was lost and is connected again: 'corbot clear' "
                                    "ends the Error (alarm: the servo device is lost: it does not answer"),
                          Not(HasSubstr("fix the cause"))));
  EXPECT_TRUE(wait_until(within(30), [&] { return corbot({"clear"}).code == 0; }));
  EXPECT_THAT(corbot({"status"}).output, Not(HasSubstr("121 the servo device")));
  EXPECT_TRUE(wait_until(within(30), [&] {
    text = corbot({"status"}).output;
    return text.find("ssc32, open") != std::string::npos;
  })) << text;
  EXPECT_EQ(supervisor_->terminate(), 0) << supervisor_->errors();
  supervisor_.reset();
  EXPECT_EQ(emulator.terminate(), 0);
}

TEST_F(Device, UpPointsToDoctorWhereTheDeviceIsMissing) {
  const std::string profile = put_ssc32_profile((directory_ / "nothing").string());
  const RunResult result = corbot({"up", profile, "--endpoint", "127.0.0.1:" + std::to_string(port_)});
  EXPECT_NE(result.code, 0);
  EXPECT_THAT(result.errors, HasSubstr("'corbot doctor " + profile + "' says what to do"));
  EXPECT_THAT(corbot({"doctor", profile}).output, HasSubstr("plug the controller in"));
  const RunResult no_file = corbot({"doctor", profile + "x"});
  EXPECT_THAT(no_file.output, AllOf(HasSubstr("no such file"), HasSubstr("give the path of a profile"),
                                    Not(HasSubstr("correct that line"))));
}

TEST_F(Device, DoctorAsksARobotThatIsUpAndTheDeviceWhenItIsDown) {
  const std::string line = (directory_ / "tty").string();
  Process emulator({CORBOT_BIN_DIR "/corbot-sim", "ssc32", "--pty", line});
  ASSERT_TRUE(emulator.wait_line("ready", within(30))) << emulator.errors();
  const std::string profile = put_ssc32_profile(line, "");
  EXPECT_THAT(corbot({"doctor", profile}).output, HasSubstr("SSC-32U (SSC32-V2.50USB) on " + line));
  up({}, profile);
  if (HasFatalFailure()) return;
  EXPECT_THAT(corbot({"doctor", profile}).output,
              AllOf(HasSubstr("'" + name_ + "' is up at 127.0.0.1:" + std::to_string(port_)),
                    HasSubstr("the robot is up, and its device is as follows: ssc32, open"),
                    Not(HasSubstr("SSC32-V2.50USB")), Not(HasSubstr("another program has it open"))));
  emulator.send("silent on");
  ASSERT_TRUE(wait_state("Error"));
  const auto sick = corbot({"doctor", profile});
  EXPECT_EQ(sick.code, 1);
  EXPECT_THAT(
      sick.output,
      AllOf(HasSubstr("the robot is up, and its device is as follows: ssc32, lost: it does not answer"),
            HasSubstr("alarm 121: the servo device is lost")));
  EXPECT_EQ(supervisor_->terminate(), 0) << supervisor_->errors();
  supervisor_.reset();
  EXPECT_THAT(corbot({"doctor", profile}).output, HasSubstr("no answer: is the controller powered"));
  EXPECT_EQ(emulator.terminate(), 0);
}

TEST_F(Device, AnOverrideDuringTheFirstMotionTakesEffectAfterIt) {
  const std::string line = (directory_ / "tty").string();
  Process emulator({CORBOT_BIN_DIR "/corbot-sim", "ssc32", "--pty", line});
  ASSERT_TRUE(emulator.wait_line("ready", within(30))) << emulator.errors();
  up({}, put_ssc32_profile(line, "", false));
  if (HasFatalFailure()) return;
  EXPECT_THAT(corbot({"override", "100"}).output, HasSubstr("after it 100 %"));
  EXPECT_EQ(corbot({"override", "5"}).output, "");
  EXPECT_EQ(corbot({"override", "100"}).code, 0);
  ASSERT_EQ(corbot({"joints", "2", "0", "0", "0"}).code, 0);
  EXPECT_EQ(corbot({"override", "100"}).output, "");
  EXPECT_EQ(supervisor_->terminate(), 0) << supervisor_->errors();
  supervisor_.reset();
  EXPECT_EQ(emulator.terminate(), 0);
}

}  // namespace
}  // namespace corbot::test
