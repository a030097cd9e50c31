// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>

#include "corbot/channel/control_flags.h"

namespace corbot::rt {

/// The number of the newest stop request, which only rises. Every change of the stop segment is one request,
/// also back to an earlier value. A change that is taken back between two cycles is not seen. Therefore the
/// servant's requests are in its own segment, which no other process can write. Real-time safe.
class StopRequests {
 public:
  /// The number before the first request. A servant gives a request on the ORB the number of stops at its
  /// arrival, where 0 means "not known".
  static constexpr std::uint64_t kNone = 1;

  explicit StopRequests(const std::atomic<std::uint64_t>& shared) noexcept
      : shared_(shared), seen_(shared.load(std::memory_order_acquire)), newest_(seen_ + kNone) {}

  /// Called once a step, and before another servant's flags are read. Acquire: commands pushed before a Stop
  /// are in the ring when the Stop is seen.
  void read(const ControlFlags& servant) noexcept {
    const std::uint64_t count = shared_.load(std::memory_order_acquire);
    if (count != seen_) ++newest_;
    seen_ = count;
    const std::uint64_t of_servant = servant.stop_count.load(std::memory_order_acquire);
    if (is_earlier_stop(newest_, of_servant)) newest_ = of_servant;
  }
  [[nodiscard]] std::uint64_t newest() const noexcept { return newest_; }
  /// Tells whether this is the number of a Stop that the servant has requested since read().
  [[nodiscard]] bool is_to_be_read(const ControlFlags& servant, std::uint64_t number) const noexcept {
    return is_earlier_stop(newest_, number) &&
           !is_earlier_stop(servant.stop_count.load(std::memory_order_acquire), number);
  }

 private:
  const std::atomic<std::uint64_t>& shared_;
  std::uint64_t seen_;
  std::uint64_t newest_;
};

}  // namespace corbot::rt
