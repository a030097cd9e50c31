// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "corbot/channel/layout.h"
#include "rt/cycle/command_check.h"

namespace corbot::rt {

/// Read before a servant has connected: no commands, no flags. Nobody writes it.
inline const ServantSegment kNoServant{};

/// The servant that is connected: its flags, and its commands behind those of the servants before it, which were
/// accepted and are carried out. Real-time safe.
class ConnectedServant {
 public:
  using Commands = decltype(ServantSegment::commands);
  static constexpr std::size_t kCapacity = Commands::capacity();
  /// Of its ring, and of what former ones have left.
  static constexpr std::size_t kMostCommands = 2 * kCapacity;

  /// What became of a former servant's commands. Where not all were taken, the last ones are missing.
  enum class Former { kTaken, kTooMuch, kCorrupt };

  explicit ConnectedServant(RingTail<>& tail) noexcept
      : tail_(tail), ring_(kNoServant.commands, tail), backlog_in_(backlog_), backlog_out_(backlog_) {
    ring_.clear();
  }
  ConnectedServant(const ConnectedServant&) = delete;
  ConnectedServant& operator=(const ConnectedServant&) = delete;

  [[nodiscard]] std::uint64_t next_command_id() const noexcept {
    return segment_->next_command_id.load(std::memory_order_acquire);
  }
  /// The last number that it or a former servant has used, as far as that can be; `last_done`: that the task knows of.
  /// A first task's numbers begin wherever its servant's are.
  [[nodiscard]] std::uint64_t last_used_id(std::uint64_t last_done) const noexcept {
    constexpr std::uint64_t kLargestFirstId = std::uint64_t{1} << 48;
    const std::uint64_t used = next_command_id() - 1;
    const bool can_be = last_done == 0 ? used < kLargestFirstId : used - last_done <= kLargestIdStep;
    return used > last_done && can_be ? used : last_done;
  }

  [[nodiscard]] PopResult pop(Command& command) noexcept {
    is_from_backlog_ = backlog_out_.pop(command) == PopResult::kOk;
    return is_from_backlog_ ? PopResult::kOk : ring_.pop(command);
  }
  /// Knots and pieces of the path that was popped last, as many as it says: from here on they are this process's own. Before the
  /// next pop, and before replace().
  void copy_rate(const Command& command, RateSlot& rate) const noexcept {
    if (is_from_backlog_) {
      copy_rate(command, backlog_rates_, rate);
    } else {
      copy_rate(command, segment_->rates, rate);
    }
  }
  /// Commands of former servants that are still to be popped.
  [[nodiscard]] std::size_t backlog() const noexcept { return backlog_.size(); }

  /// From now on another servant, and its commands behind what lies in its ring. One ring full of steps at most.
  Former replace(const ServantSegment& servant) noexcept {
    Former former = Former::kTaken;
    Command waiting{};
    for (std::size_t i = 0; i < kCapacity; ++i) {
      const PopResult result = ring_.pop(waiting);
      if (result == PopResult::kCorrupt) former = Former::kCorrupt;
      if (result != PopResult::kOk) break;
      if (!keep(waiting)) former = Former::kTooMuch;
    }
    segment_ = &servant;
    ring_ = RingConsumer(servant.commands, tail_);
    ring_.clear();
    return former;
  }

 private:
  /// What comes out of shared memory is checked later; here it leads nowhere but into the slots.
  template <std::size_t kSlots>
  static void copy_rate(const Command& command, const std::array<RateSlot, kSlots>& from,
                        RateSlot& to) noexcept {
    const KnotRange* const range = knots_of(command);
    if (range == nullptr || range->slot >= kSlots || range->pieces == 0) return;
    const RateSlot& slot = from[range->slot];
    std::copy_n(slot.knots.begin(), std::min<std::size_t>(range->count, kMostKnots), to.knots.begin());
    std::copy_n(slot.pieces.begin(), std::min<std::size_t>(range->pieces, rate::kMostPieces),
                to.pieces.begin());
  }

  /// In the backlog, in a slot of its own.
  bool keep(const Command& command) noexcept {
    const auto slot = static_cast<std::uint16_t>(kept_ % kCapacity);
    Command kept = command;
    if (KnotRange* const range = knots_of(kept); range != nullptr && range->slot < kKnotSlots)
      range->slot = slot;
    if (!backlog_in_.push(kept)) return false;
    copy_rate(command, segment_->rates, backlog_rates_[slot]);
    ++kept_;
    return true;
  }

  const ServantSegment* segment_{&kNoServant};
  RingTail<>& tail_;
  RingConsumer<Commands> ring_;
  Ring<Command, kCapacity> backlog_;
  RingProducer<Commands> backlog_in_;
  RingConsumer<Commands> backlog_out_;
  std::array<RateSlot, kCapacity> backlog_rates_{};
  std::uint64_t kept_{0};
  bool is_from_backlog_{false};
};

}  // namespace corbot::rt
