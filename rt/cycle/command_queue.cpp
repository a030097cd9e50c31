// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle/command_queue.h"

#include "rt/cycle/command_check.h"

namespace corbot::rt {

bool CommandQueue::connect(const ServantSegment& servant, std::uint64_t cycle, bool is_running) noexcept {
  bool is_sound = true;
  servant_.replace(
      servant, [&](const Command& lost) { complete(lost.id, Verdict::kFault, cycle); },
      [&] { is_sound = false; });
  completions_.follow(servant.completions_tail);
  if (!is_running && !is_waiting_ && backlog() == 0) {
    last_done_ = servant_.last_used_id(last_done_);
    cancelled_.reset();
  }
  return is_sound;
}

CommandQueue::Fetch CommandQueue::fetch() noexcept {
  if (is_waiting_) return Fetch::kOne;
  switch (servant_.pop(waiting_)) {
    case PopResult::kOk:
      is_waiting_ = true;
      return Fetch::kOne;
    case PopResult::kEmpty:
      break;
    case PopResult::kCorrupt:
      return Fetch::kCorrupt;
  }
  return Fetch::kNone;
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
