// SPDX-License-Identifier: Apache-2.0
#include "corbot/channel/trace.h"

#include <gtest/gtest.h>

#include <memory>

namespace corbot {
namespace {

TEST(Trace, KeepsTheLastRecordsAndForgetsTheOldest) {
  const auto trace = std::make_unique<Trace>();
  Snapshot snapshot{};
  EXPECT_EQ(trace->next(), 0u);
  EXPECT_FALSE(trace->read(0, snapshot));
  constexpr std::uint64_t kCount = kTraceSlots + 10;
  for (std::uint64_t i = 0; i < kCount; ++i) {
    snapshot.cycle = 1000 + i;
    trace->append(snapshot);
  }
  EXPECT_EQ(trace->next(), kCount);
  for (std::uint64_t i = 0; i < kCount; ++i) {
    Snapshot out{};
    const bool there = trace->read(i, out);
    ASSERT_EQ(there, i >= kCount - kTraceSlots) << i;
    if (there) {
      ASSERT_EQ(out.cycle, 1000 + i);
    }
  }
}

TEST(Trace, RefusesWhatIsNotThereAndLeavesTheRecordAlone) {
  const auto trace = std::make_unique<Trace>();
  Snapshot snapshot{};
  snapshot.cycle = 7;
  trace->append(snapshot);
  snapshot.cycle = 99;
  EXPECT_FALSE(trace->read(1, snapshot));
  EXPECT_FALSE(trace->read(kTraceSlots, snapshot)) << "same slot, another index";
  EXPECT_FALSE(trace->read(~std::uint64_t{0}, snapshot));
  EXPECT_EQ(snapshot.cycle, 99u);
  EXPECT_TRUE(trace->read(0, snapshot));
  EXPECT_EQ(snapshot.cycle, 7u);
}

}  // namespace
}  // namespace corbot
