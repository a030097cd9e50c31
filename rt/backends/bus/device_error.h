// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>

#include "corbot/backend/device_cause.h"

namespace corbot::rt {

/// What is wrong with a device: the cause for the alarm, and a text that names the device.
class DeviceError : public std::runtime_error {
 public:
  DeviceError(DeviceCause cause, const std::string& text) : std::runtime_error(text), cause_(cause) {}
  [[nodiscard]] DeviceCause cause() const noexcept { return cause_; }

 private:
  DeviceCause cause_;
};

/// A start that a person has ended: nothing is wrong with the device.
class StartEnded : public DeviceError {
 public:
  explicit StartEnded(const std::string& text) : DeviceError(DeviceCause::kNone, text) {}
};

/// One answer that is missing or wrong may be noise on the line.
[[nodiscard]] constexpr bool is_noise(DeviceCause cause) noexcept {
  return cause == DeviceCause::kNoAnswer || cause == DeviceCause::kBadAnswer;
}

}  // namespace corbot::rt
