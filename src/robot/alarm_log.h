// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "alarms/alarm_text.h"
#include "corbot/channel/servant_state.h"

namespace corbot {

/// Codes of the alarms that the servant itself raises. channel/records.h has the codes of the real-time task;
/// docs/alarms.md lists both.
inline constexpr std::int32_t kAlarmTaskGone = 150;
inline constexpr std::int32_t kAlarmTaskRestarted = 151;
inline constexpr std::int32_t kAlarmPositionNotSaved = 152;
inline constexpr std::int32_t kAlarmTaskFrozen = 153;
inline constexpr std::int32_t kAlarmFormerServantInvalid = 154;
inline constexpr std::int32_t kAlarmAuditLogIncomplete = 155;
inline constexpr std::int32_t kAlarmSoftLimitsUnknown = 156;
inline constexpr std::int32_t kAlarmShapesUnknown = 157;

struct AlarmEntry {
  double time_s{};  ///< since the Unix epoch
  std::int32_t code{};
  bool active{};  ///< the alarm still causes Error
  std::string text;

  friend bool operator==(const AlarmEntry&, const AlarmEntry&) = default;
};

/// The last 64 alarms, as text, and their copy for the next servant. A full log never drops an active alarm
/// for a newer one unless all are active. Thread-safe.
class AlarmLog {
 public:
  static constexpr std::size_t kKept = kKeptAlarms;
  using Records = decltype(ServantState::alarms);

  /// `shapes`: the names of the profile's planes and boxes.
  explicit AlarmLog(const JointKinds& kinds = {}, std::vector<std::string> shapes = {})
      : kinds_(kinds), shapes_(std::move(shapes)) {}

  /// Copies every alarm to `records` from now on. The owner calls this before any other function.
  void keep_in(Records& records) { records_ = &records; }
  /// Puts the alarms of the previous servant, oldest first, before all alarms here. The next event may repeat
  /// one of them.
  void inherit(const std::vector<AlarmEntry>& former);

  void add(const AlarmEvent& event);
  void add(std::int32_t code, bool active, const std::string& text);
  /// Adds an alarm with another text for a condition that lasts until Clear. Has no effect while an alarm of
  /// that code is active.
  void add_once(const AlarmEvent& event, const std::string& text);
  /// Gives another text to the active alarm of this code whose text is `before`, if there is one.
  void replace_text(std::int32_t code, const std::string& before, const std::string& text);
  /// Deactivates all alarms except kAlarmTaskGone: the robot has left Error.
  void deactivate();
  void deactivate(std::int32_t code);
  [[nodiscard]] std::vector<AlarmEntry> list() const;
  /// Returns the text of the newest active fault, or else of the hold. Returns "" if no alarm is active.
  [[nodiscard]] std::string cause() const;
  /// Returns true if a StopAndHold is the only active alarm.
  [[nodiscard]] bool is_hold_alone() const;

 private:
  /// An entry and the index of its record.
  struct Kept {
    AlarmEntry entry;
    std::size_t place{};
    std::uint64_t order{};
  };

  // The caller holds mutex_.
  void push(AlarmEntry entry);
  void keep(const Kept& kept);
  [[nodiscard]] std::deque<Kept>::iterator find_victim();

  const JointKinds kinds_;
  const std::vector<std::string> shapes_;
  mutable std::mutex mutex_;
  std::deque<Kept> entries_;
  std::uint64_t last_order_{0};
  bool may_repeat_{false};  ///< the next event may be one that the previous servant read, too
  Records* records_{nullptr};
};

}  // namespace corbot
