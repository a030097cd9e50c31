// SPDX-License-Identifier: Apache-2.0
#pragma once

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
    return backlog_out_.pop(command) == PopResult::kOk ? PopResult::kOk : ring_.pop(command);
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
      if (!backlog_in_.push(waiting)) former = Former::kTooMuch;
    }
    segment_ = &servant;
    ring_ = RingConsumer(servant.commands, tail_);
    ring_.clear();
    return former;
  }

 private:
  const ServantSegment* segment_{&kNoServant};
  RingTail<>& tail_;
  RingConsumer<Commands> ring_;
  Ring<Command, kCapacity> backlog_;
  RingProducer<Commands> backlog_in_;
  RingConsumer<Commands> backlog_out_;
};

}  // namespace corbot::rt
