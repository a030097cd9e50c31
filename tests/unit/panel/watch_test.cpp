// SPDX-License-Identifier: Apache-2.0
#include "panel/watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "panel/fake_port.h"
#include "support/wait_until.h"

namespace corbot::panel {
namespace {

using nlohmann::json;
using test::wait_until;
using testing::HasSubstr;

class PanelWatch : public testing::Test {
 protected:
  ~PanelWatch() override {
    robot_->set_polls_hang(false);
    robot_->set_stops_hang(false);
    robot_->set_calls_hang(false);
  }
  void start() {
    watch_.start([this] { ++changes_; }, received_stops_);
  }
  [[nodiscard]] json newest() const {
    const Watch::State state = watch_.newest();
    return state.text ? json::parse(*state.text) : json::object();
  }

  std::shared_ptr<FakeRobot> robot_ = std::make_shared<FakeRobot>();
  std::atomic<int> changes_{0};
  std::atomic<std::uint64_t> received_stops_{0};
  Watch watch_{"one", std::make_unique<FakePort>(robot_)};
};

TEST_F(PanelWatch, PublishesEachPollWithANumberThatRises) {
  start();
  ASSERT_TRUE(wait_until([&] { return newest().value("poll", 0) >= 2; }));
  const json first = newest();
  ASSERT_TRUE(wait_until([&] { return newest()["number"] > first["number"]; }));
  EXPECT_EQ(first["robot"], "one");
  EXPECT_EQ(first["connected"], true);
  EXPECT_EQ(first["connection"], 1);
  EXPECT_EQ(watch_.description()["urdf"], "<robot/>");
  EXPECT_GE(changes_, 2);
}

TEST_F(PanelWatch, ShowsAFailureAndConnectsAgain) {
  robot_->set_fault("no servant at 127.0.0.1:1");
  start();
  ASSERT_TRUE(wait_until([&] { return newest().contains("text"); }));
  EXPECT_EQ(newest()["connected"], false);
  EXPECT_THAT(newest()["text"], HasSubstr("no servant"));
  robot_->set_fault("");
  ASSERT_TRUE(wait_until([&] { return newest()["connected"] == true; }));
  robot_->set_fault("it died");
  ASSERT_TRUE(wait_until([&] { return newest()["connected"] == false; }));
  robot_->set_fault("");
  ASSERT_TRUE(wait_until([&] { return newest()["connected"] == true; }));
  EXPECT_EQ(newest()["connection"], 2);
}

TEST_F(PanelWatch, StopsWhileAPollHangs) {
  robot_->set_polls_hang(true);
  start();
  ASSERT_TRUE(wait_until([&] { return robot_->hanging_polls() == 1; }));
  const std::uint64_t number = watch_.request_stop();
  ASSERT_TRUE(wait_until([&] { return watch_.last_stop().number == number; }));
  EXPECT_EQ(watch_.last_stop().failure, "");
  EXPECT_EQ(robot_->stops(), 1);
  EXPECT_EQ(robot_->hanging_polls(), 1);
}

TEST_F(PanelWatch, SaysWhyAStopFailed) {
  robot_->set_fault("no answer");
  start();
  const std::uint64_t number = watch_.request_stop();
  ASSERT_TRUE(wait_until([&] { return watch_.last_stop().number == number; }));
  EXPECT_EQ(watch_.last_stop().failure, "no answer");
}

// A supervisor starts a servant that dies repeatedly after five seconds, and the motion goes on meanwhile.
TEST_F(PanelWatch, TriesAStopAgainWhileTheServantStarts) {
  robot_->set_fault("the servant closed the connection");
  start();
  const std::uint64_t number = watch_.request_stop();
  ASSERT_TRUE(wait_until([&] { return robot_->failed_stops() >= 1; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(5500));
  robot_->set_fault("");
  ASSERT_TRUE(wait_until([&] { return watch_.last_stop().number == number; }));
  EXPECT_EQ(watch_.last_stop().failure, "");
  EXPECT_EQ(robot_->stops(), 1);
}

// A supervisor needs seconds to end a servant that is frozen. Its first try fails then.
TEST_F(PanelWatch, TriesAStopAgainThatHasHung) {
  robot_->set_stops_hang(true);
  start();
  const std::uint64_t number = watch_.request_stop();
  ASSERT_TRUE(wait_until([&] { return robot_->hanging_stops() == 1; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));
  robot_->set_fault("the servant closed the connection");
  robot_->set_stops_hang(false);
  ASSERT_TRUE(wait_until([&] { return robot_->failed_stops() >= 1; }));
  robot_->set_fault("");
  ASSERT_TRUE(wait_until([&] { return watch_.last_stop().number == number; }));
  EXPECT_EQ(watch_.last_stop().failure, "");
}

TEST_F(PanelWatch, ReportsAStopThatHasHungForLong) {
  robot_->set_stops_hang(true);
  start();
  const std::uint64_t number = watch_.request_stop();
  ASSERT_TRUE(wait_until([&] { return robot_->hanging_stops() == 1; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(5100));
  robot_->set_fault("no answer");
  robot_->set_stops_hang(false);
  ASSERT_TRUE(wait_until([&] { return watch_.last_stop().number == number; }));
  EXPECT_EQ(robot_->failed_stops(), 1);
}

// Without that Stop the next coordinator would move the robots again.
TEST_F(PanelWatch, TriesAStopAgainWhileACoordinatorStarts) {
  Watch cell("cell", std::make_unique<FakePort>(robot_), Watched::kCell);
  robot_->set_fault("the coordinator does not reply");
  cell.start([] {}, received_stops_);
  const std::uint64_t number = cell.request_stop();
  ASSERT_TRUE(wait_until([&] { return robot_->failed_stops() >= 1; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(5500));
  robot_->set_fault("");
  ASSERT_TRUE(wait_until([&] { return cell.last_stop().number == number; }));
  EXPECT_EQ(cell.last_stop().failure, "");
}

// A motion may begin after the first Stop has ended. The watch must not drop the second Stop then.
TEST_F(PanelWatch, CarriesOutAStopThatComesDuringAnother) {
  robot_->set_stops_hang(true);
  start();
  (void)watch_.request_stop();
  ASSERT_TRUE(wait_until([&] { return robot_->hanging_stops() == 1; }));
  for (int i = 0; i < 9; ++i) (void)watch_.request_stop();
  const std::uint64_t last = watch_.request_stop();
  robot_->set_stops_hang(false);
  ASSERT_TRUE(wait_until([&] { return watch_.last_stop().number == last; }));
  EXPECT_EQ(robot_->stops(), 2);
}

TEST_F(PanelWatch, CarriesOutAStopBeforeItEnds) {
  robot_->set_stops_hang(true);
  start();
  (void)watch_.request_stop();
  ASSERT_TRUE(wait_until([&] { return robot_->hanging_stops() == 1; }));
  const std::uint64_t last = watch_.request_stop();
  watch_.end();
  robot_->set_stops_hang(false);
  ASSERT_TRUE(wait_until([&] { return watch_.last_stop().number == last; }));
  EXPECT_EQ(robot_->stops(), 2);
}

TEST_F(PanelWatch, MakesOneCallAtATime) {
  robot_->set_calls_hang(true);
  start();
  const auto first = watch_.request_call(client::Request{.verb = client::Verb::kReady, .numbers = {}});
  ASSERT_TRUE(first);
  ASSERT_TRUE(wait_until([&] { return robot_->hanging_calls() == 1; }));
  EXPECT_FALSE(watch_.request_call(client::Request{.verb = client::Verb::kOpen, .numbers = {}}));
  robot_->set_calls_hang(false);
  ASSERT_TRUE(wait_until([&] { return first->has_ended.load(); }));
  EXPECT_EQ(first->failure, "");
  EXPECT_EQ(first->reply["ticket"], 7);
  robot_->set_fault("the robot is not ready");
  const auto second = watch_.request_call(client::Request{.verb = client::Verb::kClose, .numbers = {}});
  ASSERT_TRUE(second);
  ASSERT_TRUE(wait_until([&] { return second->has_ended.load(); }));
  EXPECT_EQ(second->failure, "the robot is not ready");
  EXPECT_EQ(robot_->calls(), "ready\n");
  EXPECT_EQ(robot_->stops(), 0);
}

TEST_F(PanelWatch, StopsWhileACallHangsAndAgainWhenItHasStartedAMotion) {
  robot_->set_calls_hang(true);
  start();
  const auto call = watch_.request_call(client::Request{.verb = client::Verb::kReady, .numbers = {}});
  ASSERT_TRUE(wait_until([&] { return robot_->hanging_calls() == 1; }));
  const std::uint64_t number = watch_.request_stop();
  ASSERT_TRUE(wait_until([&] { return watch_.last_stop().number == number; }));
  EXPECT_EQ(robot_->stops(), 1);
  watch_.end();
  robot_->set_calls_hang(false);
  ASSERT_TRUE(wait_until([&] { return call->has_ended.load() && robot_->stops() == 2; }));
  EXPECT_THAT(call->failure, HasSubstr("a Stop was requested"));
}

// A call without an answer may still reach the robot, after both Stops.
TEST_F(PanelWatch, DoesNotPromiseRestAfterACallWithoutAnAnswer) {
  robot_->set_calls_hang(true);
  start();
  const auto call = watch_.request_call(client::Request{.verb = client::Verb::kReady, .numbers = {}});
  ASSERT_TRUE(wait_until([&] { return robot_->hanging_calls() == 1; }));
  const std::uint64_t number = watch_.request_stop();
  ASSERT_TRUE(wait_until([&] { return watch_.last_stop().number == number; }));
  robot_->set_fault("no answer");
  robot_->set_calls_hang(false);
  ASSERT_TRUE(wait_until([&] { return call->has_ended.load(); }));
  EXPECT_EQ(call->failure, "no answer");
  robot_->set_fault("");
  EXPECT_TRUE(wait_until([&] { return robot_->stops() == 2; }));
}

TEST_F(PanelWatch, AStopDuringACallThatMovesNothingIsNotRepeated) {
  robot_->set_calls_hang(true);
  start();
  const auto call = watch_.request_call(client::Request{.verb = client::Verb::kClear, .numbers = {}});
  ASSERT_TRUE(wait_until([&] { return robot_->hanging_calls() == 1; }));
  const std::uint64_t number = watch_.request_stop();
  robot_->set_calls_hang(false);
  ASSERT_TRUE(wait_until([&] { return call->has_ended.load() && watch_.last_stop().number >= number; }));
  EXPECT_EQ(call->failure, "");
  EXPECT_EQ(watch_.last_stop().number, number);
}

}  // namespace
}  // namespace corbot::panel
