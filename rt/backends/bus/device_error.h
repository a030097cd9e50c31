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

}  // namespace corbot::rt
