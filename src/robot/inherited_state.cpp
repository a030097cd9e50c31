// SPDX-License-Identifier: Apache-2.0
#include "robot/inherited_state.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace corbot {
namespace {

/// False for whatever is not finite, too.
bool is_within(double value, double lower, double upper) { return value >= lower && value <= upper; }
bool is_ratio(double value) { return value > 0.0 && value <= 1.0; }

bool is_valid(const SettingsRecord& record) {
  return is_ratio(record.speed_ratio) &&
         std::all_of(record.joint_speed_ratio.begin(), record.joint_speed_ratio.end(), is_ratio) &&
         is_within(record.tool_pitch_rad, -std::numbers::pi, std::numbers::pi);
}

/// Whether the cell has a valid record; counts one that is invalid.
template <class Record>
bool read(const DurableCell<Record>& cell, Record& record, int& invalid) {
  switch (cell.load(record)) {
    case DurableCell<Record>::Content::kNone:
      return false;
    case DurableCell<Record>::Content::kRecord:
      if (is_valid(record)) return true;
      break;
    case DurableCell<Record>::Content::kInvalid:
      break;
  }
  ++invalid;
  return false;
}

}  // namespace

InheritedState read_inherited(const ServantState& former) {
  InheritedState state;
  if (SettingsRecord record{}; read(former.settings, record, state.invalid))
    state.settings = {record.speed_ratio, record.joint_speed_ratio, record.tool_pitch_rad};
  return state;
}

}  // namespace corbot
