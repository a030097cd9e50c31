// SPDX-License-Identifier: Apache-2.0
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>

#include <cmath>
#include <thread>

#include "panel/browser.h"
#include "panel/corba_port.h"
#include "panel/server.h"
#include "support/robot_rig.h"

namespace corbot::panel {
namespace {

using nlohmann::json;
using test::wait_until;
using test::within;

class Panel : public test::RobotRig {
 protected:
  void SetUp() override {
    static const CORBA::ORB_var orb = start_panel_orb();  // before the rig's client starts it
    RobotRig::SetUp();
    if (HasFatalFailure()) return;
    others_ = connections();
    ServerSettings settings;
    settings.pages = CORBOT_SOURCE_DIR "/docs/pictures";
    settings.watch_token = kToken;
    std::vector<std::unique_ptr<Watch>> robots;
    robots.push_back(std::make_unique<Watch>("arm", std::make_unique<CorbaPort>(orb.in(), reference_)));
    server_ = std::make_unique<Server>(settings, std::move(robots));
    thread_ = std::thread([this] { server_->run(); });
  }
  void TearDown() override {
    if (server_) server_->end();
    if (thread_.joinable()) thread_.join();
    server_.reset();
    RobotRig::TearDown();
  }
  /// The first state from now on for which `condition` holds; null: there was none.
  template <class Condition>
  static json read_until(Page& page, Condition condition) {
    const test::Deadline deadline = within(30);
    while (std::chrono::steady_clock::now() < deadline) {
      json state = page.read();
      if (state.is_null() || condition(state)) return state;
    }
    return {};
  }
  static bool is_connected(const json& state) { return state.value("connected", false); }
  /// Connections of this process to the robot.
  [[nodiscard]] int connections() const {
    constexpr int kDescriptors = 1024;
    int count = 0;
    for (int fd = 0; fd < kDescriptors; ++fd) {
      sockaddr_in peer{};
      socklen_t size = sizeof(peer);
      count += ::getpeername(fd, reinterpret_cast<sockaddr*>(&peer), &size) == 0 &&
               peer.sin_family == AF_INET && ntohs(peer.sin_port) == port_;
    }
    return count;
  }

  int others_ = 0;  // connections of the rig's client
  std::unique_ptr<Server> server_;
  std::thread thread_;
};

TEST_F(Panel, ShowsAMotionAndStopsIt) {
  Page page(server_->port());
  // The panel reads the loop's statistics less often than the state. A task of 0 cycles has just begun.
  const json before = read_until(
      page, [](const json& state) { return is_connected(state) && state["loop"].value("cycles", 0) > 0; });
  ASSERT_TRUE(before.is_object());
  EXPECT_EQ(before["state"], "Standby");
  const Corbot::LoopInfo_var loop = arm_->Diagnostics();
  EXPECT_EQ(before["loop"]["period_s"], loop->period);
  EXPECT_EQ(before["loop"]["latency_counts"].size(), loop->counts.length());
  EXPECT_EQ(before["loop"]["latency_edges_s"].size(), loop->edges.length());
  const json description = json::parse(Browser(server_->port()).get("/api/robots").body())[0];
  EXPECT_EQ(description["joints"].size(), before["joints"].size());
  EXPECT_NE(description["urdf"].get<std::string>().find("<robot"), std::string::npos);

  const Corbot::Ticket ticket = arm_->StartMove(0.20, 0.10, 0.10, 0.0, 20.0);
  const json moving = read_until(page, [&](const json& state) {
    return state.contains("motion") && state["motion"].is_object() &&
           std::abs(state["joints"][0].get<double>() - before["joints"][0].get<double>()) > 0.5;
  });
  ASSERT_TRUE(moving.is_object());
  EXPECT_EQ(moving["state"], "Waiting");
  EXPECT_EQ(moving["motion"]["ticket"], ticket);

  const Response response = Browser(server_->port()).post("/api/stop");
  EXPECT_EQ(response.result(), http::status::ok) << response.body();
  const Corbot::MotionInfo_var info = arm_->Progress(ticket);
  EXPECT_EQ(info->state, Corbot::MotionStopped);
  EXPECT_TRUE(read_until(page, [](const json& state) { return state["state"] == "Standby"; }).is_object());
}

// A connection carries one call at a time: polls have one, and Stops have one.
TEST_F(Panel, HasAConnectionForStopsBeforehand) {
  Page page(server_->port());
  ASSERT_TRUE(read_until(page, is_connected).is_object());
  EXPECT_EQ(connections(), others_ + 2);
}

TEST_F(Panel, ShowsThatARobotIsGoneAndIsThereAgain) {
  Page page(server_->port());
  ASSERT_TRUE(read_until(page, is_connected).is_object());
  servant_->signal(SIGKILL);
  ASSERT_TRUE(servant_->wait(within(30)));
  const json gone = read_until(page, [](const json& state) { return !is_connected(state); });
  ASSERT_TRUE(gone.is_object());
  EXPECT_NE(gone["text"], "");
  EXPECT_EQ(Browser(server_->port()).post("/api/stop").result(), http::status::bad_gateway);
  start_servant();
  const json back = read_until(page, is_connected);
  ASSERT_TRUE(back.is_object());
  EXPECT_EQ(back["connection"], 2);
  EXPECT_EQ(Browser(server_->port()).post("/api/stop").result(), http::status::ok);
}

}  // namespace
}  // namespace corbot::panel
