// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cerrno>
#include <charconv>
#include <cstring>
#include <optional>
#include <string>

#include "rt/backends/bus/device_error.h"

namespace corbot::rt {

// The helpers that both versions of the library need; all for set-up.

/// Returns the offset by which a line is given; empty if it is a name.
inline std::optional<unsigned> gpio_offset(const std::string& line) {
  unsigned offset = 0;
  const char* end = line.data() + line.size();
  const auto [stop, error] = std::from_chars(line.data(), end, offset);
  if (error != std::errc{} || stop != end) return std::nullopt;
  return offset;
}

inline DeviceError gpio_chip_error(const std::string& chip, int error) {
  const std::string hint = error == EACCES ? " (join the group gpio, or install the udev rule)" : "";
  return {DeviceCause::kNotThere, chip + ": " + std::strerror(error) + hint};
}

inline DeviceError gpio_no_line(const std::string& chip, const std::string& line) {
  return {DeviceCause::kNotThere, chip + ": has no line " + line + " ('gpioinfo' lists them)"};
}

inline DeviceError gpio_line_taken(const std::string& chip, const std::string& line,
                                   const std::string& consumer) {
  return {DeviceCause::kInUse,
          chip + ", line " + line + ": is taken by " +
              (consumer.empty() ? "the kernel or a nameless program" : "\"" + consumer + "\"")};
}

inline DeviceError gpio_line_error(const std::string& chip, const std::string& line, int error) {
  return {DeviceCause::kNotThere, chip + ", line " + line + ": " + std::strerror(error)};
}

/// The error of a line that was there: the chip is gone.
inline DeviceError gpio_lost(const std::string& chip, int error) {
  return {DeviceCause::kHungUp, chip + ": " + std::strerror(error)};
}

}  // namespace corbot::rt
