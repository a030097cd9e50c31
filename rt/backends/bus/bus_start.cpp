// SPDX-License-Identifier: Apache-2.0
// The start of BusBackend, up to the thread that serves the device.
#include <utility>

#include "corbot/running_time.h"
#include "rt/backends/bus/bus_backend.h"
#include "rt/backends/bus/bus_reading.h"

namespace corbot::rt {
namespace {

using Clock = std::chrono::steady_clock;

/// The time-out for the positions of drives that answer to SYNC.
constexpr std::chrono::seconds kPositionsWithin{2};

constexpr const char* kPressed = "the emergency stop is pressed; release it, then start again";
constexpr const char* kPressedMeanwhile = "the emergency stop was pressed; start again";

}  // namespace

DevicePosition BusBackend::connect() {
  log(device_->open());  // a missing device is reported at once, not by an alarm
  is_connected_ = true;
  ServoFrame frame;
  frame.servo_count = arm_.dof + 1;
  for (std::size_t i = 0; i < arm_.dof; ++i) frame.channel[i] = arm_.servos[i].channel;
  frame.channel[arm_.dof] = arm_.gripper.channel;
  try {
    found_ = find(frame);
  } catch (const DeviceError&) {
    give_up_start(true);  // nothing was energised here
    throw;
  }
  // Servos without pulses may have been moved since.
  return position_of(arm_, found_, !settings_.relax_at_end);
}

/// Awaits the first replies, which may be late: with encoders a start from a guess would drive the arm to the
/// guess.
BusReading BusBackend::find(const ServoFrame& frame) {
  std::string why = settings_.name + ": reports no position";
  for (Patience patience(kPositionsWithin);;) {
    try {
      BusReading reading = device_->measure(frame);
      if (!has_encoders() || reading.unit == BusReading::Unit::kJoints) return reading;
    } catch (const DeviceError& error) {
      if (has_encoders() && !is_noise(error.cause())) throw;
      why = std::string("reports no position: ") + error.what();
    }
    if (!has_encoders()) break;
    if (patience.is_over()) {
      if (const auto warning = device_->warning()) why += std::string(": ") + warning->what();
      throw DeviceError(DeviceCause::kNoAnswer, why);
    }
    (void)pause_until(Clock::now() + std::chrono::nanoseconds(device_->period_ns()));
  }
  log(why);
  return {};
}

void BusBackend::open(const ServoFrame& first) {
  frames_.store(first);
  if (!is_connected_) (void)connect();
  stop_state_.begin();
  is_power_off_done_ = false;
  Phase phase = Phase::kStandby;
  is_starting_ = true;
  try {
    // Reads the stop input even if nothing moves yet: a Clear is accepted only after it was read.
    const bool is_pressed = is_stopped(first);
    if (first.needs_clear) {
      health_.store(BackendHealth::kStandby, std::memory_order_release);
    } else {
      if (is_pressed) throw StartEnded(kPressed);
      phase = approach();
      if (phase == Phase::kStandby) throw StartEnded(kPressedMeanwhile);
    }
  } catch (const StartEnded&) {
    give_up_start(true);
    throw;
  } catch (const DeviceError&) {
    give_up_start(false);
    throw;
  }
  is_starting_ = false;
  thread_ = std::thread([this, phase] { run_from(phase); });
}

/// Ends a failed start; it is not tried again.
void BusBackend::give_up_start(bool is_proper_end) noexcept {
  try {
    approach_.halt_left_over();
  } catch (const DeviceError& error) {
    log(std::string("could not be halted: ") + error.what());
    is_proper_end = false;
  }
  leave(is_proper_end);
  is_starting_ = is_connected_ = false;
}

void BusBackend::end_cancelled_start() const {
  if (!is_starting_ || !is_cancelled_.load(std::memory_order_relaxed)) return;
  throw StartEnded("the task was ended before the arm had reached its start position");
}

}  // namespace corbot::rt
