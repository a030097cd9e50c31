// SPDX-License-Identifier: Apache-2.0
// Tests a command's output and effect if it cannot be done as requested. The task is frozen, the servant is
// gone, or the robot is another one than the one here.
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <iterator>
#include <regex>

#include "cli/supervise/state_lock.h"
#include "cli_rig.h"
#include "support/paths.h"
#include "support/ports.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class Answers : public CliRig {
 protected:
  pid_t pid_of(const char* key) { return state().at(key).get<pid_t>(); }
  /// The tests' profile with other values of `[supervisor]`.
  std::string supervised(const std::string& key, const std::string& value) const {
    std::ifstream stream(CORBOT_TEST_PROFILE);
    std::string text{std::istreambuf_iterator<char>{stream}, {}};
    const std::size_t at = text.find(key + " = ") + key.size() + 3;
    text.replace(at, text.find_first_of(" \n", at) - at, value);
    return put("supervised.toml", text);
  }
  bool is_held() { return status().at("control").at("held") == true; }
  bool has_alarm(const std::string& code) {
    return corbot({"alarms"}).output.find(" " + code + " ") != std::string::npos;
  }
  static int exit_code(Process& process) {
    const auto end = process.wait(within(60));
    return end ? WEXITSTATUS(*end) : -1;
  }
};

TEST_F(Answers, ARecordNeedsNoTerminal) {
  up();
  const std::string file = (directory_ / "record.csv").string();
  const auto full =
      begin_in({"/bin/sh", "-c", "exec \"$@\" 2>/dev/full", "sh"}, {"record", file, "--for", "0.2"});
  EXPECT_EQ(full->wait(within(20)), 0);
  EXPECT_GT(fs::file_size(file), 5000U) << "some hundred rows";
}

TEST_F(Answers, AFullDiskIsNoSuccess) {
  const auto full = begin_in({"/bin/sh", "-c", "exec \"$@\" >/dev/full", "sh"}, {"version"});
  const auto end = full->wait(within(20));
  ASSERT_TRUE(end);
  EXPECT_EQ(WEXITSTATUS(*end), 5);
  EXPECT_THAT(full->errors(), HasSubstr("standard output: No space left on device"));
  const auto unread =
      begin_in({"/bin/bash", "-c", "\"$@\" | true; exit ${PIPESTATUS[0]}", "bash"}, {"version"});
  EXPECT_EQ(unread->wait(within(20)), 0) << "a reader has what it wanted";
  up();
  const auto stopped =
      begin_in({"/bin/bash", "-c", "\"$@\" | { exec <&-; sleep 1; }; exit ${PIPESTATUS[0]}", "bash"},
               {"stop", "--all"});
  EXPECT_EQ(stopped->wait(within(20)), 0) << stopped->errors();
}

TEST_F(Answers, AHoldOnAFrozenTaskIsCountedAndTakesEffectWhenItGoesOn) {
  up({}, supervised("respond_s", "60"));
  const pid_t rt = pid_of("rt_pid");
  ASSERT_EQ(::kill(rt, SIGSTOP), 0);
  ASSERT_TRUE(wait_state("Error"));
  const RunResult hold = corbot({"hold", "--timeout", "5"});
  EXPECT_EQ(hold.code, 1);
  EXPECT_THAT(hold.errors, AllOf(HasSubstr("does not respond"), HasSubstr("the hold is counted"),
                                 HasSubstr("takes effect"), Not(HasSubstr("NOT HELD"))));
  EXPECT_TRUE(is_held());
  EXPECT_FALSE(has_alarm("133")) << "not yet";
  ASSERT_EQ(::kill(rt, SIGCONT), 0);
  EXPECT_TRUE(wait_until(within(30), [&] { return has_alarm("133"); }));
  EXPECT_TRUE(is_held());
  EXPECT_EQ(corbot({"drive", "0", "1", "50"}).code, 1);
  EXPECT_EQ(corbot({"clear"}).code, 0);
  EXPECT_FALSE(is_held());
}

TEST_F(Answers, AHoldOnAFrozenTaskHoldsTheOneInItsPlace) {
  up({}, supervised("respond_s", "8"));
  const pid_t rt = pid_of("rt_pid");
  ASSERT_EQ(::kill(rt, SIGSTOP), 0);
  ASSERT_TRUE(wait_state("Error"));
  EXPECT_THAT(corbot({"hold", "--timeout", "5"}).errors, HasSubstr("the hold is counted"));
  EXPECT_TRUE(wait_until(within(30), [&] { return pid_of("rt_pid") != rt && has_alarm("133"); }));
  EXPECT_TRUE(is_held());
  EXPECT_TRUE(wait_until(within(30), [&] { return corbot({"clear"}).code == 0; }));
  EXPECT_FALSE(is_held());
}

TEST_F(Answers, AFrozenTasksPositionsHaveAnAge) {
  up({}, supervised("respond_s", "60"));
  EXPECT_LT(status().at("cycle_age_s").get<double>(), 30.0);
  ASSERT_EQ(::kill(pid_of("rt_pid"), SIGSTOP), 0);
  ASSERT_TRUE(wait_until(within(30), [&] { return status().at("cycle_age_s").get<double>() > 2.0; }));
  EXPECT_THAT(corbot({"status"}).output, HasSubstr(" s since the last cycle"));
  EXPECT_THAT(corbot({"watch", "--count", "1"}).output, HasSubstr("  age "));
  ASSERT_EQ(::kill(pid_of("rt_pid"), SIGCONT), 0);
  EXPECT_TRUE(wait_until(within(30), [&] { return status().at("cycle_age_s").get<double>() < 0.1; }));
  EXPECT_TRUE(wait_until(within(30), [&] {
    return corbot({"status"}).output.find("since the last cycle") == std::string::npos;
  }));
}

/// No supervisor starts another servant, so that no answer can come.
TEST_F(Answers, WhatBecameOfAMotionIsUnknownWhereTheServantIsGone) {
  up();
  const auto motion = begin({"joints", "40", "20", "30", "40", "--time", "300"});
  ASSERT_TRUE(wait_state("Waiting"));
  supervisor_->signal(SIGSTOP);
  ASSERT_EQ(::kill(pid_of("servant_pid"), SIGKILL), 0);
  EXPECT_EQ(exit_code(*motion), 3);
  EXPECT_THAT(motion->errors(),
              AllOf(HasSubstr("closed the connection"), HasSubstr("the outcome of motion 1 is unknown"),
                    HasSubstr("corbot cancel 1"), Not(HasSubstr("refused"))));
  supervisor_->signal(SIGCONT);
  EXPECT_TRUE(wait_until(within(30), [&] { return corbot({"cancel", "1"}).code == 0; })) << "it is known";
  EXPECT_TRUE(wait_state("Standby", 30));
}

TEST_F(Answers, WhatBecameOfAMotionIsUnknownWhereTheServantDoesNotAnswer) {
  up();
  const auto motion = begin({"joints", "40", "20", "30", "40", "--time", "300", "--timeout", "5"});
  ASSERT_TRUE(wait_state("Waiting"));
  const pid_t servant = pid_of("servant_pid");
  supervisor_->signal(SIGSTOP);
  ASSERT_EQ(::kill(servant, SIGSTOP), 0);
  EXPECT_EQ(exit_code(*motion), 3);
  EXPECT_THAT(motion->errors(), AllOf(HasSubstr("no answer from"), HasSubstr("in time"),
                                      HasSubstr("the outcome of motion 1 is unknown"),
                                      HasSubstr("corbot cancel 1"), Not(HasSubstr("refused"))));
  ASSERT_EQ(::kill(servant, SIGCONT), 0);
  supervisor_->signal(SIGCONT);
  EXPECT_TRUE(wait_until(within(30), [&] { return corbot({"cancel", "1"}).code == 0; }));
  EXPECT_TRUE(wait_state("Standby", 30));
}

TEST_F(Answers, AServantThatCannotBeStartedIsGivenUpAfterLongerAndLongerWaits) {
  up({}, supervised("attempts", "5"));
  const pid_t servant = pid_of("servant_pid");
  const pid_t rt = pid_of("rt_pid");
  supervisor_->signal(SIGSTOP);
  ASSERT_EQ(::kill(servant, SIGKILL), 0);
  ASSERT_TRUE(wait_until(within(30), [&] { return has_ended(servant); }));
  const int other = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int on = 1;
  ASSERT_EQ(::setsockopt(other, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on)), 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port_));
  ASSERT_TRUE(wait_until(within(30), [&] {
    return ::bind(other, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
  }));
  ASSERT_EQ(::listen(other, 1), 0);
  const auto begin = std::chrono::steady_clock::now();
  supervisor_->signal(SIGCONT);
  EXPECT_EQ(exit_code(*supervisor_), 5);
  ::close(other);
  const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begin;
  EXPECT_GE(passed.count(), 0.1 + 0.2 + 0.4 + 0.8 + 1.6);
  const std::string log = supervisor_->errors();
  std::size_t at = log.find("servant died (signal 9");
  for (const char* wait_s : {"0.1", "0.2", "0.4", "0.8", "1.6"}) {
    ASSERT_NE(at, std::string::npos) << log;
    at = log.find(std::string("starting it again in ") + wait_s + " s\n", at);
  }
  ASSERT_NE(at, std::string::npos) << log;
  EXPECT_THAT(log.substr(at),
              HasSubstr("5 starts in a row failed, the limit of [supervisor] attempts: giving up"));
  EXPECT_TRUE(has_ended(rt)) << "the others are ended";
  supervisor_.reset();
}

/// A robot of the same name on another machine, as far as this one can tell: its files are not here.
class Namesake : public Answers {
 protected:
  void SetUp() override {
    up();
    const fs::path far = directory_ / "far";
    fs::create_directory(far);
    const std::vector<std::string> environment{"XDG_RUNTIME_DIR=" + far.string(),
                                               "CORBOT_STATE_DIR=" + (far / "state").string()};
    const int port = free_port();
    where_ = "127.0.0.1:" + std::to_string(port) + "/" + name_;
    task_ = std::make_unique<Process>(
        std::vector<std::string>{CORBOT_BIN_DIR "/corbot-rt", CORBOT_TEST_PROFILE, "--name", name_},
        environment);
    ASSERT_TRUE(task_->wait_line("ready", within(30))) << task_->errors();
    servant_ = std::make_unique<Process>(
        std::vector<std::string>{servant_program(CORBOT_BIN_DIR), CORBOT_TEST_PROFILE, "--name", name_,
                                 "--endpoint", "127.0.0.1:" + std::to_string(port)},
        environment);
    ASSERT_TRUE(servant_->wait_line("ready", within(30))) << servant_->errors();
    const CORBA::Object_var object = client_orb()->string_to_object(("corbaloc::" + where_).c_str());
    const Corbot::Arm_var arm = Corbot::Arm::_narrow(object);
    const CORBA::String_var ior = client_orb()->object_to_string(arm);
    addresses_ = {where_, "corbaloc::" + where_, ior.in()};
    here_ = begin({"delay", "600"});
    ASSERT_TRUE(wait_state("Waiting"));
  }
  void TearDown() override {
    if (here_) {
      EXPECT_TRUE(here_->running()) << "nothing of the robot here was taken for the other's: "
                                    << here_->errors();
      EXPECT_EQ(status().value("state", ""), "Waiting");
      EXPECT_EQ(corbot({"stop"}).code, 0);
      EXPECT_EQ(exit_code(*here_), 4);
    }
    if (servant_ && servant_->running()) {
      EXPECT_EQ(servant_->terminate(), 0);
    }
    if (task_) {
      EXPECT_EQ(task_->terminate(), 0);
    }
  }
  std::unique_ptr<Process> begin_there(const std::string& address) {
    auto motion = begin({"delay", "600", "--robot", address});
    EXPECT_TRUE(wait_until(within(30), [&] { return there(address).at("state") == "Waiting"; }));
    return motion;
  }
  nlohmann::json there(const std::string& address) {
    const RunResult result = corbot({"status", "--json", "--robot", address});
    return result.code == 0 ? nlohmann::json::parse(result.output) : nlohmann::json{{"state", ""}};
  }

  std::string where_;
  std::vector<std::string> addresses_;
  std::unique_ptr<Process> task_;
  std::unique_ptr<Process> servant_;
  std::unique_ptr<Process> here_;
};

TEST_F(Namesake, WhatIsAskedOfAnAddressConcernsNoRobotHere) {
  for (const std::string& address : addresses_) {
    SCOPED_TRACE(address);
    auto motion = begin_there(address);
    EXPECT_EQ(corbot({"stop", "--robot", address}).code, 0);
    EXPECT_EQ(exit_code(*motion), 4);
    motion = begin_there(address);
    motion->signal(SIGINT);
    EXPECT_EQ(exit_code(*motion), 4) << "Ctrl-C";
    EXPECT_EQ(corbot({"hold", "--robot", address}).code, 0);
    EXPECT_EQ(there(address).at("control").at("held"), true);
    EXPECT_FALSE(is_held());
    EXPECT_EQ(corbot({"clear", "--robot", address}).code, 0);
    EXPECT_EQ(corbot({"pause", "--robot", address}).code, 0);
    EXPECT_EQ(there(address).at("paused"), true);
    EXPECT_EQ(status().at("paused"), false);
    EXPECT_EQ(corbot({"resume", "--robot", address}).code, 0);
    const std::string file = (directory_ / "r.csv").string();
    EXPECT_EQ(corbot({"record", file, "--for", "0.1", "--robot", address}).code, 2);
    EXPECT_FALSE(fs::exists(file));
    EXPECT_EQ(corbot({"status", "--svg", file, "--robot", address}).code, 2) << "the profile is not here";
    EXPECT_FALSE(fs::exists(file));
    EXPECT_TRUE(here_->running());
  }
  EXPECT_EQ(run({"/usr/bin/env", "XDG_RUNTIME_DIR=" + directory_.string(), "CORBOT_ROBOT=" + where_,
                 CORBOT_BIN_DIR "/corbot", "stop"})
                .code,
            0);
}

TEST_F(Namesake, ARobotElsewhereThatDoesNotAnswerIsNotTheOneHere) {
  ASSERT_EQ(servant_->terminate(), 0);
  for (const std::string& address : addresses_) {
    SCOPED_TRACE(address);
    EXPECT_EQ(corbot({"stop", "--robot", address, "--timeout", "5"}).code, 3);
    EXPECT_EQ(corbot({"hold", "--robot", address, "--timeout", "5"}).code, 3);
    EXPECT_EQ(corbot({"drive", "0", "1", "50", "--robot", address, "--timeout", "5"}).code, 3);
    EXPECT_TRUE(here_->running());
  }
}

TEST_F(Answers, RecordTakesNoLocalRobotForOneElsewhere) {
  up();
  const std::string file = (directory_ / "r.csv").string();
  const std::string port = std::to_string(port_);
  for (const std::string& robot : {"127.0.0.2:" + port + "/" + name_,
                                   "corbaloc::192.0.2.1:" + port + "/" + name_, std::string("IOR:00")}) {
    const RunResult result = corbot({"record", file, "--for", "0.1", "--robot", robot});
    EXPECT_EQ(result.code, 2) << result.errors;
    EXPECT_THAT(result.errors, HasSubstr("supervises here"));
    EXPECT_FALSE(fs::exists(file));
  }
  EXPECT_EQ(corbot({"record", file, "--for", "0.1", "--robot", "127.0.0.1:" + port + "/" + name_}).code, 0);
  EXPECT_TRUE(fs::exists(file));
}

TEST_F(Answers, StatusDrawsTheArmAsItStands) {
  up();
  const std::string file = (directory_ / "arm.svg").string();
  const auto picture = [&](const std::vector<std::string>& words) {
    const RunResult result = corbot(words);
    EXPECT_EQ(result.code, 0) << result.errors;
    std::ifstream stream(file);
    return std::string{std::istreambuf_iterator<char>{stream}, {}};
  };
  const std::vector<std::string> draw{"status", "--svg", file};
  const std::string at_home = picture(draw);
  EXPECT_THAT(at_home, HasSubstr("<title>" + name_ + ": the arm"));
  EXPECT_EQ(corbot({"joints", "40", "20", "30", "40"}).code, 0);
  const std::string turned = picture(draw);
  EXPECT_NE(turned, at_home);
  EXPECT_EQ(corbot({"tool", "0.05", "0", "0"}).code, 0);
  EXPECT_NE(picture(draw), turned) << "the tool in force";
  EXPECT_EQ(corbot({"frames", "--reset"}).code, 0);
  EXPECT_EQ(picture(draw), turned);
  EXPECT_EQ(corbot({"workspace", "ceiling", "0", "0", "-1", "-0.3"}).code, 0);
  EXPECT_NE(picture(draw), turned) << "a plane in force";
  EXPECT_EQ(corbot({"workspace", "--reset"}).code, 0);
  EXPECT_EQ(corbot({"limit", "1", "-10", "40"}).code, 0);
  EXPECT_NE(picture(draw), turned) << "a soft limit";
  EXPECT_EQ(corbot({"limit", "--reset"}).code, 0);
  EXPECT_EQ(corbot({"status", "--svg", "arm.png"}).code, 2);
  const std::string by_hand =
      picture({"kinematics", CORBOT_TEST_PROFILE, "--joints", "40,20,30,40", "--svg", file});
  EXPECT_EQ(std::regex_replace(turned, std::regex(name_), "lynx5"), by_hand);
}

TEST_F(Answers, ARefusalNamesTheSettingsBehindIt) {
  up();
  EXPECT_THAT(corbot({"kinematics", CORBOT_TEST_PROFILE, "--pose", "0.2,0,0.3"}).output,
              HasSubstr("0.253553 m"))
      << "at the same pitch";
  EXPECT_THAT(corbot({"move", "0.2", "0", "0.3"}).errors,
              HasSubstr("0.253553 m from the shoulder, allowed 0 to 0.24 m; the tool pitch is 0 degrees "
                        "('corbot pitch' sets another); this command moved"));
  EXPECT_EQ(corbot({"tool", "5", "0", "0"}).code, 0);
  EXPECT_THAT(corbot({"move", "0.2", "0", "0.1"}).errors,
              HasSubstr("; the tool frame has its origin at (5, 0, 0) m ('corbot frames')"));
  EXPECT_EQ(corbot({"limit", "0", "-80", "80"}).code, 0);
  EXPECT_THAT(corbot({"joints", "85", "0", "0", "0"}).errors,
              HasSubstr("-80 to 80 degrees; these are soft limits, the joint's range is -90 to 90"));
  EXPECT_THAT(corbot({"release"}).errors, HasSubstr("'corbot release --force' needs no reference"));
}

TEST_F(Answers, WhereARobotWasLookedForIsSaid) {
  up();
  const fs::path other = directory_ / "other";
  fs::create_directory(other);
  const auto ask_elsewhere = [&](const std::vector<std::string>& arguments) {
    std::vector<std::string> words{"/usr/bin/env", "XDG_RUNTIME_DIR=" + other.string(),
                                   "CORBOT_ROBOT=", CORBOT_BIN_DIR "/corbot"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    return run(words);
  };
  const std::vector<std::vector<std::string>> commands{
      {"status"}, {"stop"}, {"stop", "--all"}, {"status", "--robot", name_}, {"down"}};
  for (const auto& command : commands) {
    const RunResult result = ask_elsewhere(command);
    EXPECT_EQ(result.code, 3) << command[0];
    EXPECT_THAT(result.errors, HasSubstr("looked in " + (other / "corbot").string())) << command[0];
  }
}

/// The robot that is up in the other directory only has files: there is nothing to stop or to read of it.
TEST_F(Answers, StopAllSaysWhichRobotOfAnotherRuntimeDirectoryItDidNotAsk) {
  up();
  const std::string other = unique_name("two-shells");
  ASSERT_EQ(::setenv("XDG_RUNTIME_DIR", "", 1), 0);  // of this process, whose children have one of their own
  auto lock = cli::StateLock::acquire(other);
  ASSERT_TRUE(lock);
  client::RobotState state;
  state.name = other;
  state.pid = ::getpid();
  state.address = "corbaloc::127.0.0.1:1/" + other;
  lock->write(state);
  const RunResult result = corbot({"stop", "--all"});
  lock.reset();
  EXPECT_EQ(result.code, 3);
  EXPECT_EQ(result.output, name_ + ": stopped\n");
  EXPECT_THAT(result.errors, AllOf(HasSubstr("not stopped by --all: "), HasSubstr("'" + other + "' is up"),
                                   HasSubstr("--robot " + state.address)));
}

}  // namespace
}  // namespace corbot::test
