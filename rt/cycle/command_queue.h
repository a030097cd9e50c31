// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bitset>
#include <cstddef>
#include <cstdint>

#include "corbot/channel/layout.h"
#include "rt/cycle/connected_servant.h"

namespace corbot::rt {

/// The task's end of the command ring: takes commands one by one, gives them their verdicts, and knows which
/// numbers have ended and which of those to come a Cancel has taken back. Numbers come from the other process:
/// one that is too far away is none. Real-time safe, bounded.
class CommandQueue {
 public:
  enum class Fetch { kNone, kOne, kLost, kCorrupt };

  /// Of its servant's ring, and of what former ones have left.
  static constexpr std::size_t kMost = ConnectedServant::kMostCommands;

  explicit CommandQueue(TaskSegment& task) noexcept
      : servant_(task.commands_tail), completions_(task.completions, kNoServant.completions_tail) {}

  /// For a task that takes over from another. `last_done`: of the task before, with what it ran.
  void adopt(std::uint64_t last_done) noexcept { last_done_ = last_done; }
  /// The servant that connects: what its ring holds ends here, without a verdict, and so does a number whose command
  /// is not in the ring yet: it is refused when it comes. What a former servant was accepted for goes on. False when
  /// that one's ring was corrupt, and what it held is lost: see end_lost().
  [[nodiscard]] bool connect(const ServantSegment& servant, bool is_running) noexcept;
  /// Commands of former servants that are still to be fetched.
  [[nodiscard]] std::size_t backlog() const noexcept { return servant_.backlog(); }

  /// At rest. Takes the next command from the ring, unless there is one taken and not begun. kLost: the numbers that
  /// are next have no command any more, and end_lost() is to be called. kCorrupt: likewise, and the ring's indices were
  /// invalid.
  [[nodiscard]] Fetch fetch() noexcept;
  /// Their verdicts, in their turn: what came before them has ended. Bounded.
  void end_lost(std::uint64_t cycle) noexcept;
  /// Valid while is_waiting().
  [[nodiscard]] const Command& waiting() const noexcept { return waiting_; }
  [[nodiscard]] bool is_waiting() const noexcept { return is_waiting_; }
  /// The knots and pieces of a path, as many as it says, within bounds; else none. They are copied when they are first asked for.
  [[nodiscard]] rate::RatePath waiting_rate() noexcept {
    take_knots();
    const KnotRange* const range = knots_of(waiting_);
    if (range == nullptr || range->pieces == 0 || range->count == 0) return {};
    const std::size_t knots = std::min<std::size_t>(range->count, kMostKnots);
    const std::size_t pieces = std::min<std::size_t>(range->pieces, rate::kMostPieces);
    const double length_s = waiting_rate_.knots[knots - 1].lambda_s;
    return {{waiting_rate_.knots.data(), knots},
            {{waiting_rate_.pieces.data(), pieces}, waiting_.duration_s, length_s}};
  }
  /// The waiting command is begun, or has its verdict.
  void release() noexcept { is_waiting_ = false; }

  /// Verdicts in the order of the commands. A full ring drops the completion (its reader is dead or stuck,
  /// and the cycle never waits); last_done() still says that the command is over.
  void complete(std::uint64_t id, Verdict verdict, std::uint64_t cycle) noexcept;
  /// Every number up to this has ended.
  [[nodiscard]] std::uint64_t last_done() const noexcept { return last_done_; }

  void cancel(const CancelRequest& request) noexcept;
  [[nodiscard]] bool is_cancelled(std::uint64_t id) const noexcept;

 private:
  /// More than can be outstanding: a ring full, what runs and what waits.
  static constexpr std::uint64_t kOutstanding = 128;

  void take_knots() noexcept {
    if (has_knots_) return;
    servant_.copy_rate(waiting_, waiting_rate_);
    has_knots_ = true;
  }
  void end_through(std::uint64_t id) noexcept;
  /// Numbers without a command, from last_done_ on, are next.
  [[nodiscard]] bool is_lost_next() const noexcept {
    return lost_through_ > last_done_ && (!is_waiting_ || waiting_.id > lost_through_);
  }

  ConnectedServant servant_;
  RingProducer<decltype(TaskSegment::completions)> completions_;
  Command waiting_{};
  RateSlot waiting_rate_{};
  bool has_knots_{false};
  bool is_waiting_{false};
  std::uint64_t last_done_{0};
  std::uint64_t lost_through_{0};          ///< numbers up to this that are not taken by now never will be
  std::bitset<kOutstanding> cancelled_{};  ///< of the kOutstanding numbers after last_done_
};

}  // namespace corbot::rt
