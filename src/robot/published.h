// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <thread>

namespace corbot {

/// Any number of threads read this pointer without a lock, and one thread replaces it. When replace() has returned, no
/// reader is left in what the pointer named before.
template <class T>
class Published {
 public:
  /// This calls `body`, which must be short, with the pointer, which may be null. It takes no lock, no memory and no system
  /// call.
  template <class Body>
  auto read(Body&& body) const noexcept {
    const Visit visit(readers_[round_.load() % readers_.size()]);
    return body(pointer_.load());
  }

  /// This waits for the readers of the former pointer. One thread at a time may call it.
  void replace(const T* next) noexcept {
    pointer_.store(next);
    // A reader that has the former pointer is in one of the counts by now. So each count need be seen at zero once. New
    // readers use the other count meanwhile, so that they do not hold this thread up.
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

  // All accesses are sequentially consistent: the argument above is about their one order.
  std::atomic<const T*> pointer_{nullptr};
  std::atomic<std::uint32_t> round_{0};
  mutable std::array<std::atomic<std::uint32_t>, 2> readers_{};
};

}  // namespace corbot
