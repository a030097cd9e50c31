// SPDX-License-Identifier: Apache-2.0
#include "corbot/channel/ring.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <vector>

#include "corbot/motion/command.h"
#include "ring_access.h"

namespace corbot {
namespace {

using SmallRing = Ring<std::uint64_t, 8>;

/// As a process that has just come: by ends of their own.
bool push(SmallRing& ring, std::uint64_t record) { return RingProducer(ring).push(record); }
PopResult pop(SmallRing& ring, std::uint64_t& record) { return RingConsumer(ring).pop(record); }
bool push_all(SmallRing& ring, const std::uint64_t* first, std::size_t count) {
  return RingProducer(ring).push_all(first, count);
}

std::vector<std::uint64_t> drain(SmallRing& ring) {
  std::vector<std::uint64_t> taken;
  std::uint64_t record = 0;
  while (pop(ring, record) == PopResult::kOk) taken.push_back(record);
  return taken;
}

TEST(Ring, ZeroedMemoryIsAnEmptyRing) {
  alignas(SmallRing) std::byte memory[sizeof(SmallRing)];
  std::memset(memory, 0, sizeof(memory));
  auto& ring = *reinterpret_cast<SmallRing*>(memory);
  std::uint64_t record = 7;
  EXPECT_EQ(pop(ring, record), PopResult::kEmpty);
  EXPECT_EQ(record, 7u) << "an empty ring leaves the record alone";
  EXPECT_EQ(ring.size(), 0u);
  EXPECT_TRUE(push(ring, 1));
  EXPECT_EQ(pop(ring, record), PopResult::kOk);
  EXPECT_EQ(record, 1u);
}

TEST(Ring, KeepsOrderOverManyTurns) {
  SmallRing ring;
  std::uint64_t next_in = 0;
  std::uint64_t next_out = 0;
  for (int turn = 0; turn < 1000; ++turn) {
    for (int i = 0; i < 1 + turn % 8; ++i) ASSERT_TRUE(push(ring, next_in++));
    std::uint64_t record = 0;
    while (pop(ring, record) == PopResult::kOk) ASSERT_EQ(record, next_out++);
    ASSERT_EQ(next_out, next_in);
  }
}

TEST(Ring, TakesExactlyItsCapacity) {
  SmallRing ring;
  for (std::uint64_t i = 0; i < 8; ++i) ASSERT_TRUE(push(ring, i));
  EXPECT_EQ(ring.size(), SmallRing::capacity());
  EXPECT_FALSE(push(ring, 99));
  std::uint64_t record = 99;
  ASSERT_EQ(pop(ring, record), PopResult::kOk);
  EXPECT_EQ(record, 0u);
  EXPECT_TRUE(push(ring, 8)) << "one taken makes room for one";
  EXPECT_FALSE(push(ring, 99));
  EXPECT_EQ(drain(ring), (std::vector<std::uint64_t>{1, 2, 3, 4, 5, 6, 7, 8}));
}

TEST(Ring, PushesAllOrNone) {
  SmallRing ring;
  const std::uint64_t records[9] = {10, 11, 12, 13, 14, 15, 16, 17, 18};
  EXPECT_FALSE(push_all(ring, records, 9)) << "more than it can ever hold";
  ASSERT_TRUE(push_all(ring, records, 5));
  EXPECT_FALSE(push_all(ring, records, 4)) << "room for three";
  EXPECT_EQ(ring.size(), 5u);
  EXPECT_TRUE(push_all(ring, records + 5, 3));
  EXPECT_TRUE(push_all(ring, records, 0)) << "nothing fits even when it is full";
  EXPECT_EQ(drain(ring), (std::vector<std::uint64_t>{10, 11, 12, 13, 14, 15, 16, 17}));
  EXPECT_FALSE(push_all(ring, records, std::numeric_limits<std::size_t>::max()));
}

TEST(Ring, ClearDropsWhatWasPublished) {
  SmallRing ring;
  for (std::uint64_t i = 0; i < 5; ++i) ASSERT_TRUE(push(ring, i));
  RingConsumer(ring).clear();
  EXPECT_EQ(ring.size(), 0u);
  EXPECT_TRUE(push(ring, 42));
  EXPECT_EQ(drain(ring), std::vector<std::uint64_t>{42});
}

struct Indices {
  std::uint64_t head;
  std::uint64_t tail;
};

class CorruptRing : public testing::TestWithParam<Indices> {};

TEST_P(CorruptRing, IsReportedOnceAndEmptied) {
  constexpr std::uint64_t kGuard = 0xfeedface;
  struct {
    std::uint64_t before[8];
    SmallRing ring;
    std::uint64_t after[8];
  } memory{};
  for (auto& word : memory.before) word = kGuard;
  for (auto& word : memory.after) word = kGuard;
  RingIndices::set_indices(memory.ring, GetParam().head, GetParam().tail);

  EXPECT_LE(memory.ring.size(), SmallRing::capacity());
  EXPECT_FALSE(push(memory.ring, 1)) << "a producer does not write into a corrupt ring";
  std::uint64_t record = 7;
  EXPECT_EQ(pop(memory.ring, record), PopResult::kCorrupt);
  EXPECT_EQ(record, 7u);
  EXPECT_EQ(pop(memory.ring, record), PopResult::kEmpty);
  for (std::uint64_t i = 0; i < 8; ++i)
    EXPECT_TRUE(push(memory.ring, i)) << "usable again, with its whole capacity";
  EXPECT_EQ(drain(memory.ring).size(), 8u);
  for (const auto word : memory.before) EXPECT_EQ(word, kGuard);
  for (const auto word : memory.after) EXPECT_EQ(word, kGuard);
}

constexpr std::uint64_t kMax = std::numeric_limits<std::uint64_t>::max();
INSTANTIATE_TEST_SUITE_P(Indices, CorruptRing,
                         testing::Values(Indices{9, 0}, Indices{0, 1}, Indices{kMax, 0}, Indices{1u << 31, 3},
                                         Indices{5, kMax - 8}, Indices{kMax / 2, 1}));

TEST(Ring, SurvivesIndicesThatAreWrongButPossible) {
  // Seven records that were never pushed: undetectable here, harmless to memory,
  // and every record is checked afterwards.
  SmallRing ring;
  RingIndices::set_indices(ring, kMax - 1, kMax - 8);
  EXPECT_EQ(drain(ring).size(), 7u);
  EXPECT_TRUE(push(ring, 5)) << "indices wrap around";
  EXPECT_TRUE(push(ring, 6));
  EXPECT_TRUE(push(ring, 7));
  EXPECT_EQ(drain(ring), (std::vector<std::uint64_t>{5, 6, 7}));
}

TEST(Ring, CarriesCommands) {
  const auto ring = std::make_unique<Ring<Command, 64>>();
  Command in{};
  in.id = 17;
  in.kind = MotionKind::kGripper;
  in.end_q[3] = -0.5;
  ASSERT_TRUE(RingProducer(*ring).push(in));
  Command out{};
  ASSERT_EQ(RingConsumer(*ring).pop(out), PopResult::kOk);
  EXPECT_EQ(std::memcmp(&in, &out, sizeof(in)), 0);
}

TEST(Ring, KeepsItsIndicesApart) {
  EXPECT_EQ(alignof(SmallRing), kCacheLine);
  EXPECT_EQ(sizeof(SmallRing), 3 * kCacheLine) << "head, tail and slots each on lines of their own";
}

}  // namespace
}  // namespace corbot
