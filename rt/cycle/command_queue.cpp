// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle/command_queue.h"

#include "rt/cycle/command_check.h"

namespace corbot::rt {

bool CommandQueue::connect(const ServantSegment& servant, bool is_running) noexcept {
  if (is_waiting_) take_knots();  // out of memory that will be unmapped
  const ConnectedServant::Former former = servant_.replace(servant);
  completions_.follow(servant.completions_tail);
  // The numbers of the new servant's own commands begin at its next one.
  if (former != ConnectedServant::Former::kTaken) lost_through_ = servant_.last_used_id(last_done_);
  if (!is_running && !is_waiting_ && backlog() == 0 && !is_lost_next()) {
    last_done_ = servant_.last_used_id(last_done_);
    cancelled_.reset();
  }
  return former != ConnectedServant::Former::kCorrupt;
}

CommandQueue::Fetch CommandQueue::fetch() noexcept {
  if (!is_waiting_) {
    switch (servant_.pop(waiting_)) {
      case PopResult::kOk:
        is_waiting_ = true;
        has_knots_ = false;
        break;
      case PopResult::kEmpty:
        break;
      case PopResult::kCorrupt:
        lost_through_ = servant_.last_used_id(last_done_);
        return Fetch::kCorrupt;
    }
  }
  if (is_lost_next()) return Fetch::kLost;
  return is_waiting_ ? Fetch::kOne : Fetch::kNone;
}

void CommandQueue::end_lost(std::uint64_t cycle) noexcept {
  const std::uint64_t last = last_done_;
  for (std::uint64_t id = last + 1; id <= lost_through_ && id - last <= kOutstanding; ++id) {
    complete(id, Verdict::kDropped, cycle);
  }
  lost_through_ = 0;
}

void CommandQueue::complete(std::uint64_t id, Verdict verdict, std::uint64_t cycle) noexcept {
  (void)completions_.push({id, verdict, 0, cycle});
  end_through(id);
}

void CommandQueue::end_through(std::uint64_t id) noexcept {
  if (id <= last_done_ || id - last_done_ > kLargestIdStep) return;
  for (std::uint64_t i = last_done_ + 1; i <= id && i <= last_done_ + kOutstanding; ++i)
    cancelled_.reset(i % kOutstanding);
  last_done_ = id;
}

void CommandQueue::cancel(const CancelRequest& request) noexcept {
  for (std::uint64_t id = last_done_ + 1; id <= last_done_ + kOutstanding; ++id) {
    if (id >= request.first && id <= request.last) cancelled_.set(id % kOutstanding);
  }
}

bool CommandQueue::is_cancelled(std::uint64_t id) const noexcept {
  return id > last_done_ && id - last_done_ <= kOutstanding && cancelled_.test(id % kOutstanding);
}

}  // namespace corbot::rt
