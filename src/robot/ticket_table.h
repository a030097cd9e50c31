// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "robot/ticket.h"

namespace corbot {

/// The accepted motions and their states, and their copy for the servant after this one. Thread-safe. Keeps every
/// pending ticket and the last kKept ended.
class TicketTable {
 public:
  static constexpr std::size_t kKept = 1024;
  /// Not at once: a client that waits again and again would do nothing else.
  static constexpr std::chrono::milliseconds kSuspendedWait{400};

  using Records = decltype(ServantState::tickets);

  /// Before all else. From now on every change is there, too: a record for each of the last tickets.
  void keep_in(Records& records) { records_ = &records; }
  /// Before the first add(): those of the servant before this one, in the order of their numbers.
  void inherit(const std::vector<Ticket>& former);
  /// Called with each ticket that ends, with the lock: returns at once and throws nothing. Before any other call.
  void on_end(std::function<void(const Ticket&)> report) { report_end_ = std::move(report); }

  void add(const Ticket& ticket);
  /// The motion was not handed over after all.
  void remove(std::uint64_t id);
  /// A command has its verdict. Unknown numbers, and a verdict that is read twice, are ignored. A ticket ends with its
  /// last command; the first verdict other than done decides what it says.
  void complete(std::uint64_t command, Verdict verdict);
  /// Every pending ticket fails.
  void fail_pending(const std::string& reason);
  /// This one does, if it is pending.
  void fail(std::uint64_t id, const std::string& reason);
  /// A snapshot of the present task, every verdict that was out before it read: what is pending of an earlier task, or
  /// has ended there, will get no verdict, and fails. So does what is pending of an earlier servant and not there.
  void reconcile(const Snapshot& before);
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
  /// What is pending and marked as taken back.
  [[nodiscard]] std::optional<Range> cancelled() const;
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
  /// What a snapshot shows of them.
  struct Shown {
    std::optional<Ticket> running;  ///< begun and not ended, where it is known
    std::size_t queued{};           ///< pending, and not begun
  };
  [[nodiscard]] Shown shown_in(const Snapshot& snapshot) const;

 private:
  // With mutex_ held.
  void forget_old();
  void insert(const Ticket& ticket);
  void end(Ticket& ticket, TicketState state, TicketReason why, const std::string& reason);
  void end(Ticket& ticket, TicketState state, TicketReason why) { end(ticket, state, why, to_string(why)); }
  void keep(const Ticket& ticket);

  std::function<void(const Ticket&)> report_end_;
  mutable std::mutex mutex_;
  mutable std::condition_variable ended_;
  std::map<std::uint64_t, Ticket> tickets_;  // by number
  std::uint64_t inherited_through_{0};       // numbers that earlier servants have given away
  std::uint64_t added_{0};
  Records* records_{nullptr};
  std::size_t pending_{0};
  bool closed_{false};
  bool suspended_{false};
};

}  // namespace corbot
