// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bitset>
#include <cstddef>
#include <cstdint>

#include "corbot/channel/layout.h"
#include "rt/cycle/connected_servant.h"

namespace corbot::rt {

/// The task's end of the command ring. It takes commands one by one and gives them their verdicts. It knows
/// the ended numbers, and the pending ones that a Cancel has ended. Numbers come from the other process: a
/// number that is too far away is invalid. Real-time safe, bounded.
class CommandQueue {
 public:
  enum class Fetch { kNone, kOne, kLost, kCorrupt };

  /// The greatest number of commands in the servant's ring and in the backlog of previous servants.
  static constexpr std::size_t kMost = ConnectedServant::kMostCommands;

  explicit CommandQueue(TaskSegment& task) noexcept
      : servant_(task.commands_tail), completions_(task.completions, kNoServant.completions_tail) {}

  /// Takes over from another task. `last_done`: the last number that the previous task ended or ran.
  void adopt(std::uint64_t last_done) noexcept { last_done_ = last_done; }
  /// Connects a servant. The commands in its ring end here, without a verdict. A number whose command is not
  /// in the ring yet also ends: the command is refused when it comes. The accepted commands of a previous
  /// servant go on. Returns false if the previous ring was corrupt and its commands are lost: see end_lost().
  [[nodiscard]] bool connect(const ServantSegment& servant, bool is_running) noexcept;
  /// Returns the number of commands of previous servants that are still to be fetched.
  [[nodiscard]] std::size_t backlog() const noexcept { return servant_.backlog(); }

  /// Takes the next command from the ring, unless one is taken and not begun. Called at rest. Returns kLost
  /// if the next numbers have no command any more; end_lost() must be called then. Returns kCorrupt in the
  /// same case if the ring's indices were invalid.
  [[nodiscard]] Fetch fetch() noexcept;
  /// Ends the lost numbers with their verdicts, in their turn: all commands before them have ended. Bounded.
  void end_lost(std::uint64_t cycle) noexcept;
  /// Valid while is_waiting().
  [[nodiscard]] const Command& waiting() const noexcept { return waiting_; }
  [[nodiscard]] bool is_waiting() const noexcept { return is_waiting_; }
  /// Returns the knots and pieces of a path, as many as it names, within bounds; else none. The first call
  /// copies them.
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
  /// Returns the further shapes of the workspace with which the waiting command was planned, or null if the
  /// servant's are others. Once they are copied they stay.
  [[nodiscard]] const FurtherShapes* waiting_shapes() noexcept {
    take_knots();
    return has_shapes_ ? &waiting_shapes_ : nullptr;
  }
  /// Releases the waiting command, which is begun or has its verdict.
  void release() noexcept { is_waiting_ = false; }

  /// Gives verdicts in the order of the commands. A full ring drops the completion: its reader is dead or
  /// stuck, and the cycle never waits. last_done() still reports that the command is over.
  void complete(std::uint64_t id, Verdict verdict, std::uint64_t cycle) noexcept;
  /// Every number up to this one has ended.
  [[nodiscard]] std::uint64_t last_done() const noexcept { return last_done_; }

  void cancel(const CancelRequest& request) noexcept;
  [[nodiscard]] bool is_cancelled(std::uint64_t id) const noexcept;

 private:
  /// A bound above the outstanding commands: a full ring, the running and the waiting command.
  static constexpr std::uint64_t kOutstanding = 128;

  void take_knots() noexcept {
    if (has_knots_) return;
    servant_.copy_rate(waiting_, waiting_rate_);
    has_shapes_ = servant_.copy_shapes(waiting_, waiting_shapes_);
    has_knots_ = true;
  }
  void end_through(std::uint64_t id) noexcept;
  /// Tells whether the next numbers, from last_done_ on, have no command.
  [[nodiscard]] bool is_lost_next() const noexcept {
    return lost_through_ > last_done_ && (!is_waiting_ || waiting_.id > lost_through_);
  }

  ConnectedServant servant_;
  RingProducer<decltype(TaskSegment::completions)> completions_;
  Command waiting_{};
  RateSlot waiting_rate_{};
  FurtherShapes waiting_shapes_{};
  bool has_shapes_{false};
  bool has_knots_{false};
  bool is_waiting_{false};
  std::uint64_t last_done_{0};
  std::uint64_t lost_through_{0};          ///< untaken numbers up to this one will never be taken
  std::bitset<kOutstanding> cancelled_{};  ///< of the kOutstanding numbers after last_done_
};

}  // namespace corbot::rt
