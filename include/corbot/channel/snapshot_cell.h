// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "corbot/channel/atomics.h"

namespace corbot {

/// The latest value of a record in shared memory: one writer, any number of readers; all zero = never stored.
/// It is a sequence lock over atomic words. store() is wait-free; load() retries a bounded number of times.
/// Both are real-time safe.
///
/// Memory orders. The writer makes the sequence odd (relaxed), stores the words with release, then makes the
/// sequence even with release. The reader loads the sequence with acquire, the words with acquire, and the
/// sequence again (relaxed). It keeps the copy if both sequences are the same even number s. Then every word
/// is of the store that ended with s:
/// * Not older. The first load of s synchronises with its release store, so the words of that store happen
///   before the reader's loads. By coherence the loads return nothing older. (Sequence relaxed: stale words
///   under a new number.)
/// * Not newer. A later store has stored its words with release after it had made the sequence odd. The
///   acquire load that returns such a word synchronises with it. So the reader's second load of the sequence
///   returns the odd value or a later one, not s. (Words relaxed on either side: the second load may still
///   return s, and the copy is torn.) The usual remedy is a pair of fences. They are not used, because
///   ThreadSanitizer does not model them.
/// If the sequence were not odd during the store, a reader in the middle of it would see s before and after.
/// A writer that dies in the middle leaves the sequence odd. Then load() fails until the next store(), which
/// continues from there.
template <class Record, class Atomics = StdAtomics>
class SnapshotCell {
  static_assert(std::is_trivially_copyable_v<Record> && sizeof(Record) % sizeof(std::uint64_t) == 0);

 public:
  static constexpr std::size_t kWords = sizeof(Record) / sizeof(std::uint64_t);
  static constexpr int kAttempts = Atomics::kCellAttempts;

  /// For the one writer.
  void store(const Record& record) noexcept {
    std::uint64_t words[kWords];
    std::memcpy(words, &record, sizeof(Record));
    const std::uint64_t even = sequence_.load(std::memory_order_relaxed) & ~std::uint64_t{1};
    sequence_.store(even + Atomics::kCellWriting, std::memory_order_relaxed);
    for (std::size_t i = 0; i < kWords; ++i) words_[i].store(words[i], Atomics::kCellWordStore);
    sequence_.store(even + 2, Atomics::kCellSequencePublish);
  }

  /// For any reader. False if nothing has ever been stored, or if the writer overtook each attempt; `record`
  /// is then unchanged.
  [[nodiscard]] bool load(Record& record) const noexcept {
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      if (try_load(record)) return true;
    }
    return false;
  }

  /// For any reader. Makes one attempt.
  [[nodiscard]] bool try_load(Record& record) const noexcept {
    const std::uint64_t before = sequence_.load(Atomics::kCellSequenceLoad);
    if (before == 0 || (before & 1) != 0) return false;
    std::uint64_t words[kWords];
    for (std::size_t i = 0; i < kWords; ++i) words[i] = words_[i].load(Atomics::kCellWordLoad);
    if (sequence_.load(std::memory_order_relaxed) != before) return false;
    std::memcpy(&record, words, sizeof(Record));
    return true;
  }

 private:
  alignas(kCacheLine) typename Atomics::template Atomic<std::uint64_t> sequence_{0};
  typename Atomics::template Atomic<std::uint64_t> words_[kWords]{};
};

}  // namespace corbot
