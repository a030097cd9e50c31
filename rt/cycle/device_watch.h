// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "corbot/backend/backend.h"
#include "corbot/backend/still_watch.h"

namespace corbot::rt {

[[nodiscard]] constexpr bool has_failed(BackendHealth health) noexcept {
  return health == BackendHealth::kLost || health == BackendHealth::kClosed;
}
/// Tells whether the device gives energy and takes set-points.
[[nodiscard]] constexpr bool is_open(BackendHealth health) noexcept {
  return health == BackendHealth::kOpen || health == BackendHealth::kDegraded;
}

/// The device's health as the cycle sees it: the reported health, or kLost if the device thread has stalled.
/// It also tells whether the device gives up the energy on command. Real-time safe.
class DeviceWatch {
 public:
  /// Called once a step, after `given` has been written. `ran_ns`: time that has passed, without gaps of this
  /// process.
  void look(Backend& backend, const ServoFrame& given, std::int64_t ran_ns) noexcept {
    before_ = health_;
    see_answer(given);
    health_ = backend.health();
    cause_ = backend.cause();
    if (thread_.look(backend.beats(), ran_ns) && !has_failed(health_)) {
      health_ = BackendHealth::kLost;
      cause_ = DeviceCause::kThreadStill;
    }
    is_fall_asked_for_ = given.needs_clear || is_fall_awaited_;
    if (!is_open(health_)) is_fall_awaited_ = false;
    times_ = backend.times();
  }
  [[nodiscard]] BackendHealth health() const noexcept { return health_; }
  [[nodiscard]] DeviceCause cause() const noexcept { return cause_; }
  [[nodiscard]] const BackendTimes& times() const noexcept { return times_; }
  [[nodiscard]] bool has_changed() const noexcept { return health_ != before_; }
  /// Lost in this step.
  [[nodiscard]] bool is_newly_lost() const noexcept { return has_failed(health_) && !has_failed(before_); }
  /// The device has given up the energy in this step without a command.
  [[nodiscard]] bool has_fallen() const noexcept {
    return health_ == BackendHealth::kStandby && is_open(before_) && !is_fall_asked_for_;
  }
  /// Power-off was commanded and withdrawn before the device has seen either: the energy may still go.
  [[nodiscard]] bool may_fall() const noexcept { return is_fall_awaited_ && !taken_at_; }

 private:
  /// Follows the device's answers. A Clear may come before the device has read the frames of the Error. The
  /// device gives up the energy by its newest frame, or by a press that it finds beside that frame. So it no
  /// longer does so after it has taken another frame after the first without needs_clear. The times are from
  /// before this step's health, so the health includes everything done before them.
  void see_answer(const ServoFrame& given) noexcept {
    if (given.power_off) is_fall_awaited_ = true;
    if (given.needs_clear) {
      cleared_in_ = given.cycle + 1;
      taken_at_.reset();
    } else if (is_fall_awaited_ && times_.cycle >= cleared_in_) {
      if (!taken_at_) taken_at_ = times_.frames;
      if (times_.frames != *taken_at_) is_fall_awaited_ = false;
    }
  }

  StillWatch thread_{StillWatch::kDevice_ns};
  BackendHealth health_{BackendHealth::kOpen};
  BackendHealth before_{BackendHealth::kOpen};
  DeviceCause cause_{DeviceCause::kNone};
  BackendTimes times_{};
  bool is_fall_awaited_{false};
  bool is_fall_asked_for_{false};
  std::uint64_t cleared_in_{0};              ///< the first frame without needs_clear
  std::optional<std::uint64_t> taken_at_{};  ///< number of frames taken when the device had that frame
};

}  // namespace corbot::rt
