// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle/command_queue.h"

#include "rt/cycle/command_check.h"

namespace corbot::rt {

void CommandQueue::adopt(std::uint64_t last_done) noexcept {
  last_done_ = last_done;
  for (std::size_t i = 0; i < capacity() && commands_.pop(waiting_) == PopResult::kOk; ++i)
    end_through(waiting_.id);
  const std::uint64_t next = next_number();
  if (next > 0) end_through(next - 1);
}

CommandQueue::Fetch CommandQueue::fetch() noexcept {
  if (is_waiting_) return Fetch::kOne;
  switch (commands_.pop(waiting_)) {
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
