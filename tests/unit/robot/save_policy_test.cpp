// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "robot/position_saver.h"

namespace corbot::save_policy_test {
namespace {

using namespace std::chrono_literals;

Snapshot at(double base_q, std::uint64_t command_id) {
  Snapshot snapshot{};
  snapshot.position_q[0] = base_q;
  snapshot.command_id = command_id;
  return snapshot;
}

TEST(SavePolicy, KeepsRestAtOnceAndMotionEverySecond) {
  SavePolicy rule;
  SavePolicy::Instant now{};
  EXPECT_TRUE(rule.is_due(at(0.0, 0), now)) << "the first position";
  rule.saved(at(0.0, 0), now);
  EXPECT_FALSE(rule.is_due(at(0.0, 0), now + 1h)) << "nothing has changed";
  now += 10ms;
  EXPECT_FALSE(rule.is_due(at(0.1, 7), now));
  now += 1s;
  EXPECT_TRUE(rule.is_due(at(0.2, 7), now));
  rule.saved(at(0.2, 7), now);
  EXPECT_FALSE(rule.is_due(at(0.3, 7), now + 999ms));
  EXPECT_TRUE(rule.is_due(at(0.3, 0), now + 1ms)) << "at rest";
  EXPECT_TRUE(rule.is_due(at(0.2, 0), now + 1ms)) << "where it was, but at rest now";
}

TEST(SavePolicy, KeepsAHoldAtOnce) {
  SavePolicy rule;
  const SavePolicy::Instant now{};
  rule.saved(at(0.0, 7), now);
  Snapshot held = at(0.0, 7);
  held.flags = kSnapshotHeld;
  EXPECT_TRUE(rule.is_due(held, now + 10ms)) << "while it slows down";
  rule.saved(held, now + 10ms);
  EXPECT_FALSE(rule.is_due(held, now + 20ms));
  EXPECT_TRUE(rule.is_due(at(0.0, 7), now + 20ms)) << "cleared";
}

TEST(SavePolicy, KeepsAnErrorAtOnce) {
  SavePolicy rule;
  const SavePolicy::Instant now{};
  rule.saved(at(0.0, 0), now);
  Snapshot error = at(0.0, 0);
  error.state = RtState::kError;
  EXPECT_TRUE(rule.is_due(error, now + 10ms));
  rule.saved(error, now + 10ms);
  EXPECT_FALSE(rule.is_due(error, now + 20ms));
  EXPECT_TRUE(rule.is_due(at(0.0, 0), now + 20ms)) << "cleared";
}

TEST(SavePolicy, DoesNotHammerAFullDisk) {
  SavePolicy rule;
  const SavePolicy::Instant now{};
  rule.failed(now);
  EXPECT_FALSE(rule.is_due(at(0.1, 0), now + 9s));
  EXPECT_TRUE(rule.is_due(at(0.1, 0), now + 10s));
}

}  // namespace
}  // namespace corbot::save_policy_test
