// SPDX-License-Identifier: Apache-2.0
#include "corbot/channel/ring.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <thread>

#include "ring_access.h"

namespace corbot {
namespace {

using SmallRing = Ring<std::uint64_t, 8>;

TEST(RingHandles, KeepOrderAndFullness) {
  SmallRing ring;
  RingProducer producer(ring);
  RingConsumer consumer(ring);
  std::uint64_t in = 0;
  std::uint64_t out = 0;
  std::uint64_t record = 0;
  EXPECT_EQ(consumer.pop(record), PopResult::kEmpty);
  for (int turn = 0; turn < 100; ++turn) {
    while (producer.push(in)) ++in;
    ASSERT_EQ(in - out, SmallRing::capacity());
    ASSERT_EQ(ring.size(), SmallRing::capacity());
    for (int i = 0; i <= turn % 8; ++i) {
      ASSERT_EQ(consumer.pop(record), PopResult::kOk);
      ASSERT_EQ(record, out++);
    }
  }
}

TEST(RingHandles, PushAllOrNone) {
  SmallRing ring;
  RingProducer producer(ring);
  RingConsumer consumer(ring);
  const std::uint64_t records[9] = {1, 2, 3, 4, 5, 6, 7, 8, 9};
  EXPECT_FALSE(producer.push_all(records, 9));
  ASSERT_TRUE(producer.push_all(records, 6));
  EXPECT_FALSE(producer.push_all(records, 3));
  EXPECT_EQ(ring.size(), 6u);
  std::uint64_t record = 0;
  ASSERT_EQ(consumer.pop(record), PopResult::kOk);
  EXPECT_TRUE(producer.push_all(records, 3));
  EXPECT_EQ(ring.size(), 8u);
}

TEST(RingHandles, ContinueWhereTheLastOnesEnded) {
  SmallRing ring;
  for (std::uint64_t i = 0; i < 5; ++i) ASSERT_TRUE(RingProducer(ring).push(i));
  std::uint64_t record = 0;
  for (std::uint64_t i = 0; i < 5; ++i) {
    ASSERT_EQ(RingConsumer(ring).pop(record), PopResult::kOk);
    EXPECT_EQ(record, i);
  }
  EXPECT_EQ(RingConsumer(ring).pop(record), PopResult::kEmpty);
}

TEST(RingHandles, ConsumerReportsAnImpossibleHeadOnceAndGoesOn) {
  SmallRing ring;
  RingConsumer consumer(ring);
  for (const std::uint64_t head : {std::uint64_t{9}, ~std::uint64_t{0}, std::uint64_t{3}}) {
    RingIndices::set_head(ring, head);
    std::uint64_t record = 7;
    EXPECT_EQ(consumer.pop(record), PopResult::kCorrupt) << head;
    EXPECT_EQ(record, 7u);
    EXPECT_EQ(consumer.pop(record), PopResult::kEmpty);
    ASSERT_TRUE(RingProducer(ring).push(head));
    EXPECT_EQ(consumer.pop(record), PopResult::kOk);
    EXPECT_EQ(record, head);
    if (head == ~std::uint64_t{0}) RingIndices::set_head(ring, 500);  // so that 3 is behind
    consumer.clear();
  }
}

TEST(RingHandles, ConsumerDoesNotReadItsOwnIndexBack) {
  SmallRing ring;
  RingConsumer consumer(ring);
  ASSERT_TRUE(RingProducer(ring).push(11));
  ASSERT_TRUE(RingProducer(ring).push(12));
  std::uint64_t record = 0;
  ASSERT_EQ(consumer.pop(record), PopResult::kOk);
  RingIndices::set_tail(ring, 0);  // would repeat 11
  ASSERT_EQ(consumer.pop(record), PopResult::kOk);
  EXPECT_EQ(record, 12u);
}

TEST(RingHandles, ProducerTakesAnImpossibleTailForFull) {
  SmallRing ring;
  RingProducer producer(ring);
  for (std::uint64_t i = 0; i < 8; ++i) ASSERT_TRUE(producer.push(i));
  for (const std::uint64_t tail : {std::uint64_t{9}, ~std::uint64_t{0}}) {
    RingIndices::set_tail(ring, tail);
    EXPECT_FALSE(producer.push(9));
    EXPECT_FALSE(producer.push_all(&tail, 1));
  }
  RingIndices::set_tail(ring, 1);
  EXPECT_TRUE(producer.push(9));
}

TEST(RingHandles, CarryBetweenThreadsInOrder) {
  constexpr std::uint64_t kRecords = 200'000;
  const auto ring = std::make_unique<SmallRing>();
  std::thread thread([&] {
    RingProducer producer(*ring);
    for (std::uint64_t i = 0; i < kRecords;) {
      if (producer.push(i)) {
        ++i;
      } else {
        std::this_thread::yield();
      }
    }
  });
  RingConsumer consumer(*ring);
  std::uint64_t bad = 0;
  for (std::uint64_t expected = 0; expected < kRecords;) {
    std::uint64_t record = 0;
    if (consumer.pop(record) == PopResult::kOk) {
      bad += record != expected++;
    } else {
      std::this_thread::yield();
    }
  }
  thread.join();
  EXPECT_EQ(bad, 0u);
}

}  // namespace
}  // namespace corbot
