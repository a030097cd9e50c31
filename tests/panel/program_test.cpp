// SPDX-License-Identifier: Apache-2.0
// corbot-panel as its users see it.
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "panel/browser.h"
#include "support/ports.h"
#include "support/robot_rig.h"
#include "support/scratch.h"

namespace corbot::panel {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::Process;
using test::wait_until;
using test::within;
using testing::HasSubstr;

class PanelProgram : public test::RobotRig {
 protected:
  void SetUp() override {
    RobotRig::SetUp();
    fs::create_directories(directory_ / "page");
    std::ofstream(directory_ / "page" / "index.html") << "<html/>";
  }
  void TearDown() override {
    panel_.reset();
    fs::remove_all(directory_);
    RobotRig::TearDown();
  }
  [[nodiscard]] std::vector<std::string> environment() const {
    return {"XDG_RUNTIME_DIR=" + directory_.string()};
  }
  void start_panel(const std::vector<std::string>& more_environment = {}) {
    fs::permissions(directory_, fs::perms::owner_all);
    const std::string page = (directory_ / "page").string();
    std::vector<std::string> of_panel = environment();
    of_panel.insert(of_panel.end(), more_environment.begin(), more_environment.end());
    panel_.emplace(
        std::vector<std::string>{CORBOT_BIN_DIR "/corbot", "panel", "--port", "0", "--pages", page,
                                 "--allow-host", "bench", "--allow-host", "bench.local", reference_},
        of_panel);
    ASSERT_TRUE(panel_->wait_line("panel ready", within(30))) << panel_->errors();
    const std::string& printed = panel_->output();
    const auto after = [&](const std::string& words, std::size_t from) {
      const std::size_t at = printed.find(words, from) + words.size();
      return printed.substr(at, printed.find_first_of("/\n", at) - at);
    };
    port_of_panel_ = std::stoi(after("127.0.0.1:", 0));
    watch_ = after("token=", 0);
    drive_ = after("token=", printed.find("drive"));
  }
  [[nodiscard]] Response ask(const std::string& token, const std::string& verb, const std::string& target,
                             const std::string& body = "") const {
    auto wanted = Browser::request(verb, target);
    wanted.set("Authorization", "Bearer " + token);
    wanted.body = body;
    return Browser(port_of_panel_).ask(wanted);
  }
  [[nodiscard]] fs::path token_file() const {
    return directory_ / "corbot" / ("panel-" + std::to_string(port_of_panel_) + ".tokens");
  }

  fs::path directory_ =
      fs::path(test::scratch_directory(CORBOT_SCRATCH_DIR)) / test::unique_name("panel_program");
  std::optional<Process> panel_;
  int port_of_panel_ = 0;
  std::string watch_;
  std::string drive_;
};

TEST_F(PanelProgram, ServesARobotAndStopsItUntilItEnds) {
  start_panel();
  EXPECT_EQ(ask("", "GET", "/").body(), "<html/>");
  for (const char* host : {"bench", "bench.local", "127.0.0.1", "elsewhere"}) {
    auto request = Browser::request("GET", "/");
    request.set("Host", host);
    const bool is_known = std::string(host) != "elsewhere";
    EXPECT_EQ(Browser(port_of_panel_).ask(request).result() == http::status::ok, is_known) << host;
  }
  EXPECT_EQ(ask("wrong", "GET", "/api/robots").result(), http::status::unauthorized);
  EXPECT_EQ(ask(watch_, "GET", "/api/rights").body(), R"({"drive":false})");
  EXPECT_EQ(ask(drive_, "GET", "/api/rights").body(), R"({"drive":true})");
  Page page(port_of_panel_, "/ws?token=" + watch_);
  json state = page.read();
  while (state.is_object() && !state.value("connected", false)) state = page.read();
  ASSERT_TRUE(state.is_object());
  EXPECT_EQ(json::parse(ask(watch_, "GET", "/api/robots").body())[0]["robot"], reference_);

  const Corbot::Ticket ticket = arm_->StartMove(0.20, 0.10, 0.10, 0.0, 20.0);
  while (state.is_object() && !state["motion"].is_object()) state = page.read();
  ASSERT_TRUE(state.is_object());
  EXPECT_EQ(state["motion"]["ticket"], ticket);
  const Response stopped = ask(watch_, "POST", "/api/stop");
  EXPECT_EQ(stopped.result(), http::status::ok) << stopped.body();
  const Corbot::MotionInfo_var info = arm_->Progress(ticket);
  EXPECT_EQ(info->state, Corbot::MotionStopped);

  struct stat found {};
  ASSERT_EQ(::stat(token_file().c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777, 0600);
  EXPECT_EQ(panel_->terminate(), 0) << panel_->errors();
  EXPECT_FALSE(fs::exists(token_file()));
}

TEST_F(PanelProgram, MovesARobotForWhoMayDrive) {
  start_panel();
  const auto call = [&](const std::string& token, const std::string& action, json values) {
    values["robot"] = reference_;
    values["do"] = action;
    return ask(token, "POST", "/api/call", values.dump());
  };
  const json near{{"to_m", {0.20, 0.10, 0.10}}};
  EXPECT_EQ(call(watch_, "move", near).result(), http::status::forbidden);
  const Response far = call(drive_, "move", {{"to_m", {2, 0, 0}}});
  EXPECT_EQ(far.result(), http::status::conflict);
  EXPECT_THAT(far.body(), HasSubstr("refused: (2, 0, 0) m is out of reach"));

  const Response moved = call(drive_, "move", near);
  ASSERT_EQ(moved.result(), http::status::ok) << moved.body();
  const auto ticket = json::parse(moved.body())["ticket"].get<Corbot::Ticket>();
  const Corbot::MotionInfo_var motion = arm_->Wait(ticket, 30);
  EXPECT_EQ(motion->state, Corbot::MotionDone);
  const Corbot::CartesianCoord tool = arm_->CartCoord();
  EXPECT_NEAR(tool.x, 0.20, 1e-3);

  EXPECT_EQ(call(drive_, "override", {{"percent", 50}}).body(), R"({"done":true})");
  EXPECT_EQ(arm_->State()->overridePercent, 50);
  EXPECT_EQ(call(drive_, "release", json::object()).body(),
            R"({"text":"this panel has no control to give up"})");
  ASSERT_EQ(call(drive_, "acquire", json::object()).result(), http::status::ok);
  EXPECT_STREQ(arm_->Control()->holder, "panel");
  EXPECT_EQ(test::raised_by([&] { arm_->StartReady(); }), "NotReady");
  EXPECT_EQ(call(drive_, "open", json::object()).result(), http::status::ok);
  EXPECT_EQ(call(drive_, "release", json::object()).result(), http::status::ok);
  EXPECT_STREQ(arm_->Control()->holder, "");
  EXPECT_EQ(call(drive_, "ready", json::object()).result(), http::status::ok);
}

TEST_F(PanelProgram, MovesARobotWhenItsControlHasEnded) {
  start_panel();
  const auto call = [&](json body) {
    body["robot"] = reference_;
    return ask(drive_, "POST", "/api/call", body.dump());
  };
  ASSERT_EQ(call({{"do", "acquire"}, {"lease_s", 0.5}}).result(), http::status::ok);
  ASSERT_TRUE(wait_until(within(20), [&] { return *arm_->Control()->holder.in() == '\0'; }));
  const Response ended = call({{"do", "ready"}});
  EXPECT_EQ(ended.result(), http::status::conflict);
  EXPECT_THAT(ended.body(), HasSubstr("control has ended"));
  EXPECT_EQ(call({{"do", "ready"}}).result(), http::status::ok);
}

TEST_F(PanelProgram, RefusesAProgramOnceWhenItsControlHasEnded) {
  start_panel();
  ASSERT_EQ(ask(drive_, "POST", "/api/call",
                json{{"robot", reference_}, {"do", "acquire"}, {"lease_s", 0.5}}.dump())
                .result(),
            http::status::ok);
  ASSERT_TRUE(wait_until(within(20), [&] { return *arm_->Control()->holder.in() == '\0'; }));
  Page page(port_of_panel_, "/ws?token=" + watch_);
  const auto end_of_run = [&]() -> json {
    const json body{{"robot", reference_}, {"name", "p"}, {"text", "ready"}};
    if (ask(drive_, "POST", "/api/program", body.dump()).result() != http::status::ok) return {};
    const test::Deadline deadline = within(60);
    for (json update = page.read(); update.is_object(); update = page.read()) {
      const json program = update.value("program", json());
      if (program.is_object() && (program["state"] == "failed" || program["state"] == "done")) return program;
      if (std::chrono::steady_clock::now() > deadline) break;
    }
    return {};
  };
  EXPECT_THAT(end_of_run()["text"].get<std::string>(), HasSubstr("control has ended"));
  EXPECT_TRUE(wait_until(within(30), [&] { return end_of_run()["state"] == "done"; }));
}

TEST_F(PanelProgram, RunsAProgramAndStopsItWithItsRobot) {
  start_panel();
  Page page(port_of_panel_, "/ws?token=" + watch_);
  const auto run = [&](const std::string& text) {
    const json body{{"robot", reference_}, {"name", "p.corbot"}, {"text", text}};
    return ask(drive_, "POST", "/api/program", body.dump());
  };
  const auto read_until = [&](const std::string& state, int line) {
    const test::Deadline deadline = within(60);
    for (json update = page.read(); update.is_object(); update = page.read()) {
      const json program = update.value("program", json());
      if (program.is_object() && program["state"] == state && program["line"] == line) return program;
      if (std::chrono::steady_clock::now() > deadline) break;
    }
    return json::object({{"text", "no such state"}});
  };
  const Response wrong = run("ready\nmove 1\n");
  EXPECT_EQ(wrong.result(), http::status::bad_request);
  EXPECT_THAT(wrong.body(), HasSubstr("p.corbot:2: "));

  ASSERT_EQ(run("speed 100\nmove 0.20 0.10 0.10\n").result(), http::status::ok);
  EXPECT_EQ(read_until("done", 2)["text"], "");
  EXPECT_NEAR(arm_->CartCoord().x, 0.20, 1e-3);

  ASSERT_EQ(run("open\nmove 2 0 0\nready\n").result(), http::status::ok);
  EXPECT_THAT(read_until("failed", 2)["text"].get<std::string>(),
              HasSubstr("p.corbot:2: move 2 0 0: refused: (2, 0, 0) m is out of reach"));

  ASSERT_EQ(run("move 0.15 -0.05 0.10 --time 60\nready\n").result(), http::status::ok);
  ASSERT_TRUE(wait_until(within(30), [&] { return arm_->State()->motion.id != 0; }));
  EXPECT_EQ(run("ready\n").result(), http::status::conflict);
  EXPECT_EQ(ask(watch_, "POST", "/api/stop").result(), http::status::ok);
  EXPECT_THAT(read_until("stopped", 1)["text"].get<std::string>(), HasSubstr("line 2 was not begun"));
  EXPECT_EQ(arm_->State()->motion.id, 0);
}

TEST_F(PanelProgram, APanelThatEndsStopsTheRobotOfItsProgram) {
  start_panel();
  const json body{{"robot", reference_}, {"name", "p"}, {"text", "move 0.15 -0.05 0.10 --time 60\nready"}};
  ASSERT_EQ(ask(drive_, "POST", "/api/program", body.dump()).result(), http::status::ok);
  ASSERT_TRUE(wait_until(within(30), [&] { return arm_->State()->motion.id != 0; }));
  const Corbot::Ticket ticket = arm_->State()->motion.id;
  EXPECT_EQ(panel_->terminate(), 0) << panel_->errors();
  EXPECT_EQ(arm_->Progress(ticket)->state, Corbot::MotionStopped);
}

TEST_F(PanelProgram, AfterAPanelIsKilledTheLineEndsAndNoOtherBegins) {
  start_panel();
  const json body{
      {"robot", reference_}, {"name", "p"}, {"text", "move 0.15 -0.05 0.10 --time 2\nmove 0.20 0.10 0.10"}};
  ASSERT_EQ(ask(drive_, "POST", "/api/program", body.dump()).result(), http::status::ok);
  ASSERT_TRUE(wait_until(within(30), [&] { return arm_->State()->motion.id != 0; }));
  const Corbot::Ticket ticket = arm_->State()->motion.id;
  panel_->signal(SIGKILL);
  ASSERT_TRUE(wait_until(within(30), [&] { return arm_->State()->motion.id == 0; }));
  // The servant takes the motion's end a moment after the task's state shows none.
  EXPECT_TRUE(wait_until(within(30), [&] { return arm_->Progress(ticket)->state == Corbot::MotionDone; }));
  EXPECT_FALSE(wait_until(within(1), [&] { return arm_->State()->motion.id != 0; }));
  EXPECT_NEAR(arm_->CartCoord().x, 0.15, 1e-3);
}

TEST_F(PanelProgram, MovesARobotThatHasStartedAgain) {
  start_panel();
  const std::string ready = json{{"robot", reference_}, {"do", "ready"}}.dump();
  ASSERT_EQ(ask(drive_, "POST", "/api/call", ready).result(), http::status::ok);
  Page page(port_of_panel_, "/ws?token=" + watch_);
  const auto read_until_connected = [&](bool wanted) {
    json state = page.read();
    while (state.is_object() && state.value("connected", false) != wanted) state = page.read();
    return state.is_object();
  };
  ASSERT_TRUE(read_until_connected(true));
  servant_->signal(SIGKILL);
  ASSERT_TRUE(servant_->wait(within(30)));
  ASSERT_TRUE(read_until_connected(false));
  start_servant();
  ASSERT_TRUE(read_until_connected(true));
  const Response moved = ask(drive_, "POST", "/api/call", ready);
  EXPECT_EQ(moved.result(), http::status::ok) << moved.body();
}

TEST_F(PanelProgram, MovesARobotAtAnotherPortWhenItsControlHasEnded) {
  fs::permissions(directory_, fs::perms::owner_all);
  reference_ = name_ + "-up";
  const auto up = [&] {
    return Process({CORBOT_BIN_DIR "/corbot", "up", CORBOT_TEST_PROFILE, "--name", reference_, "--endpoint",
                    "127.0.0.1:" + std::to_string(test::free_port())},
                   environment());
  };
  Process robot = up();
  ASSERT_TRUE(robot.wait_line(reference_ + " is up", within(30))) << robot.errors();
  start_panel();
  const auto call = [&](const char* action) {
    return ask(drive_, "POST", "/api/call", json{{"robot", reference_}, {"do", action}}.dump());
  };
  ASSERT_EQ(call("acquire").result(), http::status::ok);
  EXPECT_EQ(robot.terminate(), 0) << robot.errors();
  Process again = up();
  ASSERT_TRUE(again.wait_line(reference_ + " is up", within(30))) << again.errors();
  Page page(port_of_panel_, "/ws?token=" + watch_);
  json state = page.read();
  while (state.is_object() && (!state.value("connected", false) || state["connection"] == 1))
    state = page.read();
  EXPECT_EQ(call("clear").result(), http::status::ok) << "needs no control";
  const Response ended = call("ready");
  EXPECT_EQ(ended.result(), http::status::conflict);
  EXPECT_THAT(ended.body(), HasSubstr("the panel's control has ended"));
  EXPECT_EQ(call("ready").result(), http::status::ok);
  EXPECT_EQ(again.terminate(), 0) << again.errors();
}

TEST_F(PanelProgram, EndsSoonThoughARobotDoesNotAnswer) {
  start_panel();
  const json body{{"robot", reference_}, {"name", "p"}, {"text", "move 0.15 -0.05 0.10 --time 60"}};
  ASSERT_EQ(ask(drive_, "POST", "/api/program", body.dump()).result(), http::status::ok);
  ASSERT_TRUE(wait_until(within(30), [&] { return arm_->State()->motion.id != 0; }));
  servant_->signal(SIGSTOP);
  panel_->signal(SIGTERM);
  const auto end = panel_->wait(within(7));
  servant_->signal(SIGCONT);
  ASSERT_TRUE(end);
  EXPECT_EQ(WEXITSTATUS(*end), 3);
  EXPECT_THAT(panel_->errors(), HasSubstr("its Stop is not confirmed"));
  EXPECT_FALSE(fs::exists(token_file()));
}

TEST_F(PanelProgram, SendsNoMotionToARobotThatDoesNotAnswer) {
  start_panel();
  const std::string ready = json{{"robot", reference_}, {"do", "ready"}}.dump();
  servant_->signal(SIGSTOP);
  const Response lost = ask(drive_, "POST", "/api/call", ready);
  servant_->signal(SIGCONT);
  EXPECT_EQ(lost.result(), http::status::conflict);
  EXPECT_THAT(lost.body(), HasSubstr("no answer"));
  EXPECT_THAT(lost.body(), HasSubstr("watch the robot before you try again"));
  EXPECT_THAT(lost.body(), testing::Not(HasSubstr("--timeout")));
  EXPECT_THAT(lost.body(), testing::Not(HasSubstr("whether the motion was accepted")));
}

TEST_F(PanelProgram, LeavesTheTokensOfAPanelWithItsPortAtAnotherAddress) {
  start_panel();
  const std::vector<std::string> second{CORBOT_BIN_DIR "/corbot-panel",
                                        "--host",
                                        "127.0.0.2",
                                        "--port",
                                        std::to_string(port_of_panel_),
                                        "--pages",
                                        (directory_ / "page").string(),
                                        reference_};
  const test::RunResult refused = test::run(second, 30, environment());
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.errors, HasSubstr("name another file with --token-file"));
  EXPECT_TRUE(fs::exists(token_file()));
  panel_->signal(SIGKILL);
  ASSERT_TRUE(panel_->wait(within(30)));
  Process third(second, environment());
  EXPECT_TRUE(third.wait_line("panel ready", within(30))) << third.errors();
}

/// Returns the process of that program whose parent is `parent`; 0: there is none.
pid_t child_of(pid_t parent, const std::string& program) {
  std::ifstream children("/proc/" + std::to_string(parent) + "/task/" + std::to_string(parent) + "/children");
  for (pid_t child = 0; children >> child;) {
    std::error_code ignored;
    if (fs::read_symlink("/proc/" + std::to_string(child) + "/exe", ignored).filename() == program)
      return child;
  }
  return 0;
}

/// Copies the programs and the page as the package installs them. Returns the command that starts a robot
/// with a panel.
std::vector<std::string> install(const fs::path& directory, const std::string& robot, int panel_port) {
  const fs::path programs = directory / "bin";
  fs::create_directories(programs);
  for (const char* program : {"corbot", "corbot-panel", "corbot-rt", "corbot-servant"})
    fs::copy_file(fs::path(CORBOT_BIN_DIR) / program, programs / program);
  fs::create_directories(directory / "share" / "corbot");
  fs::rename(directory / "page", directory / "share" / "corbot" / "page");
  fs::permissions(directory, fs::perms::owner_all);
  return {(programs / "corbot").string(),
          "up",
          CORBOT_TEST_PROFILE,
          "--name",
          robot,
          "--endpoint",
          "127.0.0.1:" + std::to_string(test::free_port()),
          "--panel",
          std::to_string(panel_port)};
}

TEST_F(PanelProgram, TakesAnyFreePortWithItsRobot) {
  Process up(install(directory_, name_ + "-up", 0), environment());
  const auto url = up.wait_line("watch and stop: http://127.0.0.1:", within(30));
  ASSERT_TRUE(url) << up.errors();
  port_of_panel_ = std::stoi(url->substr(url->find("127.0.0.1:") + 10));
  EXPECT_EQ(ask("", "GET", "/").body(), "<html/>");
  EXPECT_EQ(up.terminate(), 0) << up.errors();
}

TEST_F(PanelProgram, StartsAndRestartsWithItsRobot) {
  port_of_panel_ = test::free_port();
  const std::string robot = name_ + "-up";
  Process up(install(directory_, robot, port_of_panel_), environment());
  const auto first = up.wait_line("watch and stop: http://127.0.0.1:", within(30));
  ASSERT_TRUE(first) << up.errors();
  ASSERT_TRUE(up.wait_line(robot + " is up", within(30))) << up.errors();
  watch_ = first->substr(first->find("token=") + 6);
  EXPECT_EQ(ask("", "GET", "/").body(), "<html/>");
  EXPECT_EQ(json::parse(ask(watch_, "GET", "/api/robots").body())[0]["robot"], robot);

  const pid_t servant = child_of(up.pid(), "corbot-servant");
  const pid_t panel = child_of(up.pid(), "corbot-panel");
  ASSERT_NE(panel, 0);  // kill(2) would kill this test's process group
  ASSERT_EQ(::kill(panel, SIGKILL), 0);
  const auto second = up.wait_line("watch and stop: ", within(30));
  ASSERT_TRUE(second) << up.errors();
  EXPECT_NE(*second, *first);
  EXPECT_EQ(child_of(up.pid(), "corbot-servant"), servant);
  EXPECT_TRUE(fs::exists(token_file()));
  EXPECT_EQ(up.terminate(), 0) << up.errors();
  EXPECT_FALSE(fs::exists(token_file()));
}

// A servant that is killed repeatedly starts later and later. The motion goes on meanwhile.
TEST_F(PanelProgram, StopsARobotOnThisMachineWithoutItsServant) {
  port_of_panel_ = test::free_port();
  const std::string robot = name_ + "-up";
  const std::vector<std::string> command = install(directory_, robot, port_of_panel_);
  const std::string& endpoint = command.at(6);
  Process up(command, environment());
  const auto url = up.wait_line("watch and stop: ", within(30));
  ASSERT_TRUE(url) << up.errors();
  ASSERT_TRUE(up.wait_line(robot + " is up", within(30))) << up.errors();
  watch_ = url->substr(url->find("token=") + 6);
  Page page(port_of_panel_, "/ws?token=" + watch_);
  json state = page.read();
  while (state.is_object() && !state.value("connected", false)) state = page.read();
  const Corbot::Arm_var arm = connect("corbaloc::" + endpoint + "/" + robot);
  const Corbot::Ticket ticket = arm->StartMove(0.20, 0.10, 0.10, 0.0, 60.0);
  const pid_t servant = child_of(up.pid(), "corbot-servant");
  const pid_t task = child_of(up.pid(), "corbot-rt");
  ASSERT_NE(servant, 0);
  ASSERT_NE(task, 0);
  up.signal(SIGSTOP);  // it starts no other servant
  ASSERT_EQ(::kill(servant, SIGKILL), 0);
  const Response stopped = ask(watch_, "POST", "/api/stop");
  EXPECT_EQ(stopped.result(), http::status::ok) << stopped.body();

  ASSERT_EQ(::kill(task, SIGSTOP), 0);
  const Response failed = ask(watch_, "POST", "/api/stop");
  ASSERT_EQ(::kill(task, SIGCONT), 0);
  up.signal(SIGCONT);
  EXPECT_EQ(failed.result(), http::status::bad_gateway);
  EXPECT_THAT(failed.body(), testing::AllOf(HasSubstr("the real-time task of " + robot + " does not answer"),
                                            HasSubstr("by its servant: ")));
  EXPECT_TRUE(wait_until(within(30), [&] {
    try {
      return arm->Progress(ticket)->state == Corbot::MotionStopped;
    } catch (const CORBA::SystemException&) {
      return false;  // the servant starts again
    }
  }));
  EXPECT_EQ(up.terminate(), 0) << up.errors();
}

TEST_F(PanelProgram, StopsTheRobotThatItShowsAndNotANamesake) {
  fs::permissions(directory_, fs::perms::owner_all);
  reference_ = name_ + "-up";
  const std::string endpoint = "127.0.0.1:" + std::to_string(test::free_port());
  Process up(
      {CORBOT_BIN_DIR "/corbot", "up", CORBOT_TEST_PROFILE, "--name", reference_, "--endpoint", endpoint},
      environment());
  ASSERT_TRUE(up.wait_line(reference_ + " is up", within(30))) << up.errors();
  const std::string elsewhere = "CORBOT_RUN_DIR=" + (directory_ / "run").string();
  Process namesake({CORBOT_BIN_DIR "/corbot-rt", CORBOT_TEST_PROFILE, "--name", reference_}, {elsewhere});
  ASSERT_TRUE(namesake.wait_line("ready", within(30))) << namesake.errors();
  start_panel({elsewhere});

  const Corbot::Arm_var arm = connect("corbaloc::" + endpoint + "/" + reference_);
  Corbot::Ticket ticket = arm->StartMove(0.20, 0.10, 0.10, 0.0, 60.0);
  Page page(port_of_panel_, "/ws?token=" + watch_);
  json state = page.read();
  while (state.is_object() && !state.value("connected", false)) state = page.read();
  const Response stopped = ask(watch_, "POST", "/api/stop");
  EXPECT_EQ(stopped.result(), http::status::ok) << stopped.body();
  EXPECT_EQ(arm->Progress(ticket)->state, Corbot::MotionStopped);

  ticket = arm->StartMove(0.20, 0.10, 0.10, 0.0, 60.0);
  std::vector<std::string> of_command = environment();
  of_command.push_back(elsewhere);
  EXPECT_EQ(test::run({CORBOT_BIN_DIR "/corbot", "stop", "--robot", reference_}, 30, of_command).code, 0);
  EXPECT_EQ(arm->Progress(ticket)->state, Corbot::MotionStopped);
  EXPECT_EQ(up.terminate(), 0) << up.errors();
  EXPECT_EQ(namesake.terminate(), 0) << namesake.errors();
}

TEST_F(PanelProgram, WarnsOfARobotThatIsNotUp) {
  fs::permissions(directory_, fs::perms::owner_all);
  const std::string page = (directory_ / "page").string();
  Process panel({CORBOT_BIN_DIR "/corbot-panel", "--port", "0", "--pages", page, reference_, "mistyped"},
                environment());
  ASSERT_TRUE(panel.wait_line("panel ready", within(30))) << panel.errors();
  EXPECT_EQ(panel.terminate(), 0);
  EXPECT_THAT(panel.errors(), HasSubstr("corbot-panel: warning: no robot named 'mistyped' is up"));
  EXPECT_THAT(panel.errors(), HasSubstr("or name a robot elsewhere with corbot panel HOST:PORT/NAME"));
  EXPECT_THAT(panel.errors(), testing::Not(HasSubstr(reference_)));
}

TEST_F(PanelProgram, SaysWhatIsMissing) {
  const auto fault = [&](std::vector<std::string> words) {
    words.insert(words.begin(), CORBOT_BIN_DIR "/corbot-panel");
    const test::RunResult result = test::run(words, 30, environment());
    EXPECT_NE(result.code, 0);
    return std::to_string(result.code) + " " + result.errors;
  };
  const std::string page = (directory_ / "page").string();
  EXPECT_THAT(fault({"--pages", directory_.string(), reference_}), HasSubstr("there is no index.html"));
  EXPECT_THAT(fault({"--pages", page, reference_, reference_}), HasSubstr("is named twice"));
  EXPECT_THAT(fault({"--pages", page, "--port", "65536", reference_}),
              HasSubstr("2 corbot-panel: --port: '65536' is not a whole number"));
  EXPECT_THAT(fault({"--pages", page, "--port", "0", "--host", "localhost", reference_}),
              HasSubstr("in figures"));
  EXPECT_THAT(fault({"--pages", page, "--port", "0", "--host", "192.0.2.1", reference_}),
              HasSubstr("'192.0.2.1' is not an address of this machine: choose another --port or --host"));
  EXPECT_THAT(fault({"--pages", page, "--port", "0", "no name"}),
              HasSubstr("2 corbot-panel: corbot panel 'no"));
  EXPECT_THAT(fault({"--allow-host", "http://bench", reference_}), HasSubstr("write it without scheme"));
  EXPECT_THAT(fault({"--pages", page, "--port", "0", "--token-file", page + "/index.html", reference_}),
              HasSubstr("exists already"));
  EXPECT_THAT(fault({"--pages", page, "--port", std::to_string(port_), reference_}), HasSubstr("in use"));
  EXPECT_THAT(fault({"--pages", page, "--cell", "none"}),
              HasSubstr("3 corbot-panel: --cell none: no cell runs"));
  EXPECT_THAT(fault({"--pages", page, "--cell", "./none.toml"}), HasSubstr("2 corbot-panel: ./none.toml"));
  const std::string cell = CORBOT_SOURCE_DIR "/profiles/cell/cell.toml";
  EXPECT_THAT(fault({"--pages", page, "--cell", cell, "--cell", cell}),
              HasSubstr("--cell demo: is named twice"));
  const std::string limited = "ulimit -n 40; exec \"$@\"";
  const test::RunResult few = test::run(
      {"/bin/sh", "-c", limited, "sh", CORBOT_BIN_DIR "/corbot-panel", "--pages", page, reference_}, 30);
  EXPECT_EQ(few.code, 2);
  EXPECT_THAT(few.errors, HasSubstr("40 files may be open, and the panel needs 92: raise 'ulimit -n'"));
  fs::permissions(directory_, fs::perms::owner_all);
  EXPECT_THAT(fault({"--pages", page, "--port", "0"}), HasSubstr("no robot is up on this machine"));
}

}  // namespace
}  // namespace corbot::panel
