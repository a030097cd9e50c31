// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <thread>

namespace corbot {

/// A pointer that any number of threads read without a lock, and that one thread replaces. When replace() has
/// returned, no reader uses the previous object any more.
template <class T>
class Published {
 public:
  /// Calls `body`, which must be short, with the pointer, which may be null. Takes no lock, no memory and no
  /// system call.
  template <class Body>
  auto read(Body&& body) const noexcept {
    const Visit visit(readers_[round_.load() % readers_.size()]);
    return body(pointer_.load());
  }

  /// Replaces the pointer and waits for the readers of the previous one. One thread at a time may call it.
  void replace(const T* next) noexcept {
    pointer_.store(next);
    // A reader of the previous pointer is in one of the two counts by now, so each count must be seen at zero
    // once. New readers use the other count meanwhile, so they do not delay this thread.
    for (std::size_t i = 0; i < readers_.size(); ++i) {
      const std::atomic<std::uint32_t>& former = readers_[round_.fetch_add(1) % readers_.size()];
      while (former.load() != 0) std::this_thread::sleep_for(std::chrono::microseconds(50));
    }
  }

 private:
  class Visit {
   public:
    explicit Visit(std::atomic<std::uint32_t>& readers) noexcept : readers_(readers) {
      readers_.fetch_add(1);
    }
    Visit(const Visit&) = delete;
    Visit& operator=(const Visit&) = delete;
    ~Visit() { readers_.fetch_sub(1); }

   private:
    std::atomic<std::uint32_t>& readers_;
  };

  // All accesses are sequentially consistent: the argument in replace() needs one total order.
  std::atomic<const T*> pointer_{nullptr};
  std::atomic<std::uint32_t> round_{0};
  mutable std::array<std::atomic<std::uint32_t>, 2> readers_{};
};

}  // namespace corbot
