// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

#include "corbot/channel/layout.h"

namespace corbot {

/// A servant for which the cycle works from now on.
struct ServantOffer {
  const ServantSegment* segment{nullptr};
  std::uint64_t session{0};  ///< number of the connection, rising
};

/// Hands segments from the thread that receives servants to the cycle, inside the real-time task. The cycle
/// takes the newest at the beginning of a step, without waiting.
///
/// Memory orders. post() releases the data it points to; take() acquires the data. confirm() releases all
/// reads that the cycle made through earlier offers. A thread that acquires the number by connected() may
/// unmap those offers.
class ServantMailbox {
 public:
  /// For the receiving thread. `offer` stays valid until connected() has reached its session, or a later one.
  void post(const ServantOffer& offer) noexcept { offer_.store(&offer, std::memory_order_release); }
  /// Returns the session that the cycle works for; 0: none yet. For any thread.
  [[nodiscard]] std::uint64_t connected() const noexcept {
    return connected_.load(std::memory_order_acquire);
  }

  /// Real-time safe; for the cycle. Null if there is no new offer. An offer that was replaced before it was
  /// taken is never seen.
  [[nodiscard]] const ServantOffer* take() noexcept {
    if (offer_.load(std::memory_order_relaxed) == nullptr) return nullptr;
    return offer_.exchange(nullptr, std::memory_order_acquire);
  }
  /// Real-time safe; for the cycle, when it no longer uses the offers before that session.
  void confirm(std::uint64_t session) noexcept { connected_.store(session, std::memory_order_release); }

 private:
  std::atomic<const ServantOffer*> offer_{nullptr};
  std::atomic<std::uint64_t> connected_{0};
};

}  // namespace corbot
