// SPDX-License-Identifier: Apache-2.0
// The cycle from one servant to the next, and what a stop count may be.
#include <gtest/gtest.h>

#include <limits>
#include <list>
#include <memory>
#include <thread>
#include <vector>

#include "channel/ring_access.h"
#include "rt/rig.h"
#include "support/cases.h"

namespace corbot::test::servants_test {
namespace {

const Joints kThere{0.8, 1.2, 1.5, 0.5};

class Servants : public ::testing::Test {
 protected:
  Servants() { rig.step(); }
  /// A new servant, whose numbers go on; the former one's segment stays as it is.
  void replace_servant() {
    former.push_back(std::move(rig.servant));
    rig.servant = std::make_unique<ServantSegment>();
    rig.servant->next_command_id.store(former.back()->next_command_id.load());
    rig.servants.post(offers.emplace_back(ServantOffer{rig.servant.get(), ++rig.session}));
  }
  void go(const Joints& from, const Joints& to) {
    rig.submit(rig.planner.move_joints({from, 0.0}, {}, to, 0.0));
  }
  Verdict verdict_of(std::uint64_t id) {
    for (int i = 0; i < 100'000; ++i) {
      rig.step();
      while (const auto taken = rig.completion()) {
        if (taken->id == id) return taken->verdict;
      }
    }
    ADD_FAILURE() << "no verdict";
    return Verdict::kMalformed;
  }

  /// Returns the verdicts of the numbers up to `last` that have none yet, each once and in their order.
  std::vector<Verdict> verdicts(std::uint64_t last) {
    std::vector<Verdict> all;
    for (int i = 0; i < 100'000 && last_verdict < last; ++i) {
      rig.step();
      while (const auto taken = rig.completion()) {
        EXPECT_EQ(taken->id, ++last_verdict);
        all.push_back(taken->verdict);
      }
    }
    return all;
  }

  Rig rig;
  std::uint64_t last_verdict{0};
  std::vector<std::unique_ptr<ServantSegment>> former;
  std::list<ServantOffer> offers;
};

TEST_F(Servants, WhatTheFormerOneWasAcceptedForIsCarriedOutFirst) {
  go({}, kThere);
  go(kThere, {});
  rig.step(10);
  replace_servant();
  rig.step();
  EXPECT_EQ(rig.snapshot.servant_session, rig.session);
  EXPECT_EQ(rig.servants.connected(), rig.session);
  EXPECT_EQ(rig.snapshot.backlog, 1u);
  EXPECT_EQ(rig.snapshot.command_id, 1u);
  EXPECT_EQ(rig.snapshot.last_done_id, 0u) << "a number counts as done when it is";
  EXPECT_EQ(rig.queued(), 0u);
  go({}, kThere);  // queued by the new one behind them
  EXPECT_EQ(verdict_of(2), Verdict::kDone);
  EXPECT_EQ(verdict_of(3), Verdict::kDone);
  EXPECT_EQ(rig.snapshot.position_q, kThere);
  EXPECT_EQ(rig.snapshot.backlog, 0u);
}

TEST_F(Servants, AServantsFlagsCountAtOnce) {
  rig.pause(true);
  go({}, kThere);
  rig.step(10);
  EXPECT_EQ(rig.snapshot.state, RtState::kPaused);
  replace_servant();
  EXPECT_EQ(verdict_of(1), Verdict::kDone) << "nobody else could resume it";
}

TEST_F(Servants, AClearOfTheFormerOneIsNotTheNewOnes) {
  rig.clear();
  rig.step();
  replace_servant();
  rig.emergency_stop->set(StopSource::kDevice, true);
  rig.emergency_stop->set(StopSource::kDevice, false);
  rig.step(2);
  EXPECT_EQ(rig.snapshot.state, RtState::kError);
  rig.clear();
  rig.step();
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
}

TEST_F(Servants, AStopEndsTheBacklog) {
  go({}, kThere);
  go(kThere, {});
  go({}, kThere);
  rig.step(10);
  replace_servant();
  rig.step();
  EXPECT_EQ(rig.snapshot.backlog, 2u);
  rig.stop();
  EXPECT_EQ(verdict_of(3), Verdict::kStopped);
  EXPECT_EQ(rig.snapshot.backlog, 0u);
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
}

TEST_F(Servants, SeveralInARowLoseNothing) {
  go({}, kThere);
  go(kThere, {});
  rig.step(5);
  for (int i = 0; i < 5; ++i) {
    replace_servant();
    rig.step();
  }
  EXPECT_EQ(rig.snapshot.backlog, 1u);
  replace_servant();
  replace_servant();  // before the cycle has looked
  rig.step();
  EXPECT_EQ(rig.snapshot.servant_session, rig.session);
  EXPECT_EQ(verdict_of(2), Verdict::kDone);
}

TEST_F(Servants, ACorruptRingOfTheFormerOneEndsWhatItHeldAndNothingElse) {
  go({}, kThere);
  rig.step(10);
  go(kThere, {});
  go({}, kThere);
  RingIndices::set_head(rig.servant->commands, 1'000'000);
  replace_servant();
  rig.step();
  EXPECT_EQ(rig.alarm()->code, AlarmCode::kRingCorrupt);
  EXPECT_EQ(rig.snapshot.command_id, 1u);
  EXPECT_EQ(rig.snapshot.last_done_id, 0u) << "it runs";
  go(kThere, {});
  EXPECT_EQ(verdicts(4), (std::vector{Verdict::kDone, Verdict::kDropped, Verdict::kDropped, Verdict::kDone}));
  EXPECT_EQ(rig.snapshot.position_q, Joints{});
  EXPECT_FALSE(rig.alarm());
}

TEST_F(Servants, ACorruptRingLeavesTheBacklogOfOthersAlone) {
  go({}, kThere);
  go(kThere, {});
  rig.step(10);
  replace_servant();
  rig.step();
  go({}, kThere);
  RingIndices::set_head(rig.servant->commands, 1'000'000);
  replace_servant();
  rig.step();
  go({}, kThere);
  replace_servant();
  rig.step();
  EXPECT_EQ(verdicts(4), (std::vector{Verdict::kDone, Verdict::kDone, Verdict::kDropped, Verdict::kDone}));
  EXPECT_EQ(rig.snapshot.position_q, kThere);
}

TEST_F(Servants, ACorruptRingAtRestEndsWhatItHeld) {
  go({}, kThere);
  RingIndices::set_head(rig.servant->commands, 1'000'000);
  replace_servant();
  EXPECT_EQ(verdicts(1), (std::vector{Verdict::kDropped}));
  go({}, kThere);
  EXPECT_EQ(verdicts(2), (std::vector{Verdict::kDone}));
}

TEST_F(Servants, WhatFindsNoPlaceInTheBacklogEndsAfterIt) {
  go({}, kThere);
  rig.step(10);
  constexpr std::uint64_t kRoom = rt::ConnectedServant::kCapacity;
  for (std::uint64_t i = 0; i < kRoom; ++i) rig.submit(rig.planner.dwell({kThere, 0.0}, 0.01));
  replace_servant();
  rig.step();
  EXPECT_EQ(rig.snapshot.backlog, kRoom);
  for (int i = 0; i < 3; ++i) rig.submit(rig.planner.dwell({kThere, 0.0}, 0.01));
  replace_servant();
  rig.step();
  EXPECT_EQ(rig.snapshot.last_done_id, 0u);
  std::vector<Verdict> expected(1 + kRoom, Verdict::kDone);
  expected.insert(expected.end(), 3, Verdict::kDropped);
  EXPECT_EQ(verdicts(expected.size()), expected);
}

TEST_F(Servants, AStopDoesNotChangeWhatIsLost) {
  go({}, kThere);
  rig.step(10);
  go(kThere, {});
  RingIndices::set_head(rig.servant->commands, 1'000'000);
  replace_servant();
  rig.step();
  rig.stop();
  EXPECT_EQ(verdicts(2), (std::vector{Verdict::kStopped, Verdict::kDropped}));
  rig.step(2);
  EXPECT_EQ(rig.snapshot.stops_done, rig.servant->control.stop_count.load());
}

TEST_F(Servants, WhatLayInAServantsRingBeforeItConnectedIsNotCarriedOut) {
  former.push_back(std::move(rig.servant));
  rig.servant = std::make_unique<ServantSegment>();
  rig.servant->next_command_id.store(50);
  const RingTail<> nobody;
  Command early = rig.stamp(std::get<std::vector<Command>>(rig.planner.move_joints({}, {}, kThere, 0.0))[0]);
  ASSERT_TRUE(RingProducer(rig.servant->commands, nobody).push(early));
  rig.servants.post(offers.emplace_back(ServantOffer{rig.servant.get(), ++rig.session}));
  rig.step(5);
  EXPECT_EQ(rig.snapshot.position_q, Joints{});
  EXPECT_EQ(rig.snapshot.last_done_id, 50u) << "its number is used";
  go({}, kThere);
  EXPECT_EQ(verdict_of(51), Verdict::kDone);
}

TEST_F(Servants, ABrokenTailLosesVerdictsAndNothingElse) {
  rig.servant->completions_tail.begin_at(~std::uint64_t{0});
  go({}, kThere);
  rig.step(20'000);
  EXPECT_EQ(rig.snapshot.last_done_id, 1u);
  EXPECT_EQ(rig.snapshot.position_q, kThere);
}

TEST_F(Servants, EveryChangeOfTheStopCountIsAStopAndTheNumberOfStopsRises) {
  std::uint64_t stops = rig.snapshot.stops_done;
  for (const std::uint64_t count : {std::uint64_t{5}, std::numeric_limits<std::uint64_t>::max(),
                                    std::uint64_t{0}, std::uint64_t{1} << 63, std::uint64_t{3}}) {
    go(rig.snapshot.position_q, rig.snapshot.position_q == kThere ? Joints{} : kThere);
    rig.step(50);
    ASSERT_EQ(rig.snapshot.state, RtState::kMoving) << count;
    rig.stops->count.store(count);
    rig.step(2000);
    EXPECT_EQ(rig.snapshot.state, RtState::kStandby) << count;
    EXPECT_EQ(rig.snapshot.command_id, 0u);
    EXPECT_EQ(rig.snapshot.stops_done, ++stops);
  }
}

/// A member of the stop group writes what was there before.
TEST_F(Servants, AStopOfTheServantIsNotUndoneByAnOldCount) {
  rig.stops->count.store(7);
  rig.step();
  go({}, kThere);
  go(kThere, {});
  rig.step(50);
  ASSERT_EQ(rig.snapshot.state, RtState::kMoving);
  rig.stop();
  rig.stops->count.store(8);
  rig.stops->count.store(7);
  EXPECT_EQ(verdict_of(1), Verdict::kStopped);
  EXPECT_EQ(verdict_of(2), Verdict::kStopped);
  const std::uint64_t stops = rig.snapshot.stops_done;
  const Command old = [&] {
    Command command = rig.stamp(std::get<std::vector<Command>>(
        rig.planner.move_joints({rig.snapshot.position_q, 0.0}, {}, kThere, 0.0))[0]);
    --command.epoch;  // planned before the stop
    return command;
  }();
  rig.stops->count.store(6);  // an older one yet
  ASSERT_TRUE(rig.push(old));
  EXPECT_EQ(verdict_of(old.id), Verdict::kStopped);
  EXPECT_EQ(rig.snapshot.stops_done, stops + 1);
}

TEST_F(Servants, AStopIsNotLostWithItsServant) {
  go({}, kThere);
  go(kThere, {});
  rig.step(50);
  ASSERT_EQ(rig.snapshot.state, RtState::kMoving);
  rig.stop();
  replace_servant();  // before the cycle has looked
  EXPECT_EQ(verdict_of(1), Verdict::kStopped);
  EXPECT_EQ(verdict_of(2), Verdict::kStopped);
}

TEST_F(Servants, AStopOfAnotherProcessIsNotTheNumberOfTheServantsNext) {
  rig.stops->count.fetch_add(1);
  rig.step();
  go({}, kThere);  // planned after that stop
  rig.step(50);
  ASSERT_EQ(rig.snapshot.state, RtState::kMoving);
  rig.stop();
  EXPECT_EQ(verdict_of(1), Verdict::kStopped);
}

/// The mailbox between two threads: an offer that is confirmed is no longer read.
TEST(ServantMailbox, HandsOverTheNewest) {
  ServantMailbox mailbox;
  const auto offers = static_cast<std::uint64_t>(cases(2000));
  std::thread cycle([&] {
    for (std::uint64_t last = 0; last < offers;) {
      const ServantOffer* const offer = mailbox.take();
      if (offer == nullptr) {
        std::this_thread::yield();
        continue;
      }
      EXPECT_GT(offer->session, last);
      last = offer->session;
      EXPECT_EQ(offer->segment->header.id, last);
      mailbox.confirm(last);
    }
  });
  std::list<std::pair<std::unique_ptr<ServantSegment>, ServantOffer>> mapped;
  for (std::uint64_t session = 1; session <= offers; ++session) {
    auto& each = mapped.emplace_back(std::make_unique<ServantSegment>(), ServantOffer{nullptr, session});
    each.first->header.id = session;
    each.second.segment = each.first.get();
    mailbox.post(each.second);
    mapped.remove_if([&](const auto& old) { return old.second.session < mailbox.connected(); });
  }
  cycle.join();
  EXPECT_EQ(mailbox.connected(), offers);
}

}  // namespace
}  // namespace corbot::test::servants_test
