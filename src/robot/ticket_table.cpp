// SPDX-License-Identifier: Apache-2.0
#include "robot/ticket_table.h"

#include <algorithm>

#include "corbot/running_time.h"

namespace corbot {
namespace {

const char* reason_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::kDone:
      return "";
    case Verdict::kStopped:
      return "stopped by Stop";
    case Verdict::kFault:
      return "the robot went into Error; see its alarms";
    case Verdict::kMalformed:
      return "the real-time task refused the command: a field is invalid";
    case Verdict::kDiscontinuous:
      return "the motion planned before this one did not arrive where this one begins";
    case Verdict::kLimit:
      return "the real-time task refused the command: beyond a limit of the arm";
    case Verdict::kLost:
      return "the real-time task was restarted; the motion was lost with the old one";
    case Verdict::kOrphaned:
      return "no servant responded: the motion was stopped on its path";
  }
  return "the real-time task gave an unknown verdict";
}

TicketState state_of(Verdict verdict) {
  if (verdict == Verdict::kDone) return TicketState::kDone;
  return verdict == Verdict::kStopped ? TicketState::kStopped : TicketState::kFailed;
}

constexpr std::chrono::milliseconds kLook{20};

constexpr const char* kTakenBack = "taken back by Cancel";

}  // namespace

void TicketTable::add(const Ticket& ticket) {
  const std::lock_guard lock(mutex_);
  if (tickets_.emplace(ticket.last, ticket).second) ++pending_;
  forget_old();
}

void TicketTable::remove(std::uint64_t id) {
  const std::lock_guard lock(mutex_);
  const auto found = tickets_.find(id);
  if (found == tickets_.end()) return;
  if (found->second.state == TicketState::kPending) --pending_;
  tickets_.erase(found);
  ended_.notify_all();
}

void TicketTable::complete(std::uint64_t command, Verdict verdict) {
  const std::lock_guard lock(mutex_);
  const auto found = tickets_.lower_bound(command);
  if (found == tickets_.end()) return;
  Ticket& ticket = found->second;
  if (command < ticket.first || ticket.state != TicketState::kPending) return;
  // After another verdict than done, later commands of the ticket are refused for following this one: it ends
  // with the cause, not with the effect.
  if (command != ticket.last && verdict == Verdict::kDone) return;
  const bool taken_back = verdict == Verdict::kStopped && ticket.cancelled;
  end(ticket, state_of(verdict), taken_back ? kTakenBack : reason_of(verdict));
}

void TicketTable::end(Ticket& ticket, TicketState state, const std::string& reason) {
  ticket.state = state;
  ticket.reason = reason;
  --pending_;
  ended_.notify_all();
}

void TicketTable::fail_pending(const std::string& reason) {
  const std::lock_guard lock(mutex_);
  for (auto& [id, ticket] : tickets_) {
    if (ticket.state == TicketState::kPending) end(ticket, TicketState::kFailed, reason);
  }
}

void TicketTable::fail(std::uint64_t id, const std::string& reason) {
  const std::lock_guard lock(mutex_);
  const auto found = tickets_.find(id);
  if (found == tickets_.end() || found->second.state != TicketState::kPending) return;
  end(found->second, TicketState::kFailed, reason);
}

void TicketTable::reconcile(std::uint64_t incarnation, std::uint64_t ended_through) {
  const std::lock_guard lock(mutex_);
  if (pending_ == 0) return;
  for (auto& [id, ticket] : tickets_) {
    if (ticket.state != TicketState::kPending) continue;
    if (ticket.incarnation != incarnation) {
      end(ticket, TicketState::kFailed, reason_of(Verdict::kLost));
    } else if (ticket.last <= ended_through) {
      end(ticket, TicketState::kFailed, "the motion has ended, but the record of how it ended was lost");
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
    range.last = later->second.last;
  }
  return range;
}

void TicketTable::end_cancelled(std::uint64_t begun) {
  const std::lock_guard lock(mutex_);
  for (auto& [id, ticket] : tickets_) {
    if (ticket.state == TicketState::kPending && ticket.cancelled && ticket.first > begun)
      end(ticket, TicketState::kStopped, kTakenBack);
  }
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
    // Looked up anew after every wait: a ticket that ended long ago may have been forgotten meanwhile.
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
    ended_.wait_for(lock, kLook);
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

void TicketTable::forget_old() {
  auto oldest = tickets_.begin();
  while (tickets_.size() - pending_ > kKept && oldest != tickets_.end()) {
    oldest = oldest->second.state == TicketState::kPending ? std::next(oldest) : tickets_.erase(oldest);
  }
}

}  // namespace corbot
