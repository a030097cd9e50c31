// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "corbot/arm/workspace_limits.h"
#include "corbot/channel/fingerprint.h"
#include "corbot/channel/layout.h"
#include "rt/cycle/command_check.h"

namespace corbot::rt {

/// The segment that is read before a servant has connected: no commands, no flags. No process writes it.
inline const ServantSegment kNoServant{};

/// The connected servant: its flags, and its commands. The accepted commands of the servants before it come
/// first. Real-time safe.
class ConnectedServant {
 public:
  using Commands = decltype(ServantSegment::commands);
  static constexpr std::size_t kCapacity = Commands::capacity();
  /// The greatest number of commands in its ring and in the backlog of previous servants.
  static constexpr std::size_t kMostCommands = 2 * kCapacity;

  /// The fate of a previous servant's commands. If not all were taken, the last ones are missing.
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
  /// Returns the last plausible number that this servant or a previous one has used. `last_done`: the last
  /// number that the task knows. A first task's numbers begin at its servant's.
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
  /// Copies the knots and pieces of the path that was popped last, as many as it names: from then on they are
  /// this process's own. Call it before the next pop, and before replace().
  void copy_rate(const Command& command, RateSlot& rate) const noexcept {
    if (is_from_backlog_) {
      copy_rate(command, backlog_rates_, rate);
    } else {
      copy_rate(command, segment_->rates, rate);
    }
  }
  /// Copies the further shapes of the workspace in the same way, if the command that was popped last names
  /// any. Returns false if there are none, or not such as number_of() names them.
  [[nodiscard]] bool copy_shapes(const Command& command, FurtherShapes& shapes) const noexcept {
    shapes.count = 0;
    if (command.shapes == 0) return true;
    if (is_from_backlog_)
      shapes = backlog_shapes_;
    else if (!segment_->shapes.load(shapes))
      return false;
    return are_sound(shapes) && number_of(shapes) == command.shapes;
  }
  /// Returns the number of commands of previous servants that are still to be popped.
  [[nodiscard]] std::size_t backlog() const noexcept { return backlog_.size(); }

  /// Switches to another servant. Keeps the commands of the previous ring in the backlog, and drops those
  /// that already lie in the new ring. Takes at most one ring full of steps.
  Former replace(const ServantSegment& servant) noexcept {
    Former former = Former::kTaken;
    Command waiting{};
    for (std::size_t i = 0; i < kCapacity; ++i) {
      const PopResult result = ring_.pop(waiting);
      if (result == PopResult::kCorrupt) former = Former::kCorrupt;
      if (result != PopResult::kOk) break;
      if (!keep(waiting)) former = Former::kTooMuch;
    }
    // A servant changes its shapes only while nothing is pending, so one place serves the backlog. A command
    // that names other shapes ends as malformed.
    if (backlog() > 0) (void)segment_->shapes.load(backlog_shapes_);
    segment_ = &servant;
    ring_ = RingConsumer(servant.commands, tail_);
    ring_.clear();
    return former;
  }

 private:
  /// Copies within the slots only; the values from shared memory are checked later.
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

  /// Keeps a command in the backlog, with its path in a slot of its own.
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
  FurtherShapes backlog_shapes_{};
  std::uint64_t kept_{0};
  bool is_from_backlog_{false};
};

}  // namespace corbot::rt
