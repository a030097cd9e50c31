// SPDX-License-Identifier: Apache-2.0
#include "robot/ticket_table.h"

#include <gtest/gtest.h>

#include <thread>

namespace corbot::ticket_table_test {
namespace {

Ticket ticket(std::uint64_t first, std::uint64_t last) {
  Ticket result;
  result.first = first;
  result.last = last;
  return result;
}

TEST(TicketTable, EndsWithTheVerdictOfItsCommand) {
  TicketTable table;
  table.add(ticket(1, 1));
  EXPECT_EQ(table.pending(), 1u);
  EXPECT_EQ(table.find(1)->state, TicketState::kPending);
  table.complete(1, Verdict::kDone);
  EXPECT_EQ(table.pending(), 0u);
  EXPECT_EQ(table.find(1)->state, TicketState::kDone);
  EXPECT_EQ(table.find(1)->reason, "");
}

TEST(TicketTable, TwoCommandsAreOneMotion) {
  TicketTable table;
  table.add(ticket(1, 2));
  table.complete(1, Verdict::kDone);
  EXPECT_EQ(table.find(2)->state, TicketState::kPending);
  table.complete(2, Verdict::kDone);
  EXPECT_EQ(table.find(2)->state, TicketState::kDone);
  EXPECT_EQ(table.pending(), 0u);
}

TEST(TicketTable, TheFirstFaultSaysWhy) {
  TicketTable table;
  table.add(ticket(1, 2));
  table.complete(1, Verdict::kStopped);
  table.complete(2, Verdict::kDiscontinuous);
  EXPECT_EQ(table.find(2)->state, TicketState::kStopped);
  EXPECT_NE(table.find(2)->reason, "");
  EXPECT_EQ(table.pending(), 0u);
}

TEST(TicketTable, VerdictsOfOtherNumbersChangeNothing) {
  TicketTable table;
  table.add(ticket(5, 5));
  table.complete(4, Verdict::kDone);
  table.complete(6, Verdict::kDone);
  EXPECT_EQ(table.find(5)->state, TicketState::kPending);
  table.complete(5, Verdict::kDone);
  table.complete(5, Verdict::kFault);  // a second verdict has no ticket
  EXPECT_EQ(table.find(5)->state, TicketState::kDone);
  EXPECT_EQ(table.pending(), 0u);
}

TEST(TicketTable, KeepsTheLastThousandAndForgetsOlderOnes) {
  TicketTable table;
  constexpr std::uint64_t kCount = 3000;
  for (std::uint64_t id = 1; id <= kCount; ++id) {
    table.add(ticket(id, id));
    table.complete(id, Verdict::kDone);
  }
  for (std::uint64_t id = kCount - 999; id <= kCount; ++id) EXPECT_TRUE(table.find(id)) << id;
  EXPECT_FALSE(table.find(1));
}

TEST(TicketTable, PendingOnesAreNeverForgotten) {
  TicketTable table;
  table.add(ticket(1, 1));
  for (std::uint64_t id = 2; id <= 3000; ++id) {
    table.add(ticket(id, id));
    table.complete(id, Verdict::kDone);
  }
  EXPECT_TRUE(table.find(1));
  EXPECT_EQ(table.pending(), 1u);
}

TEST(TicketTable, WakesEveryWaitingThread) {
  TicketTable table;
  table.add(ticket(1, 1));
  table.add(ticket(2, 2));
  std::thread first([&] { EXPECT_EQ(table.wait(1, std::nullopt)->state, TicketState::kDone); });
  std::thread second([&] { EXPECT_EQ(table.wait(2, std::nullopt)->state, TicketState::kFailed); });
  table.complete(1, Verdict::kDone);
  table.fail_pending("gone");
  first.join();
  second.join();
  EXPECT_EQ(table.find(2)->reason, "gone");
  EXPECT_EQ(table.find(1)->state, TicketState::kDone) << "an ended one does not fail afterwards";
}

TEST(TicketTable, WaitEndsWithItsTimeOrWithTheTable) {
  TicketTable table;
  table.add(ticket(1, 1));
  EXPECT_EQ(table.wait(1, std::chrono::steady_clock::now())->state, TicketState::kPending);
  EXPECT_FALSE(table.wait(7, std::nullopt));
  std::thread waiter([&] { EXPECT_EQ(table.wait(1, std::nullopt)->state, TicketState::kPending); });
  table.close();
  waiter.join();
}

TEST(TicketTable, ARemovedOneIsGone) {
  TicketTable table;
  table.add(ticket(1, 1));
  table.remove(1);
  EXPECT_FALSE(table.find(1));
  EXPECT_EQ(table.pending(), 0u);
  table.remove(1);
  EXPECT_EQ(table.pending(), 0u);
}

TEST(TicketTable, WaitsForAllOfARangeAndNoFurther) {
  TicketTable table;
  for (const std::uint64_t id : {1u, 2u, 3u}) {
    Ticket ticket;
    ticket.first = ticket.last = id;
    table.add(ticket);
  }
  table.complete(1, Verdict::kStopped);
  EXPECT_FALSE(table.wait_ended(1, 2, std::chrono::seconds(0)));
  std::thread pump([&] { table.complete(2, Verdict::kStopped); });
  EXPECT_TRUE(table.wait_ended(1, 2, std::chrono::seconds(30)));
  pump.join();
  EXPECT_FALSE(table.wait_ended(1, 3, std::chrono::seconds(0))) << "the third is still pending";
}

TEST(TicketTable, WhileWaitsAreSuspendedNoneIsLongAndNoneIsBusy) {
  using Clock = std::chrono::steady_clock;
  TicketTable table;
  table.add(ticket(1, 1));
  std::thread suspend([&] { table.suspend_waits(true); });
  const Clock::time_point begin = Clock::now();
  EXPECT_EQ(table.wait(1, std::nullopt)->state, TicketState::kPending);
  EXPECT_EQ(table.wait(1, begin + std::chrono::hours(1))->state, TicketState::kPending);
  EXPECT_GE(Clock::now() - begin, 2 * TicketTable::kSuspendedWait);
  EXPECT_LT(Clock::now() - begin, std::chrono::seconds(20));
  suspend.join();
  const Clock::time_point soon = Clock::now() + std::chrono::milliseconds(1);
  EXPECT_EQ(table.wait(1, soon)->state, TicketState::kPending) << "the caller's own time comes first";
  std::thread end([&] {
    table.suspend_waits(false);
    table.complete(1, Verdict::kDone);
  });
  while (table.wait(1, std::nullopt)->state == TicketState::kPending) {
  }
  EXPECT_EQ(table.find(1)->state, TicketState::kDone);
  end.join();
}

TEST(TicketTable, WhatIsDoneByNowWaitedInASnapshotOfBefore) {
  TicketTable table;
  for (const std::uint64_t id : {1u, 2u, 3u}) {
    Ticket added = ticket(id, id);
    added.incarnation = 7;
    table.add(added);
  }
  Snapshot before{};
  before.incarnation = 7;
  before.command_id = 1;
  EXPECT_EQ(table.shown_in(before).queued, 2u);
  table.complete(1, Verdict::kDone);
  table.complete(2, Verdict::kDone);
  const TicketTable::Shown shown = table.shown_in(before);
  ASSERT_TRUE(shown.running);
  EXPECT_EQ(shown.running->last, 1u);
  EXPECT_EQ(shown.queued, 2u);
  before.command_id = 0;
  before.last_done_id = 2;
  EXPECT_EQ(table.shown_in(before).queued, 1u);
  Snapshot of_another_task{};
  of_another_task.incarnation = 8;
  EXPECT_EQ(table.shown_in(of_another_task).queued, 1u)
      << "what an earlier task did never waited in this one";
}

}  // namespace
}  // namespace corbot::ticket_table_test
