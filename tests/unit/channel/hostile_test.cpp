// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <string>
#include <vector>

#include "segment_fixture.h"

namespace corbot {
namespace {

using Kind = SegmentError::Kind;
using MeetingTest = SegmentTest;

/// A connection of a client that says what it likes.
class Hostile : public MeetingTest {
 protected:
  [[nodiscard]] static Descriptor connection(const std::string& robot) {
    return RunDirectory::open(false)->connect(robot);
  }
  /// Whether the task ends the connection.
  static bool is_ended(const Descriptor& connection) {
    for (int i = 0; i < 10'000; ++i) {
      Message message;
      if (receive_message(connection, message) == Received::kClosed) return true;
      const timespec pause{0, 1'000'000};
      ::nanosleep(&pause, nullptr);
    }
    return false;
  }
};

TEST_F(Hostile, WhatIsNoMessageEndsTheConnection) {
  const auto rt = task();
  const std::vector<std::string> garbage{"x", std::string(4096, 'x'), std::string(64, '\0'),
                                         std::string(sizeof(Message::Record), 'a')};
  for (const std::string& bytes : garbage) {
    const Descriptor peer = connection(name());
    ASSERT_GT(::send(peer.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL), 0);
    EXPECT_TRUE(is_ended(peer));
  }
  for (const MessageType type : {MessageType::kReady, MessageType::kWelcome, MessageType::kRefused}) {
    const Descriptor peer = connection(name());
    ASSERT_TRUE(send_message(peer, Message::make(type, name())));
    EXPECT_TRUE(is_ended(peer));
  }
  EXPECT_NO_THROW((void)Observer::of(name()));
}

TEST_F(Hostile, AServantWithoutAProperSegmentIsRefused) {
  const auto rt = task();
  const auto other = Segment<ServantSegment>::create("other", kTestFingerprint);
  const auto wrong_arm = Segment<ServantSegment>::create(name(), 99);
  for (const int fd : {-1, other.memory().get(), wrong_arm.memory().get(), rt->task.memory().get()}) {
    const Descriptor peer = connection(name());
    ASSERT_TRUE(
        send_message(peer, Message::make(MessageType::kServantHello, name()), {{kCarriesServant, fd}}));
    EXPECT_TRUE(is_ended(peer));
  }
  EXPECT_EQ(rt->step(), nullptr);
  const auto port = servant();
  EXPECT_NO_THROW((void)connect(*port));
}

TEST_F(Hostile, AnotherVersionIsToldSo) {
  const auto rt = task();
  const Descriptor peer = connection(name());
  Message hello = Message::make(MessageType::kObserverHello, name());
  hello.record.abi = kSegmentAbi + 1;
  ASSERT_TRUE(send_message(peer, std::move(hello)));
  Message answer;
  while (receive_message(peer, answer) == Received::kNothing) ::sched_yield();
  EXPECT_EQ(answer.record.type, MessageType::kRefused);
  EXPECT_EQ(answer.error().kind(), Kind::kWrongVersion);
}

TEST_F(Hostile, AFloodOfConnectionsKeepsNeitherServantNorStopOut) {
  const auto rt = task();
  const auto port = servant();
  const auto channel = connect(*port);
  (void)rt->await_servant();
  std::vector<Descriptor> flood;
  for (int i = 0; i < 500; ++i) {
    try {
      flood.push_back(connection(name()));
    } catch (const SegmentError& error) {
      ASSERT_EQ(error.kind(), Kind::kSilent);  // faster than the task accepts
      ::sched_yield();
    }
  }
  std::optional<StopPort> stop;
  while (!stop) {
    try {
      stop.emplace(StopPort::of(name()));
    } catch (const SegmentError& error) {
      ASSERT_THAT(error.kind(), testing::AnyOf(Kind::kSilent, Kind::kAbsent)) << error.what();
    }
  }
  stop->request();
  EXPECT_EQ(rt->stop->count.load(), 1u);
  EXPECT_TRUE(channel->task_alive());
}

}  // namespace
}  // namespace corbot
