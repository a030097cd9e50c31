// SPDX-License-Identifier: Apache-2.0
#include "net/arrivals.h"

#include <sys/mman.h>
#include <sys/wait.h>

#include <atomic>
#include <cerrno>
#include <csignal>
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
          auto* self = static_cast<Arrivals*>(of);
          *all = self->stops_;
          *by_others = self->stops_by_others_;
          if (self->closes_) ::close(::dup(STDIN_FILENO));
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
  std::atomic<std::uint64_t> stops_by_others_{0};
  std::atomic<bool> closes_{false};
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

/// A reader that takes a connection with a Stop first numbers before what has arrived on the others.
TEST_F(Arrivals, WhatHasANumberKeepsItUntilItIsRead) {
  const auto number = [&] { corbot_arrivals_number(pair_.server, corbot_arrivals_now()); };
  number();
  send(message(20));
  number();
  stops_ = 2;
  send(message(20));
  number();
  stops_ = 3;
  send(message(20));
  number();
  stops_ = 4;
  send(message(20));
  const auto read = [&](std::uint64_t expected) {
    EXPECT_EQ(receive(), 12);
    EXPECT_EQ(receive(), 20);
    EXPECT_EQ(corbot_arrival(), expected);
  };
  for (const std::uint64_t expected : {1u, 2u, 2u, 4u}) read(expected);  // the third came behind the second
  // On a connection that always has unread bytes the numbers go on.
  send(message(20));
  for (stops_ = 10; stops_ < 20; ++stops_) {
    send(message(20));
    number();
    read(stops_ == 10 ? 10 : stops_ - 1);
  }
  corbot_arrivals_number(-1, 3);
  corbot_arrivals_number(CORBOT_DESCRIPTORS, 3);
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

/// A request whose fragments come around another one: each has the number of its own last bytes.
TEST_F(Arrivals, InterleavedRequestsKeepTheirOwnNumbers) {
  const auto part = [](char type, std::uint32_t id) {
    std::string text = message(8);
    text[7] = type;
    for (int i = 0; i < 4; ++i) text[12 + static_cast<std::size_t>(i)] = static_cast<char>(id >> (8 * i));
    return text;
  };
  const auto pass = [&](const std::string& bytes) {
    send(bytes);
    EXPECT_EQ(receive(), 12);
    EXPECT_EQ(receive(), 8);
  };
  constexpr char kRequest = 0;
  constexpr char kFragment = 7;
  pass(part(kRequest, 300));
  pass(part(kRequest, 301));
  stops_ = 2;
  EXPECT_EQ(corbot_arrival_of(pair_.server, 300), 1u);
  pass(part(kFragment, 300));
  std::thread([&] {
    EXPECT_EQ(corbot_arrival_of(pair_.server, 300), 2u);
    EXPECT_EQ(corbot_arrival_of(pair_.server, 301), 1u);
    EXPECT_EQ(corbot_arrival_of(pair_.server, 302), 0u);
  }).join();
  for (std::uint32_t id = 400; id < 464; ++id) pass(part(kRequest, id));
  EXPECT_EQ(corbot_arrival_of(pair_.server, 301), 0u) << "of long ago";
  EXPECT_EQ(corbot_arrival_of(pair_.server, 463), 2u);
}

/// Counting may let go of the last descriptor of a channel, while a connection is being accepted.
TEST_F(Arrivals, CountingTheStopsMayCloseADescriptor) {
  closes_ = true;
  const AcceptedPair another{listener_};
  EXPECT_GE(another.server, 0);
}

/// Frozen twice, and what arrived in the first freeze is read after the second: it is from before the stop of
/// the first.
TEST_F(Arrivals, WhatLayThereAtTwoFreezesKeepsTheOlderNumber) {
  const pid_t self = ::getpid();
  const int client = pair_.client;
  std::atomic<std::uint64_t>* const shared = static_cast<std::atomic<std::uint64_t>*>(
      ::mmap(nullptr, sizeof(std::uint64_t), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
  ASSERT_NE(static_cast<void*>(shared), MAP_FAILED);
  corbot_arrivals_end();
  corbot_arrivals_start(
      [](void* of, std::uint64_t* all, std::uint64_t* by_others) {
        *by_others = *static_cast<std::atomic<std::uint64_t>*>(of);
        *all = *by_others + 100;
      },
      shared);
  corbot_arrivals_opened(pair_.server);
  const std::string request = message(20);
  const pid_t child = ::fork();
  if (child == 0) {
    const auto pause_ms = [](long ms) {
      const timespec time{ms / 1000, ms % 1000 * 1'000'000};
      ::nanosleep(&time, nullptr);
    };
    pause_ms(400);
    ::kill(self, SIGSTOP);
    pause_ms(100);
    if (::send(client, request.data(), request.size(), MSG_NOSIGNAL) < 0) ::_exit(1);
    shared->fetch_add(1);  // another process stops the arm
    pause_ms(1300);
    ::kill(self, SIGCONT);
    pause_ms(400);
    ::kill(self, SIGSTOP);
    pause_ms(1300);
    ::kill(self, SIGCONT);
    ::_exit(0);
  }
  int status = 0;
  while (::waitpid(child, &status, 0) < 0) ASSERT_EQ(errno, EINTR);
  ASSERT_EQ(status, 0);
  EXPECT_EQ(receive(), 12);
  EXPECT_EQ(receive(), 20);
  EXPECT_EQ(corbot_arrival(), 100u);
  corbot_arrivals_end();
  ::munmap(shared, sizeof(std::uint64_t));
}

}  // namespace
}  // namespace corbot::test
