// SPDX-License-Identifier: Apache-2.0
#include "net/connections.h"

#include <poll.h>

#include <atomic>
#include <chrono>
#include <future>
#include <thread>
#include <utility>
#include <vector>

#include "net/arrivals.h"
#include "support/process.h"
#include "unit/net/accepted_pair.h"

namespace corbot::test {
namespace {

bool is_closed(int client) {
  pollfd polled{client, POLLRDHUP, 0};
  return ::poll(&polled, 1, 0) > 0 && (polled.revents & POLLRDHUP) != 0;
}

TEST(Connections, TheServantsOwnIsNeverTheOneThatMakesRoom) {
  const Listener listener;
  const AcceptedPair own(listener, true);
  const AcceptedPair oldest(listener);
  std::vector<AcceptedPair> others;
  others.reserve(CORBOT_MOST_CONNECTIONS);
  for (int i = 1; i < CORBOT_MOST_CONNECTIONS; ++i) others.emplace_back(listener);
  EXPECT_FALSE(is_closed(oldest.client)) << "counts for the bound";
  others.emplace_back(listener);
  EXPECT_TRUE(is_closed(oldest.client));
  EXPECT_FALSE(is_closed(own.client));
}

TEST(Connections, TheServantsOwnIsAcceptedWhereNoOtherIs) {
  const Listener listener;
  std::vector<AcceptedPair> busy;
  busy.reserve(CORBOT_MOST_CONNECTIONS);
  std::vector<corbot_connection> calls;
  for (int i = 0; i < CORBOT_MOST_CONNECTIONS; ++i) {
    busy.emplace_back(listener);
    calls.push_back(corbot_connection_used(busy.back().server));
    ASSERT_TRUE(corbot_connection_begin_call(calls.back()));
  }
  const AcceptedPair refused(listener);
  EXPECT_EQ(refused.server, -1);
  const AcceptedPair own(listener, true);
  EXPECT_NE(own.server, -1);
  for (const corbot_connection& call : calls) corbot_connection_end_call(call);
}

/// The ORB has noticed none of the connections that were closed to make room.
TEST(Connections, WaitInTheListenQueueWhileTheOrbHasEndedOnesToNotice) {
  const Listener listener;
  std::vector<AcceptedPair> ended;
  ended.reserve(2 * CORBOT_MOST_CONNECTIONS);
  for (int i = 0; i < 2 * CORBOT_MOST_CONNECTIONS; ++i) ended.emplace_back(listener);
  ASSERT_NE(ended.back().server, -1);
  const AcceptedPair waiting(listener);
  EXPECT_EQ(waiting.server, -1);
  EXPECT_FALSE(is_closed(waiting.client));
  ::close(std::exchange(ended.front().server, -1));
  int server = -1;
  EXPECT_TRUE(wait_until(within(20), [&] { return (server = listener.accept()) != -1; }))
      << "the first is noticed";
  EXPECT_FALSE(is_closed(waiting.client));
  ::close(server);
}

TEST(Connections, TheServantsOwnWaitsBrieflyBesideEndedOnes) {
  const Listener listener;
  std::vector<AcceptedPair> ended;
  ended.reserve(2 * CORBOT_MOST_CONNECTIONS);
  for (int i = 0; i < 2 * CORBOT_MOST_CONNECTIONS; ++i) ended.emplace_back(listener);
  const AcceptedPair refused(listener);
  EXPECT_EQ(refused.server, -1);
  const AcceptedPair own(listener, true);
  int server = own.server;
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (server == -1 && std::chrono::steady_clock::now() < deadline) server = listener.accept();
  EXPECT_NE(server, -1);
  EXPECT_TRUE(is_closed(refused.client)) << "there was no room for it";
  EXPECT_FALSE(is_closed(own.client));
  ::close(server);
}

/// Closes elsewhere, and holds the lock that every connection takes, in a thread that accepts one.
class HeldLock {
 public:
  explicit HeldLock(const Listener& listener) {
    corbot_connections_close_elsewhere();
    // An accepted connection reads the number of stops with that lock held.
    corbot_arrivals_start(&HeldLock::read_stops, this);
    accepting_ = std::async(std::launch::async, [&listener] {
      accepts_ = true;
      const AcceptedPair another(listener);
      accepts_ = false;
    });
    EXPECT_TRUE(wait_until(within(20), [&] { return is_held_.load(); }));
  }
  HeldLock(const HeldLock&) = delete;
  HeldLock& operator=(const HeldLock&) = delete;
  ~HeldLock() {
    release();
    corbot_arrivals_end();
  }
  void release() {
    ends_ = true;
    accepting_.wait();
  }

 private:
  static void read_stops(void* of, std::uint64_t* /*all*/, std::uint64_t* /*by_others*/) {
    auto* const self = static_cast<HeldLock*>(of);
    if (accepts_) self->is_held_ = true;
    while (accepts_ && !self->ends_) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  static inline thread_local bool accepts_ = false;
  std::atomic<bool> is_held_{false};
  std::atomic<bool> ends_{false};
  std::future<void> accepting_;
};

/// omniORB closes connections while it holds locks that every call takes.
TEST(Connections, ClosingElsewhereWaitsForNoOther) {
  const Listener listener;
  AcceptedPair pair(listener);
  ASSERT_NE(pair.server, -1);
  const corbot_connection connection = corbot_connection_used(pair.server);
  HeldLock lock(listener);
  const int server = std::exchange(pair.server, -1);
  const auto closing = std::async(std::launch::async, [server] {
    EXPECT_EQ(::close(server), 0);
    EXPECT_EQ(::close(server), -1) << "it was closed before";
  });
  EXPECT_EQ(closing.wait_until(within(20)), std::future_status::ready);
  EXPECT_FALSE(is_closed(pair.client));
  lock.release();
  EXPECT_FALSE(corbot_connection_lives(connection));
  EXPECT_TRUE(wait_until(within(20), [&] { return is_closed(pair.client); }));
}

}  // namespace
}  // namespace corbot::test
