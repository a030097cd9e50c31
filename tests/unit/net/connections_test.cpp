// SPDX-License-Identifier: Apache-2.0
#include "net/connections.h"

#include <poll.h>

#include <chrono>
#include <utility>
#include <vector>

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
  const int server = listener.accept();
  EXPECT_NE(server, -1) << "the first is noticed";
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

}  // namespace
}  // namespace corbot::test
