// SPDX-License-Identifier: Apache-2.0
#include "robot/alarm_log.h"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <utility>

#include "robot/call_error.h"

namespace corbot {
namespace {

bool is_hold(const AlarmEntry& entry) { return entry.code == static_cast<std::int32_t>(AlarmCode::kHeld); }

}  // namespace

void AlarmLog::add(const AlarmEvent& event) {
  AlarmEntry entry{static_cast<double>(event.time_ns) * 1e-9, static_cast<std::int32_t>(event.code),
                   causes_error(event.code), alarm_text(event, kinds_, shapes_)};
  const std::lock_guard lock(mutex_);
  const bool is_repeated =
      may_repeat_ && std::any_of(entries_.begin(), entries_.end(), [&](const Kept& kept) {
        return kept.entry.time_s == entry.time_s && kept.entry.code == entry.code &&
               kept.entry.text == entry.text;
      });
  may_repeat_ = false;
  if (!is_repeated) push(std::move(entry));
}

void AlarmLog::add(std::int32_t code, bool active, const std::string& text) {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const std::lock_guard lock(mutex_);
  push({std::chrono::duration<double>(now).count(), code, active, text});
}

void AlarmLog::add_once(const AlarmEvent& event, const std::string& text) {
  const auto code = static_cast<std::int32_t>(event.code);
  const std::lock_guard lock(mutex_);
  may_repeat_ = false;
  const bool is_listed = std::any_of(entries_.begin(), entries_.end(), [&](const Kept& kept) {
    return kept.entry.active && kept.entry.code == code;
  });
  if (!is_listed) push({static_cast<double>(event.time_ns) * 1e-9, code, true, text});
}

void AlarmLog::replace_text(std::int32_t code, const std::string& before, const std::string& text) {
  const std::lock_guard lock(mutex_);
  for (Kept& kept : entries_) {
    if (!kept.entry.active || kept.entry.code != code || kept.entry.text != before) continue;
    kept.entry.text = text;
    keep(kept);
  }
}

void AlarmLog::inherit(const std::vector<AlarmEntry>& former) {
  const std::lock_guard lock(mutex_);
  const std::deque<Kept> own = std::exchange(entries_, {});
  for (const AlarmEntry& entry : former) push(entry);
  for (const Kept& kept : own) push(kept.entry);
  may_repeat_ = true;
}

void AlarmLog::push(AlarmEntry entry) {
  entries_.push_back({std::move(entry), entries_.size(), ++last_order_});
  if (entries_.size() <= kKept) return keep(entries_.back());
  const auto victim = find_victim();
  const bool is_kept = victim != std::prev(entries_.end());
  entries_.back().place = victim->place;
  if (is_kept) keep(entries_.back());
  entries_.erase(victim);
}

/// Picks the entry to drop: the oldest inactive one. If all are active, picks an entry whose code occurs
/// again in a later one. A device that connects and disconnects repeatedly causes this case.
std::deque<AlarmLog::Kept>::iterator AlarmLog::find_victim() {
  auto victim =
      std::find_if(entries_.begin(), entries_.end(), [](const Kept& old) { return !old.entry.active; });
  for (auto old = entries_.begin(); victim == entries_.end() && old != entries_.end(); ++old) {
    const bool again = std::any_of(std::next(old), entries_.end(),
                                   [&](const Kept& later) { return later.entry.code == old->entry.code; });
    if (again) victim = old;
  }
  return victim == entries_.end() ? entries_.begin() : victim;
}

void AlarmLog::keep(const Kept& kept) {
  if (records_ == nullptr) return;
  AlarmRecord record{kept.order, kept.entry.time_s, kept.entry.code, kept.entry.active ? 1u : 0u, {}};
  copy_text(kept.entry.text, record.text, sizeof(record.text));
  (*records_)[kept.place].store(record);
}

void AlarmLog::deactivate() {
  const std::lock_guard lock(mutex_);
  for (Kept& kept : entries_) {
    if (!kept.entry.active || kept.entry.code == kAlarmTaskGone) continue;
    kept.entry.active = false;
    keep(kept);
  }
}

void AlarmLog::deactivate(std::int32_t code) {
  const std::lock_guard lock(mutex_);
  for (Kept& kept : entries_) {
    if (!kept.entry.active || kept.entry.code != code) continue;
    kept.entry.active = false;
    keep(kept);
  }
}

std::vector<AlarmEntry> AlarmLog::list() const {
  const std::lock_guard lock(mutex_);
  std::vector<AlarmEntry> list;
  list.reserve(entries_.size());
  for (const Kept& kept : entries_) list.push_back(kept.entry);
  return list;
}

std::string AlarmLog::cause() const {
  const std::lock_guard lock(mutex_);
  std::string hold;
  for (auto kept = entries_.rbegin(); kept != entries_.rend(); ++kept) {
    if (kept->entry.active && !is_hold(kept->entry)) return kept->entry.text;
    if (kept->entry.active && hold.empty()) hold = kept->entry.text;
  }
  return hold;
}

bool AlarmLog::is_hold_alone() const {
  const std::lock_guard lock(mutex_);
  const auto is_active = [](const Kept& kept) { return kept.entry.active; };
  const auto is_fault = [](const Kept& kept) { return kept.entry.active && !is_hold(kept.entry); };
  return std::any_of(entries_.begin(), entries_.end(), is_active) &&
         std::none_of(entries_.begin(), entries_.end(), is_fault);
}

}  // namespace corbot
