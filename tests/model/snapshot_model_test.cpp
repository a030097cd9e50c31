// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>
#include <iostream>

#include "corbot/channel/snapshot_cell.h"
#include "corbot/channel/trace.h"
#include "model_atomics.h"

// SnapshotCell and BasicTrace, the very templates, under every execution. Bounds: words a record, stores, and
// attempts as the programs say.

namespace corbot::model::snapshot_model_test {
namespace {

template <std::size_t kWords>
using Words = std::array<std::uint64_t, kWords>;

template <std::size_t kWords>
Words<kWords> filled(std::uint64_t value) {
  Words<kWords> words;
  words.fill(value);
  return words;
}

/// One writer, kReaders readers; record n has n in every word. A reader never sees a mixture,
/// and never goes back.
template <class Atomics, std::size_t kWords, int kStores, std::size_t kReaders, int kLoads>
struct Seqlock {
  static constexpr std::size_t kThreads = 1 + kReaders;
  SnapshotCell<Words<kWords>, Atomics> cell;
  std::array<int, kReaders> loaded{};
  inline static int most_loaded =
      0;  ///< over all executions: the test is void if no reader ever loads anything

  Seqlock() = default;
  Seqlock(Seqlock&&) noexcept { std::abort(); }

  void run(std::size_t thread) {
    if (thread == 0) {
      for (int i = 1; i <= kStores; ++i) cell.store(filled<kWords>(static_cast<std::uint64_t>(i)));
      return;
    }
    std::uint64_t last = 0;
    for (int i = 0; i < kLoads; ++i) {
      Words<kWords> words{};
      if (!cell.try_load(words)) continue;
      for (const std::uint64_t word : words) require(word == words[0], "torn record");
      require(words[0] >= 1, "a record that was never stored");
      require(words[0] >= last, "went back");
      last = words[0];
      ++loaded[thread - 1];
    }
  }
  void finish() {
    for (const int count : loaded) most_loaded = std::max(most_loaded, count);
    Words<kWords> words{};
    require(cell.try_load(words) && words == filled<kWords>(kStores),
            "the last record is not there at the end");
  }
};

template <class Program>
void expect_right(int loads) {
  Program::most_loaded = 0;
  const Outcome outcome = explore<Program>();
  EXPECT_EQ(outcome.failure, "");
  EXPECT_GT(outcome.executions, 100u);
  EXPECT_EQ(Program::most_loaded, loads) << "the model never lets a reader through";
  std::cout << outcome.executions << " executions, " << outcome.infeasible << " infeasible\n";
}

TEST(SnapshotModel, TwoWordsFiveStoresFourLoads) { expect_right<Seqlock<ModelAtomics, 2, 5, 1, 4>>(4); }
TEST(SnapshotModel, FourWordsThreeStoresThreeLoads) { expect_right<Seqlock<ModelAtomics, 4, 3, 1, 3>>(3); }
TEST(SnapshotModel, TwoReaders) { expect_right<Seqlock<ModelAtomics, 2, 3, 2, 2>>(2); }

// Each order, and the odd sequence, is needed.
struct RelaxedWordStore : ModelAtomics {
  static constexpr std::memory_order kCellWordStore = std::memory_order_relaxed;
};
struct RelaxedWordLoad : ModelAtomics {
  static constexpr std::memory_order kCellWordLoad = std::memory_order_relaxed;
};
struct RelaxedPublish : ModelAtomics {
  static constexpr std::memory_order kCellSequencePublish = std::memory_order_relaxed;
};
struct RelaxedSequenceLoad : ModelAtomics {
  static constexpr std::memory_order kCellSequenceLoad = std::memory_order_relaxed;
};
struct NeverOdd : ModelAtomics {
  static constexpr unsigned kCellWriting = 0;
};

template <class Atomics>
class BrokenCell : public testing::Test {};
using Broken =
    testing::Types<RelaxedWordStore, RelaxedWordLoad, RelaxedPublish, RelaxedSequenceLoad, NeverOdd>;
TYPED_TEST_SUITE(BrokenCell, Broken);

TYPED_TEST(BrokenCell, IsCaught) {
  EXPECT_EQ((explore<Seqlock<TypeParam, 2, 2, 1, 1>>().failure), "torn record");
}

/// Two records into two slots: none is overwritten, so each one announced by next() must be readable.
template <class Atomics>
struct Recorder {
  static constexpr std::size_t kThreads = 2;
  BasicTrace<std::uint64_t, 2, Atomics> trace;

  Recorder() = default;
  Recorder(Recorder&&) noexcept { std::abort(); }

  void run(std::size_t thread) {
    if (thread == 0) {
      trace.append(10);
      trace.append(11);
      return;
    }
    const std::uint64_t next = trace.next();
    for (std::uint64_t i = 0; i < next; ++i) {
      std::uint64_t record = 0;
      require(trace.read(i, record), "an announced record is not there");
      require(record == 10 + i, "wrong record");
    }
  }
  void finish() {}
};

/// Three records into two slots: record 0 is lost to the third, and never mistaken for it.
struct Overwriting {
  static constexpr std::size_t kThreads = 2;
  BasicTrace<std::uint64_t, 2, ModelAtomics> trace;

  Overwriting() = default;
  Overwriting(Overwriting&&) noexcept { std::abort(); }

  void run(std::size_t thread) {
    if (thread == 0) {
      for (std::uint64_t i = 0; i < 3; ++i) trace.append(10 + i);
      return;
    }
    std::uint64_t record = 0;
    if (trace.read(0, record)) require(record == 10, "another record under this index");
  }
  void finish() {
    std::uint64_t record = 0;
    require(!trace.read(0, record) && trace.read(2, record) && record == 12, "wrong records at the end");
  }
};

struct RelaxedTracePublish : ModelAtomics {
  static constexpr std::memory_order kTracePublish = std::memory_order_relaxed;
};
struct RelaxedTraceObserve : ModelAtomics {
  static constexpr std::memory_order kTraceObserve = std::memory_order_relaxed;
};

TEST(TraceModel, EveryExecutionIsRight) {
  for (const Outcome& outcome : {explore<Recorder<ModelAtomics>>(), explore<Overwriting>()}) {
    EXPECT_EQ(outcome.failure, "");
    std::cout << outcome.executions << " executions, " << outcome.infeasible << " infeasible\n";
  }
}

TEST(TraceModel, BothOrdersAreNeeded) {
  EXPECT_EQ(explore<Recorder<RelaxedTracePublish>>().failure, "an announced record is not there");
  EXPECT_EQ(explore<Recorder<RelaxedTraceObserve>>().failure, "an announced record is not there");
}

}  // namespace
}  // namespace corbot::model::snapshot_model_test
