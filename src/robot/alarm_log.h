// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <vector>

#include "alarms/alarm_text.h"
#include "corbot/channel/servant_state.h"

namespace corbot {

/// Codes that the servant itself raises; those of the real-time task are in channel/records.h. docs/alarms.md
/// has both.
inline constexpr std::int32_t kAlarmTaskGone = 150;
inline constexpr std::int32_t kAlarmTaskRestarted = 151;
inline constexpr std::int32_t kAlarmPositionNotSaved = 152;
inline constexpr std::int32_t kAlarmTaskFrozen = 153;
inline constexpr std::int32_t kAlarmFormerServantInvalid = 154;
inline constexpr std::int32_t kAlarmAuditLogIncomplete = 155;
inline constexpr std::int32_t kAlarmSoftLimitsUnknown = 156;

struct AlarmEntry {
  double time_s{};  ///< since the Unix epoch
  std::int32_t code{};
  bool active{};  ///< still the cause of Error
  std::string text;

  friend bool operator==(const AlarmEntry&, const AlarmEntry&) = default;
};

/// The last 64 alarms, as text; an active one is never pushed out by others. And their copy for the servant after
/// this one. Thread-safe.
class AlarmLog {
 public:
  static constexpr std::size_t kKept = kKeptAlarms;
  using Records = decltype(ServantState::alarms);

  explicit AlarmLog(const JointKinds& kinds = {}) : kinds_(kinds) {}

  /// Before all else. From now on every alarm is there, too.
  void keep_in(Records& records) { records_ = &records; }
  /// What the servant before this one has left, oldest first; older than all that is here. The next
  /// event may be one of them once more.
  void inherit(const std::vector<AlarmEntry>& former);

  void add(const AlarmEvent& event);
  void add(std::int32_t code, bool active, const std::string& text);
  /// Of a state that lasts until it is cleared, with another text: no effect while one of that code is active.
  void add_once(const AlarmEvent& event, const std::string& text);
  /// The active alarm of that code with the text `before`, if there is one, gets another text.
  void replace_text(std::int32_t code, const std::string& before, const std::string& text);
  /// The robot has left Error: nothing is its cause any more.
  void deactivate();
  void deactivate(std::int32_t code);
  [[nodiscard]] std::vector<AlarmEntry> list() const;
  /// Text of the newest active alarm that is a fault, or else of the hold; empty when there is none.
  [[nodiscard]] std::string cause() const;
  /// Nothing is active but a StopAndHold.
  [[nodiscard]] bool is_hold_alone() const;

 private:
  /// An entry and its place in the records.
  struct Kept {
    AlarmEntry entry;
    std::size_t place{};
    std::uint64_t order{};
  };

  // With mutex_ held.
  void push(AlarmEntry entry);
  void keep(const Kept& kept);
  [[nodiscard]] std::deque<Kept>::iterator find_victim();

  const JointKinds kinds_;
  mutable std::mutex mutex_;
  std::deque<Kept> entries_;
  std::uint64_t last_order_{0};
  bool may_repeat_{false};  ///< the next event may be one that the servant before this one has taken, too
  Records* records_{nullptr};
};

}  // namespace corbot
