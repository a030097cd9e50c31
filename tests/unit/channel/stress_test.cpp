// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

#include "corbot/channel/layout.h"
#include "support/paths.h"

// Two threads at full speed, bounded in count. Without a sanitizer these look for torn and reordered records;
// in the tsan preset also for accesses that nothing orders.

namespace corbot {
namespace {

/// Every word is a function of the first: a mixture of two records does not verify.
using Pattern = std::array<std::uint64_t, 45>;  // as large as a Command

Pattern pattern(std::uint64_t number) {
  Pattern words;
  for (std::size_t i = 0; i < words.size(); ++i) words[i] = number * (2 * i + 1) + i;
  return words;
}
bool whole(const Pattern& words) {
  const std::uint64_t number = words[0];
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i] != number * (2 * i + 1) + i) return false;
  }
  return true;
}

constexpr std::uint64_t kRecords = CORBOT_SANITIZED ? 50'000 : 200'000;

TEST(Stress, RingKeepsOrderAndLosesNothing) {
  const auto ring = std::make_unique<Ring<Pattern, 8>>();
  std::thread thread([&] {
    RingProducer producer(*ring);
    for (std::uint64_t i = 1; i <= kRecords;) {
      if (producer.push(pattern(i))) {
        ++i;
      } else {
        std::this_thread::yield();
      }
    }
  });
  RingConsumer consumer(*ring);
  std::uint64_t bad = 0;
  for (std::uint64_t expected = 1; expected <= kRecords;) {
    Pattern record;
    const PopResult result = consumer.pop(record);
    if (result == PopResult::kOk) {
      bad += record[0] != expected || !whole(record);
      ++expected;
    } else {
      bad += result == PopResult::kCorrupt;
      std::this_thread::yield();
    }
  }
  thread.join();
  EXPECT_EQ(bad, 0u);
  EXPECT_EQ(ring->size(), 0u);
}

TEST(Stress, PushAllIsNeverSeenInPart) {
  const auto ring = std::make_unique<Ring<std::uint64_t, 8>>();
  constexpr std::uint64_t kBatch = 3;
  std::thread thread([&] {
    RingProducer producer(*ring);
    for (std::uint64_t i = 0; i < kRecords;) {
      const std::uint64_t batch[kBatch] = {i, i + 1, i + 2};
      if (producer.push_all(batch, kBatch)) {
        i += kBatch;
      } else {
        std::this_thread::yield();
      }
    }
  });
  RingConsumer consumer(*ring);
  std::uint64_t bad = 0;
  constexpr std::uint64_t kTotal = (kRecords + kBatch - 1) / kBatch * kBatch;
  for (std::uint64_t expected = 0; expected < kTotal;) {
    std::uint64_t record = 0;
    if (consumer.pop(record) != PopResult::kOk) {
      bad += expected % kBatch != 0;  // one record of a batch seen: the rest must be there
      std::this_thread::yield();
      continue;
    }
    bad += record != expected;
    ++expected;
  }
  thread.join();
  EXPECT_EQ(bad, 0u);
}

TEST(Stress, SnapshotIsNeverTornAndNeverGoesBack) {
  const auto cell = std::make_unique<SnapshotCell<Pattern>>();
  std::atomic<bool> done{false};
  std::vector<std::uint64_t> bad(3, 0);
  std::vector<std::uint64_t> seen(3, 0);
  cell->store(pattern(1));
  std::vector<std::thread> readers;
  for (std::size_t r = 0; r < bad.size(); ++r) {
    readers.emplace_back([&, r] {
      std::uint64_t last = 0;
      do {
        Pattern record;
        if (!cell->load(record)) continue;
        bad[r] += !whole(record) || record[0] < last;
        last = record[0];
        ++seen[r];
      } while (!done.load());
    });
  }
  for (std::uint64_t i = 2; i <= kRecords; ++i) cell->store(pattern(i));
  done.store(true);
  for (auto& reader : readers) reader.join();
  for (std::size_t r = 0; r < bad.size(); ++r) EXPECT_EQ(bad[r], 0u) << "of " << seen[r] << " loads";
  Pattern last;
  ASSERT_TRUE(cell->load(last));
  EXPECT_EQ(last[0], kRecords);
}

TEST(Stress, TraceReturnsTheRecordAskedForOrNone) {
  const auto trace = std::make_unique<BasicTrace<Pattern, 16>>();
  std::atomic<bool> done{false};
  std::uint64_t bad = 0;
  std::uint64_t read = 0;
  std::thread reader([&] {
    do {
      const std::uint64_t next = trace->next();
      for (std::uint64_t back = 1; back <= 16 && back <= next; ++back) {
        Pattern record;
        if (!trace->read(next - back, record)) continue;
        bad += record[0] != next - back || !whole(record);
        ++read;
      }
    } while (!done.load());
  });
  for (std::uint64_t i = 0; i < kRecords; ++i) trace->append(pattern(i));
  done.store(true);
  reader.join();
  EXPECT_EQ(bad, 0u);
  EXPECT_GT(read, 0u);
}

}  // namespace
}  // namespace corbot
