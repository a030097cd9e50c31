// SPDX-License-Identifier: Apache-2.0
#include "robot/position_saver.h"

#include <pthread.h>

#include <exception>
#include <utility>

namespace corbot {
namespace {

using namespace std::chrono_literals;

constexpr auto kPollPeriod = 100ms;
constexpr auto kWhileMoving = 1s;
constexpr auto kAfterFailure = 10s;

bool is_at_rest(const Snapshot& snapshot) { return snapshot.command_id == 0; }

bool is_held(const Snapshot& snapshot) { return (snapshot.flags & kSnapshotHeld) != 0; }

bool is_in_error(const Snapshot& snapshot) { return snapshot.state == RtState::kError; }

bool is_same(const Snapshot& a, const Snapshot& b) {
  return a.position_q == b.position_q && a.gripper == b.gripper && is_at_rest(a) == is_at_rest(b);
}

}  // namespace

bool SavePolicy::is_due(const Snapshot& now, Instant at) const {
  if (at < not_before_) return false;
  if (!last_ || is_held(*last_) != is_held(now) || is_in_error(*last_) != is_in_error(now)) return true;
  return !is_same(*last_, now) && (is_at_rest(now) || at >= saved_at_ + kWhileMoving);
}

void SavePolicy::saved(const Snapshot& now, Instant at) {
  last_ = now;
  saved_at_ = at;
}

void SavePolicy::failed(Instant at) { not_before_ = at + kAfterFailure; }

PositionSaver::PositionSaver(const Link& link, const ArmModel& arm, PositionStore store, Warn warn)
    : link_(link), arm_(arm), store_(std::move(store)), warn_(std::move(warn)), thread_([this] { run(); }) {}

PositionSaver::~PositionSaver() {
  {
    const std::lock_guard lock(mutex_);
    end_ = true;
  }
  end_requested_.notify_all();
  thread_.join();
}

void PositionSaver::run() {
  ::pthread_setname_np(::pthread_self(), "robot.position");
  for (bool end = false; !end;) {
    {
      std::unique_lock lock(mutex_);
      end = end_requested_.wait_for(lock, kPollPeriod, [&] { return end_; });
    }
    poll();
  }
}

void PositionSaver::poll() {
  Snapshot now{};
  const auto at = std::chrono::steady_clock::now();
  if (!link_.alive() || !link_.snapshot(now) || !rule_.is_due(now, at)) return;
  try {
    store_.save(position_of(now, store_.robot(), store_.device()), arm_);
    rule_.saved(now, at);
    has_warned_ = false;
  } catch (const std::exception& error) {
    rule_.failed(at);
    if (!std::exchange(has_warned_, true)) {
      warn_(std::string("the last position is not saved, nor is an Error or a hold: ") + error.what());
    }
  }
}

}  // namespace corbot
