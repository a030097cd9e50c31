// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>
#include <set>

#include "model_atomics.h"

// The checker against textbook results: which outcomes of the classic litmus tests C++ allows, and how many
// executions there are. A checker that explores too little or too much fails here.

namespace corbot::model::litmus_test {
namespace {

constexpr auto kRelaxed = std::memory_order_relaxed;
constexpr auto kAcquire = std::memory_order_acquire;
constexpr auto kRelease = std::memory_order_release;

using Results = std::array<std::uint64_t, 4>;
std::set<Results> seen;

template <std::size_t kCount>
struct Litmus {
  static constexpr std::size_t kThreads = kCount;
  ModelAtomic<std::uint64_t> x;
  ModelAtomic<std::uint64_t> y;
  Results r{};
  void finish() { seen.insert(r); }
  Litmus() = default;
  Litmus(Litmus&&) noexcept { std::abort(); }  // a vector asks for it, and never uses it
};

template <class Program>
std::uint64_t count() {
  seen.clear();
  const Outcome outcome = explore<Program>();
  EXPECT_EQ(outcome.failure, "");
  return outcome.executions;
}

struct StoreBuffering : Litmus<2> {
  void run(std::size_t thread) {
    auto& mine = thread == 0 ? x : y;
    auto& other = thread == 0 ? y : x;
    mine.store(1, kRelease);
    r[thread] = other.load(kAcquire);
  }
};
TEST(LitmusTest, StoreBufferingAllowsAllFour) {
  EXPECT_EQ(count<StoreBuffering>(), 4u);
  EXPECT_EQ(seen, (std::set<Results>{{0, 0}, {0, 1}, {1, 0}, {1, 1}}));
}

template <std::memory_order kStore, std::memory_order kLoad>
struct MessagePassing : Litmus<2> {
  void run(std::size_t thread) {
    if (thread == 0) {
      x.store(1, kRelaxed);
      y.store(1, kStore);
    } else {
      r[0] = y.load(kLoad);
      r[1] = x.load(kRelaxed);
    }
  }
};
TEST(LitmusTest, MessagePassingForbidsTheStaleReadOnlyWithBothOrders) {
  EXPECT_EQ((count<MessagePassing<kRelease, kAcquire>>()), 3u);
  EXPECT_EQ(seen, (std::set<Results>{{0, 0}, {0, 1}, {1, 1}}));
  EXPECT_EQ((count<MessagePassing<kRelaxed, kAcquire>>()), 4u);
  EXPECT_EQ((count<MessagePassing<kRelease, kRelaxed>>()), 4u);
  EXPECT_EQ(seen, (std::set<Results>{{0, 0}, {0, 1}, {1, 0}, {1, 1}}));
}

struct Coherence : Litmus<2> {
  void run(std::size_t thread) {
    if (thread == 0) {
      x.store(1, kRelaxed);
      x.store(2, kRelaxed);
    } else {
      r[0] = x.load(kRelaxed);
      r[1] = x.load(kRelaxed);
    }
  }
};
TEST(LitmusTest, ReadsOfOneVariableNeverGoBack) {
  EXPECT_EQ(count<Coherence>(), 6u);
  EXPECT_EQ(seen, (std::set<Results>{{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}}));
}

struct IndependentReads : Litmus<4> {
  void run(std::size_t thread) {
    if (thread == 0) {
      x.store(1, kRelease);
    } else if (thread == 1) {
      y.store(1, kRelease);
    } else {
      const bool x_first = thread == 2;
      r[2 * (thread - 2)] = (x_first ? x : y).load(kAcquire);
      r[2 * (thread - 2) + 1] = (x_first ? y : x).load(kAcquire);
    }
  }
};
TEST(LitmusTest, IndependentReadersMayDisagree) {
  EXPECT_EQ(count<IndependentReads>(), 16u);
  EXPECT_TRUE(seen.contains({1, 0, 1, 0}));
}

template <std::memory_order kHandOn>
struct Chain : Litmus<3> {  // write-to-read causality: happens-before is transitive
  void run(std::size_t thread) {
    if (thread == 0) x.store(1, kRelease);
    if (thread == 1) {
      r[0] = x.load(kAcquire);
      y.store(1, kHandOn);
    }
    if (thread == 2) {
      r[1] = y.load(kAcquire);
      r[2] = x.load(kRelaxed);
    }
  }
};
TEST(LitmusTest, HappensBeforeIsTransitive) {
  count<Chain<kRelease>>();
  EXPECT_FALSE(seen.contains({1, 1, 0}));
  EXPECT_TRUE(seen.contains({0, 1, 0}));
  count<Chain<kRelaxed>>();
  EXPECT_TRUE(seen.contains({1, 1, 0}));
}

template <std::memory_order kStore>
struct GuardedCell : Litmus<2> {
  ModelCell<int> cell;
  void run(std::size_t thread) {
    if (thread == 0) {
      cell.write(1);
      x.store(1, kStore);
    } else if (x.load(kAcquire) == 1) {
      int value = 0;
      cell.read(value);
      require(value == 1, "stale cell");
    }
  }
};
TEST(LitmusTest, CellBehindAReleaseIsSafeAndBehindARelaxedStoreARace) {
  EXPECT_EQ((explore<GuardedCell<kRelease>>().failure), "");
  EXPECT_NE((explore<GuardedCell<kRelaxed>>().failure.find("data race")), std::string::npos);
}

struct LateWrite : Litmus<2> {  // a release covers what comes before it, not after
  ModelCell<int> cell;
  void run(std::size_t thread) {
    if (thread == 0) {
      x.store(1, kRelease);
      cell.write(1);
    } else if (x.load(kAcquire) == 1) {
      int value = 0;
      cell.read(value);
    }
  }
};
TEST(LitmusTest, CellWrittenAfterTheReleaseIsARace) {
  EXPECT_NE(explore<LateWrite>().failure.find("data race"), std::string::npos);
}

struct TwoWriters : Litmus<2> {
  void run(std::size_t) { x.store(1, kRelaxed); }
};
TEST(LitmusTest, RefusesWhatItDoesNotModel) {
  EXPECT_EQ(explore<TwoWriters>().failure, "a variable with two writers");
}

}  // namespace
}  // namespace corbot::model::litmus_test
