// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string_view>
#include <thread>

#include "corbot/channel/ring.h"
#include "corbot/channel/snapshot_cell.h"

// One memory order weakened at a time. Run by expect_race.sh: 'right' must pass under ThreadSanitizer, each
// other variant must be reported as a data race. Exit code 77 where the sanitizer is not built in.

#if defined(__SANITIZE_THREAD__)  // GCC
#define CORBOT_TSAN true
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer)  // Clang
#define CORBOT_TSAN true
#endif
#endif
#ifndef CORBOT_TSAN
#define CORBOT_TSAN false
#endif

namespace {

using corbot::PopResult;
using corbot::StdAtomics;
using Record = std::array<std::uint64_t, 8>;

struct RelaxedPublish : StdAtomics {
  static constexpr std::memory_order kRingPublish = std::memory_order_relaxed;
};
struct RelaxedTake : StdAtomics {
  static constexpr std::memory_order kRingTake = std::memory_order_relaxed;
};
struct RelaxedFree : StdAtomics {
  static constexpr std::memory_order kRingFree = std::memory_order_relaxed;
};
struct RelaxedReuse : StdAtomics {
  static constexpr std::memory_order kRingReuse = std::memory_order_relaxed;
};
/// The cell's words are atomic, so a weaker order of them is not a data race by itself (tests/model shows the
/// torn record). The data race shows in a plain variable. One thread writes it before a store, another reads
/// it after the load that returned that store.
struct RelaxedSequence : StdAtomics {
  static constexpr std::memory_order kCellSequencePublish = std::memory_order_relaxed;
  static constexpr std::memory_order kCellWordStore = std::memory_order_relaxed;
};

template <class Atomics>
void run_ring() {
  constexpr std::uint64_t kRecords = 20'000;
  const auto ring = std::make_unique<corbot::Ring<Record, 4, Atomics>>();
  std::thread thread([&] {
    corbot::RingProducer producer(*ring);
    for (std::uint64_t i = 0; i < kRecords;) {
      if (producer.push(Record{i})) {
        ++i;
      } else {
        std::this_thread::yield();
      }
    }
  });
  corbot::RingConsumer consumer(*ring);
  std::uint64_t sum = 0;
  for (std::uint64_t i = 0; i < kRecords;) {
    Record record;
    if (consumer.pop(record) == PopResult::kOk) {
      sum += record[0];  // used, or the compiler drops the read that the sanitizer should see
      ++i;
    } else {
      std::this_thread::yield();
    }
  }
  thread.join();
  if (sum != kRecords * (kRecords - 1) / 2) std::puts("records lost or torn");
}

template <class Atomics>
void run_cell() {
  corbot::SnapshotCell<Record, Atomics> cell;
  std::uint64_t plain = 0;
  std::thread writer([&] {
    plain = 42;
    cell.store(Record{1});
  });
  Record record{};
  while (!cell.load(record)) std::this_thread::yield();
  if (plain != 42) std::puts("stale");
  writer.join();
}

}  // namespace

int main(int argc, char** argv) {
  if (!CORBOT_TSAN) {
    std::puts("skipped: needs ThreadSanitizer (preset tsan)");
    return 77;
  }
  const std::string_view variant = argc > 1 ? argv[1] : "";
  if (variant == "right") {
    run_ring<StdAtomics>();
    run_cell<StdAtomics>();
  } else if (variant == "relaxed_publish") {
    run_ring<RelaxedPublish>();
  } else if (variant == "relaxed_take") {
    run_ring<RelaxedTake>();
  } else if (variant == "relaxed_free") {
    run_ring<RelaxedFree>();
  } else if (variant == "relaxed_reuse") {
    run_ring<RelaxedReuse>();
  } else if (variant == "relaxed_sequence") {
    run_cell<RelaxedSequence>();
  } else {
    std::puts("unknown variant");
    return 2;
  }
  return 0;
}
