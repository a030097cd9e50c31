// SPDX-License-Identifier: Apache-2.0
#include "corbot/channel/snapshot_cell.h"

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <memory>

#include "corbot/channel/layout.h"
#include "corbot/channel/records.h"

namespace corbot {
namespace {

using Words = std::array<std::uint64_t, 4>;
constexpr Words kFirst{1, 2, 3, 4};
constexpr Words kSecond{5, 6, 7, 8};

/// Stops a writer in the middle, as SIGKILL would. The users of store() need it noexcept, so the policy
/// cannot throw. Its atomics count instead, and drop every store after the given one.
struct DyingAtomics : StdAtomics {
  inline static int stores_left = 1'000'000;
  template <class T>
  struct Atomic {
    T value{};
    Atomic() = default;
    Atomic(T initial) : value(initial) {}
    T load(std::memory_order) const noexcept { return value; }
    void store(T to, std::memory_order) noexcept {
      if (stores_left > 0) value = to;
      --stores_left;
    }
  };
};

TEST(SnapshotCell, HoldsNothingBeforeTheFirstStore) {
  SnapshotCell<Words> cell;
  Words out{9, 9, 9, 9};
  EXPECT_FALSE(cell.load(out));
  EXPECT_EQ(out, (Words{9, 9, 9, 9}));
}

TEST(SnapshotCell, ReturnsTheLatest) {
  SnapshotCell<Words> cell;
  Words out{};
  cell.store(kFirst);
  ASSERT_TRUE(cell.load(out));
  EXPECT_EQ(out, kFirst);
  cell.store(kSecond);
  ASSERT_TRUE(cell.load(out));
  EXPECT_EQ(out, kSecond);
}

TEST(SnapshotCell, CarriesASnapshotWhole) {
  const auto cell = std::make_unique<SnapshotCell<Snapshot>>();
  Snapshot in{};
  std::memset(static_cast<void*>(&in), 0x5a, sizeof(in));
  cell->store(in);
  Snapshot out{};
  ASSERT_TRUE(cell->load(out));
  EXPECT_EQ(std::memcmp(&in, &out, sizeof(in)), 0);
}

TEST(SnapshotCell, RefusesATornRecordUntilTheNextStoreWhereverTheWriterDied) {
  constexpr int kStores = 6;  // odd, four words, even
  for (int survived = 0; survived <= kStores; ++survived) {
    SnapshotCell<Words, DyingAtomics> cell;
    DyingAtomics::stores_left = 1'000'000;
    cell.store(kFirst);
    DyingAtomics::stores_left = survived;
    cell.store(kSecond);
    Words out{9, 9, 9, 9};
    const bool loaded = cell.load(out);
    if (survived == 0) {
      EXPECT_TRUE(loaded);
      EXPECT_EQ(out, kFirst);
    } else if (survived == kStores) {
      EXPECT_TRUE(loaded);
      EXPECT_EQ(out, kSecond);
    } else {
      EXPECT_FALSE(loaded) << "died after store " << survived;
      EXPECT_EQ(out, (Words{9, 9, 9, 9}));
    }
    DyingAtomics::stores_left = 1'000'000;
    cell.store(kSecond);  // the successor
    ASSERT_TRUE(cell.load(out));
    EXPECT_EQ(out, kSecond);
  }
}

TEST(LastSnapshot, FallsBackOnTheFlightRecorder) {
  const auto layout = std::make_unique<TaskSegment>();
  Snapshot out{};
  EXPECT_FALSE(last_snapshot(*layout, out));
  Snapshot in{};
  in.cycle = 41;
  layout->trace.append(in);
  ASSERT_TRUE(last_snapshot(*layout, out)) << "the cell has never been stored, or is torn";
  EXPECT_EQ(out.cycle, 41u);
  in.cycle = 42;
  layout->snapshot.store(in);
  ASSERT_TRUE(last_snapshot(*layout, out));
  EXPECT_EQ(out.cycle, 42u);
}

}  // namespace
}  // namespace corbot
