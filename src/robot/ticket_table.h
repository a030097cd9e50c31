// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "corbot/channel/records.h"
#include "planner/planner.h"

namespace corbot {

enum class TicketState { kPending, kDone, kStopped, kFailed };

/// One accepted motion: one or two consecutive commands. Its number is that of the last of them.
struct Ticket {
  std::uint64_t first{};
  std::uint64_t last{};
  double duration_s{};          ///< of all its commands, at override 100 %
  double second_from_s{};       ///< when the second command begins, within duration_s
  std::uint64_t incarnation{};  ///< of the real-time task that it was handed to
  std::uint64_t epoch{};        ///< number of stops when its call came
  PlanStart end;                ///< where the arm rests when it is done
  bool cancelled{false};        ///< a Cancel has taken it back
  TicketState state{TicketState::kPending};
  std::string reason;  ///< empty unless stopped or failed
};

/// The accepted motions and their states. Thread-safe. Keeps every pending ticket and the last kKept ended.
class TicketTable {
 public:
  static constexpr std::size_t kKept = 1024;
  /// Not at once: a client that waits again and again would do nothing else.
  static constexpr std::chrono::milliseconds kSuspendedWait{400};

  void add(const Ticket& ticket);
  /// The motion was not handed over after all.
  void remove(std::uint64_t id);
  /// A command has its verdict. Unknown numbers (of an earlier servant) are ignored. A ticket ends with its
  /// last command; the first verdict other than done decides what it says.
  void complete(std::uint64_t command, Verdict verdict);
  /// Every pending ticket fails.
  void fail_pending(const std::string& reason);
  /// This one does, if it is pending.
  void fail(std::uint64_t id, const std::string& reason);
  /// The present task, and the highest command number that has ended there, every verdict up to it read: what
  /// is pending of an earlier task, or up to that number, will get no verdict, and fails.
  void reconcile(std::uint64_t incarnation, std::uint64_t ended_through);
  /// Marks the pending tickets from this one on as taken back. The number of the first command of the first
  /// of them and of the last command of the last; nothing when this one has ended.
  struct Range {
    std::uint64_t first;
    std::uint64_t last;
  };
  [[nodiscard]] std::optional<Range> cancel_from(std::uint64_t id);
  /// The task has taken back what was marked: ends it, but for the ticket that has commands up to `begun`,
  /// which waits for its verdict.
  void end_cancelled(std::uint64_t begun);
  /// Wakes every waiting thread, for good: the robot is being closed.
  void close();
  /// While true no wait lasts longer than kSuspendedWait: nothing can end a motion.
  void suspend_waits(bool suspended);

  [[nodiscard]] std::optional<Ticket> find(std::uint64_t id) const;
  /// Waits until the ticket has ended, the time has passed (no value: for ever), the table is closed or
  /// waits are suspended, and returns it as it then is. Nothing when there is no such ticket.
  [[nodiscard]] std::optional<Ticket> wait(std::uint64_t id,
                                           std::optional<std::chrono::steady_clock::time_point> until) const;
  /// Waits until no ticket with these numbers is pending, this process has run for `bound`, or the table is closed or
  /// waits are suspended. True in the first case.
  bool wait_ended(std::uint64_t from, std::uint64_t through, std::chrono::duration<double> bound) const;
  /// The one that ends last.
  [[nodiscard]] std::optional<Ticket> last_pending() const;
  [[nodiscard]] std::size_t pending() const;

 private:
  // With mutex_ held.
  void forget_old();
  void end(Ticket& ticket, TicketState state, const std::string& reason);

  mutable std::mutex mutex_;
  mutable std::condition_variable ended_;
  std::map<std::uint64_t, Ticket> tickets_;  // by number
  std::size_t pending_{0};
  bool closed_{false};
  bool suspended_{false};
};

}  // namespace corbot
