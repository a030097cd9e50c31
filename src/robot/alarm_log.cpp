// SPDX-License-Identifier: Apache-2.0
#include "robot/alarm_log.h"

#include <algorithm>
#include <chrono>
#include <iterator>

namespace corbot {
void AlarmLog::add(const AlarmEvent& event) {
  push({static_cast<double>(event.time_ns) * 1e-9, static_cast<std::int32_t>(event.code),
        causes_error(event.code), alarm_text(event)});
}

void AlarmLog::add(std::int32_t code, bool active, const std::string& text) {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  push({std::chrono::duration<double>(now).count(), code, active, text});
}

void AlarmLog::push(AlarmEntry entry) {
  const std::lock_guard lock(mutex_);
  entries_.push_back(std::move(entry));
  if (entries_.size() <= kKept) return;
  // What has not been cleared outlives what has. Where all are active, which takes a device that comes and
  // goes, a later one of the same code says the same.
  auto victim = std::find_if(entries_.begin(), entries_.end(), [](const auto& old) { return !old.active; });
  for (auto old = entries_.begin(); victim == entries_.end() && old != entries_.end(); ++old) {
    const bool again = std::any_of(std::next(old), entries_.end(),
                                   [&](const auto& later) { return later.code == old->code; });
    if (again) victim = old;
  }
  entries_.erase(victim == entries_.end() ? entries_.begin() : victim);
}

void AlarmLog::deactivate() {
  const std::lock_guard lock(mutex_);
  for (AlarmEntry& entry : entries_) entry.active = entry.code == kAlarmTaskGone && entry.active;
}

void AlarmLog::deactivate(std::int32_t code) {
  const std::lock_guard lock(mutex_);
  for (AlarmEntry& entry : entries_) entry.active = entry.active && entry.code != code;
}

std::vector<AlarmEntry> AlarmLog::list() const {
  const std::lock_guard lock(mutex_);
  return {entries_.begin(), entries_.end()};
}

std::string AlarmLog::cause() const {
  const std::lock_guard lock(mutex_);
  for (auto entry = entries_.rbegin(); entry != entries_.rend(); ++entry) {
    if (entry->active) return entry->text;
  }
  return {};
}

}  // namespace corbot
