// SPDX-License-Identifier: Apache-2.0
// `corbot calibrate` against an emulated controller; the test computes the angles that an operator would read
// off the arm.
#include <gmock/gmock.h>
#include <signal.h>

#include <fstream>
#include <sstream>

#include "cli_rig.h"
#include "config/profile.h"
#include "support/paths.h"
#include "terminal.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class Calibrate : public CliRig {
 protected:
  Calibrate() {
    line_ = (directory_ / "tty").string();
    power_emulator();
    profile_ = put_ssc32_profile(line_);
    before_ = text_of(profile_);
  }
  ~Calibrate() override {
    supervisor_.reset();
    EXPECT_EQ(emulator_->terminate(), 0);
  }

  /// Also off and on again: it has lost its pulses then.
  void power_emulator() {
    if (emulator_) {
      EXPECT_EQ(emulator_->terminate(), 0);
    }
    emulator_ = std::make_unique<Process>(
        std::vector<std::string>{CORBOT_BIN_DIR "/corbot-sim", "ssc32", "--pty", line_});
    EXPECT_TRUE(emulator_->wait_line("ready", within(30))) << emulator_->errors();
  }
  /// A robot of this name was up with that profile, went to 60, 40, 30, 20 degrees, and did `last`.
  void use(const std::string& profile, const std::vector<std::string>& last = {"status"}) {
    up({}, profile);
    if (HasFatalFailure()) return;
    ASSERT_EQ(corbot({"joints", "60", "40", "30", "20"}).code, 0);
    ASSERT_EQ(corbot(last).code, 0);
    EXPECT_EQ(supervisor_->terminate(), 0) << supervisor_->errors();
    supervisor_.reset();
    power_emulator();
  }

  static std::string text_of(const std::string& file) {
    std::ifstream stream(file);
    std::ostringstream text;
    text << stream.rdbuf();
    return text.str();
  }
  /// A session at a terminal or a pipe; the caller sends commands and waits for output.
  void start(const std::vector<std::string>& more = {}, bool terminal = true) {
    std::vector<std::string> arguments{"calibrate", profile_, "--name", name_};
    arguments.insert(arguments.end(), more.begin(), more.end());
    if (terminal) terminal_ = std::make_unique<Terminal>();
    session_ = begin(arguments, terminal ? terminal_->path() : "");
    ASSERT_TRUE(session_->wait_line("  quit", within(30))) << session_->errors();
  }
  std::string ask(const std::string& command, const std::string& answer) {
    send(command);
    const Deadline deadline = within(30);
    while (auto line = session_->wait_line("", deadline)) {
      while (line->starts_with("> ")) line->erase(0, 2);
      if (line->starts_with(answer)) return *line;
    }
    return "no answer that begins with " + answer;
  }
  void send(const std::string& command) { terminal_ ? terminal_->type(command) : session_->send(command); }
  int end() {
    const auto status = session_->wait(within(20));
    return status && WIFEXITED(*status) ? WEXITSTATUS(*status) : -1;
  }
  bool pulse_is(const std::string& word) {
    emulator_->send("pulses");
    const std::string now = emulator_->wait_line("pulses", within(10)).value_or("") + " ";
    return now.find(" " + word + " ") != std::string::npos;
  }
  bool pulse_arrives(const std::string& word) {
    return wait_until(within(20), [&] { return pulse_is(word); });
  }

  std::string line_;
  std::string profile_;
  std::string before_;
  std::unique_ptr<Process> emulator_;
  std::unique_ptr<Terminal> terminal_;
  std::unique_ptr<Process> session_;
};

TEST_F(Calibrate, FindsTheServoMap) {
  // Really: base 1520 + 9.5 a, elbow 2050 - 10.5 a; the profile says 1500 + 10 a and 2100 - 10 a.
  start();
  if (HasFatalFailure()) return;
  EXPECT_THAT(session_->output(), HasSubstr("SERVO POSITIONS UNKNOWN"));
  EXPECT_EQ(ask("joint base", "base"), "base 1500 us, 0.0 degrees by the present calibration");
  EXPECT_THAT(ask("+ 20", "refused:"), HasSubstr("'on' first"));
  ask("on", "the servos");
  EXPECT_TRUE(pulse_arrives("0=1500"));
  EXPECT_EQ(ask("+ 20", "base"), "base 1520 us, 2.0 degrees by the present calibration");
  EXPECT_TRUE(pulse_arrives("0=1520"));
  EXPECT_THAT(ask("mark open", "refused:"), HasSubstr("choose 'joint gripper' first"));
  EXPECT_THAT(ask("mark 0", "base"), HasSubstr("zero_us 1520, us_per_degree 10"));
  EXPECT_THAT(ask("goto 2600", "refused:"), HasSubstr("from 500 to 2500 us"));
  ask("goto 1947.5", "base");
  EXPECT_THAT(ask("mark 45", "base"), HasSubstr("zero_us 1520, us_per_degree 9.5, direction 1"));
  ask("joint elbow", "elbow");
  ask("goto 2050", "elbow");
  ask("mark 0", "elbow");
  ask("goto 1525", "elbow");
  EXPECT_THAT(ask("mark 50", "elbow"), HasSubstr("zero_us 2050, us_per_degree 10.5, direction -1"));
  EXPECT_THAT(ask("write", "!"), HasSubstr("elbow: its high end, 150 degrees, needs 475 us"));
  EXPECT_EQ(text_of(profile_), before_);
  ask("goto 520", "elbow");
  EXPECT_THAT(ask("limit high", "elbow"), HasSubstr("range_deg -30 to 145.7"));
  ask("joint gripper", "gripper");
  ask("-7", "gripper 1893");
  ask("mark closed", "gripper closed at 1893");
  EXPECT_THAT(ask("frobnicate", "refused:"), HasSubstr("unknown command"));
  ask("write", "written");
  send("quit");
  EXPECT_EQ(end(), 0) << session_->errors();

  const std::string after = text_of(profile_);
  EXPECT_EQ(text_of(profile_ + ".bak"), before_);
  EXPECT_THAT(after, HasSubstr("servo = { channel = 0, zero_us = 1520, us_per_degree = 9.5, direction = 1,"));
  EXPECT_THAT(after, HasSubstr("range_deg = [-30, 145.7]\n"));
  EXPECT_THAT(after, HasSubstr("name = \"elbow\"  # 1500 us at 60 degrees; turns the other way"));
  EXPECT_THAT(after, HasSubstr("closed_us = 1893\n"));
  const auto lines = [](const std::string& text) { return std::count(text.begin(), text.end(), '\n'); };
  EXPECT_EQ(lines(after), lines(before_));

  // The operator turns the base to 45 degrees and checks it.
  supervisor_ = begin({"up", profile_, "--name", name_, "--endpoint", "127.0.0.1:" + std::to_string(port_)});
  ASSERT_TRUE(supervisor_->wait_line(name_ + " is up", within(30))) << supervisor_->errors();
  ASSERT_EQ(corbot({"joints", "40", "0", "100", "0"}).code, 0);
  EXPECT_TRUE(pulse_arrives("0=1900"));
  EXPECT_TRUE(pulse_arrives("2=1000"));
  const RunResult second = corbot({"calibrate", profile_, "--name", name_});
  EXPECT_EQ(second.code, 5);
  EXPECT_THAT(second.errors, HasSubstr("corbot down --name " + name_));
  EXPECT_EQ(supervisor_->terminate(), 0);
}

TEST_F(Calibrate, TheSimulatorsPositionAndHoldAreNotTheArms) {
  use(CORBOT_TEST_PROFILE, {"hold"});
  if (HasFatalFailure()) return;
  start();
  if (HasFatalFailure()) return;
  EXPECT_THAT(session_->output(), HasSubstr("SERVO POSITIONS UNKNOWN; angle 0 of the profile is assumed"));
  EXPECT_EQ(ask("on", "the servos"), "the servos have their pulses");
  EXPECT_TRUE(pulse_arrives("0=1500"));
  send("quit");
  EXPECT_EQ(end(), 0) << session_->errors();
}

TEST_F(Calibrate, StoredAnglesAreShownAndConfirmedBeforeTheServosGoThere) {
  use(profile_);
  if (HasFatalFailure()) return;
  start();
  if (HasFatalFailure()) return;
  EXPECT_THAT(session_->output(), HasSubstr("servo positions are the stored ones"));
  EXPECT_THAT(ask("yes", "refused:"), HasSubstr("'on' first"));
  const std::string warning =
      "'on' takes the servos AT FULL SPEED to base 60.0 degrees, shoulder 40.0 degrees, elbow 30.0 "
      "degrees, wrist 20.0 degrees, gripper ";
  EXPECT_THAT(ask("on", "'on'"), HasSubstr(warning));
  ask("joint base", "base");
  EXPECT_THAT(ask("yes", "refused:"), HasSubstr("'on' first")) << "another command takes 'on' back";
  EXPECT_THAT(ask("+ 20", "refused:"), HasSubstr("'on' first"));
  emulator_->send("pulses");
  EXPECT_THAT(emulator_->wait_line("pulses", within(10)).value_or(""), Not(HasSubstr("0=")));
  ask("on", "'on'");
  EXPECT_EQ(ask("yes", "the servos"), "the servos have their pulses");
  EXPECT_THAT(ask("yes", "refused:"),
              HasSubstr("there is no question to answer with 'yes': the servos are on already"));
  EXPECT_TRUE(pulse_arrives("0=2100"));
  send("quit");
  EXPECT_EQ(end(), 0) << session_->errors();
}

TEST_F(Calibrate, IsRefusedWhileAHoldIsInForce) {
  use(profile_, {"hold"});
  if (HasFatalFailure()) return;
  const RunResult held = corbot({"calibrate", profile_, "--name", name_});
  EXPECT_EQ(held.code, 1);
  EXPECT_THAT(held.errors, AllOf(HasSubstr("'" + name_ + "' is held"), HasSubstr("corbot up " + profile_),
                                 HasSubstr("corbot clear"), HasSubstr("delete ")));
  emulator_->send("pulses");
  EXPECT_THAT(emulator_->wait_line("pulses", within(10)).value_or(""), Not(HasSubstr("0=")));
  up({}, profile_);  // what the message says
  if (HasFatalFailure()) return;
  EXPECT_EQ(corbot({"clear"}).code, 0);
  EXPECT_TRUE(wait_state("Standby"));
  EXPECT_EQ(corbot({"down"}).code, 0);
  supervisor_.reset();
  start();
  if (HasFatalFailure()) return;
  send("quit");
  EXPECT_EQ(end(), 0) << session_->errors();
}

TEST_F(Calibrate, WhatASymbolicLinkLeadsToIsWrittenAndTheLinkStays) {
  const std::string target = profile_;
  profile_ = (directory_ / "link.toml").string();
  fs::create_symlink(target, profile_);
  start();
  if (HasFatalFailure()) return;
  ask("on", "the servos");
  ask("joint base", "base");
  ask("- 13", "base 1487");
  ask("mark 0", "base");
  EXPECT_EQ(ask("write", "written"), "written: " + target + ", to which " + profile_ +
                                         " is a link; the old one is " + target + ".bak");
  send("quit");
  EXPECT_EQ(end(), 0) << session_->errors();
  EXPECT_TRUE(fs::is_symlink(profile_));
  EXPECT_THAT(text_of(target), HasSubstr("zero_us = 1487"));
  EXPECT_EQ(text_of(target + ".bak"), before_);
  EXPECT_FALSE(fs::exists(profile_ + ".bak"));
}

TEST_F(Calibrate, ADryRunChangesNothing) {
  start({"--dry-run"});
  if (HasFatalFailure()) return;
  ask("on", "the servos");
  ask("joint 0", "base");
  ask("- 13", "base 1487");
  ask("mark 0", "base");
  send("write");
  EXPECT_TRUE(session_->wait_line("-servo = { channel = 0, zero_us = 1500", within(10)));
  EXPECT_TRUE(session_->wait_line("+servo = { channel = 0, zero_us = 1487", within(10)));
  ask("undo", "base");
  EXPECT_THAT(ask("write", "refused:"), HasSubstr("nothing has changed"));
  send("quit");
  EXPECT_EQ(end(), 0);
  EXPECT_EQ(text_of(profile_), before_);
  EXPECT_FALSE(fs::exists(profile_ + ".bak"));
}

TEST_F(Calibrate, CtrlCEndsAMotionAndWritesNothing) {
  start();
  if (HasFatalFailure()) return;
  ask("on", "the servos");
  ask("joint base", "base");
  EXPECT_TRUE(pulse_arrives("0=1500"));
  send("goto 2500");  // takes five seconds
  EXPECT_TRUE(wait_until(within(10), [&] { return !pulse_is("0=1500"); }));
  session_->signal(SIGINT);
  EXPECT_EQ(end(), 4) << session_->errors();
  EXPECT_THAT(session_->errors(), HasSubstr("nothing is written"));
  EXPECT_FALSE(pulse_is("0=2500"));
  EXPECT_EQ(text_of(profile_), before_);
}

/// Servos wait for their turn while the first ones have their pulses.
class CalibrateInTheBegin : public Calibrate {
 protected:
  void begin_to_switch_on() {
    std::string text = before_;
    ASSERT_NE(text.find("[backend.ssc32]\n"), std::string::npos);
    text.replace(text.find("[backend.ssc32]\n"), 16,
                 "[backend.ssc32]\nstagger_ms = 2000\nstop_input = \"A\"\nstop_active = \"high\"\n");
    std::ofstream(profile_) << text;
    emulator_->send("input A 0");
    start({}, false);
    if (HasFatalFailure()) return;
    send("on");
    send("joint base");
    send("goto 1600");
    ASSERT_TRUE(pulse_arrives("0=1500"));
  }
  /// The last one would have had its pulse eight seconds after the first.
  void expect_no_more() {
    emulator_->send("pulses");
    const std::string now = emulator_->wait_line("pulses", within(10)).value_or("") + " ";
    EXPECT_EQ(now.find(" 4="), std::string::npos) << now;
    EXPECT_THAT(now, HasSubstr(" 0=1500 "));
  }
};

TEST_F(CalibrateInTheBegin, IsEndedByCtrlC) {
  begin_to_switch_on();
  if (HasFatalFailure()) return;
  session_->signal(SIGINT);
  EXPECT_EQ(end(), 4) << session_->errors();
  EXPECT_THAT(session_->errors(), HasSubstr("ended by Ctrl-C; nothing is written"));
  expect_no_more();
}

TEST_F(CalibrateInTheBegin, IsEndedBySigterm) {
  begin_to_switch_on();
  if (HasFatalFailure()) return;
  session_->signal(SIGTERM);
  EXPECT_EQ(end(), 4) << session_->errors();
  EXPECT_THAT(session_->errors(), HasSubstr("ended by SIGTERM; nothing is written"));
  expect_no_more();
}

TEST_F(CalibrateInTheBegin, IsEndedByAPress) {
  begin_to_switch_on();
  if (HasFatalFailure()) return;
  emulator_->send("input A 1");
  EXPECT_EQ(end(), 4) << session_->errors();
  EXPECT_THAT(session_->errors(), HasSubstr("the emergency stop was pressed"));
  expect_no_more();
}

TEST_F(Calibrate, ALostDeviceEndsIt) {
  start();
  if (HasFatalFailure()) return;
  ask("on", "the servos");
  ask("joint base", "base");
  send("goto 2500");
  EXPECT_TRUE(wait_until(within(10), [&] { return !pulse_is("0=1500"); }));
  emulator_->send("unplug");
  EXPECT_EQ(end(), 5);
  EXPECT_THAT(session_->errors(), AllOf(HasSubstr("the device is lost: " + line_),
                                        HasSubstr("; nothing is written"), Not(HasSubstr("trying again"))));
  EXPECT_THAT(session_->output(), AllOf(HasSubstr("ssc32: lost: " + line_), Not(HasSubstr("trying again"))));
  EXPECT_EQ(text_of(profile_), before_);
  emulator_->send("plug");
}

TEST_F(Calibrate, ARefusedLineFromAPipeEndsItBeforeAnythingIsWritten) {
  start({}, false);
  if (HasFatalFailure()) return;
  for (const char* line : {"on", "# first the base", "joint base", "mark 5", "mark O", "write", "quit"})
    send(line);
  EXPECT_EQ(end(), 2);
  EXPECT_THAT(session_->errors(), HasSubstr("line 5: 'O' is not a number; nothing is written"));
  EXPECT_EQ(text_of(profile_), before_);
}

TEST_F(Calibrate, ARefusedWriteFromAPipeEndsIt) {
  start({}, false);
  if (HasFatalFailure()) return;
  for (const char* line : {"on", "joint base", "mark 0.5", "write", "+ 300", "mark 15.5", "write", "mark 3"})
    send(line);
  EXPECT_EQ(end(), 2);
  EXPECT_THAT(session_->output(), HasSubstr("! base: its"));
  EXPECT_THAT(session_->errors(),
              AllOf(HasSubstr("line 7: "),
                    HasSubstr("fix the faults marked '!' first; 1 joint was marked and not written"),
                    Not(HasSubstr("nothing is written"))));
  EXPECT_NE(text_of(profile_), before_) << "the first one was good";
}

TEST_F(Calibrate, MarksThatWereNotWrittenAreReported) {
  start({}, false);
  if (HasFatalFailure()) return;
  for (const char* line : {"on", "joint base", "mark 1", "joint elbow", "mark 1", "quit"}) send(line);
  EXPECT_EQ(end(), 0);
  EXPECT_THAT(session_->errors(), HasSubstr("2 joints were marked and not written"));
  EXPECT_EQ(text_of(profile_), before_);
}

TEST_F(Calibrate, QuitWarnsOnceAtATerminal) {
  start();
  if (HasFatalFailure()) return;
  ask("on", "the servos");
  ask("joint base", "base");
  ask("mark 1", "base");
  EXPECT_EQ(
      ask("quit", "1 joint"),
      "1 joint was marked and not written: type 'write' to keep the values, or 'quit' again to lose them");
  ask("write", "written");
  ask("joint gripper", "gripper");
  ask("- 7", "gripper");
  ask("mark closed", "gripper closed");
  EXPECT_THAT(ask("quit", "1 joint"), HasSubstr("'quit' again"));
  send("quit");
  EXPECT_EQ(end(), 0) << session_->errors();
  EXPECT_THAT(text_of(profile_), Not(HasSubstr("closed_us = 1893")));
}

TEST_F(Calibrate, ADeviceThatIsLostAfterAWriteLeavesWhatWasWritten) {
  start();
  if (HasFatalFailure()) return;
  ask("on", "the servos");
  ask("joint base", "base");
  ask("mark 1", "base");
  ask("write", "written");
  send("goto 2500");
  EXPECT_TRUE(wait_until(within(10), [&] { return !pulse_is("0=1500"); }));
  emulator_->send("unplug");
  EXPECT_EQ(end(), 5);
  EXPECT_THAT(session_->errors(), AllOf(HasSubstr("the device is lost: " + line_),
                                        Not(HasSubstr("is written")), Not(HasSubstr("trying again"))));
  emulator_->send("plug");
}

TEST_F(Calibrate, TheSimulatorIsReported) {
  session_ = begin({"calibrate", CORBOT_TEST_PROFILE, "--name", name_});
  send("quit");
  EXPECT_EQ(end(), 0) << session_->errors();
  EXPECT_THAT(session_->output(), AllOf(HasSubstr("this is the simulator: no real servo is measured"),
                                        Not(HasSubstr("UNKNOWN"))));
}

TEST_F(Calibrate, IsRefusedWhileARealTimeTaskHoldsTheServos) {
  Process task({CORBOT_BIN_DIR "/corbot-rt", CORBOT_TEST_PROFILE, "--name", name_});
  ASSERT_TRUE(task.wait_line("ready", within(30))) << task.errors();
  const RunResult result = corbot({"calibrate", profile_, "--name", name_});
  EXPECT_EQ(result.code, 5);
  EXPECT_THAT(result.errors, HasSubstr("is running and holds the servos"));
  EXPECT_EQ(task.terminate(), 0);
  EXPECT_EQ(corbot({"calibrate", "/nonexistent.toml"}).code, 2);
  EXPECT_THAT(corbot({"calibrate", "--help"}).output, AllOf(HasSubstr("--dry-run"), HasSubstr("mark VALUE")));
}

}  // namespace
}  // namespace corbot::test
