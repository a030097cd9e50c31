// SPDX-License-Identifier: Apache-2.0
#include "robot/ticket_table.h"

#include <algorithm>

#include "corbot/running_time.h"

namespace corbot {
namespace {

constexpr std::chrono::milliseconds kLongestLook{20};

}  // namespace

void TicketTable::inherit(const std::vector<Ticket>& former) {
  const std::lock_guard lock(mutex_);
  for (const Ticket& ticket : former) {
    insert(ticket);
    inherited_through_ = std::max(inherited_through_, ticket.last);
  }
}

void TicketTable::add(const Ticket& ticket) {
  const std::lock_guard lock(mutex_);
  insert(ticket);
  forget_old();
}

void TicketTable::insert(const Ticket& ticket) {
  const auto [entry, is_new] = tickets_.emplace(ticket.last, ticket);
  if (!is_new) return;
  static_assert(kKeptTickets > kKept);
  entry->second.place = added_++ % kKeptTickets;
  if (ticket.state == TicketState::kPending) ++pending_;
  keep(entry->second);
}

/// Stores the ticket's record. Motions end in the order of their numbers, and fewer motions can be pending
/// than there are records. The record that is overwritten is therefore the oldest.
void TicketTable::keep(const Ticket& ticket) {
  if (records_ != nullptr) (*records_)[ticket.place].store(to_record(ticket));
}

void TicketTable::remove(std::uint64_t id) {
  const std::lock_guard lock(mutex_);
  const auto found = tickets_.find(id);
  if (found == tickets_.end()) return;
  if (found->second.state == TicketState::kPending) --pending_;
  if (records_ != nullptr) (*records_)[found->second.place].store({});
  tickets_.erase(found);
  ended_.notify_all();
}

void TicketTable::complete(std::uint64_t command, Verdict verdict) {
  const std::lock_guard lock(mutex_);
  const auto found = tickets_.lower_bound(command);
  if (found == tickets_.end()) return;
  Ticket& ticket = found->second;
  if (command < ticket.first || ticket.state != TicketState::kPending) return;
  // After a verdict other than done, the task refuses later commands of the ticket, as they follow the failed
  // one. The ticket ends with the cause, not with that effect.
  if (command != ticket.last && verdict == Verdict::kDone) return;
  const bool taken_back = verdict == Verdict::kStopped && ticket.cancelled;
  end(ticket, state_of(verdict), taken_back ? TicketReason::kTakenBack : reason_of(verdict));
}

void TicketTable::end(Ticket& ticket, TicketState state, TicketReason why, const std::string& reason) {
  ticket.state = state;
  ticket.why = why;
  ticket.reason = reason;
  keep(ticket);
  --pending_;
  if (report_end_) report_end_(ticket);
  ended_.notify_all();
}

void TicketTable::fail_pending(const std::string& reason) {
  const std::lock_guard lock(mutex_);
  for (auto& [id, ticket] : tickets_) {
    if (ticket.state == TicketState::kPending)
      end(ticket, TicketState::kFailed, TicketReason::kTaskGone, reason);
  }
}

void TicketTable::fail(std::uint64_t id, const std::string& reason) {
  const std::lock_guard lock(mutex_);
  const auto found = tickets_.find(id);
  if (found == tickets_.end() || found->second.state != TicketState::kPending) return;
  end(found->second, TicketState::kFailed, TicketReason::kTaskGone, reason);
}

void TicketTable::reconcile(const Snapshot& before) {
  const std::lock_guard lock(mutex_);
  if (pending_ == 0) return;
  // Commands of earlier servants come first: if none of them runs or waits, all have ended.
  const auto is_inherited = [&](std::uint64_t id) { return id != 0 && id <= inherited_through_; };
  const bool has_inherited =
      before.backlog != 0 || is_inherited(before.command_id) || is_inherited(before.waiting_id);
  const std::uint64_t ended_through =
      has_inherited ? before.last_done_id : std::max(before.last_done_id, inherited_through_);
  for (auto& [id, ticket] : tickets_) {
    if (ticket.state != TicketState::kPending) continue;
    if (ticket.incarnation != before.incarnation) {
      end(ticket, TicketState::kFailed, TicketReason::kLost);
    } else if (ticket.last <= ended_through) {
      end(ticket, TicketState::kFailed, TicketReason::kRecordLost);
    }
  }
}

std::optional<TicketTable::Range> TicketTable::cancel_from(std::uint64_t id) {
  const std::lock_guard lock(mutex_);
  const auto found = tickets_.find(id);
  if (found == tickets_.end() || found->second.state != TicketState::kPending) return std::nullopt;
  Range range{found->second.first, found->second.last};
  for (auto later = found; later != tickets_.end(); ++later) {
    if (later->second.state != TicketState::kPending) continue;
    later->second.cancelled = true;
    keep(later->second);
    range.last = later->second.last;
  }
  return range;
}

void TicketTable::end_cancelled(std::uint64_t begun) {
  const std::lock_guard lock(mutex_);
  for (auto& [id, ticket] : tickets_) {
    if (ticket.state == TicketState::kPending && ticket.cancelled && ticket.first > begun)
      end(ticket, TicketState::kStopped, TicketReason::kTakenBack);
  }
}

std::optional<TicketTable::Range> TicketTable::cancelled() const {
  const std::lock_guard lock(mutex_);
  std::optional<Range> range;
  for (const auto& [id, ticket] : tickets_) {
    if (ticket.state != TicketState::kPending || !ticket.cancelled) continue;
    range = Range{range ? range->first : ticket.first, ticket.last};
  }
  return range;
}

void TicketTable::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  ended_.notify_all();
}

void TicketTable::suspend_waits(bool suspended) {
  const std::lock_guard lock(mutex_);
  suspended_ = suspended;
  ended_.notify_all();
}

std::optional<Ticket> TicketTable::find(std::uint64_t id) const {
  const std::lock_guard lock(mutex_);
  const auto found = tickets_.find(id);
  return found == tickets_.end() ? std::nullopt : std::optional(found->second);
}

std::optional<Ticket> TicketTable::wait(std::uint64_t id,
                                        std::optional<std::chrono::steady_clock::time_point> until) const {
  const auto suspended_until = std::chrono::steady_clock::now() + kSuspendedWait;
  std::unique_lock lock(mutex_);
  for (;;) {
    // Looked up again after every wait: a ticket that ended long ago may have been dropped meanwhile.
    const auto found = tickets_.find(id);
    if (found == tickets_.end()) return std::nullopt;
    if (found->second.state != TicketState::kPending || closed_) return found->second;
    const auto now = std::chrono::steady_clock::now();
    if ((until && now >= *until) || (suspended_ && now >= suspended_until)) return found->second;
    if (!until && !suspended_) {
      ended_.wait(lock);
    } else {
      ended_.wait_until(lock,
                        suspended_ ? std::min(suspended_until, until.value_or(suspended_until)) : *until);
    }
  }
}

bool TicketTable::wait_ended(std::uint64_t from, std::uint64_t through,
                             std::chrono::duration<double> bound) const {
  const auto all_ended = [&] {
    return std::none_of(tickets_.lower_bound(from), tickets_.upper_bound(through),
                        [](const auto& entry) { return entry.second.state == TicketState::kPending; });
  };
  std::unique_lock lock(mutex_);
  for (Patience patience(bound);;) {
    const bool is_last = patience.is_over();
    if (all_ended()) return true;
    if (closed_ || suspended_ || is_last) return false;
    ended_.wait_for(lock, std::min<std::chrono::duration<double>>(kLongestLook, bound));
  }
}

std::optional<Ticket> TicketTable::last_pending() const {
  const std::lock_guard lock(mutex_);
  for (auto entry = tickets_.rbegin(); pending_ > 0 && entry != tickets_.rend(); ++entry) {
    if (entry->second.state == TicketState::kPending) return entry->second;
  }
  return std::nullopt;
}

std::size_t TicketTable::pending() const {
  const std::lock_guard lock(mutex_);
  return pending_;
}

TicketTable::Shown TicketTable::shown_in(const Snapshot& snapshot) const {
  const std::uint64_t begun = std::max(snapshot.command_id, snapshot.last_done_id);
  const std::lock_guard lock(mutex_);
  Shown shown;
  // Between the two commands of a motion there is a cycle in which neither runs.
  const auto found = tickets_.upper_bound(snapshot.last_done_id);
  if (found != tickets_.end() && found->second.first <= begun) shown.running = found->second;
  // A motion that this task has completed by now, but had not begun in this snapshot, was queued in the
  // snapshot.
  const auto waited = [&](const Ticket& ticket) {
    const bool is_done_since =
        ticket.state == TicketState::kDone && ticket.incarnation == snapshot.incarnation;
    return ticket.first > begun && (ticket.state == TicketState::kPending || is_done_since);
  };
  shown.queued = static_cast<std::size_t>(std::count_if(
      tickets_.upper_bound(begun), tickets_.end(), [&](const auto& entry) { return waited(entry.second); }));
  return shown;
}

void TicketTable::forget_old() {
  auto oldest = tickets_.begin();
  while (tickets_.size() - pending_ > kKept && oldest != tickets_.end()) {
    oldest = oldest->second.state == TicketState::kPending ? std::next(oldest) : tickets_.erase(oldest);
  }
}

}  // namespace corbot
