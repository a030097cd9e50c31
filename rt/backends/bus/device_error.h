// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>

#include "corbot/backend/device_cause.h"

namespace corbot::rt {

/// A problem of a device: the cause for the alarm, and a text that names the device.
class DeviceError : public std::runtime_error {
 public:
  DeviceError(DeviceCause cause, const std::string& text) : std::runtime_error(text), cause_(cause) {}
  [[nodiscard]] DeviceCause cause() const noexcept { return cause_; }

 private:
  DeviceCause cause_;
};

/// The end of a start by a person: the device has no problem.
class StartEnded : public DeviceError {
 public:
  explicit StartEnded(const std::string& text) : DeviceError(DeviceCause::kNone, text) {}
};

/// One missing or wrong reply may be noise on the line.
[[nodiscard]] constexpr bool is_noise(DeviceCause cause) noexcept {
  return cause == DeviceCause::kNoAnswer || cause == DeviceCause::kBadAnswer;
}

}  // namespace corbot::rt
