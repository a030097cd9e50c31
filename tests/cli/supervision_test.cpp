// SPDX-License-Identifier: Apache-2.0
#include <arpa/inet.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <utility>

#include "cli_rig.h"
#include "corbot/units.h"
#include "shm/channel_client.h"
#include "shm/descriptor.h"
#include "support/paths.h"
#include "support/ports.h"
#include "support/traced_thread.h"
#include "terminal.h"

namespace corbot::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class Supervision : public CliRig {
 protected:
  pid_t pid_of(const char* key) { return state().at(key).get<pid_t>(); }
  /// The tests' profile with that `respond_s`, which is a fault of the loop, too.
  std::string responding_within(int seconds) const {
    std::ifstream stream(CORBOT_TEST_PROFILE);
    std::string text{std::istreambuf_iterator<char>{stream}, {}};
    for (const auto& [key, value] :
         {std::pair{"respond_s = ", seconds}, std::pair{"gap_fault_ms = ", 1000 * seconds}}) {
      const std::size_t at = text.find(key) + std::strlen(key);
      text.replace(at, text.find_first_of(" \n", at) - at, std::to_string(value));
    }
    return put("respond.toml", text);
  }
  /// The robot replies and executes a motion.
  bool works() {
    return wait_until(within(30), [&] { return corbot({"drive", "0", "1", "50"}).code == 0; });
  }
};

TEST_F(Supervision, DownEndsEverythingAndLeavesNothing) {
  up();
  EXPECT_THAT(supervisor_->output(), HasSubstr("corbaloc::127.0.0.1:" + std::to_string(port_) + "/" + name_));
  const pid_t rt = pid_of("rt_pid");
  const pid_t servant = pid_of("servant_pid");
  ASSERT_GT(rt, 0);
  ASSERT_GT(servant, 0);
  const RunResult result = corbot({"down"});
  EXPECT_EQ(result.code, 0) << result.errors;
  EXPECT_EQ(result.output, name_ + " is down\n");
  EXPECT_TRUE(has_ended(rt));
  EXPECT_TRUE(has_ended(servant));
  EXPECT_EQ(supervisor_->wait(within(30)), 0);
  EXPECT_FALSE(channel_exists(name_, directory_.string()));
  EXPECT_EQ(corbot({"down"}).code, 3) << "there is nothing left to end";
  supervisor_.reset();
}

TEST_F(Supervision, SimulatedStartsNothingThatDrivesADevice) {
  const std::string profile = put_ssc32_profile((directory_ / "tty").string());
  const RunResult refused = corbot({"up", profile, "--simulated"});
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.errors,
              HasSubstr("backend.kind of " + profile + " is \"ssc32\", which drives a device"));
  up({"--simulated"});
}

TEST_F(Supervision, ADoubtfulProfileWarnsAtTheStart) {
  std::ifstream stream(CORBOT_TEST_PROFILE);
  std::string text{std::istreambuf_iterator<char>{stream}, {}};
  const std::string key = "\nspeed_m_s = ";
  const std::size_t at = text.find(key);
  ASSERT_NE(at, std::string::npos);
  text.replace(at, text.find('\n', at + 1) - at, key + "250");
  up({}, put("fast.toml", text));
  EXPECT_THAT(supervisor_->errors(), HasSubstr("path.speed_m_s = 250 m/s: millimetres? Then 0.25 is meant"));
}

TEST_F(Supervision, RangesThatReadAsRadiansAreDoubted) {
  std::ifstream stream(CORBOT_TEST_PROFILE);
  std::string text{std::istreambuf_iterator<char>{stream}, {}};
  const std::string key = "range_deg = [";
  for (std::size_t at = text.find(key); at != std::string::npos; at = text.find(key, at + 1))
    text.replace(at, text.find(']', at) - at, key + "-1.3, 1.3");
  up({}, put("radians.toml", text));
  EXPECT_THAT(supervisor_->errors(),
              HasSubstr("joint 'base': range_deg is within 1.3 degrees of 0: radians?"));
}

TEST_F(Supervision, TheEndOfStandardInputEndsTheRobotThatAsksForIt) {
  up({"--until-eof"});
  const pid_t rt = pid_of("rt_pid");
  const pid_t servant = pid_of("servant_pid");
  supervisor_->send("a line that nothing needs");
  EXPECT_EQ(corbot({"status"}).code, 0);
  supervisor_->close_input();
  EXPECT_EQ(supervisor_->wait(within(30)), 0);
  EXPECT_TRUE(has_ended(rt));
  EXPECT_TRUE(has_ended(servant));
  supervisor_.reset();
}

TEST_F(Supervision, DownEndsTheRobotThatTheEnvironmentNames) {
  up();
  const auto down_of = [&](const std::string& robot) {
    return run({"/usr/bin/env", "CORBOT_ROBOT=" + robot, CORBOT_BIN_DIR "/corbot", "down"}, 30,
               environment());
  };
  const RunResult other = down_of("another");
  EXPECT_EQ(other.code, 3);
  EXPECT_THAT(other.errors, AllOf(HasSubstr("no robot named 'another' is up"),
                                  HasSubstr("; these are up: " + name_ + "\n")));
  EXPECT_THAT(corbot({"down", "--name", name_ + "x"}).errors, HasSubstr("did you mean '" + name_ + "'?"));
  const RunResult elsewhere = down_of("corbaloc::127.0.0.1:1/another");
  EXPECT_EQ(elsewhere.code, 2);
  EXPECT_THAT(elsewhere.errors, HasSubstr("name one with --name"));
  EXPECT_EQ(corbot({"status"}).code, 0);
  EXPECT_EQ(down_of("127.0.0.1:" + std::to_string(port_) + "/" + name_).output, name_ + " is down\n");
  EXPECT_EQ(supervisor_->wait(within(30)), 0);
  supervisor_.reset();
}

TEST_F(Supervision, DownEndsTheRobotThatTheOptionBeforeItNames) {
  up();
  const RunResult other = corbot({"--robot", "another", "down"});
  EXPECT_EQ(other.code, 3);
  EXPECT_THAT(other.errors, HasSubstr("no robot named 'another' is up"));
  const RunResult elsewhere = corbot({"--robot", "corbaloc::127.0.0.1:1/another", "down"});
  EXPECT_EQ(elsewhere.code, 2);
  EXPECT_THAT(elsewhere.errors, HasSubstr("--robot names no robot that 'corbot up' supervises"));
  EXPECT_EQ(corbot({"status"}).code, 0) << "the only robot that is up is another one";
  EXPECT_EQ(corbot({"--robot", name_, "down"}).output, name_ + " is down\n");
  EXPECT_EQ(supervisor_->wait(within(30)), 0);
  supervisor_.reset();
}

TEST_F(Supervision, DownEndsWhoHoldsTheNameWhateverPidItsFileSays) {
  up();
  Process bystander({"/bin/sleep", "300"});
  const std::filesystem::path file = directory_ / "corbot" / (name_ + ".json");
  auto forged = state();
  forged["pid"] = bystander.pid();
  std::ofstream(file) << forged.dump();

  const RunResult result = corbot({"down", "--name", name_});
  EXPECT_EQ(result.code, 0) << result.errors;
  EXPECT_EQ(result.output, name_ + " is down\n");
  EXPECT_EQ(supervisor_->wait(within(30)), 0);
  EXPECT_FALSE(has_ended(bystander.pid())) << "it has nothing to do with the robot";
  supervisor_.reset();
}

TEST_F(Supervision, DownWaitsForTheKillOfAProcessThatDoesNotEnd) {
  up();
  const pid_t servant = pid_of("servant_pid");
  const pid_t rt = pid_of("rt_pid");
  ASSERT_EQ(::kill(servant, SIGSTOP), 0);  // it cannot handle SIGTERM
  const RunResult result = corbot({"down"});
  EXPECT_EQ(result.code, 0) << result.errors;
  EXPECT_TRUE(has_ended(servant));
  EXPECT_TRUE(has_ended(rt));
  EXPECT_EQ(supervisor_->wait(within(30)), 0);
  const std::string log = supervisor_->errors();
  const std::size_t killing = log.find("servant has not ended yet; killing it");
  ASSERT_NE(killing, std::string::npos) << log;
  EXPECT_LT(killing, log.find("at rest, ended")) << "the real-time task outlives the servant";
  supervisor_.reset();
}

/// The servant is killed at the end of its grace, and the arm must not move on until then.
TEST_F(Supervision, DownStopsTheArmWhateverHoldsTheServant) {
  if (const std::string why = why_not_traceable(); !why.empty()) GTEST_SKIP() << why;
  up({}, responding_within(10));
  const auto motion = begin({"joints", "80", "20", "30", "40", "--time", "60"});
  ASSERT_TRUE(wait_state("Waiting"));
  ASSERT_EQ(::setenv("XDG_RUNTIME_DIR", directory_.c_str(), 1), 0);
  const Observer task = Observer::of(name_);
  const auto moves = [&] {
    Snapshot now{};
    return task.task().snapshot.load(now) && now.velocity_q_s[0] != 0.0;
  };
  ASSERT_TRUE(wait_until(within(20), moves));
  const pid_t servant = pid_of("servant_pid");
  TracedThread held(servant, servant);  // its other threads go on, so the task has a servant
  const auto down = begin({"down"});
  EXPECT_TRUE(wait_until(within(20), [&] { return !moves(); }));
  EXPECT_FALSE(has_ended(servant)) << "the arm is at rest before it is killed";
  const auto joint_deg = [&] {
    Snapshot now{};
    EXPECT_TRUE(task.task().snapshot.load(now));
    return to_degrees(now.position_q[0]);
  };
  const double rest_deg = joint_deg();
  const auto later = begin({"joints", "-80", "20", "30", "40", "--time", "5"});
  EXPECT_NE(later->wait(within(30)), 0);
  EXPECT_NEAR(joint_deg(), rest_deg, 5.0) << "the servant has not been killed yet, and begins motions";
  held.release();
  EXPECT_EQ(down->wait(within(30)), 0);
  EXPECT_EQ(supervisor_->wait(within(30)), 0);
  supervisor_.reset();
}

/// As with a terminal that Ctrl-S has stopped: each log line would wait.
TEST_F(Supervision, WithoutAReaderOfItsOutputTheProgramsAreReplaced) {
  const std::string log = (directory_ / "log").string();
  ASSERT_EQ(::mkfifo(log.c_str(), 0600), 0);
  const Descriptor fifo(::open(log.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  ASSERT_TRUE(fifo);
  std::vector<std::string> words{"up",  CORBOT_TEST_PROFILE, "--name",
                                 name_, "--endpoint",        "127.0.0.1:" + std::to_string(port_)};
  if (on_orbit2()) words.insert(words.end(), {"--orb", "orbit2"});
  supervisor_ = begin_in({"/bin/sh", "-c", "exec \"$@\" 2>\"$0\"", log}, words);
  ASSERT_TRUE(supervisor_->wait_line(name_ + " is up", within(30)));
  std::array<char, 4096> page{};
  while (::write(fifo.get(), page.data(), page.size()) > 0 || ::write(fifo.get(), page.data(), 1) > 0) {
  }
  for (const char* key : {"rt_pid", "servant_pid"}) {
    const pid_t old = pid_of(key);
    ASSERT_EQ(::kill(old, SIGKILL), 0);
    EXPECT_TRUE(wait_until(within(30), [&] { return pid_of(key) != old && works(); })) << key;
  }
  EXPECT_EQ(corbot({"down"}).code, 0);
  EXPECT_EQ(supervisor_->wait(within(30)), 0);
  supervisor_.reset();
}

TEST_F(Supervision, AServantThatWasNotBuiltIsNamed) {
  if (::access(CORBOT_BIN_DIR "/corbot-servant-orbit2", X_OK) == 0)
    GTEST_SKIP() << "skipped: built with ORBit2";
  const RunResult result = corbot({"up", CORBOT_TEST_PROFILE, "--name", name_, "--endpoint",
                                   "127.0.0.1:" + std::to_string(port_), "--orb", "orbit2"});
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.errors, HasSubstr("built without ORBit2"));
}

TEST_F(Supervision, CtrlCEndsEverything) {
  up();
  const pid_t rt = pid_of("rt_pid");
  supervisor_->signal(SIGINT);
  EXPECT_EQ(supervisor_->wait(within(20)), 0);
  EXPECT_TRUE(has_ended(rt));
  const std::string log = supervisor_->errors() + supervisor_->output();
  EXPECT_THAT(log, HasSubstr(name_ + " is down"));
  supervisor_.reset();
}

TEST_F(Supervision, ASecondRequestToEndJoinsTheFirst) {
  up();
  const auto motion = begin({"joints", "80", "20", "30", "40"});
  ASSERT_TRUE(wait_state("Waiting"));
  supervisor_->signal(SIGTERM);  // as of 'corbot down', of '--replace', and of a service manager
  ASSERT_TRUE(supervisor_->wait_line("ending " + name_, within(30)));
  supervisor_->signal(SIGTERM);
  EXPECT_EQ(supervisor_->wait(within(30)), 0);
  EXPECT_THAT(supervisor_->errors(), AllOf(HasSubstr("at rest, ended"), Not(HasSubstr("killing it"))))
      << "the arm came to rest on its path";
  supervisor_.reset();
}

TEST_F(Supervision, AReplacementWhosePortIsTakenEndsNothing) {
  up();
  const int taken = free_port();
  const Descriptor listener(::socket(AF_INET, SOCK_STREAM, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(taken));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ASSERT_EQ(::bind(listener.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  ASSERT_EQ(::listen(listener.get(), 1), 0);
  const std::string port = std::to_string(taken);
  const std::vector<std::vector<std::string>> requests{
      {"--endpoint", "127.0.0.1:" + port},
      {"--endpoint", "127.0.0.1:" + std::to_string(free_port()), "--naming", port}};
  for (const std::vector<std::string>& request : requests) {
    std::vector<std::string> words{"up", CORBOT_TEST_PROFILE, "--name", name_, "--replace"};
    words.insert(words.end(), request.begin(), request.end());
    const RunResult refused = corbot(words);
    EXPECT_EQ(refused.code, 5);
    EXPECT_THAT(refused.errors, HasSubstr("port " + port));
    EXPECT_TRUE(works());
  }
}

TEST_F(Supervision, AKilledServantIsRestartedAndTheArmGoesOn) {
  up();
  const pid_t first = pid_of("servant_pid");
  const auto motion = begin({"joints", "40", "20", "30", "40", "--time", "3"});
  ASSERT_TRUE(wait_state("Waiting"));
  ASSERT_EQ(::kill(first, SIGKILL), 0);
  EXPECT_TRUE(wait_until(within(20), [&] { return pid_of("servant_pid") != first; }));
  const auto end = motion->wait(within(20));
  ASSERT_TRUE(end);
  // Its ticket outlives the servant; where the next one was not there in time, the client says that it does
  // not know.
  if (WEXITSTATUS(*end) != 0) {
    EXPECT_EQ(WEXITSTATUS(*end), 3);
    EXPECT_THAT(motion->errors(), HasSubstr("the outcome of motion 1 is unknown"));
  }
  EXPECT_TRUE(wait_state("Standby"));
  EXPECT_NEAR(status().at("joints").at(0).at("value_deg").get<double>(), 40.0, 1e-6);
  EXPECT_TRUE(works());
  EXPECT_THAT(supervisor_->errors(),
              AllOf(HasSubstr("servant died (signal 9"), HasSubstr("servant restarted")));
}

TEST_F(Supervision, AKilledRealTimeTaskIsRestartedWhereTheArmWas) {
  up();
  ASSERT_EQ(corbot({"joints", "30", "0", "0", "0"}).code, 0);
  const pid_t first = pid_of("rt_pid");
  ASSERT_EQ(::kill(first, SIGKILL), 0);
  ASSERT_TRUE(wait_until(within(20), [&] {
    const RunResult alarms = corbot({"alarms"});
    return alarms.output.find("is gone; its supervisor is starting it again") != std::string::npos;
  }));
  ASSERT_TRUE(wait_until(within(20), [&] {
    const pid_t now = pid_of("rt_pid");
    return now != 0 && now != first;
  }));
  ASSERT_TRUE(works());
  EXPECT_GT(status().at("joints").at(0).at("value_deg").get<double>(), 30.0) << "it goes on from 30 degrees";
  EXPECT_THAT(supervisor_->errors(), HasSubstr("real-time task died (signal 9"));
}

TEST_F(Supervision, AFrozenServantIsReplaced) {
  up({}, responding_within(4));
  const pid_t first = pid_of("servant_pid");
  const pid_t rt = pid_of("rt_pid");
  ASSERT_EQ(::kill(first, SIGSTOP), 0);
  ASSERT_TRUE(wait_until(within(30), [&] {
    const pid_t now = pid_of("servant_pid");
    return now != 0 && now != first;
  })) << supervisor_->errors();
  EXPECT_TRUE(has_ended(first));
  EXPECT_TRUE(works()) << "without a person's Clear";
  EXPECT_EQ(pid_of("rt_pid"), rt);
  EXPECT_THAT(supervisor_->errors(),
              AllOf(HasSubstr("servant (pid " + std::to_string(first) + ") has not responded for 4 s"),
                    HasSubstr("servant restarted")));
}

TEST_F(Supervision, AFrozenTaskIsReplacedInErrorUntilClear) {
  up({}, responding_within(4));
  ASSERT_EQ(corbot({"joints", "30", "0", "0", "0"}).code, 0);
  const pid_t first = pid_of("rt_pid");
  const pid_t servant = pid_of("servant_pid");
  ASSERT_EQ(::kill(first, SIGSTOP), 0);
  ASSERT_TRUE(wait_until(within(30), [&] {
    const pid_t now = pid_of("rt_pid");
    return now != 0 && now != first && corbot({"alarms"}).output.find(" 142 ") != std::string::npos;
  })) << supervisor_->errors();
  EXPECT_EQ(status().at("state"), "Error");
  EXPECT_EQ(pid_of("servant_pid"), servant) << "which responds while its task does not";
  EXPECT_EQ(corbot({"drive", "0", "1", "50"}).code, 1);
  ASSERT_EQ(corbot({"clear"}).code, 0);
  EXPECT_TRUE(works());
  EXPECT_GT(status().at("joints").at(0).at("value_deg").get<double>(), 30.0) << "it goes on from 30 degrees";
  EXPECT_THAT(supervisor_->errors(),
              HasSubstr("real-time task (pid " + std::to_string(first) + ") has not responded"));
}

/// Only the supervisor has the shared memory left.
TEST_F(Supervision, WhenBothAreKilledTheNextTaskTakesOverFromTheLast) {
  // Not what the simulator knows: with a position that is only assumed, the first motion would be slow again.
  std::ifstream stream(CORBOT_TEST_PROFILE);
  std::string profile{std::istreambuf_iterator<char>{stream}, {}};
  const std::string backend = "[backend]\n";
  ASSERT_NE(profile.find(backend), std::string::npos);
  profile.insert(profile.find(backend) + backend.size(), "position_known_at_start = false\n");
  up({}, put("unknown.toml", profile));
  ASSERT_EQ(corbot({"drive", "0", "20", "50"}).code, 0);
  EXPECT_EQ(status().at("device").at("position_uncertain"), false) << status();
  const pid_t servant = pid_of("servant_pid");
  const pid_t rt = pid_of("rt_pid");
  for (const pid_t pid : {servant, rt})
    ASSERT_EQ(::kill(pid, SIGSTOP), 0);  // so that neither sees the other go
  for (const pid_t pid : {servant, rt}) ASSERT_EQ(::kill(pid, SIGKILL), 0);
  ASSERT_TRUE(wait_until(within(30), [&] {
    return pid_of("servant_pid") != servant && pid_of("rt_pid") != rt && corbot({"status"}).code == 0;
  })) << supervisor_->errors();
  ASSERT_TRUE(wait_until(within(30), [&] { return status().at("state") == "Standby"; }))
      << supervisor_->errors();
  EXPECT_NEAR(status().at("joints").at(0).at("value_deg").get<double>(), 20.0, 1e-6);
  EXPECT_EQ(status().at("device").at("position_uncertain"), false);
  EXPECT_TRUE(works());
}

TEST_F(Supervision, AKeyInTheConsoleStopsTheArm) {
  const Terminal terminal;
  std::vector<std::string> words{"up",  CORBOT_TEST_PROFILE, "--name",
                                 name_, "--endpoint",        "127.0.0.1:" + std::to_string(port_)};
  if (on_orbit2()) words.insert(words.end(), {"--orb", "orbit2"});
  supervisor_ = begin(words, terminal.path());
  ASSERT_TRUE(supervisor_->wait_line("try: ", within(30))) << supervisor_->errors();
  EXPECT_THAT(supervisor_->output(), HasSubstr("Enter stops the arm"));
  for (const char* key : {" ", "s", ""}) {
    const auto motion = begin({"joints", "80", "20", "30", "40", "--time", "60"});
    ASSERT_TRUE(wait_state("Waiting"));
    terminal.type(key);
    const auto end = motion->wait(within(20));
    ASSERT_TRUE(end);
    EXPECT_EQ(WEXITSTATUS(*end), 4) << motion->errors();
    EXPECT_TRUE(supervisor_->wait_line("the arm is stopped", within(20)));
    ASSERT_TRUE(wait_state("Standby"));
  }
  const auto motion = begin({"joints", "-80", "20", "30", "40", "--time", "60"});
  ASSERT_TRUE(wait_state("Waiting"));
  const pid_t servant = pid_of("servant_pid");
  ASSERT_EQ(::kill(servant, SIGSTOP), 0);
  terminal.type("");
  EXPECT_TRUE(supervisor_->wait_line("the arm is stopped", within(20))) << "without a servant that responds";
  ASSERT_EQ(::kill(servant, SIGCONT), 0);
  ASSERT_TRUE(motion->wait(within(20)));
  ASSERT_TRUE(wait_state("Standby"));
  EXPECT_GT(status().at("joints").at(0).at("value_deg").get<double>(), -79);
  terminal.type("help");
  EXPECT_TRUE(supervisor_->wait_line("Enter, or s and Enter, stops the arm", within(20)));
  EXPECT_TRUE(works());
}

TEST_F(Supervision, NoChildOutlivesAKilledSupervisor) {
  up();
  const pid_t rt = pid_of("rt_pid");
  const pid_t servant = pid_of("servant_pid");
  supervisor_->signal(SIGKILL);
  ASSERT_TRUE(supervisor_->wait(within(30)));
  EXPECT_TRUE(wait_until(within(20), [&] { return has_ended(rt) && has_ended(servant); }));
  EXPECT_EQ(corbot({"status"}).code, 3) << "a stale state file is not a robot";
  const RunResult result = corbot({"down", "--name", name_});
  EXPECT_EQ(result.code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("stale files are removed"));
  supervisor_.reset();
}

/// The files of the supervisor that was killed are there when the next one takes the name.
TEST_F(Supervision, ARobotThatCameUpAfterACrashCanBeEnded) {
  up();
  const pid_t rt = pid_of("rt_pid");
  const pid_t servant = pid_of("servant_pid");
  supervisor_->signal(SIGKILL);
  ASSERT_TRUE(supervisor_->wait(within(30)));
  ASSERT_TRUE(wait_until(within(20), [&] { return has_ended(rt) && has_ended(servant); }));
  supervisor_.reset();
  up();
  const RunResult result = corbot({"down"});
  EXPECT_EQ(result.code, 0) << result.errors;
  EXPECT_EQ(supervisor_->wait(within(30)), 0);
  supervisor_.reset();
}

TEST_F(Supervision, StaleFilesOfATotalCrashAreListed) {
  up();
  const std::vector<pid_t> all{pid_of("rt_pid"), pid_of("servant_pid"), supervisor_->pid()};
  // Or the children would still end in order when the supervisor dies.
  for (const pid_t pid : all) ASSERT_EQ(::kill(pid, SIGSTOP), 0);
  for (const pid_t pid : all) ASSERT_EQ(::kill(pid, SIGKILL), 0);
  ASSERT_TRUE(supervisor_->wait(within(30)));
  ASSERT_TRUE(wait_until(within(20), [&] { return has_ended(all[0]) && has_ended(all[1]); }));
  ASSERT_TRUE(channel_exists(name_, directory_.string()));
  // The task's socket alone.
  for (const char* suffix : {".json", ".lock"})
    std::filesystem::remove(directory_ / "corbot" / (name_ + suffix));
  const RunResult nothing = corbot({"down"});
  EXPECT_EQ(nothing.code, 3);
  EXPECT_THAT(nothing.errors,
              HasSubstr("stale after a crash: " + name_ + ": 'corbot down --name " + name_ + "'"));
  EXPECT_EQ(corbot({"down", "--name", name_}).code, 0);
  EXPECT_THAT(corbot({"down"}).errors, testing::Not(HasSubstr(name_)));
  supervisor_.reset();
}

TEST_F(Supervision, ATimeoutIsANumberWithinItsRange) {
  for (const char* word : {"nan", "inf", "-nan", "0x10", " 1", "1 ", "", "0.09", "3601", "-1", "1,5"}) {
    const RunResult result = corbot({"status", "--timeout", word});
    EXPECT_EQ(result.code, 2) << "'" << word << "': " << result.errors;
    EXPECT_THAT(result.errors, HasSubstr("--timeout")) << word;
  }
  EXPECT_EQ(corbot({"status", "--timeout", "+1.5"}).code, 3) << "no robot is up";
  EXPECT_EQ(corbot({"watch", "--count", "1", "--interval", "nan"}).code, 2);
}

TEST_F(Supervision, ASecondOneIsRefused) {
  up();
  const RunResult same = corbot({"up", CORBOT_TEST_PROFILE, "--name", name_});
  EXPECT_EQ(same.code, 5);
  EXPECT_THAT(same.errors, AllOf(HasSubstr("already running"), HasSubstr("corbot down --name " + name_)));
  const RunResult port = corbot(
      {"up", CORBOT_TEST_PROFILE, "--name", name_ + "b", "--endpoint", "127.0.0.1:" + std::to_string(port_)});
  EXPECT_EQ(port.code, 5);
  EXPECT_THAT(port.errors, AllOf(HasSubstr("port " + std::to_string(port_)), HasSubstr("--endpoint")));
  EXPECT_EQ(corbot({"status"}).code, 0) << "the first one is untouched";
}

TEST_F(Supervision, AUnixSocketIsListenedOnAsWell) {
  if (on_orbit2()) GTEST_SKIP() << "it listens on one address";
  const std::string socket = directory_ / "clients.sock";
  up({"--unix", socket});
  EXPECT_EQ(corbot({"status", "--robot", "corbaloc:omniunix:" + socket + ":/" + name_}).code, 0);
  EXPECT_EQ(corbot({"status"}).code, 0);
}

TEST_F(Supervision, TheNamingServiceKnowsTheRobot) {
  const int naming = free_port();
  up({"--naming", std::to_string(naming)});
  const std::string robot = "corbaname::127.0.0.1:" + std::to_string(naming) + "#Robots/" + name_ + ".Robot";
  EXPECT_TRUE(supervisor_->wait_line("and, once the servant has its name, at " + robot, within(10)));
  EXPECT_TRUE(wait_until(within(20), [&] {
    return corbot({"status", "--robot", robot}).code == 0;
  })) << supervisor_->errors();
}

TEST_F(Supervision, WrongStartsAreUsageErrors) {
  const std::string bad = put("bad.toml", "[robot]\nname = 3\n");
  const std::vector<std::pair<std::vector<std::string>, const char*>> cases{
      {{"up"}, "PROFILE"},
      {{"up", "/nonexistent.toml"}, "/nonexistent.toml"},
      {{"up", bad}, "bad.toml:2"},
      {{"up", CORBOT_TEST_PROFILE, "--name", "a b"},
       "--name 'a b': 1 to 32 ASCII letters, digits, '_' or '-'"},
      {{"down", "--name", "a\tb"}, "--name 'a?b': 1 to 32 ASCII letters"},
      {{"up", CORBOT_TEST_PROFILE, "--endpoint", "here"}, "--endpoint: 'here' is not HOST:PORT"},
      {{"up", CORBOT_TEST_PROFILE, "--orb", "tao"}, "--orb"},
      {{"up", CORBOT_TEST_PROFILE, "--orb", "orbit2", "--unix", "/tmp/s"}, "ORBit2 listens on one address"},
      {{"up", CORBOT_TEST_PROFILE, "--unix", "s"}, "--unix s: write an absolute path"},
      {{"up", CORBOT_TEST_PROFILE, "--unix", "/none/s"},
       "--unix /none/s: this user cannot create files in /none"},
      {{"up", CORBOT_TEST_PROFILE, "--unix", "/tmp/" + std::string(103, 'x')}, "has 108 bytes, at most 107"},
      {{"up", CORBOT_TEST_PROFILE, "--realtime", "never"}, "--realtime"}};
  for (const auto& [arguments, phrase] : cases) {
    const RunResult result = corbot(arguments);
    EXPECT_EQ(result.code, 2) << phrase << ": " << result.errors;
    EXPECT_THAT(result.errors, HasSubstr(phrase));
  }
}

}  // namespace
}  // namespace corbot::test
