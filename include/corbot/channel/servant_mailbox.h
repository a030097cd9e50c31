// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

#include "corbot/channel/layout.h"

namespace corbot {

/// A servant that the cycle is to work for from now on.
struct ServantOffer {
  const ServantSegment* segment{nullptr};
  std::uint64_t session{0};  ///< number of the connection, rising
};

/// Inside the real-time task: the thread that receives servants hands their segments to the cycle, which takes
/// the newest at the beginning of a step, without waiting.
///
/// Memory orders. post() releases what it points to; take() acquires it. confirm() releases all reads that the
/// cycle made through earlier offers; whoever sees the number by connected(), which acquires it, may unmap them.
class ServantMailbox {
 public:
  /// The receiving thread. `offer` stays valid until connected() has reached its session, or a later one's.
  void post(const ServantOffer& offer) noexcept { offer_.store(&offer, std::memory_order_release); }
  /// Anyone. The session that the cycle works for; 0: none yet.
  [[nodiscard]] std::uint64_t connected() const noexcept {
    return connected_.load(std::memory_order_acquire);
  }

  /// Real-time safe; the cycle. Null when there is nothing new. An offer that was replaced before it was taken
  /// is never seen.
  [[nodiscard]] const ServantOffer* take() noexcept {
    if (offer_.load(std::memory_order_relaxed) == nullptr) return nullptr;
    return offer_.exchange(nullptr, std::memory_order_acquire);
  }
  /// Real-time safe; the cycle, when it no longer uses the offers before that session.
  void confirm(std::uint64_t session) noexcept { connected_.store(session, std::memory_order_release); }

 private:
  std::atomic<const ServantOffer*> offer_{nullptr};
  std::atomic<std::uint64_t> connected_{0};
};

}  // namespace corbot
