// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

namespace corbot::test {

/// A row of what corbot-sim writes with --record: of a servo in us, of a drive in counts.
struct DeviceRow {
  std::int64_t time_ns{};
  std::uint32_t channel{};  ///< or the drive's node
  double given{};           ///< the pulse that it sends, 0: none; the drive's target
  double shaft{};
  bool has_power{};  ///< it sends pulses; the drive's motor has current
};

/// Nothing where the line is no whole row.
inline std::optional<DeviceRow> device_row(std::string line) {
  std::replace(line.begin(), line.end(), ',', ' ');
  std::istringstream words(line);
  DeviceRow row;
  if (!(words >> row.time_ns >> row.channel >> row.given >> row.shaft)) return std::nullopt;
  int power = row.given > 0.0 ? 1 : 0;
  words >> std::ws;
  if (!words.eof()) words >> power;  // only drives say so
  row.has_power = power != 0;
  return row;
}

/// The rows so far.
inline std::vector<DeviceRow> device_rows(const std::string& record) {
  std::vector<DeviceRow> rows;
  std::ifstream file(record);
  for (std::string line; std::getline(file, line) && !file.eof();) {  // one without its end is not whole yet
    if (const auto row = device_row(line)) rows.push_back(*row);
  }
  return rows;
}

}  // namespace corbot::test
