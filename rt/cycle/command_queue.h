// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bitset>
#include <cstdint>

#include "corbot/channel/layout.h"

namespace corbot::rt {

/// The task's end of the command ring: takes commands one by one, gives them their verdicts, and knows which
/// numbers have ended and which of those to come a Cancel has taken back. Numbers come from the other process:
/// one that is too far away is none. Real-time safe, bounded.
class CommandQueue {
 public:
  enum class Fetch { kNone, kOne, kCorrupt };

  explicit CommandQueue(SegmentLayout& segment) noexcept
      : segment_(segment), commands_(segment.commands), completions_(segment.completions) {}

  /// For a task that adopts the segment: what was handed to the task before ends here, without a verdict. So
  /// does what that one had taken from the ring, what a corrupt ring has lost, and a number whose command is
  /// not in the ring yet: it is refused when it comes. `last_done`: of the task before, with what it ran.
  void adopt(std::uint64_t last_done) noexcept;

  /// Takes the next command from the ring, unless there is one taken and not begun. kCorrupt: the ring's
  /// indices were invalid, and what it held is lost.
  [[nodiscard]] Fetch fetch() noexcept;
  /// Valid while is_waiting().
  [[nodiscard]] const Command& waiting() const noexcept { return waiting_; }
  [[nodiscard]] bool is_waiting() const noexcept { return is_waiting_; }
  /// The waiting command is begun, or has its verdict.
  void release() noexcept { is_waiting_ = false; }

  /// Verdicts in the order of the commands. A full ring drops the completion (its reader is dead or stuck,
  /// and the cycle never waits); last_done() still says that the command is over.
  void complete(std::uint64_t id, Verdict verdict, std::uint64_t cycle) noexcept;
  /// Every number up to this has ended.
  [[nodiscard]] std::uint64_t last_done() const noexcept { return last_done_; }
  /// One more than the highest number that the servant has given away, as it says.
  [[nodiscard]] std::uint64_t next_number() const noexcept {
    return segment_.header.next_command_id.load(std::memory_order_acquire);
  }

  void cancel(const CancelRequest& request) noexcept;
  [[nodiscard]] bool is_cancelled(std::uint64_t id) const noexcept;

  [[nodiscard]] static constexpr std::size_t capacity() noexcept {
    return decltype(SegmentLayout::commands)::capacity();
  }

 private:
  /// More than can be outstanding: a ring full, what runs and what waits.
  static constexpr std::uint64_t kOutstanding = 128;

  void end_through(std::uint64_t id) noexcept;

  SegmentLayout& segment_;
  RingConsumer<decltype(SegmentLayout::commands)> commands_;
  RingProducer<decltype(SegmentLayout::completions)> completions_;
  Command waiting_{};
  bool is_waiting_{false};
  std::uint64_t last_done_{0};
  std::bitset<kOutstanding> cancelled_{};  ///< of the kOutstanding numbers after last_done_
};

}  // namespace corbot::rt
