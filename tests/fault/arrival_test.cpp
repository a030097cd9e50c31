// SPDX-License-Identifier: Apache-2.0
// A call that had arrived before a Stop is not carried out after it. This holds even if the servant was
// frozen, so that the time of arrival is unknown. A later call is carried out.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include <fmt/core.h>

#include "shm/channel_client.h"
#include "support/giop.h"
#include "support/robot_rig.h"
#include "support/traced_thread.h"

namespace corbot::test {
namespace {

constexpr std::uint32_t kResult = 0;
constexpr std::uint32_t kUserException = 1;

class Arrival : public RobotRig {
 protected:
  void TearDown() override {
    if (servant_) servant_->signal(SIGCONT);
    RobotRig::TearDown();
  }
  /// Until every thread of it has stopped.
  void freeze() {
    servant_->signal(SIGSTOP);
    const auto has_stopped = [&](pid_t thread) {
      std::ifstream stream(fmt::format("/proc/{}/task/{}/stat", servant_->pid(), thread));
      const std::string text{std::istreambuf_iterator<char>{stream}, {}};
      const std::size_t state = text.rfind(") ");
      return state != std::string::npos && text[state + 2] == 'T';
    };
    ASSERT_TRUE(wait_until(within(30), [&] {
      const std::vector<pid_t> threads = threads_of(servant_->pid());
      return std::all_of(threads.begin(), threads.end(), has_stopped);
    }));
    frozen_at_ = std::chrono::steady_clock::now();
  }
  /// Sends a read if `reads`, a start on another connection, and a Stop on the first, while the servant is
  /// frozen. Returns whether the arm then carries out the start. A freeze of a second or more would count as
  /// such.
  std::optional<bool> is_carried_out(bool reads, RawConnection& stop, RawConnection& start) {
    constexpr auto kShort = std::chrono::milliseconds(800);
    for (;;) {
      freeze();
      if (HasFatalFailure()) return std::nullopt;
      EXPECT_TRUE(!reads || stop.send(giop_request(2, name_, "_get_DoF")));
      EXPECT_TRUE(start.send(request(3, name_)));
      EXPECT_TRUE(stop.send(giop_request(4, name_, "Stop")));
      servant_->signal(SIGCONT);
      const auto reply = start.reply(within(30));
      const bool was_short = std::chrono::steady_clock::now() - frozen_at_ < kShort;
      EXPECT_TRUE(!reads || stop.reply(within(30)));
      EXPECT_TRUE(stop.reply(within(30)));
      if (!reply) return std::nullopt;
      Corbot::Ticket ticket{};
      const bool is_result = reply->status == kResult && reply->body.size() >= sizeof(ticket);
      if (is_result) std::memcpy(&ticket, &reply->body[reply->body.size() - sizeof(ticket)], sizeof(ticket));
      const bool goes_on =
          is_result && Corbot::MotionInfo_var(arm_->Progress(ticket))->state != Corbot::MotionStopped;
      arm_->Stop();
      if (was_short) return goes_on;
    }
  }
  /// After more than a second.
  void thaw() {
    const auto until = frozen_at_ + std::chrono::milliseconds(1500);
    ASSERT_TRUE(wait_until(within(30), [&] { return std::chrono::steady_clock::now() > until; }));
    servant_->signal(SIGCONT);
  }
  /// As `corbot stop` does on the robot's machine.
  void stop_without_servant() {
    StopPort port = StopPort::of(name_);
    port.request();
    ASSERT_TRUE(wait_until(within(30), [&] { return port.outcome() == StopPort::Outcome::kAtRest; }));
  }
  static std::string request(std::uint32_t id, const std::string& name) {
    return giop_request(id, name, "StartDelay", {600.0});
  }
  static void expect_stopped(RawConnection& connection, const std::string& which) {
    const auto reply = connection.reply(within(30));
    ASSERT_TRUE(reply) << which;
    EXPECT_EQ(reply->status, kUserException) << which;
    EXPECT_NE(reply->body.find("Corbot/Stopped"), std::string::npos) << which;
  }

  std::chrono::steady_clock::time_point frozen_at_;
};

TEST_F(Arrival, WhatLayInTheSocketsOfAFrozenServantIsStopped) {
  RawConnection known(port_);
  ASSERT_TRUE(known.send(giop_request(1, name_, "OverridePercent")));  // no such operation, but an answer
  ASSERT_TRUE(known.reply(within(30)));
  freeze();
  if (HasFatalFailure()) return;
  ASSERT_TRUE(known.send(request(2, name_)));
  RawConnection waiting(port_);  // to be accepted
  ASSERT_TRUE(waiting.send(request(3, name_)));
  stop_without_servant();
  thaw();
  if (HasFatalFailure()) return;
  expect_stopped(known, "an open connection");
  expect_stopped(waiting, "one that had not been accepted");
  ASSERT_TRUE(known.send(request(4, name_)));
  const auto later = known.reply(within(30));
  ASSERT_TRUE(later);
  EXPECT_EQ(later->status, kResult) << "what is sent after the thaw";
  arm_->Stop();
}

TEST_F(Arrival, WithoutAStopMeanwhileAFreezeCostsNothing) {
  arm_->Stop();  // counted by the servant itself
  RawConnection known(port_);
  ASSERT_TRUE(known.send(giop_request(1, name_, "OverridePercent")));
  ASSERT_TRUE(known.reply(within(30)));
  freeze();
  if (HasFatalFailure()) return;
  ASSERT_TRUE(known.send(request(2, name_)));
  thaw();
  if (HasFatalFailure()) return;
  const auto reply = known.reply(within(30));
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->status, kResult);
  arm_->Stop();
}

/// ORBit2 reads all connections in one thread, a connection with a Stop first, and else the older ones.
TEST_F(Arrival, AStartThatArrivedBeforeAStopIsStoppedWhicheverIsReadFirst) {
  if (!on_orbit2()) GTEST_SKIP() << "skipped: omniORB reads each connection in a thread of its own";
  RawConnection older(port_);
  RawConnection newer(port_);
  for (RawConnection* connection : {&older, &newer}) {
    ASSERT_TRUE(connection->send(giop_request(1, name_, "_get_DoF")));
    ASSERT_TRUE(connection->reply(within(30)));
  }
  for (const bool reads : {false, true}) {
    EXPECT_EQ(is_carried_out(reads, newer, older), false) << "on an older connection; " << reads;
    EXPECT_EQ(is_carried_out(reads, older, newer), false) << "on a newer connection; " << reads;
  }
  for (RawConnection* connection : {&older, &newer}) {
    ASSERT_TRUE(connection->send(giop_request(5, name_, "Stop") + request(6, name_)));
    ASSERT_TRUE(connection->reply(within(30)));
    const auto reply = connection->reply(within(30));
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->status, kResult) << "behind the Stop on its connection";
    arm_->Stop();
  }
}

/// On one connection several threads of the ORB read, each whatever comes next.
TEST_F(Arrival, ARequestInFragmentsArrivesWithItsLastBytes) {
  if (on_orbit2()) GTEST_SKIP() << "skipped: ORBit2 takes no fragments";
  constexpr std::size_t kFirst = 28;
  constexpr std::uint32_t kThreads = 4;
  RawConnection client(port_);
  for (std::uint32_t id = 0; id < kThreads; ++id)
    ASSERT_TRUE(client.send(giop_request(id, name_, "Delay", {0.3})));
  for (std::uint32_t id = 0; id < kThreads; ++id) ASSERT_TRUE(client.reply(within(30)));
  const auto expect_result = [&](std::uint32_t id) {
    const auto reply = client.reply(within(30));
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->id, id);
    EXPECT_EQ(reply->status, kResult) << reply->body;
  };
  for (int i = 0; i < 3; ++i) arm_->Stop();
  for (std::uint32_t id = 100; id < 180; id += 2) {
    const GiopFragments around = giop_fragments(id, name_, "StartDelay", {0.001}, kFirst);
    const GiopFragments within = giop_fragments(id + 1, name_, "StartDelay", {0.001}, kFirst);
    ASSERT_TRUE(client.send(around.first + within.first + within.last));
    expect_result(id + 1);
    ASSERT_TRUE(client.send(around.last));
    expect_result(id);
    ASSERT_TRUE(wait_for(Corbot::Standby));
  }
  const GiopFragments begun = giop_fragments(200, name_, "StartDelay", {0.001}, kFirst);
  ASSERT_TRUE(client.send(begun.first));
  const GiopFragments read = giop_fragments(201, name_, "Progress", {}, kFirst);  // ends too early: refused
  ASSERT_TRUE(client.send(read.first + read.last));
  ASSERT_TRUE(client.reply(within(30))) << "and what was sent before it is read";
  arm_->Stop();
  ASSERT_TRUE(client.send(begun.last));
  expect_result(200);
}

}  // namespace
}  // namespace corbot::test
