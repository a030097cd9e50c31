// SPDX-License-Identifier: Apache-2.0
#include "net/arrivals.h"

#include <atomic>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>

#include "support/process.h"
#include "unit/net/accepted_pair.h"

namespace corbot::test {
namespace {

/// A message of GIOP with a body of that size, little-endian.
std::string message(std::size_t size) {
  std::string text("GIOP\1\2\1\0", 8);
  for (int i = 0; i < 4; ++i) text += static_cast<char>(size >> (8 * i) & 0xffU);
  return text + std::string(size, 'x');
}

class Arrivals : public ::testing::Test {
 protected:
  void SetUp() override {
    corbot_arrivals_start(
        [](void* of, std::uint64_t* all, std::uint64_t* by_others) {
          *all = static_cast<Arrivals*>(of)->stops_;
          *by_others = 0;
        },
        this);
  }
  void TearDown() override { corbot_arrivals_end(); }
  void send(const std::string& bytes) const {
    ASSERT_EQ(::send(pair_.client, bytes.data(), bytes.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(bytes.size()));
  }
  /// As an ORB reads: as much as there is.
  ssize_t receive() const {
    char bytes[4096];
    return ::recv(pair_.server, bytes, sizeof(bytes), 0);
  }

  std::atomic<std::uint64_t> stops_{1};
  const Listener listener_;
  const AcceptedPair pair_{listener_};
};

TEST_F(Arrivals, EachMessageHasTheNumberThatHeldWhenItWasRead) {
  send(message(20) + message(30));
  EXPECT_EQ(receive(), 12);
  EXPECT_EQ(receive(), 20);
  EXPECT_EQ(corbot_arrival(), 1u);
  stops_ = 2;
  EXPECT_EQ(corbot_arrival(), 1u) << "of the one that was read";
  EXPECT_EQ(receive(), 12);
  EXPECT_EQ(receive(), 30) << "nothing of the next is lost";
  EXPECT_EQ(corbot_arrival(), 2u);
}

/// The number is read when the bytes are there, not when the reader began to wait for them.
TEST_F(Arrivals, AReaderThatWaitedDoesNotMakeAMessageOld) {
  std::atomic<pid_t> waiting{0};
  std::uint64_t arrival = 0;
  std::thread reader([&] {
    waiting = ::gettid();
    EXPECT_EQ(receive(), 12);
    arrival = corbot_arrival();
  });
  ASSERT_TRUE(wait_until(within(30), [&] {
    if (waiting == 0) return false;
    std::ifstream stream("/proc/self/task/" + std::to_string(waiting) + "/stat");
    const std::string text{std::istreambuf_iterator<char>{stream}, {}};
    const std::size_t state = text.rfind(") ");
    return state != std::string::npos && text[state + 2] == 'S';
  }));
  stops_ = 2;
  send(message(20));
  reader.join();
  EXPECT_EQ(arrival, 2u);
}

TEST_F(Arrivals, WhatIsNoGiopIsHandedOnAsItIs) {
  send("GET / HTTP/1.1\r\nHost: robot\r\n");
  EXPECT_EQ(receive(), 12);
  EXPECT_EQ(receive(), 17);
  ::shutdown(pair_.client, SHUT_WR);
  EXPECT_EQ(receive(), 0);
}

TEST_F(Arrivals, AMessageInPiecesIsFollowed) {
  const std::string first = message(20);
  for (const char byte : first) {
    send(std::string(1, byte));
    EXPECT_EQ(receive(), 1);
  }
  send(message(5) + message(1));
  EXPECT_EQ(receive(), 12);
  EXPECT_EQ(receive(), 5);
  EXPECT_EQ(receive(), 12);
}

}  // namespace
}  // namespace corbot::test
