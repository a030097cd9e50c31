// SPDX-License-Identifier: Apache-2.0
#include "robot/inherited_state.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "corbot/motion/bounds.h"
#include "planner/frame_settings.h"
#include "robot/call_error.h"
#include "robot/control.h"
#include "robot/settings.h"

namespace corbot {
namespace {

constexpr double kLatest_s = 1e12;  // since the Unix epoch
constexpr double kRounding = 1e-6;  // of an end that was computed from the plan
constexpr std::int32_t kCodes = 1000;

/// Returns false for any value that is not finite, too.
bool is_within(double value, double lower, double upper) { return value >= lower && value <= upper; }
bool is_ratio(double value) { return value > 0.0 && value <= 1.0; }

/// Returns false also if the arm cannot take the tool: the profile may differ from the previous servant's.
bool are_valid_frames(const SettingsRecord& record, const ArmModel& arm) {
  const bool has_tool = (record.frames_set & kSettingsToolFrame) != 0;
  const bool has_base = (record.frames_set & kSettingsBaseFrame) != 0;
  return record.frames_set <= (kSettingsToolFrame | kSettingsBaseFrame) &&
         (!has_tool || (is_frame(record.tool_frame, kFarthestTool_m) &&
                        !check_tool_frame(arm.kinematics, record.tool_frame))) &&
         (!has_base || is_frame(record.base_frame, kFarthestBase_m));
}

bool is_valid(const SettingsRecord& record) {
  return is_ratio(record.speed_ratio) &&
         std::all_of(record.joint_speed_ratio.begin(), record.joint_speed_ratio.end(), is_ratio) &&
         record.tool_is_set <= static_cast<std::uint64_t>(SettingsTool::kOrientation) &&
         is_within(record.tool_pitch_rad, -std::numbers::pi, std::numbers::pi) &&
         is_within(squared_norm(record.tool_orientation), 1.0 - kRounding, 1.0 + kRounding);
}

/// Returns true for printable ASCII with a terminating zero.
template <class Text>
bool is_text(const Text& text) {
  const auto end = std::find(std::begin(text), std::end(text), '\0');
  return end != std::end(text) && std::all_of(std::begin(text), end, is_printable);
}

bool is_valid(const AlarmRecord& record) {
  return record.order != 0 && is_within(record.time_s, 0.0, kLatest_s) && record.code > 0 &&
         record.code < kCodes && record.active <= 1 && is_text(record.text);
}

bool is_end(const TicketRecord& record, const ArmModel& arm) {
  for (std::size_t i = 0; i < kMaxJoints; ++i) {
    const bool is_joint = i < arm.dof;
    const double lower_q = is_joint ? arm.joints[i].lower_q : 0.0;
    const double upper_q = is_joint ? arm.joints[i].upper_q : 0.0;
    if (!is_within(record.end_q[i], lower_q - kRounding, upper_q + kRounding)) return false;
  }
  return is_within(record.end_gripper, -kRounding, 1.0 + kRounding);
}

bool is_valid(const TicketRecord& record, const ArmModel& arm, std::uint64_t next_command_id) {
  return record.first != 0 && record.last >= record.first && record.last - record.first <= 1 &&
         record.last < next_command_id && is_within(record.duration_s, 0.0, 2.0 * kLongestCommand_s) &&
         is_within(record.second_from_s, 0.0, record.duration_s) && record.cancelled <= 1 &&
         is_consistent(record.state, record.reason) && is_end(record, arm);
}

bool is_valid(const ControlRecord& record) { return Control::is_valid(record); }

bool is_valid(const HoldRecord& record) { return is_text(record.by); }

/// Returns true if there is a record. Counts a cell that no servant has written as invalid.
template <class Record>
bool read(const DurableCell<Record>& cell, Record& record, int& invalid) {
  const auto content = cell.load(record);
  if (content == DurableCell<Record>::Content::kInvalid) ++invalid;
  return content == DurableCell<Record>::Content::kRecord;
}

/// Returns true if there is a valid record. Counts an invalid one, too.
template <class Record>
bool read_valid(const DurableCell<Record>& cell, Record& record, int& invalid) {
  if (!read(cell, record, invalid)) return false;
  if (is_valid(record)) return true;
  ++invalid;
  return false;
}

void read_alarms(const ServantState& former, InheritedState& state) {
  std::vector<AlarmRecord> records;
  for (const auto& cell : former.alarms) {
    AlarmRecord record{};
    if (read_valid(cell, record, state.invalid)) records.push_back(record);
  }
  std::sort(records.begin(), records.end(), [](const auto& a, const auto& b) { return a.order < b.order; });
  std::uint64_t last = 0;
  for (const AlarmRecord& record : records) {
    if (std::exchange(last, record.order) == record.order) {
      ++state.invalid;
    } else {
      state.alarms.push_back({record.time_s, record.code, record.active == 1, record.text});
    }
  }
}

/// Returns true if the servant was killed before it handed the motion over. No client then received the
/// number.
bool was_never_handed_over(const TicketRecord& record, const ServantSegment& former) {
  return record.handed_until != 0 &&
         static_cast<std::int64_t>(former.commands.published() - record.handed_until) < 0;
}

void read_tickets(const ServantSegment& former, const ArmModel& arm, std::uint64_t next_command_id,
                  InheritedState& state) {
  std::vector<TicketRecord> records;
  for (const auto& cell : former.state.tickets) {
    TicketRecord record{};
    if (!read(cell, record, state.invalid) || record.first == 0) continue;
    if (record.state == TicketState::kPending && was_never_handed_over(record, former)) continue;
    if (is_valid(record, arm, next_command_id)) {
      records.push_back(record);
    } else {
      ++state.invalid;
    }
  }
  std::sort(records.begin(), records.end(), [](const auto& a, const auto& b) { return a.last < b.last; });
  std::uint64_t last = 0;
  for (const TicketRecord& record : records) {
    if (record.first <= last) {
      ++state.invalid;
      continue;
    }
    last = record.last;
    state.tickets.push_back(to_ticket(record));
  }
}

}  // namespace

InheritedState read_inherited(const ServantSegment& former, const ArmModel& arm,
                              std::uint64_t next_command_id) {
  InheritedState state;
  if (SettingsRecord record{}; read_valid(former.state.settings, record, state.invalid)) {
    if (are_valid_frames(record, arm)) {
      state.settings = to_settings(record);
    } else {
      ++state.invalid;
    }
  }
  read_alarms(former.state, state);
  read_tickets(former, arm, next_command_id, state);
  if (ControlRecord record{}; read_valid(former.state.control, record, state.invalid)) state.control = record;
  if (HoldRecord record{}; read_valid(former.state.hold, record, state.invalid))
    state.held_by = record.by.data();
  return state;
}

}  // namespace corbot
