// SPDX-License-Identifier: Apache-2.0
#include "contract/driver.h"

#include <time.h>

#include <algorithm>

#include "contract/system_call_watch.h"
#include "rt/cycle/servo_map.h"
#include "support/process.h"

namespace corbot::test {
namespace {

constexpr std::int64_t kPeriod_ns = 1'000'000;
constexpr std::int64_t kLatest_ns = 5 * kPeriod_ns;

std::int64_t now_ns() noexcept {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

template <class Record>
Record newest(const SnapshotCell<Record>& cell) {
  Record record{};
  while (!cell.load(record)) std::this_thread::yield();
  return record;
}

}  // namespace

Driver::Driver(const ArmModel& arm, Backend& backend, DeviceFixture& fixture, const Pose& at)
    : arm_(arm), backend_(backend), fixture_(fixture) {
  pose_.store(at);
  feedback_.store(ServoFeedback{});
}

ServoFrame Driver::frame(const ArmModel& arm, const Pose& pose) {
  ServoFrame frame;
  rt::map_to_pulses(arm, pose.position_q, pose.opening, frame);
  return frame;
}

void Driver::start() {
  thread_ = std::thread([this] { run(); });
}

void Driver::end() {
  end_ = true;
  if (thread_.joinable()) thread_.join();
}

void Driver::move(const Pose& to, double seconds) {
  motion_.store({++asked_, to, static_cast<std::int64_t>(seconds * 1e9)});
  wait_until(within(20), [&] { return begun_.load() == asked_; });
}

void Driver::freeze(bool frozen) {
  frozen_.store(frozen);
  wait_until(within(20), [&] { return is_frozen_.load() == frozen; });
}

Pose Driver::pose() const { return newest(pose_); }

ServoFeedback Driver::feedback() const { return newest(feedback_); }

std::vector<double> Driver::wanted(bool joints) const {
  const ServoFrame all = frame(arm_, pose());
  if (joints) return {all.position_q.begin(), all.position_q.begin() + arm_.dof};
  return {all.pulse_us.begin(), all.pulse_us.begin() + all.servo_count};
}

/// Takes the measured position as the arm's while the device stands by, whatever the last frame was.
void Driver::follow(Pose& at) noexcept {
  ServoFeedback feedback{};
  if (backend_.health() != BackendHealth::kStandby || !feedback_.load(feedback) || !feedback.measured) return;
  for (std::size_t i = 0; i < arm_.dof; ++i) {
    const JointLimits& joint = arm_.joints[i];
    at.position_q[i] = std::clamp(feedback.position_q[i], joint.lower_q, joint.upper_q);
  }
  moving_.store(false);
}

void Driver::run() noexcept {
  (void)watch_system_calls();
  Pose at{};
  (void)pose_.load(at);
  Pose from = at;
  Motion motion{};
  std::int64_t moved_ns = 0;
  bool in_error = false;
  ServoFrame frame{};
  std::int64_t due_ns = now_ns();
  while (!end_.load(std::memory_order_relaxed)) {
    due_ns += kPeriod_ns;
    const timespec due{due_ns / 1'000'000'000, due_ns % 1'000'000'000};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr);
    // As in the cycle, periods that are missed delay a motion.
    if (const std::int64_t late_ns = now_ns() - due_ns; late_ns > kLatest_ns) due_ns += late_ns;
    is_frozen_.store(frozen_.load());
    if (is_frozen_.load()) continue;
    Motion asked{};
    if (motion_.load(asked) && asked.number > begun_.load(std::memory_order_relaxed)) {
      motion = asked;
      from = at;
      moved_ns = 0;
      moving_.store(true);
      begun_.store(asked.number);
    }
    if (backend_.health() == BackendHealth::kLost && motion.duration_ns > 0) moving_.store(false);
    if (moving_.load(std::memory_order_relaxed)) {
      moved_ns += kPeriod_ns;
      const double share =
          std::min(1.0, static_cast<double>(moved_ns) /
                            static_cast<double>(std::max<std::int64_t>(motion.duration_ns, 1)));
      for (std::size_t i = 0; i < arm_.dof; ++i) {
        at.position_q[i] = from.position_q[i] + share * (motion.to.position_q[i] - from.position_q[i]);
      }
      at.opening = from.opening + share * (motion.to.opening - from.opening);
      if (share >= 1.0) {
        at = motion.to;
        moving_.store(false);
      }
    }
    follow(at);
    ++frame.cycle;
    frame.time_ns = due_ns;
    const BackendHealth health = backend_.health();
    in_error = health == BackendHealth::kLost ||
               (in_error && !(health == BackendHealth::kStandby && is_attended_.load()));
    frame.needs_clear = emergency_stop_.load() || in_error;
    frame.power_off = frame.needs_clear;
    rt::map_to_pulses(arm_, at.position_q, at.opening, frame);
    backend_.write(frame);
    pose_.store(at);
    feedback_.store(backend_.read());
    oldest_ns_ = std::max(oldest_ns_.load(), backend_.times().age_max_ns);
    (void)backend_.cause();
    fixture_.after_write();
    cycles_.store(frame.cycle, std::memory_order_release);
  }
}

}  // namespace corbot::test
