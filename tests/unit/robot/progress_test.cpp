// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "robot/task_watch.h"

namespace corbot::progress_test {
namespace {

using namespace std::chrono_literals;

const Progress::Clock::time_point kStart{1000s};

TEST(Progress, ACounterThatStandsStillIsFrozenAfterATenthOfASecond) {
  Progress progress(100ms);
  EXPECT_FALSE(progress.see(5, kStart));
  EXPECT_FALSE(progress.see(5, kStart + 40ms));
  EXPECT_FALSE(progress.see(5, kStart + 80ms));
  EXPECT_TRUE(progress.see(5, kStart + 100ms));
  EXPECT_EQ(progress.changed_at(), kStart);
  EXPECT_FALSE(progress.see(6, kStart + 120ms));
  EXPECT_EQ(progress.changed_at(), kStart + 120ms);
}

TEST(Progress, OneThatAdvancesIsNotHoweverRarelyItIsLookedAt) {
  Progress progress(100ms);
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(progress.see(static_cast<std::uint64_t>(i), kStart + i * 10s));
}

TEST(Progress, TimeInWhichNobodyLookedIsNotHeldAgainstIt) {
  // Both processes were frozen for a minute; this one looks before the other has made a step.
  Progress progress(100ms);
  EXPECT_FALSE(progress.see(5, kStart));
  EXPECT_FALSE(progress.see(5, kStart + 60s));
  EXPECT_FALSE(progress.see(5, kStart + 60s + 20ms));
  EXPECT_FALSE(progress.see(6, kStart + 60s + 40ms));
  EXPECT_FALSE(progress.see(6, kStart + 60s + 80ms));
}

TEST(Progress, BeginsAnewAfterAReset) {
  Progress progress(100ms);
  for (int i = 0; i < 10; ++i) (void)progress.see(5, kStart + i * 40ms);
  ASSERT_TRUE(progress.is_frozen());
  progress.reset();
  EXPECT_FALSE(progress.is_frozen());
  EXPECT_FALSE(progress.see(5, kStart + 10s));
}

TEST(Patience, IsOverWhenThisProcessHasRunForItsBound) {
  Patience patience(2s, kStart);
  for (auto t = 0ms; t <= 2000ms; t += 10ms) ASSERT_FALSE(patience.is_over(kStart + t));
  EXPECT_TRUE(patience.is_over(kStart + 2010ms));
}

TEST(Patience, OutlastsAMachineThatStandsStill) {
  Patience patience(2s, kStart);
  EXPECT_FALSE(patience.is_over(kStart + 10ms));
  EXPECT_FALSE(patience.is_over(kStart + 60s)) << "what it waits for has had no time either";
  EXPECT_FALSE(patience.is_over(kStart + 61s));
  for (auto t = 0ms; t <= 1500ms; t += 10ms) ASSERT_FALSE(patience.is_over(kStart + 61s + t));
  EXPECT_TRUE(patience.is_over(kStart + 61s + 1700ms));
}

}  // namespace
}  // namespace corbot::progress_test
