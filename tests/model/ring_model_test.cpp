// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <iostream>
#include <string>

#include "corbot/channel/ring.h"
#include "model_atomics.h"

// Ring and its two ends, the very templates, under every execution: capacity 2, so that slots are reused and
// both full and empty are met. Bounds: kPushes and kPops attempts, of which some fail.

namespace corbot::model::ring_model_test {
namespace {

using Record = std::uint64_t;

template <class Atomics>
struct Ends {
  using RingType = Ring<Record, 2, Atomics>;
  RingType ring;
  auto producer() { return RingProducer(ring); }
  auto consumer() { return RingConsumer(ring); }
};

template <class Atomics, int kPushes, int kPops>
struct OneByOne {
  static constexpr std::size_t kThreads = 2;
  Ends<Atomics> ends;
  Record pushed{0};
  Record popped{0};

  OneByOne() = default;
  OneByOne(OneByOne&&) noexcept { std::abort(); }

  void run(std::size_t thread) {
    if (thread == 0) {
      auto producer = ends.producer();
      for (int i = 0; i < kPushes; ++i) pushed += producer.push(pushed + 1);
    } else {
      auto consumer = ends.consumer();
      for (int i = 0; i < kPops; ++i) take(consumer);
    }
  }
  /// Alone again: what is left must be there, in order, and nothing else.
  void finish() {
    auto consumer = ends.consumer();
    while (popped < pushed) {
      const Record before = popped;
      take(consumer);
      if (popped == before) return require(false, "a record is lost");
    }
    Record record = 0;
    require(consumer.pop(record) == PopResult::kEmpty, "a record too many");
  }
  template <class Consumer>
  void take(Consumer& consumer) {
    Record record = 0;
    const PopResult result = consumer.pop(record);
    require(result != PopResult::kCorrupt, "the indices are corrupt");
    if (result == PopResult::kOk) require(record == ++popped, "wrong record");
  }
};

/// Batches of two through push_all: a consumer that has seen the first gets the second at the next attempt.
template <class Atomics>
struct Batches {
  static constexpr std::size_t kThreads = 2;
  Ends<Atomics> ends;
  Record pushed{0};
  Record popped{0};

  Batches() = default;
  Batches(Batches&&) noexcept { std::abort(); }

  void run(std::size_t thread) {
    if (thread == 0) {
      auto producer = ends.producer();
      for (int i = 0; i < 4; ++i) {
        const Record batch[2] = {pushed + 1, pushed + 2};
        if (producer.push_all(batch, 2)) pushed += 2;
      }
    } else {
      auto consumer = ends.consumer();
      for (int i = 0; i < 6; ++i) {
        Record record = 0;
        const PopResult result = consumer.pop(record);
        require(result != PopResult::kCorrupt, "the indices are corrupt");
        if (result == PopResult::kOk) {
          require(record == ++popped, "wrong record");
        } else {
          require(popped % 2 == 0, "half a batch");
        }
      }
    }
  }
  void finish() { require(popped <= pushed, "more taken than given"); }
};

template <class Program>
void expect_right() {
  const Outcome outcome = explore<Program>();
  EXPECT_EQ(outcome.failure, "");
  EXPECT_GT(outcome.executions, 100u);
  std::cout << outcome.executions << " executions, " << outcome.infeasible << " infeasible\n";
}

TEST(RingModel, EveryExecutionIsRight) { expect_right<OneByOne<ModelAtomics, 8, 8>>(); }
TEST(RingModel, EveryExecutionOfBatchesIsRight) { expect_right<Batches<ModelAtomics>>(); }

// Each order is needed: without it the checker finds the race.
struct RelaxedPublish : ModelAtomics {
  static constexpr std::memory_order kRingPublish = std::memory_order_relaxed;
};
struct RelaxedTake : ModelAtomics {
  static constexpr std::memory_order kRingTake = std::memory_order_relaxed;
};
struct RelaxedFree : ModelAtomics {
  static constexpr std::memory_order kRingFree = std::memory_order_relaxed;
};
struct RelaxedReuse : ModelAtomics {
  static constexpr std::memory_order kRingReuse = std::memory_order_relaxed;
};

template <class Atomics>
class BrokenRing : public testing::Test {};
using Broken = testing::Types<RelaxedPublish, RelaxedTake, RelaxedFree, RelaxedReuse>;
TYPED_TEST_SUITE(BrokenRing, Broken);

TYPED_TEST(BrokenRing, IsCaught) {
  const std::string failure = explore<OneByOne<TypeParam, 3, 3>>().failure;
  EXPECT_NE(failure.find("data race"), std::string::npos) << failure;
}

}  // namespace
}  // namespace corbot::model::ring_model_test
