// SPDX-License-Identifier: Apache-2.0
// Tests the events around `corbot up` that do not end the robot, and that `corbot up` leaves other robots
// alone.
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>
#include <tuple>

#include "cli/supervise/supervisor.h"
#include "cli_rig.h"
#include "support/paths.h"
#include "support/ports.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class Robustness : public CliRig {
 protected:
  pid_t pid_of(const char* key) { return state().at(key).get<pid_t>(); }
  bool works() {
    return wait_until(within(30), [&] { return corbot({"drive", "0", "1", "50"}).code == 0; });
  }
  /// Kills a process of the robot and waits until there is another.
  bool is_restarted(const char* key) {
    const pid_t first = pid_of(key);
    if (::kill(first, SIGKILL) != 0) return false;
    return wait_until(within(30), [&] {
      const pid_t now = pid_of(key);
      return now != 0 && now != first;
    });
  }
  [[nodiscard]] std::vector<std::string> up_command(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words{"up",  CORBOT_TEST_PROFILE, "--name",
                                   name_, "--endpoint",        "127.0.0.1:" + std::to_string(port_)};
    if (on_orbit2()) words.insert(words.end(), {"--orb", "orbit2"});
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  /// At once: what is removed file by file would be put back meanwhile.
  void move_state_away() const {
    const fs::path away = directory_ / "away";
    fs::rename(directory_ / "corbot", away);
    fs::remove_all(away);
  }
  /// In another runtime directory, where no state file of the first robot is.
  std::unique_ptr<Process> begin_elsewhere(const std::vector<std::string>& arguments) {
    const fs::path other = directory_ / "elsewhere";
    fs::create_directory(other);
    return begin_in({"/usr/bin/env", "XDG_RUNTIME_DIR=" + other.string()}, arguments);
  }
};

const std::vector<std::string> kWithoutStreams{"/bin/sh", "-c", "exec \"$@\" <&- >&- 2>&-", "sh"};

/// Returns the file of a standard stream of a process, "" for a closed one.
std::string stream_of(pid_t pid, int stream) {
  std::error_code error;
  return fs::read_symlink("/proc/" + std::to_string(pid) + "/fd/" + std::to_string(stream), error).string();
}

TEST_F(Robustness, WithoutStandardStreamsNoSegmentGetsTheirNumber) {
  supervisor_ = begin_in(kWithoutStreams, up_command());
  ASSERT_TRUE(wait_until(within(30), [&] { return corbot({"status"}).code == 0; }));
  for (const char* key : {"pid", "rt_pid", "servant_pid"}) {
    for (int stream = 0; stream < 3; ++stream)
      EXPECT_THAT(stream_of(pid_of(key), stream), testing::AnyOf("/dev/null", HasSubstr("pipe:")))
          << key << ", stream " << stream;
  }
  ASSERT_EQ(::kill(pid_of("servant_pid"), SIGSTOP), 0);
  const RunResult stopped = corbot({"stop"});
  EXPECT_EQ(stopped.code, 0) << stopped.output << stopped.errors;
  EXPECT_EQ(::kill(pid_of("servant_pid"), SIGCONT), 0);
  EXPECT_EQ(corbot({"down"}).code, 0);
}

TEST_F(Robustness, WithoutStandardStreamsEachProgramKeepsTheirNumbers) {
  const std::string ports = std::to_string(free_ports(8));
  const std::string state = directory_.string();
  const std::vector<std::vector<std::string>> programs{
      {"corbot-rt", CORBOT_TEST_PROFILE, "--name", name_, "--state-dir", state},
      {"corbot-sim", "ssc32", "--pty", state + "/tty"},
      {"corbot-store", CORBOT_CELL "/cell.toml", "--ports", ports, "--state-dir", state + "/store"},
      {"corbot-scene", CORBOT_CELL "/cell.toml", "--ports", ports, "--state-dir", state + "/scene"},
  };
  for (std::vector<std::string> words : programs) {
    const std::string name = words.front();
    words.front() = CORBOT_BIN_DIR "/" + name;
    if (!fs::exists(words.front())) continue;  // left out of this build
    std::vector<std::string> command = kWithoutStreams;
    command.insert(command.end(), words.begin(), words.end());
    Process process(command, environment());
    const std::vector<std::string> kept(3, "/dev/null");
    std::vector<std::string> streams;
    EXPECT_TRUE(wait_until(
        within(20),
        [&] {
          streams = {stream_of(process.pid(), 0), stream_of(process.pid(), 1), stream_of(process.pid(), 2)};
          return streams == kept;
        }))
        << name << ": " << testing::PrintToString(streams);
  }
}

TEST_F(Robustness, TheLossOfTheStateDirectoryEndsNothing) {
  up();
  const pid_t rt = pid_of("rt_pid");
  move_state_away();
  ASSERT_TRUE(wait_until(within(20), [&] { return fs::exists(directory_ / "corbot" / (name_ + ".json")); }))
      << supervisor_->errors();
  EXPECT_EQ(corbot({"status"}).code, 0) << "found by its name";
  EXPECT_TRUE(is_restarted("servant_pid")) << supervisor_->errors();
  EXPECT_TRUE(works());
  EXPECT_EQ(pid_of("rt_pid"), rt);
  EXPECT_EQ(corbot({"down"}).code, 0);
  EXPECT_EQ(supervisor_->wait(within(20)), 0);
  supervisor_.reset();
}

TEST_F(Robustness, AStateDirectoryThatCannotBeMadeAgainEndsNothing) {
  up();
  ASSERT_TRUE(wait_until(within(20), [&] {
    move_state_away();
    std::ofstream(directory_ / "corbot") << "in its place\n";
    return fs::is_regular_file(directory_ / "corbot");
  }));
  ASSERT_TRUE(wait_until(within(20), [&] {
    return supervisor_->errors().find("commands cannot find the robot by its name") != std::string::npos;
  }));
  const std::string robot = "127.0.0.1:" + std::to_string(port_) + "/" + name_;
  EXPECT_EQ(corbot({"drive", "0", "1", "50", "--robot", robot}).code, 0);
  fs::remove(directory_ / "corbot");
  EXPECT_TRUE(wait_until(within(20), [&] { return corbot({"status"}).code == 0; }));
}

TEST_F(Robustness, AHangUpUnderNohupEndsNothing) {
  supervisor_ = begin_in({"/bin/sh", "-c", "trap '' HUP; exec \"$@\"", "sh"}, up_command());
  ASSERT_TRUE(supervisor_->wait_line(name_ + " is up", within(30))) << supervisor_->errors();
  supervisor_->signal(SIGHUP);
  EXPECT_TRUE(is_restarted("servant_pid")) << "it goes on supervising";
  EXPECT_TRUE(works());
}

TEST_F(Robustness, NamesOutliveTheNamingService) {
  const int naming = free_port();
  // So that the servant, which this test freezes, is not replaced meanwhile.
  std::ifstream stream(CORBOT_TEST_PROFILE);
  std::string text{std::istreambuf_iterator<char>{stream}, {}};
  const std::string key = "respond_s = 3.0";
  ASSERT_NE(text.find(key), std::string::npos);
  up({"--naming", std::to_string(naming)},
     put("patient.toml", text.replace(text.find(key), key.size(), "respond_s = 60")));
  const std::string service = "corbaname::127.0.0.1:" + std::to_string(naming);
  const std::string robot = service + "#Robots/" + name_ + ".Robot";
  ASSERT_TRUE(wait_until(within(20), [&] { return corbot({"status", "--robot", robot}).code == 0; }));
  // The robot's name stays unbound while its servant does not run.
  const pid_t servant = pid_of("servant_pid");
  ASSERT_EQ(::kill(servant, SIGSTOP), 0);
  pid_t service_pid = 0;
  for (const auto& entry : fs::directory_iterator("/proc")) {
    std::ifstream file(entry.path() / "cmdline");
    const std::string command{std::istreambuf_iterator<char>{file}, {}};
    if (command.starts_with("omniNames") && command.find(":" + std::to_string(naming)) != std::string::npos)
      service_pid = std::stoi(entry.path().filename().string());
  }
  ASSERT_GT(service_pid, 0);
  ASSERT_EQ(::kill(service_pid, SIGKILL), 0);
  ASSERT_TRUE(wait_until(within(30), [&] {
    return supervisor_->errors().find("naming service restarted") != std::string::npos;
  })) << supervisor_->errors();
  // The service resolves the name, and the servant behind it does not answer: not found would be another
  // text.
  const RunResult result = corbot({"status", "--robot", robot, "--timeout", "0.5"});
  EXPECT_THAT(result.errors, HasSubstr("no answer")) << result.output;
  ASSERT_EQ(::kill(servant, SIGCONT), 0);
  EXPECT_TRUE(wait_until(within(20), [&] { return corbot({"status", "--robot", robot}).code == 0; }));
}

TEST_F(Robustness, AnEditOfTheProfileTakesEffectAtTheNextUp) {
  std::ifstream stream(CORBOT_TEST_PROFILE);
  const std::string text{std::istreambuf_iterator<char>{stream}, {}};
  const std::string profile = put("mine.toml", text);
  up({}, profile);
  put("mine.toml", "no profile any more\n");
  EXPECT_TRUE(is_restarted("rt_pid")) << supervisor_->errors();
  EXPECT_TRUE(is_restarted("servant_pid")) << supervisor_->errors();
  EXPECT_TRUE(works()) << supervisor_->errors();
  EXPECT_EQ(state().at("profile"), profile);
}

TEST_F(Robustness, ANameInUseElsewhereIsRefusedAndTakenOnPurpose) {
  up();
  const std::string pid = std::to_string(supervisor_->pid());
  const auto second = begin_elsewhere(up_command());
  const auto end = second->wait(within(30));
  ASSERT_TRUE(end);
  EXPECT_EQ(WEXITSTATUS(*end), 5);
  EXPECT_THAT(second->errors(), AllOf(HasSubstr("'" + name_ + "' is already running"),
                                      HasSubstr("corbot up (pid " + pid + ")"), HasSubstr("--replace")));
  EXPECT_TRUE(works()) << "the first one is untouched";

  auto third = begin_elsewhere(up_command({"--replace"}));
  ASSERT_TRUE(third->wait_line(name_ + " is up", within(40))) << third->errors();
  EXPECT_EQ(supervisor_->wait(within(30)), 0) << "ended in order";
  supervisor_ = std::move(third);
}

TEST_F(Robustness, ATaskStartedByHandIsRefusedAndTakenOnPurpose) {
  Process task({CORBOT_BIN_DIR "/corbot-rt", CORBOT_TEST_PROFILE, "--name", name_});
  ASSERT_TRUE(task.wait_line("ready", within(30))) << task.errors();
  const RunResult refused = corbot(up_command());
  EXPECT_EQ(refused.code, 5);
  EXPECT_THAT(refused.errors, HasSubstr("corbot-rt (pid " + std::to_string(task.pid()) + ")"));
  EXPECT_TRUE(task.running());
  up({"--replace"});
  EXPECT_EQ(task.wait(within(30)), 0) << "it ended at rest";
  EXPECT_TRUE(works());
}

TEST_F(Robustness, AServantThatIsBeingRestartedIsReportedAsSuch) {
  up();
  const pid_t servant = pid_of("servant_pid");
  supervisor_->signal(SIGSTOP);  // so that the moment lasts
  ASSERT_EQ(::kill(servant, SIGKILL), 0);
  ASSERT_TRUE(wait_until(within(20), [&] { return has_ended(servant); }));
  const RunResult result = corbot({"status"});
  supervisor_->signal(SIGCONT);
  EXPECT_EQ(result.code, 3);
  EXPECT_THAT(result.errors, HasSubstr("the servant of '" + name_ + "' is being restarted by 'corbot up'"));
  EXPECT_TRUE(works());
}

TEST_F(Robustness, StopAllStopsEveryRobotAndSaysWhichDidNot) {
  EXPECT_EQ(corbot({"stop", "--all"}).code, 3) << "none is up";
  up();
  const std::string other = name_ + "-b";
  const int other_port = free_port();
  std::vector<std::string> words = up_command();
  words[3] = other;
  words[5] = "127.0.0.1:" + std::to_string(other_port);
  const auto second = begin(words);
  ASSERT_TRUE(second->wait_line(other + " is up", within(30))) << second->errors();
  const std::vector<std::vector<std::string>> requests{{"stop", "--all"}, {"stop"}};
  for (const std::vector<std::string>& request : requests) {
    std::vector<std::unique_ptr<Process>> motions;
    for (const std::string& robot : {name_, other})
      motions.push_back(begin({"joints", "80", "20", "30", "40", "--time", "60", "--robot", robot}));
    for (const std::string& robot : {name_, other}) {
      ASSERT_TRUE(wait_until(within(20), [&] {
        return corbot({"status", "--robot", robot}).output.find("Waiting") != std::string::npos;
      }));
    }
    const RunResult all = corbot(request);
    EXPECT_EQ(all.code, 0) << all.errors;
    EXPECT_EQ(all.output, name_ + ": stopped\n" + other + ": stopped\n");
    for (const auto& motion : motions) {
      const auto end = motion->wait(within(20));
      ASSERT_TRUE(end);
      EXPECT_EQ(WEXITSTATUS(*end), 4) << motion->errors();
    }
  }
  EXPECT_EQ(corbot({"stop", "--all", "--robot", name_}).code, 2);
  EXPECT_EQ(second->terminate(), 0);
}

/// A shell passes an empty word if a variable is not set. Such a word does not choose the only robot.
TEST_F(Robustness, AnEmptyWordMovesNothing) {
  up();
  const double before = status().at("joints").at(0).at("value_deg").get<double>();
  const std::vector<std::pair<std::vector<std::string>, std::string>> lines{
      {{"joints", "10", "0", "0", "0", "--robot", ""}, "an empty word follows '--robot'"},
      {{"joints", "10", "0", "0", "0", "--robot="}, "'--robot=' has no value"},
      {{"joints", "", "10", "0", "0", "0"}, "an empty word follows 'joints'"},
      {{"up", CORBOT_TEST_PROFILE, "--state-dir", ""}, "an empty word follows '--state-dir'"},
      {{"record", ""}, "an empty word follows 'record'"},
      {{"cell", "check", ""}, "an empty word follows 'check'"},
      {{"help", ""}, "an empty word follows 'help'"},
      {{""}, "an empty word follows 'corbot'"}};
  for (const auto& [words, fault] : lines) {
    const RunResult refused = corbot(words);
    EXPECT_EQ(refused.code, 2) << fault;
    EXPECT_EQ(refused.errors, "corbot: " + fault + ": is a variable of the shell not set?\n");
  }
  const RunResult unnamed = corbot({"up", CORBOT_TEST_PROFILE, "--name", "--simulated"});
  EXPECT_EQ(unnamed.code, 2);
  EXPECT_THAT(unnamed.errors, HasSubstr("--name: '--simulated' is an option: is a variable of the shell"));
  using Words = std::vector<std::string>;
  for (const Words& stop : {Words{"stop", "--robot", ""}, Words{"--robot", "", "stop"},
                            Words{"--timeout", "2", "stop", "--robot", ""}, Words{"stop", "--robot="},
                            Words{"--robot=", "stop"}, Words{"stop", "--robot=", "--timeout", "5"}}) {
    const RunResult stopped = corbot(stop);
    EXPECT_EQ(stopped.code, 0) << "a stop stops: " << stopped.errors;
  }
  const RunResult held = corbot({"hold", "--robot", ""});
  EXPECT_EQ(held.code, 0) << "so does a hold: " << held.errors;
  EXPECT_EQ(corbot({"clear"}).code, 0);
  EXPECT_EQ(corbot({"acquire", "--who=lab="}).code, 0) << "a value may end so";
  EXPECT_EQ(status().at("joints").at(0).at("value_deg").get<double>(), before);
}

TEST_F(Robustness, AStopOnTheSameMachineNeedsNoServant) {
  up();
  for (const bool by_all : {false, true}) {
    const auto motion = begin({"joints", by_all ? "-80" : "80", "20", "30", "40", "--time", "60"});
    ASSERT_TRUE(wait_state("Waiting"));
    supervisor_->signal(SIGSTOP);  // it would replace the servant
    const pid_t servant = pid_of("servant_pid");
    ASSERT_EQ(::kill(servant, SIGSTOP), 0);
    const RunResult stop =
        corbot(by_all ? std::vector<std::string>{"stop", "--all"} : std::vector<std::string>{"stop"});
    EXPECT_EQ(stop.code, 0) << stop.errors;
    ASSERT_EQ(::kill(servant, SIGCONT), 0);
    supervisor_->signal(SIGCONT);
    const auto end = motion->wait(within(20));
    ASSERT_TRUE(end);
    EXPECT_EQ(WEXITSTATUS(*end), 4) << motion->errors();
    EXPECT_TRUE(wait_state("Standby"));
    EXPECT_LT(std::abs(status().at("joints").at(0).at("value_deg").get<double>()), 79);
  }
}

TEST_F(Robustness, CtrlCStopsTheArmAlsoWhereItsServantDoesNotRespond) {
  up();
  const auto motion = begin({"joints", "80", "20", "30", "40", "--time", "60", "--timeout", "2"});
  ASSERT_TRUE(wait_state("Waiting"));
  supervisor_->signal(SIGSTOP);
  const pid_t servant = pid_of("servant_pid");
  ASSERT_EQ(::kill(servant, SIGSTOP), 0);
  motion->signal(SIGINT);
  const auto end = motion->wait(within(60));
  ASSERT_EQ(::kill(servant, SIGCONT), 0);
  supervisor_->signal(SIGCONT);
  ASSERT_TRUE(end);
  EXPECT_EQ(WEXITSTATUS(*end), 4) << motion->errors();
  EXPECT_THAT(motion->errors(), HasSubstr("the arm was stopped by Ctrl-C"));
  EXPECT_TRUE(wait_state("Standby"));
  EXPECT_LT(status().at("joints").at(0).at("value_deg").get<double>(), 79);
}

TEST_F(Robustness, AStopThatTheTaskDoesNotConfirmIsAskedOfItsServantAsWell) {
  up();
  const auto motion = begin({"joints", "80", "20", "30", "40", "--time", "60"});
  ASSERT_TRUE(wait_state("Waiting"));
  supervisor_->signal(SIGSTOP);
  const pid_t task = pid_of("rt_pid");
  ASSERT_EQ(::kill(task, SIGSTOP), 0);
  const RunResult stop = corbot({"stop", "--timeout", "1"});
  EXPECT_EQ(stop.code, 1) << "the servant's answer";
  EXPECT_THAT(stop.errors, AllOf(HasSubstr("the real-time task of " + name_ + " does not answer"),
                                 HasSubstr("by its servant: "), HasSubstr("does not respond")));
  ASSERT_EQ(::kill(task, SIGCONT), 0);
  supervisor_->signal(SIGCONT);
  const auto end = motion->wait(within(30));
  ASSERT_TRUE(end);
  EXPECT_NE(WEXITSTATUS(*end), 0) << motion->errors();
  EXPECT_TRUE(wait_state("Standby"));
  EXPECT_LT(status().at("joints").at(0).at("value_deg").get<double>(), 79);
}

TEST_F(Robustness, StopAllStopsWhatWasStartedByHand) {
  up();
  const std::string by_hand = name_ + "-h";
  Process task({CORBOT_BIN_DIR "/corbot-rt", CORBOT_TEST_PROFILE, "--name", by_hand}, environment());
  ASSERT_TRUE(task.wait_line("ready", within(30))) << task.errors();
  const RunResult all = corbot({"stop", "--all"});
  EXPECT_EQ(all.code, 0) << all.errors;
  EXPECT_EQ(all.output, name_ + ": stopped\n" + by_hand + ": stopped\n");
  task.signal(SIGSTOP);
  const RunResult frozen = corbot({"stop", "--all", "--timeout", "1"});
  task.signal(SIGCONT);
  EXPECT_EQ(frozen.code, 3);
  EXPECT_THAT(frozen.output, HasSubstr(name_ + ": stopped\n" + by_hand + ": NOT STOPPED: "));
  EXPECT_EQ(task.terminate(), 0);
  EXPECT_EQ(corbot({"stop", "--all"}).output, name_ + ": stopped\n");
}

TEST_F(Robustness, StopAllSaysWhichRobotDidNotStop) {
  up();
  supervisor_->signal(SIGSTOP);
  for (const char* key : {"rt_pid", "servant_pid"}) {
    const pid_t pid = pid_of(key);
    ASSERT_EQ(::kill(pid, SIGKILL), 0);
    ASSERT_TRUE(wait_until(within(20), [&] { return has_ended(pid); }));
  }
  const RunResult result = corbot({"stop", "--all", "--timeout", "1"});
  supervisor_->signal(SIGCONT);
  EXPECT_EQ(result.code, 3);
  EXPECT_THAT(result.output,
              HasSubstr(name_ + ": NOT STOPPED: the servant of '" + name_ + "' is being restarted"));
  EXPECT_THAT(result.errors, HasSubstr("1 of 1 robots did not confirm the stop: " + name_));
}

TEST_F(Robustness, WhatIsWrongWithAnAddressIsNotAVersion) {
  for (const char* robot : {"IOR:", "IOR:0", "IOR:zz", "IOR:0102", "IOR:ffffffffffffffffffffffff",
                            "IOR:000000000000002049444c3a", "IOR:010000000100000000000000ffffffff"}) {
    const RunResult result = corbot({"status", "--robot", robot});
    EXPECT_THAT(result.errors, AllOf(Not(HasSubstr("version")), HasSubstr("is not the address of a robot")))
        << robot;
    EXPECT_EQ(result.code, 2) << robot;
  }
}

TEST_F(Robustness, AHostThatCannotBeFoundIsNamed) {
  const RunResult result = corbot({"status", "--robot", "nowhere.invalid:12810/lynx5"});
  EXPECT_EQ(result.code, 3);
  EXPECT_THAT(result.errors, HasSubstr("'nowhere.invalid' is not a host that this machine can find"));
}

TEST_F(Robustness, ManualAndCompletionHaveEveryCommandAndOption) {
  std::ifstream file(CORBOT_SOURCE_DIR "/packaging/man/corbot.1");
  const std::string manual{std::istreambuf_iterator<char>(file), {}};
  const auto completed = [](const std::string& command, const std::string& begun) {
    const RunResult words = run(
        {"/bin/bash", "-c",
         ". " CORBOT_SOURCE_DIR "/packaging/completion/corbot; COMP_WORDS=(corbot " + command + " '" + begun +
             "'); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _corbot; printf '%s\\n' \"${COMPREPLY[@]}\""},
        20);
    return words.output;
  };
  const std::string commands = corbot({"--help"}).output;
  const std::string offered = completed("", "");
  std::istringstream lines(commands.substr(commands.find("Subcommands:")));
  const std::regex command_line("^  ([a-z]+) .*"), option("\n  (-[a-z],)?(--[a-z-]+)");
  int count = 0;
  for (std::string line; std::getline(lines, line);) {
    std::smatch found;
    if (!std::regex_match(line, found, command_line)) continue;
    const std::string command = found[1];
    ++count;
    EXPECT_THAT(offered, testing::ContainsRegex("(^|\n)" + command + "\n"));
    EXPECT_THAT(manual, testing::ContainsRegex("\n\\.B[^\n]*[ \"]" + command + "[ \",\n]"));
    if (command == "cell" || command == "help") continue;  // the options are those of other commands
    const std::string help = corbot({command, "--help"}).output, options = completed(command, "--");
    EXPECT_THAT(help, Not(HasSubstr(" TEXT"))) << command << " names an option's type instead of its value";
    for (std::sregex_iterator at(help.begin(), help.end(), option), end; at != end; ++at)
      EXPECT_THAT(options, HasSubstr((*at)[2].str())) << command;
  }
  EXPECT_GT(count, 40);
}

TEST_F(Robustness, HelpIsNotTakenForHold) {
  const RunResult help = corbot({"help"});
  EXPECT_EQ(help.code, 0);
  EXPECT_THAT(help.output, HasSubstr("acquire"));
  const RunResult of_move = corbot({"help", "move"});
  EXPECT_EQ(of_move.code, 0);
  EXPECT_THAT(of_move.output, HasSubstr("--above"));
  const RunResult of_cell = corbot({"cell", "help"});
  EXPECT_EQ(of_cell.code, 0);
  EXPECT_EQ(of_cell.output, corbot({"help", "cell"}).output);
  EXPECT_THAT(corbot({"cell", "help", "run"}).output, HasSubstr("--pieces"));
  EXPECT_THAT(corbot({"pitch", "--help"}).output, HasSubstr("'orientation --reset'"));
}

TEST_F(Robustness, MisspeltOptionsGetASuggestion) {
  const std::vector<std::pair<std::vector<std::string>, const char*>> cases{
      {{"up", CORBOT_TEST_PROFILE, "--nmae", "x"}, "did you mean '--name'?"},
      {{"move", "1", "2", "3", "--tme", "3"}, "did you mean '--time'?"},
      {{"status", "--jsn"}, "did you mean '--json'?"},
      {{"stop", "--al"}, "did you mean '--all'?"},
      {{"frames", "reset"}, "did you mean '--reset'?"},
      {{"stop", "lynx5"}, "did you mean '--robot lynx5'?"},
      {{"down", "lynx5"}, "did you mean '--name lynx5'?"},
      {{"cell", "statsu"}, "unknown command 'cell statsu'; did you mean 'status'? ('corbot cell --help'"},
      {{"--robot", "a", "statsu"}, "unknown command 'statsu'; did you mean 'status'?"},
      {{"--robot=a", "--timeout=3", "statsu"}, "unknown command 'statsu'; did you mean 'status'?"},
      {{"status", "--robt=a"}, "did you mean '--robot'?"}};
  for (const auto& [arguments, phrase] : cases) {
    const RunResult result = corbot(arguments);
    EXPECT_EQ(result.code, 2) << phrase;
    EXPECT_THAT(result.errors, HasSubstr(phrase));
  }
  EXPECT_THAT(corbot({"status", "--frobnicate"}).errors, Not(HasSubstr("did you mean")));
  const RunResult program = corbot({"run", put("p.corbot", "move 1 2 3 --tiem 4\n")});
  EXPECT_THAT(program.errors, HasSubstr("did you mean '--time'?"));
}

TEST_F(Robustness, EachCommandReadsWholeNumbersAlike) {
  const std::vector<std::tuple<const char*, const char*, const char*>> cases{
      {"--pieces", "010", "--pieces: '010' is not a whole number from 0 to 100"},
      {"--pieces", "0x10", "--pieces: '0x10' is not a whole number from 0 to 100"},
      {"--seed", "010", "--seed: '010' is not a whole number from 0 to 4294967295"},
      {"--ports", "02000", "--ports: '02000' is not a whole number from 1024 to 65535"}};
  for (const auto& [option, number, fault] : cases) {
    const RunResult result = corbot({"cell", "run", "x", option, number});
    EXPECT_EQ(result.code, 2) << fault;
    EXPECT_THAT(result.errors, HasSubstr(fault));
  }
}

TEST_F(Robustness, EachCommandReadsTheIntervalAlike) {
  const char* const fault = "--interval: '5s' is not a number";
  EXPECT_THAT(corbot({"watch", "--interval", "5s"}).errors, HasSubstr(fault));
  EXPECT_THAT(corbot({"cell", "watch", "x", "--interval", "5s"}).errors, HasSubstr(fault));
}

// `corbot up` under a supervisor that keeps to systemd's protocol: another one of its own kind.
TEST_F(Robustness, UnderAServiceManagerItReportsThatItIsUpAndWell) {
  std::ifstream stream(CORBOT_TEST_PROFILE);
  std::string profile{std::istreambuf_iterator<char>{stream}, {}};
  const std::string backend = "[backend]\n";
  ASSERT_NE(profile.find(backend), std::string::npos);
  profile.insert(profile.find(backend) + backend.size(), "position_known_at_start = false\n");
  std::vector<std::string> words = up_command();
  words[1] = put("unknown.toml", profile);
  words.insert(words.begin(),
               {"/usr/bin/env", "XDG_RUNTIME_DIR=" + directory_.string(), CORBOT_BIN_DIR "/corbot"});
  int changes = 0;
  cli::Supervisor manager(
      {.notify_path = (directory_ / "manager").string(), .on_change = [&] { ++changes; }});
  ASSERT_TRUE(manager.start({.title = "corbot up", .command = words, .ready_within_s = 30, .respond_s = 2}));
  EXPECT_EQ(corbot({"status"}).code, 0) << "READY=1 comes when it can be used";
  ASSERT_EQ(corbot({"drive", "0", "5", "50"}).code, 0);
  const pid_t first = manager.pid_of("corbot up");
  const auto begin = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() - begin < std::chrono::seconds(4)) ASSERT_TRUE(manager.step());
  EXPECT_EQ(manager.pid_of("corbot up"), first) << "WATCHDOG=1 comes";
  ASSERT_EQ(::kill(first, SIGSTOP), 0);
  ASSERT_TRUE(wait_until(within(60), [&] { return !manager.step() || changes == 3; }));
  EXPECT_NE(manager.pid_of("corbot up"), first);
  EXPECT_NEAR(status().at("joints").at(0).at("value_deg").get<double>(), 5.0, 1e-6);
  EXPECT_EQ(status().at("device").at("position_uncertain"), false)
      << "what was stored came back, and is the last";
  EXPECT_TRUE(works());
}

// Such a process is the panel: the robot must not end with it.
TEST_F(Robustness, AProcessThatIsNotNeededIsNeverGivenUp) {
  const std::string starts = put("starts", "");
  const auto count = [&] {
    std::ifstream file(starts);
    return std::count(std::istreambuf_iterator<char>(file), {}, '\n');
  };
  cli::Supervisor supervisor(
      {.notify_path = (directory_ / "manager").string(), .attempts = 1, .on_change = [] {}});
  ASSERT_TRUE(supervisor.start({.title = "needed",
                                .command = {"/bin/sleep", "1000"},
                                .is_ready = [](const std::string&) { return true; }}));
  // Only its first start gets ready.
  ASSERT_TRUE(supervisor.start(
      {.title = "other",
       .command = {"/bin/sh", "-c", "echo >> \"$0\"; [ $(wc -l < \"$0\") -gt 1 ] || echo ready", starts},
       .is_ready = [](const std::string& line) { return line == "ready"; },
       .is_needed = false}));
  EXPECT_TRUE(wait_until(within(60), [&] { return !supervisor.step() || count() > 2; }));
  EXPECT_TRUE(supervisor.all_ready());
  supervisor.stop_all();
}

// So the panel of 'corbot cell run' is started again as that of 'corbot up', and the run ends with the cell's
// own processes.
TEST_F(Robustness, WithoutRestartsAProcessThatIsNotNeededIsStartedAgain) {
  cli::Supervisor supervisor(
      {.notify_path = (directory_ / "manager").string(), .restarts = false, .on_change = [] {}});
  for (const bool is_needed : {true, false})
    ASSERT_TRUE(supervisor.start({.title = is_needed ? "needed" : "other",
                                  .command = {"/bin/sleep", "1000"},
                                  .is_ready = [](const std::string&) { return true; },
                                  .is_needed = is_needed}));
  const pid_t other = supervisor.pid_of("other");
  ASSERT_EQ(::kill(other, SIGKILL), 0);
  const auto is_back = [&] {
    return !supervisor.step() || (supervisor.pid_of("other") != 0 && supervisor.pid_of("other") != other);
  };
  EXPECT_TRUE(wait_until(within(20), is_back));
  ASSERT_EQ(::kill(supervisor.pid_of("needed"), SIGKILL), 0);
  EXPECT_TRUE(wait_until(within(20), [&] { return supervisor.step() && supervisor.pid_of("needed") == 0; }));
  supervisor.stop_all();
}

TEST_F(Robustness, PathsThatAreNoUtf8AreHandled) {
  std::ifstream stream(CORBOT_TEST_PROFILE);
  const std::string text{std::istreambuf_iterator<char>{stream}, {}};
  const std::string profile = put("caf\xe9.toml", text);
  up({}, profile);
  EXPECT_THAT(state().at("profile").get<std::string>(), HasSubstr("caf"));
  EXPECT_EQ(corbot({"status"}).code, 0);
  const std::string csv = (directory_ / "\xff.csv").string();
  EXPECT_EQ(corbot({"record", csv, "--for", "0.1"}).code, 0);
  EXPECT_TRUE(fs::exists(csv));
  const RunResult missing = corbot({"up", "/nonexistent/\xe9.toml"});
  EXPECT_EQ(missing.code, 2);
  EXPECT_THAT(missing.errors, AllOf(HasSubstr("/nonexistent/\xe9.toml"), HasSubstr("no such file")));
  const std::string program = put("p\xe9.corbot", "dance\n");
  EXPECT_EQ(corbot({"run", program}).code, 2);
}

}  // namespace
}  // namespace corbot::test
