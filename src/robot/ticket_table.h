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

/// The accepted motions, their states, and their copy for the next servant. Keeps every pending ticket and
/// the last kKept ended ones. Thread-safe.
class TicketTable {
 public:
  static constexpr std::size_t kKept = 1024;
  /// Longest wait while waits are suspended. Above zero, as a client that waits repeatedly would otherwise
  /// keep the processor busy.
  static constexpr std::chrono::milliseconds kSuspendedWait{400};

  using Records = decltype(ServantState::tickets);

  /// Copies every change to `records` from now on, one record for each of the last tickets. Called before any
  /// other function.
  void keep_in(Records& records) { records_ = &records; }
  /// Takes over the previous servant's tickets, ordered by number. Called before the first add().
  void inherit(const std::vector<Ticket>& former);
  /// Sets the function that is called with each ticket that ends. It runs with the lock held, so it must
  /// return at once and throw nothing. Called before any thread uses the table.
  void on_end(std::function<void(const Ticket&)> report) { report_end_ = std::move(report); }

  void add(const Ticket& ticket);
  /// Removes a motion that was not handed over after all.
  void remove(std::uint64_t id);
  /// Records the verdict of a command. Ignores unknown numbers and repeated verdicts. A ticket ends with its
  /// last command; the first verdict other than done determines its state.
  void complete(std::uint64_t command, Verdict verdict);
  /// Fails every pending ticket.
  void fail_pending(const std::string& reason);
  /// Fails this ticket if it is pending.
  void fail(std::uint64_t id, const std::string& reason);
  /// Compares the tickets with a snapshot of the present task; every verdict before the snapshot has been
  /// read. Fails tickets of an earlier task that are pending or ended there: they will get no verdict. Also
  /// fails tickets of an earlier servant that the task does not have.
  void reconcile(const Snapshot& before);
  /// Marks the pending tickets from this one on as cancelled. Returns the first command of the first ticket
  /// and the last command of the last one, or nothing if this ticket has ended.
  struct Range {
    std::uint64_t first;
    std::uint64_t last;
  };
  [[nodiscard]] std::optional<Range> cancel_from(std::uint64_t id);
  /// Ends the marked tickets, which the task has cancelled. A ticket with commands up to `begun` instead
  /// waits for its verdict.
  void end_cancelled(std::uint64_t begun);
  /// Returns the range of the pending tickets that are marked as cancelled.
  [[nodiscard]] std::optional<Range> cancelled() const;
  /// Wakes every waiting thread, for good: the robot is shutting down.
  void close();
  /// While `suspended`, no wait lasts longer than kSuspendedWait: no motion can end.
  void suspend_waits(bool suspended);

  [[nodiscard]] std::optional<Ticket> find(std::uint64_t id) const;
  /// Waits until the ticket has ended, the time has passed (no value: without limit), the table is closed or
  /// waits are suspended. Returns the ticket as it is then, or nothing if there is no such ticket.
  [[nodiscard]] std::optional<Ticket> wait(std::uint64_t id,
                                           std::optional<std::chrono::steady_clock::time_point> until) const;
  /// Waits until no ticket with these numbers is pending, this process has run for `bound`, the table is
  /// closed or waits are suspended. Returns true in the first case.
  bool wait_ended(std::uint64_t from, std::uint64_t through, std::chrono::duration<double> bound) const;
  /// Returns the pending ticket that ends last.
  [[nodiscard]] std::optional<Ticket> last_pending() const;
  [[nodiscard]] std::size_t pending() const;
  /// The tickets as a snapshot shows them.
  struct Shown {
    std::optional<Ticket> running;  ///< begun and not ended, if it is known
    std::size_t queued{};           ///< number of tickets that are pending and have not begun
  };
  [[nodiscard]] Shown shown_in(const Snapshot& snapshot) const;

 private:
  // The caller holds mutex_.
  void forget_old();
  void insert(const Ticket& ticket);
  void end(Ticket& ticket, TicketState state, TicketReason why, const std::string& reason);
  void end(Ticket& ticket, TicketState state, TicketReason why) { end(ticket, state, why, to_string(why)); }
  void keep(const Ticket& ticket);

  std::function<void(const Ticket&)> report_end_;
  mutable std::mutex mutex_;
  mutable std::condition_variable ended_;
  std::map<std::uint64_t, Ticket> tickets_;  // by number
  std::uint64_t inherited_through_{0};       // last number that earlier servants issued
  std::uint64_t added_{0};
  Records* records_{nullptr};
  std::size_t pending_{0};
  bool closed_{false};
  bool suspended_{false};
};

}  // namespace corbot
