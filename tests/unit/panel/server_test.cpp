// SPDX-License-Identifier: Apache-2.0
#include "panel/server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio/write.hpp>
#include <filesystem>
#include <fstream>
#include <set>
#include <thread>

#include "client/failure.h"
#include "panel/browser.h"
#include "panel/fake_port.h"
#include "panel/http_session.h"
#include "support/paths.h"
#include "support/process.h"
#include "support/scratch.h"
#include "support/wait_until.h"

namespace corbot::panel {
namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;
using nlohmann::json;
using test::wait_until;
using testing::HasSubstr;

constexpr const char* kDriveToken = "fedcba9876543210";

class PanelServer : public testing::Test {
 protected:
  PanelServer() {
    fs::create_directories(directory_ / "page" / "parts");
    write("page/index.html", "<html/>");
    write("page/parts/main.js", "run()");
    write("page/.hidden", "secret");
    write("secret", "secret");
    fs::create_symlink(directory_ / "secret", directory_ / "page" / "link");
    settings_.pages = directory_ / "page";
    settings_.watch_token = kToken;
    settings_.drive_token = kDriveToken;
  }
  ~PanelServer() override {
    for (const auto& robot : {one_, two_, cell_}) {
      robot->set_polls_hang(false);
      robot->set_stops_hang(false);
      robot->set_calls_hang(false);
    }
    if (server_) server_->end();
    if (thread_.joinable()) thread_.join();
    server_.reset();
    fs::remove_all(directory_);
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(directory_ / name) << text;
  }
  static Request to_drive(const std::string& verb, const std::string& target, const std::string& body = "") {
    auto request = Browser::request(verb, target);
    request.set("Authorization", std::string("Bearer ") + kDriveToken);
    request.body = body;
    return request;
  }
  static Response call(int port, const std::string& body) {
    return Browser(port).ask(to_drive("POST", "/api/call", body));
  }
  static Response program(int port, const std::string& body) {
    return Browser(port).ask(to_drive("POST", "/api/program", body));
  }
  /// Waits until the robot's program has this state, and returns it.
  static json program_at(int port, const std::string& robot, const std::string& state) {
    Page page(port);
    for (;;) {
      json update = page.read();  // of a robot or a cell
      if (update.is_null()) return {};
      if (update["robot"] == robot && update["program"].is_object() && update["program"]["state"] == state)
        return update["program"];
    }
  }
  int start(bool with_cell = false) {
    std::vector<std::unique_ptr<Watch>> watches;
    watches.push_back(std::make_unique<Watch>("one", std::make_unique<FakePort>(one_)));
    watches.push_back(std::make_unique<Watch>("two", std::make_unique<FakePort>(two_)));
    if (with_cell)
      watches.push_back(std::make_unique<Watch>("one", std::make_unique<FakePort>(cell_), Watched::kCell));
    server_ = std::make_unique<Server>(settings_, std::move(watches));
    thread_ = std::thread([this] { server_->run(); });
    return server_->port();
  }

  fs::path directory_ = fs::path(test::scratch_directory(CORBOT_SCRATCH_DIR)) / test::unique_name("panel");
  ServerSettings settings_;
  std::shared_ptr<FakeRobot> one_ = std::make_shared<FakeRobot>();
  std::shared_ptr<FakeRobot> two_ = std::make_shared<FakeRobot>();
  std::shared_ptr<FakeRobot> cell_ = std::make_shared<FakeRobot>();  // named like the first robot
  std::unique_ptr<Server> server_;
  std::thread thread_;
};

TEST_F(PanelServer, ServesThePageWithItsTypesAndAPolicy) {
  Browser browser(start());
  const Response page = browser.get("/");
  EXPECT_EQ(page.result(), http::status::ok);
  EXPECT_EQ(page.body(), "<html/>");
  EXPECT_EQ(page["Content-Type"], "text/html; charset=utf-8");
  EXPECT_THAT(page["Content-Security-Policy"], HasSubstr("default-src 'none'; script-src 'self'"));
  EXPECT_EQ(page["X-Content-Type-Options"], "nosniff");
  const Response script = browser.get("/parts/main.js?x=1");
  EXPECT_EQ(script.body(), "run()");
  EXPECT_EQ(script["Content-Type"], "text/javascript; charset=utf-8");
}

TEST_F(PanelServer, ServesNoFileBesidesThePage) {
  Browser browser(start());
  for (const char* target :
       {"/../secret", "/parts/../../secret", "/%2e%2e/secret", "/..%2fsecret", "//secret", "/.hidden",
        "/link", "/parts", "secret", "/page/index.html", "/index.html/"})
    EXPECT_EQ(browser.get(target).result(), http::status::not_found) << target;
}

TEST_F(PanelServer, RefusesAMissingOrWrongToken) {
  const int port = start();
  for (const char* token : {"", "Bearer ", "Bearer 0123456789abcdee", "0123456789abcdef"}) {
    Browser browser(port);
    for (const char* target : {"/api/robots", "/api/stop", "/api/stop?token=x", "/ws", "/api/none"}) {
      auto request = Browser::request("POST", target);
      request.set("Authorization", token);
      EXPECT_EQ(browser.ask(request).result(), http::status::unauthorized) << token << " " << target;
    }
  }
  Page page(port, "/ws?token=0123456789abcdee");
  EXPECT_TRUE(page.error());
  EXPECT_EQ(page.refusal(), http::status::unauthorized);
  EXPECT_EQ(one_->stops(), 0);
}

TEST_F(PanelServer, OnlyTheTokenToDriveMakesCalls) {
  const int port = start();
  EXPECT_EQ(Browser(port).get("/api/rights").body(), R"({"drive":false})");
  EXPECT_EQ(Browser(port).ask(to_drive("GET", "/api/rights")).body(), R"({"drive":true})");
  EXPECT_EQ(Browser(port).ask(to_drive("POST", "/api/stop")).result(), http::status::ok);
  EXPECT_FALSE(Page(port, std::string("/ws?token=") + kDriveToken).error());
  const std::string body = R"({"robot": "two", "do": "move", "to_m": [0.2, -0.1, 0.1], "time_s": 4})";
  const Response refused = Browser(port).post("/api/call", body);
  EXPECT_EQ(refused.result(), http::status::forbidden);
  EXPECT_THAT(refused.body(), HasSubstr("this token allows to watch and to stop"));
  EXPECT_EQ(two_->calls(), "");
  const Response done = call(port, body);
  EXPECT_EQ(done.result(), http::status::ok) << done.body();
  EXPECT_EQ(json::parse(done.body()), json({{"done", true}, {"ticket", 7}}));
  EXPECT_EQ(two_->calls(), "move 0.2 -0.1 0.1 --time 4\n");
  EXPECT_EQ(one_->calls(), "");
}

TEST_F(PanelServer, WithoutATokenToDriveNoClientMayDrive) {
  settings_.drive_token = "";
  const int port = start();
  auto request = to_drive("POST", "/api/call", R"({"robot": "one", "do": "ready"})");
  EXPECT_EQ(Browser(port).ask(request).result(), http::status::unauthorized);
  request.set("Authorization", "Bearer ");
  EXPECT_EQ(Browser(port).ask(request).result(), http::status::unauthorized);
  EXPECT_EQ(one_->calls(), "");
}

TEST_F(PanelServer, SaysWhyACallIsRefused) {
  const int port = start();
  for (const char* body : {"", "{", "[]", R"({"do": "ready"})", R"({"robot": "three", "do": "ready"})"}) {
    const Response response = call(port, body);
    EXPECT_EQ(response.result(), http::status::bad_request) << body;
    EXPECT_THAT(response.body(), HasSubstr("with a robot of this panel")) << body;
  }
  const Response wrong = call(port, R"({"robot": "one", "do": "speed", "percent": 101})");
  EXPECT_EQ(wrong.result(), http::status::bad_request);
  EXPECT_EQ(json::parse(wrong.body())["text"], "speed: PERCENT 101: must be above 0 and at most 100");
  EXPECT_EQ(one_->calls(), "");
  one_->set_fault("refused: out of reach");
  const Response refused = call(port, R"({"robot": "one", "do": "ready"})");
  EXPECT_EQ(refused.result(), http::status::conflict);
  EXPECT_EQ(refused.body(), R"({"text":"refused: out of reach"})");
}

TEST_F(PanelServer, ACallThatHangsDelaysNoStop) {
  one_->set_calls_hang(true);
  const int port = start();
  std::thread hanging([&] {
    const Response response = call(port, R"({"robot": "one", "do": "ready"})");
    EXPECT_EQ(response.result(), http::status::conflict);
    EXPECT_THAT(response.body(), HasSubstr("a Stop was requested"));
  });
  EXPECT_TRUE(wait_until([&] { return one_->hanging_calls() == 1; }));
  const Response busy = call(port, R"({"robot": "one", "do": "open"})");
  EXPECT_EQ(busy.result(), http::status::conflict);
  EXPECT_THAT(busy.body(), HasSubstr("busy"));
  EXPECT_EQ(call(port, R"({"robot": "two", "do": "open"})").result(), http::status::ok);
  EXPECT_EQ(Browser(port).post("/api/stop").result(), http::status::ok);
  EXPECT_EQ(one_->stops(), 1);
  EXPECT_EQ(one_->hanging_calls(), 1);
  one_->set_calls_hang(false);
  hanging.join();
  EXPECT_TRUE(wait_until([&] { return one_->stops() == 2; }));
}

TEST_F(PanelServer, RunsAProgramForWhoMayDrive) {
  const int port = start();
  const std::string body =
      json{{"robot", "two"}, {"name", "p.corbot"}, {"text", "# head\nready\nmove 0.2 0 0.1\n"}}.dump();
  EXPECT_EQ(Browser(port).post("/api/program", body).result(), http::status::forbidden);
  EXPECT_EQ(program(port, body).body(), R"({"commands":2,"done":true})");
  const json state = program_at(port, "two", "done");
  EXPECT_EQ(state["name"], "p.corbot");
  EXPECT_EQ(state["line"], 3);
  EXPECT_EQ(state["statement"], "move 0.2 0 0.1");
  EXPECT_EQ(state["count"], 2);
  EXPECT_EQ(two_->calls(), "ready\nmove 0.2 0 0.1\n");
  EXPECT_EQ(one_->calls(), "");
}

TEST_F(PanelServer, SaysWhyAProgramIsRefused) {
  const int port = start(true);
  const std::vector<std::pair<json, const char*>> cases{
      {{{"robot", "three"}, {"name", "p"}, {"text", "ready"}}, "with a robot of this panel"},
      {{{"cell", "one"}, {"name", "p"}, {"text", "ready"}}, "with a robot of this panel"},
      {{{"robot", "one"}, {"name", "p"}}, "text: must be a text"},
      {{{"robot", "one"}, {"name", ""}, {"text", "ready"}}, "name: has 0 bytes: must have 1 to 100"},
      {{{"robot", "one"}, {"name", "p"}, {"text", "ready"}, {"do", "x"}}, "do: a program has no such value"},
      {{{"robot", "one"}, {"name", "p"}, {"text", "# nothing"}}, "p: the program has no command"},
      {{{"robot", "one"}, {"name", "p"}, {"text", "ready\nmove 1\nstop"}}, "p:2: "},
      {{{"robot", "one"}, {"name", "p"}, {"text", "ready\nmove 1\nstop"}},
       "p:3: 'stop' is not for programs"}};
  for (const auto& [body, fault] : cases) {
    const Response response = program(port, body.dump());
    EXPECT_EQ(response.result(), http::status::bad_request) << body;
    EXPECT_THAT(json::parse(response.body())["text"].get<std::string>(), HasSubstr(fault)) << body;
  }
  std::string text;
  for (int line = 0; line < 30; ++line) text += "dance\n";
  text += "ready\n";
  EXPECT_THAT(program(port, json{{"robot", "one"}, {"name", "p"}, {"text", text}}.dump()).body(),
              HasSubstr("30 lines to fix, of which 20 are shown"));
  const Response large = program(port, std::string(65'537, ' '));
  EXPECT_EQ(large.result(), http::status::payload_too_large);
  EXPECT_EQ(large.body(), "the body is larger than 65536 bytes\n");
  EXPECT_EQ(one_->calls(), "");
}

TEST_F(PanelServer, AStopEndsAProgramAndNoOtherProgramBeginsBefore) {
  one_->set_calls_hang(true);
  const int port = start();
  const std::string body = json{{"robot", "one"}, {"name", "p"}, {"text", "ready\nopen"}}.dump();
  EXPECT_EQ(program(port, body).result(), http::status::ok);
  ASSERT_TRUE(wait_until([&] { return one_->hanging_calls() == 1; }));
  EXPECT_TRUE(wait_until([&] { return program_at(port, "one", "runs")["progress"] == 0.5; }));
  const Response busy = program(port, body);
  EXPECT_EQ(busy.result(), http::status::conflict);
  EXPECT_THAT(busy.body(), HasSubstr("a program runs on this robot"));
  EXPECT_EQ(Browser(port).post("/api/stop").result(), http::status::ok);
  const json state = program_at(port, "one", "stopped");
  EXPECT_THAT(state["text"].get<std::string>(), HasSubstr("p:1: ready"));
  EXPECT_THAT(state["text"].get<std::string>(), HasSubstr("line 2 was not begun"));
  EXPECT_EQ(one_->stops(), 1);
  EXPECT_EQ(one_->calls(), "");
  one_->set_calls_hang(false);
  EXPECT_EQ(program(port, body).result(), http::status::ok);
  EXPECT_EQ(program_at(port, "one", "done")["text"], "");
}

// On its way a request may be delayed for seconds, so that a Stop of the same page overtakes it.
TEST_F(PanelServer, AStopPrecedesAMotionThatItHasOvertaken) {
  const int port = start(true);
  Page page(port);
  const auto stops_of = [&](const char* key) {
    json state = page.read_until(key);
    while (state.is_object() && state[key] != "one") state = page.read_until(key);
    return state.value("stops", json());
  };
  EXPECT_EQ(stops_of("robot"), 0);
  const auto begin = [&](const std::string& robot, int stops) {
    const json body{{"robot", robot}, {"name", "p"}, {"text", "ready"}, {"stops", stops}};
    return program(port, body.dump());
  };
  EXPECT_EQ(Browser(port).post("/api/stop", R"({"robot": "one"})").result(), http::status::ok);
  // A cell moves its robots, so a Stop of any of them precedes its start.
  for (const Response& refused :
       {begin("one", 0), call(port, R"({"robot": "one", "do": "ready", "stops": 0})"),
        call(port, R"({"robot": "one", "do": "resume", "stops": 0})"),
        call(port, R"({"cell": "one", "do": "start", "stops": 0})")}) {
    EXPECT_EQ(refused.result(), http::status::conflict) << refused.body();
    EXPECT_THAT(refused.body(), HasSubstr("a Stop came before it arrived"));
  }
  EXPECT_EQ(one_->calls() + cell_->calls(), "");
  EXPECT_EQ(call(port, R"({"robot": "one", "do": "clear", "stops": 0})").result(), http::status::ok);
  EXPECT_EQ(call(port, R"({"robot": "one", "do": "ready", "stops": "1"})").result(),
            http::status::bad_request);
  ASSERT_TRUE(wait_until([&] { return stops_of("robot") == 1 && stops_of("cell") == 1; }));
  EXPECT_EQ(call(port, R"({"cell": "one", "do": "start", "stops": 1})").result(), http::status::ok);
  EXPECT_EQ(begin("one", 1).result(), http::status::ok);
  EXPECT_EQ(program_at(port, "one", "done")["text"], "");
}

TEST_F(PanelServer, AProgramThatFailsSaysItsLine) {
  const int port = start();
  ASSERT_TRUE(wait_until([&] { return one_->polls() > 0; }));
  one_->set_fault("out of reach");
  EXPECT_EQ(program(port, json{{"robot", "one"}, {"name", "p"}, {"text", "\nready"}}.dump()).result(),
            http::status::ok);
  EXPECT_EQ(program_at(port, "one", "failed")["text"], "p:2: ready: out of reach");
  EXPECT_EQ(one_->stops(), 0);
}

TEST_F(PanelServer, AServerThatEndsStopsTheRobotOfAProgram) {
  one_->set_calls_hang(true);
  const int port = start();
  EXPECT_EQ(program(port, json{{"robot", "one"}, {"name", "p"}, {"text", "ready\nopen"}}.dump()).result(),
            http::status::ok);
  ASSERT_TRUE(wait_until([&] { return one_->hanging_calls() == 1; }));
  server_->end();
  thread_.join();
  server_.reset();
  EXPECT_GE(one_->stops(), 1);
  EXPECT_EQ(one_->calls(), "");
  EXPECT_EQ(two_->stops(), 0);
}

TEST_F(PanelServer, RefusesForeignHostsAndOrigins) {
  const int port = start();
  Browser browser(port);
  for (const char* target : {"/", "/api/robots", "/api/stop"}) {
    auto rebound = Browser::request("POST", target);
    rebound.set("Host", "example.org");
    EXPECT_EQ(browser.ask(rebound).result(), http::status::forbidden) << target;
    auto foreign = Browser::request("POST", target);
    foreign.set("Origin", "http://example.org");
    EXPECT_EQ(browser.ask(foreign).result(), http::status::forbidden) << target;
  }
  auto two_hosts = Browser::request("POST", "/api/stop");
  two_hosts.insert("Host", "example.org");
  EXPECT_EQ(browser.ask(two_hosts).result(), http::status::forbidden);
  Page page(port, std::string("/ws?token=") + kToken, "http://example.org");
  EXPECT_EQ(page.refusal(), http::status::forbidden);
  EXPECT_EQ(one_->stops(), 0);
}

TEST_F(PanelServer, RefusesOversizedAndBrokenRequests) {
  const int port = start();
  auto long_header = Browser::request("GET", "/");
  long_header.set("X-Long", std::string(9000, 'x'));
  EXPECT_EQ(Browser(port).ask(long_header).result(), http::status::request_header_fields_too_large);
  EXPECT_EQ(Browser(port).get("/" + std::string(20'000, 'x')).result(),
            http::status::request_header_fields_too_large);
  EXPECT_EQ(Browser(port).post("/api/stop", std::string(5000, ' ')).result(),
            http::status::payload_too_large);
  EXPECT_EQ(Browser(port).send_bytes("GIOP\1\2\1\0\r\n\r\n").result(), http::status::bad_request);
  EXPECT_EQ(one_->stops(), 0);
}

TEST_F(PanelServer, DescribesTheRobots) {
  const int port = start();
  ASSERT_TRUE(wait_until([&] { return one_->polls() > 0 && two_->polls() > 0; }));
  const json robots = json::parse(Browser(port).get("/api/robots").body());
  EXPECT_EQ(robots,
            json::parse(R"([{"robot": "one", "urdf": "<robot/>"}, {"robot": "two", "urdf": "<robot/>"}])"));
}

TEST_F(PanelServer, SendsTheStatesOfAllRobots) {
  Page page(start());
  ASSERT_FALSE(page.error());
  std::set<std::string> seen;
  while (seen.size() < 2) {
    const json state = page.read();
    ASSERT_TRUE(state.is_object());
    seen.insert(state["robot"]);
  }
}

// The states are large, so that the states for the slow browser fill the kernel's buffers.
TEST_F(PanelServer, ABrowserThatDoesNotReadMissesStatesAndHoldsUpNobody) {
  one_->set_padding(std::string(200'000, 'x'));
  two_->set_polls_hang(true);
  settings_.socket_idle = std::chrono::minutes(5);  // the slow browser answers no ping, either
  const int port = start();
  Page slow(port);
  Page quick(port);
  json last;
  for (int states = 0; states < 40; ++states) {
    last = quick.read();
    ASSERT_TRUE(last.is_object());
  }
  // The browser gets the state that the server was sending, and then the newest one.
  int read = 0;
  for (;; ++read) {
    const json state = slow.read();
    ASSERT_TRUE(state.is_object());
    if (state.at("number") >= last.at("number")) break;
  }
  EXPECT_LE(read, 2);
}

TEST_F(PanelServer, StopsAllRobotsWhilePollsHang) {
  one_->set_polls_hang(true);
  two_->set_polls_hang(true);
  const int port = start();
  ASSERT_TRUE(wait_until([&] { return one_->hanging_polls() + two_->hanging_polls() == 2; }));
  const Response response = Browser(port).post("/api/stop");
  EXPECT_EQ(response.result(), http::status::ok);
  EXPECT_EQ(
      json::parse(response.body()),
      json::parse(R"({"robots": [{"robot": "one", "stopped": true}, {"robot": "two", "stopped": true}]})"));
  EXPECT_EQ(one_->stops(), 1);
  EXPECT_EQ(two_->stops(), 1);
}

TEST_F(PanelServer, StopsTheRobotThatIsNamed) {
  const int port = start();
  Browser browser(port);
  EXPECT_EQ(browser.post("/api/stop", R"({"robot": "two"})").result(), http::status::ok);
  EXPECT_EQ(one_->stops(), 0);
  EXPECT_EQ(two_->stops(), 1);
  for (const char* body : {"[]", "{", "null", R"({"robot": "three"})", R"({"robot": 1})"})
    EXPECT_EQ(browser.post("/api/stop", body).result(), http::status::bad_request) << body;
  EXPECT_EQ(browser.get("/api/stop").result(), http::status::not_found);
  EXPECT_EQ(two_->stops(), 1);
}

TEST_F(PanelServer, SaysWhichRobotDidNotStop) {
  const int port = start();
  two_->set_fault("no answer");
  const Response response = Browser(port).post("/api/stop");
  EXPECT_EQ(response.result(), http::status::bad_gateway);
  EXPECT_EQ(json::parse(response.body())["robots"][1],
            json::parse(R"({"robot": "two", "stopped": false, "text": "no answer"})"));
}

TEST_F(PanelServer, AStopThatHangsHoldsUpNoOther) {
  one_->set_stops_hang(true);
  const int port = start();
  Browser waiting(port);
  std::thread caller([&] { EXPECT_EQ(waiting.post("/api/stop").result(), http::status::ok); });
  EXPECT_TRUE(wait_until([&] { return one_->hanging_stops() == 1 && two_->stops() == 1; }));
  EXPECT_EQ(Browser(port).post("/api/stop", R"({"robot": "two"})").result(), http::status::ok);
  one_->set_stops_hang(false);
  caller.join();
}

TEST_F(PanelServer, AServerEndsWhileAStopIsUnderWay) {
  one_->set_stops_hang(true);
  const int port = start();
  Page page(port);
  page.send(R"({"stop": {}})");
  Browser waiting(port);
  std::thread caller([&] { EXPECT_EQ(waiting.post("/api/stop").result(), http::status::unknown); });
  EXPECT_TRUE(wait_until([&] { return one_->hanging_stops() == 1 && two_->stops() >= 1; }));
  server_->end();
  thread_.join();
  one_->set_stops_hang(false);
  server_.reset();
  caller.join();
}

TEST_F(PanelServer, StopsByAMessageOfTheWebSocket) {
  one_->set_polls_hang(true);
  Page page(start());
  page.send(R"({"stop": {}})");
  EXPECT_EQ(page.read_until("stop")["stop"]["robots"].size(), 2U);
  EXPECT_EQ(one_->stops(), 1);
  page.send(R"({"stop": {"robot": "two"}})");
  EXPECT_EQ(page.read_until("stop"),
            json::parse(R"({"stop": {"robots": [{"robot": "two", "stopped": true}]}})"));
  EXPECT_EQ(two_->stops(), 2);
  for (const char* text : {"stop", "{}", "[]", R"({"stop": {"robot": "three"}})", R"({"stop": null})"}) {
    page.send(text);
    EXPECT_TRUE(page.read_until("error").is_object()) << text;
  }
  page.send(std::string(5000, ' '));
  EXPECT_TRUE(page.read_until("error").is_null());
  EXPECT_EQ(two_->stops(), 2);
}

TEST_F(PanelServer, EachStopOfAWebSocketHasItsReply) {
  one_->set_stops_hang(true);
  Page page(start());
  page.send(R"({"stop": {"robot": "one"}, "id": 1})");
  ASSERT_TRUE(wait_until([&] { return one_->hanging_stops() == 1; }));
  page.send(R"({"stop": {"robot": "two"}, "id": "second"})");
  const json second = page.read_until("stop");
  EXPECT_EQ(second["id"], "second");
  EXPECT_EQ(second["stop"]["robots"][0]["robot"], "two");
  one_->set_stops_hang(false);
  const json first = page.read_until("stop");
  EXPECT_EQ(first["id"], 1);
  EXPECT_EQ(first["stop"]["robots"][0]["robot"], "one");
  page.send(R"({"stop": {"robot": "three"}, "id": [3]})");
  EXPECT_EQ(page.read_until("error")["id"], json::array({3}));
}

TEST_F(PanelServer, RefusesTooManyWebSockets) {
  settings_.most_sockets = 2;
  const int port = start();
  auto first = std::make_unique<Page>(port);
  Page second(port);
  Page third(port);
  EXPECT_EQ(third.refusal(), http::status::service_unavailable);
  EXPECT_EQ(Browser(port).post("/api/stop").result(), http::status::ok);
  first.reset();
  EXPECT_TRUE(wait_until([&] { return !Page(port).error(); }));
}

TEST_F(PanelServer, ManyConnectionsThatSendNothingLeaveRoomForAStop) {
  settings_.most_requests = 3;
  settings_.idle = std::chrono::minutes(5);
  const int port = start();
  std::vector<std::unique_ptr<Browser>> silent;
  for (int i = 0; i < 10; ++i) silent.push_back(std::make_unique<Browser>(port));
  EXPECT_EQ(Browser(port).post("/api/stop").result(), http::status::ok);
  EXPECT_TRUE(silent.front()->is_closed());
}

TEST_F(PanelServer, ManyConnectionsThatSendNothingLeaveAStopItsReply) {
  settings_.most_requests = 3;
  settings_.idle = std::chrono::minutes(5);
  one_->set_stops_hang(true);
  const int port = start();
  Browser waiting(port);
  std::thread caller([&] { EXPECT_EQ(waiting.post("/api/stop").result(), http::status::ok); });
  EXPECT_TRUE(wait_until([&] { return one_->hanging_stops() == 1; }));
  std::vector<std::unique_ptr<Browser>> silent;
  for (int i = 0; i < 10; ++i) silent.push_back(std::make_unique<Browser>(port));
  EXPECT_TRUE(silent.front()->is_closed());
  one_->set_stops_hang(false);
  caller.join();
}

TEST_F(PanelServer, ForgetsAStopWhoseConnectionWasReplaced) {
  settings_.most_requests = 1;
  one_->set_stops_hang(true);
  std::vector<std::unique_ptr<Watch>> watches;
  watches.push_back(std::make_unique<Watch>("one", std::make_unique<FakePort>(one_)));
  Hub hub(settings_, std::move(watches));
  hub.watches[0]->start([] {}, hub.received_stops);
  asio::ip::tcp::acceptor acceptor(hub.io, {asio::ip::address_v4::loopback(), 0});
  asio::ip::tcp::socket browser(hub.io);
  browser.connect(acceptor.local_endpoint());
  auto session = std::make_shared<HttpSession>(hub, acceptor.accept());
  hub.add_request(session);
  session->start();
  asio::write(browser, asio::buffer(Browser::request("POST", "/api/stop").text()));
  ASSERT_TRUE(wait_until([&] { return hub.io.poll() > 0 && hub.received_stops == 1; }));
  const std::weak_ptr<Session> replaced = std::exchange(session, nullptr);
  ASSERT_FALSE(replaced.expired());
  browser = asio::ip::tcp::socket(hub.io);
  browser.connect(acceptor.local_endpoint());
  hub.add_request(std::make_shared<HttpSession>(hub, acceptor.accept()));
  hub.io.poll();
  hub.on_change();
  EXPECT_TRUE(replaced.expired());
  one_->set_stops_hang(false);
}

TEST_F(PanelServer, ClosesAConnectionThatSendsNothing) {
  settings_.idle = std::chrono::milliseconds(50);
  Browser browser(start());
  EXPECT_TRUE(browser.is_closed());
}

TEST_F(PanelServer, ClosesAWebSocketThatAnswersNoPing) {
  settings_.most_sockets = 1;
  settings_.socket_idle = std::chrono::milliseconds(100);
  const int port = start();
  Page silent(port);
  ASSERT_FALSE(silent.error());
  EXPECT_TRUE(wait_until([&] { return !Page(port).error(); }));
}

TEST_F(PanelServer, ShowsACellBesideItsRobots) {
  const int port = start(true);
  Page page(port);
  EXPECT_EQ(page.read_until("cell")["cell"], "one");
  EXPECT_EQ(page.read_until("robot").contains("cell"), false);
  Browser browser(port);
  EXPECT_TRUE(wait_until([&] { return json::parse(browser.get("/api/cells").body())[0].contains("urdf"); }));
  EXPECT_EQ(json::parse(browser.get("/api/robots").body()).size(), 2);
  EXPECT_EQ(browser.get("/api/cells/one/picture").result(), http::status::not_found);
  cell_->set_picture("a picture");
  const Response picture = browser.get("/api/cells/one/picture");
  EXPECT_EQ(picture.body(), "a picture");
  EXPECT_EQ(picture["Content-Type"], "image/jpeg");
  EXPECT_EQ(browser.get("/api/cells/two/picture").result(), http::status::not_found);
  EXPECT_EQ(browser.get("/api/cells/picture").result(), http::status::not_found);
}

TEST_F(PanelServer, StartsPausesAndStopsACell) {
  const int port = start(true);
  EXPECT_EQ(call(port, R"({"cell": "one", "do": "start"})").result(), http::status::ok);
  EXPECT_EQ(call(port, R"({"cell": "one", "do": "pause"})").result(), http::status::ok);
  EXPECT_EQ(cell_->calls(), "start\npause\n");
  EXPECT_EQ(Browser(port).post("/api/call", R"({"cell": "one", "do": "start"})").result(),
            http::status::forbidden);
  const Response stop = call(port, R"({"cell": "one", "do": "stop"})");
  EXPECT_EQ(stop.result(), http::status::bad_request);
  EXPECT_THAT(stop.body(), HasSubstr("POST /api/stop"));
  EXPECT_EQ(call(port, R"({"cell": "one", "do": "start", "time_s": 1})").result(), http::status::bad_request);
  EXPECT_EQ(one_->calls(), "");
  const Response stopped = Browser(port).post("/api/stop", R"({"cell": "one"})");
  EXPECT_EQ(json::parse(stopped.body())["cells"], json::parse(R"([{"cell": "one", "stopped": true}])"));
  EXPECT_EQ(cell_->stops(), 1);
  EXPECT_EQ(one_->stops(), 0);
  cell_->set_fault("the store has not noted it");
  EXPECT_EQ(Browser(port).post("/api/stop").result(), http::status::bad_gateway);
  EXPECT_EQ(one_->stops(), 1);
  EXPECT_EQ(Browser(port).post("/api/stop", R"({"cell": "two"})").result(), http::status::bad_request);
}

TEST_F(PanelServer, TakesAPersonsWordAboutACellForWhoMayDrive) {
  const int port = start(true);
  const std::string gone = R"({"cell": "one", "do": "resolve", "piece": 4, "gone": true})";
  EXPECT_EQ(Browser(port).post("/api/call", gone).result(), http::status::forbidden);
  EXPECT_EQ(cell_->calls(), "");
  EXPECT_EQ(call(port, gone).result(), http::status::ok);
  EXPECT_EQ(call(port, R"({"cell": "one", "do": "exchange", "place": "pallet2"})").result(),
            http::status::ok);
  EXPECT_EQ(cell_->calls(), "resolve 4  -1\nexchange pallet2\n");
  cell_->set_fault("that slot of pallet2 is occupied or reserved");
  const Response refused = call(port, gone);
  EXPECT_EQ(refused.result(), http::status::conflict);
  EXPECT_THAT(refused.body(), HasSubstr("is occupied or reserved"));
}

TEST_F(PanelServer, AStopAlsoEndsAStartOfACellThatIsUnderWay) {
  cell_->set_calls_hang(true);
  const int port = start(true);
  std::thread hanging(
      [&] { EXPECT_EQ(call(port, R"({"cell": "one", "do": "start"})").result(), http::status::conflict); });
  EXPECT_TRUE(wait_until([&] { return cell_->hanging_calls() == 1; }));
  EXPECT_EQ(Browser(port).post("/api/stop").result(), http::status::ok);
  cell_->set_calls_hang(false);
  hanging.join();
  EXPECT_TRUE(wait_until([&] { return cell_->stops() == 2; }));
}

TEST_F(PanelServer, SaysWhyItCannotListen) {
  settings_.port = start();
  try {
    const Server second(settings_, {});
    FAIL() << "two listen at one port";
  } catch (const client::Failure& failure) {
    EXPECT_THAT(failure.what(), HasSubstr("in use"));
  }
  settings_.pages = directory_ / "none";
  EXPECT_THROW(Server(settings_, {}), client::Failure);
}

}  // namespace
}  // namespace corbot::panel
