// SPDX-License-Identifier: Apache-2.0
// A Stop is counted once, where its request arrives: whatever the servant's other calls hold.
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/syscall.h>
#include <sys/uio.h>

#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <fmt/core.h>

#include "shm/channel_client.h"
#include "support/giop.h"
#include "support/ior.h"
#include "support/robot_rig.h"
#include "support/traced_thread.h"

namespace corbot::test {
namespace {

class StopArrival : public RobotRig {
 protected:
  void SetUp() override {
    RobotRig::SetUp();
    if (!HasFatalFailure()) channel_ = std::make_unique<Observer>(Observer::of(name_));
  }
  void TearDown() override {
    channel_.reset();
    if (rt_) rt_->signal(SIGCONT);
    RobotRig::TearDown();
  }

  [[nodiscard]] std::uint64_t stops() const { return channel_->servant()->control.stop_count; }
  [[nodiscard]] std::uint64_t holds() const { return channel_->servant()->control.hold_count; }
  /// The servant has read from the connection that this returns.
  [[nodiscard]] std::unique_ptr<RawConnection> open() {
    auto connection = std::make_unique<RawConnection>(port_);
    EXPECT_TRUE(connection->send(giop_request(1, name_, "_get_DoF")));
    EXPECT_TRUE(connection->reply(within(30)));
    return connection;
  }
  [[nodiscard]] static std::string key_of(Corbot::Arm_ptr arm) {
    const CORBA::String_var text = client_orb()->object_to_string(arm);
    return parse_ior(text.in()).key;
  }

  /// The servant holds the lock of all connections while it looks whether a client is there. This recognises
  /// that look.
  [[nodiscard]] bool is_look_at_a_client(const SystemCall& call) const {
#ifdef SYS_poll
    if (call.number != SYS_poll || call.arguments[1] != 1 || call.arguments[2] != 0) return false;
#else
    return false;
#endif
    pollfd polled{};
    iovec to{&polled, sizeof(polled)};
    iovec from{reinterpret_cast<void*>(call.arguments[0]), sizeof(polled)};
    return ::process_vm_readv(servant_->pid(), &to, 1, &from, 1, 0) == sizeof(polled) &&
           polled.events == POLLRDHUP;
  }
  /// This holds a thread of a call that waits, in the middle of that look.
  [[nodiscard]] std::optional<TracedThread> hold_the_connections() {
    std::vector<pid_t> threads;
    for (const pid_t thread : threads_of(servant_->pid())) {
      if (!thread_name(servant_->pid(), thread).starts_with("robot.")) threads.push_back(thread);
    }
    return hold_at_call(
        servant_->pid(), threads, [&](const SystemCall& call) { return is_look_at_a_client(call); },
        within(30));
  }
  /// This sends the request while a thread of the servant keeps the connections' lock. It is counted all the
  /// same, and once.
  void expect_counted_while_held(const std::string& key, const std::string& operation) {
    if (const std::string why = why_not_traceable(); !why.empty()) GTEST_SKIP() << why;
    const auto waiting = open();
    const auto client = open();
    const Corbot::Ticket ticket = arm_->StartDelay(600.0);
    ASSERT_TRUE(waiting->send(giop_request(2, name_, "Ready")));  // behind the delay
    ASSERT_TRUE(wait_until(within(30), [&] {
      return raised_by([&] { Corbot::MotionInfo_var info = arm_->Progress(ticket + 1); }).empty();
    }));
    const std::uint64_t before = stops();
    {
      const auto held = hold_the_connections();
      ASSERT_TRUE(held) << "no thread looks whether its client is there";
      ASSERT_TRUE(client->send(giop_request(3, key, operation)));
      EXPECT_TRUE(wait_until(within(10), [&] { return stops() > before; })) << "not counted before the lock";
    }
    const auto reply = client->reply(within(30));
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->status, 0u) << reply->body;
    EXPECT_TRUE(waiting->reply(within(30)));
    EXPECT_EQ(stops(), before + 1) << "once";
  }

  std::unique_ptr<Observer> channel_;
};

TEST_F(StopArrival, IsBeforeTheLockOfTheConnections) { expect_counted_while_held(name_, "Stop"); }

TEST_F(StopArrival, OfAStopAndHoldIsBeforeTheLockOfTheConnections) {
  const std::uint64_t before = holds();
  expect_counted_while_held(name_, "StopAndHold");
  if (IsSkipped()) return;
  EXPECT_EQ(holds(), before + 1);
  EXPECT_TRUE(wait_for(Corbot::Error));
  arm_->Clear();
}

TEST_F(StopArrival, OnAReferenceOfControlIsBeforeTheLockOfTheConnections) {
  const Corbot::Arm_var control = arm_->Acquire("someone", 60.0);
  const std::string key = key_of(control);
  control->Release();
  expect_counted_while_held(key, "Stop");
}

TEST_F(StopArrival, CountsEachRequestOnce) {
  std::uint64_t before = stops();
  for (int i = 0; i < 3; ++i) arm_->Stop();
  EXPECT_EQ(stops(), before + 3);
  before = stops();
  const Corbot::Arm_var control = arm_->Acquire("someone", 60.0);
  control->Stop();
  EXPECT_EQ(stops(), before + 1) << "by whom who has control";
  arm_->Stop();
  EXPECT_EQ(stops(), before + 2) << "by whom who has none";
  control->Release();
  EXPECT_EQ(stops(), before + 3) << "the end of control";
  EXPECT_EQ(raised_by([&] { control->Stop(); }), "") << "a Stop is free, through every key";
  EXPECT_EQ(stops(), before + 4);
  before = stops();
  const std::uint64_t holds_before = holds();
  arm_->StopAndHold();
  EXPECT_EQ(stops(), before + 1);
  EXPECT_EQ(holds(), holds_before + 1);
  bool is_named = false;
  for (const Corbot::AlarmInfo& alarm : alarms())
    is_named =
        is_named || (alarm.code == 133 && std::string(alarm.text).find("asked for by") != std::string::npos);
  EXPECT_TRUE(is_named);
  arm_->Stop();
  EXPECT_EQ(stops(), before + 2) << "in Error as well";
  arm_->Clear();
}

/// Some of them have a place, and some have none.
TEST_F(StopArrival, CountsEachOfManyOnce) {
  constexpr std::uint64_t kStops = 20;
  std::vector<std::unique_ptr<RawConnection>> clients;
  for (std::uint64_t i = 0; i < kStops; ++i) clients.push_back(open());
  const std::uint64_t before = stops();
  rt_->signal(SIGSTOP);
  for (const auto& client : clients) EXPECT_TRUE(client->send(giop_request(2, name_, "Stop")));
  EXPECT_TRUE(wait_until(within(30), [&] { return stops() >= before + kStops; })) << stops() - before;
  rt_->signal(SIGCONT);
  for (const auto& client : clients) EXPECT_TRUE(client->reply(within(30)));
  EXPECT_EQ(stops(), before + kStops);
}

/// A client that looks for the object on the connection of a Stop sends no second Stop.
TEST_F(StopArrival, CountsNothingForALocateRequest) {
  constexpr std::uint8_t kLocateRequest = 3;
  const auto client = open();
  const std::uint64_t before = stops();
  ASSERT_TRUE(client->send(giop_request(2, name_, "Stop")));
  ASSERT_TRUE(client->reply(within(30)));
  std::string body{'\3', '\0', '\0', '\0', static_cast<char>(name_.size()), '\0', '\0', '\0'};
  body += name_;
  ASSERT_TRUE(client->send(giop_header(kLocateRequest, body.size()) + body));
  ASSERT_TRUE(client->send(giop_request(4, name_, "_get_DoF")));
  ASSERT_TRUE(client->reply(within(30))) << "what was sent before it is read";
  EXPECT_EQ(stops(), before + 1);
}

TEST_F(StopArrival, CountsNothingForAnotherObject) {
  const std::uint64_t before = stops();
  for (const std::string& key : {name_ + "x", name_.substr(1), std::string("other")}) {
    RawConnection client(port_);
    ASSERT_TRUE(client.send(giop_request(2, key, "Stop")));
    (void)client.reply(within(5));  // ORBit2 answers in another version of GIOP
  }
  const auto client = open();
  ASSERT_TRUE(client->send(giop_request(2, name_, "Stopp")));
  EXPECT_TRUE(client->reply(within(30)));
  EXPECT_EQ(stops(), before);
}

}  // namespace
}  // namespace corbot::test
