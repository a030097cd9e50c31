// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <vector>

#include "alarms/alarm_text.h"

namespace corbot {

/// Codes that the servant itself raises; those of the real-time task are in channel/records.h. docs/alarms.md
/// has both.
inline constexpr std::int32_t kAlarmTaskGone = 150;
inline constexpr std::int32_t kAlarmTaskRestarted = 151;
inline constexpr std::int32_t kAlarmPositionNotSaved = 152;
inline constexpr std::int32_t kAlarmTaskFrozen = 153;
inline constexpr std::int32_t kAlarmFormerServantInvalid = 154;

struct AlarmEntry {
  double time_s{};  ///< since the Unix epoch
  std::int32_t code{};
  bool active{};  ///< still the cause of Error
  std::string text;
};

/// The last 64 alarms, as text; an active one is never pushed out by others. Thread-safe.
class AlarmLog {
 public:
  static constexpr std::size_t kKept = 64;

  void add(const AlarmEvent& event);
  void add(std::int32_t code, bool active, const std::string& text);
  /// The robot has left Error: nothing is its cause any more.
  void deactivate();
  void deactivate(std::int32_t code);
  [[nodiscard]] std::vector<AlarmEntry> list() const;
  /// Text of the newest active alarm; empty when there is none.
  [[nodiscard]] std::string cause() const;

 private:
  void push(AlarmEntry entry);

  mutable std::mutex mutex_;
  std::deque<AlarmEntry> entries_;
};

}  // namespace corbot
