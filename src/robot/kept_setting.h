// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <variant>

#include "corbot/arm/arm_model.h"
#include "planner/request.h"
#include "robot/call_error.h"
#include "state/soft_limits_store.h"

namespace corbot {

[[nodiscard]] inline bool moves_joints(const MotionRequest& request) {
  return !std::holds_alternative<DwellRequest>(request) && !std::holds_alternative<GripperRequest>(request);
}

/// A limit that planned motions keep, and its copy on disk, which outlives servant, task and power-down. If
/// the copy cannot be read, the setting is unknown, and no joint moves until it is set or reset. Thread-safe.
template <class Store>
class KeptSetting {
 public:
  using Value = typename Store::Value;

  /// `what`: a plural for texts.
  KeptSetting(const ArmModel& arm, std::string what) : arm_(arm), what_(std::move(what)) {}

  /// Reads the copy, before calls are served. Returns what is wrong with the copy, or "".
  [[nodiscard]] std::string keep_in(Store store) {
    const std::lock_guard lock(mutex_);
    try {
      value_ = store.load(arm_);
    } catch (const SettingError& error) {
      unknown_ = error.what();
    }
    store_ = std::move(store);
    return unknown_;
  }

  [[nodiscard]] bool is_known() const {
    const std::lock_guard lock(mutex_);
    return unknown_.empty();
  }
  /// Returns the value for PlanSettings: nothing if none is set, or it is not known.
  [[nodiscard]] std::optional<Value> wanted() const {
    const std::lock_guard lock(mutex_);
    return unknown_.empty() ? value_ : std::nullopt;
  }
  /// Throws CallError (not ready) if the setting is not known and the request moves joints.
  void check_known(const MotionRequest& request) const {
    if (!moves_joints(request)) return;
    const std::lock_guard lock(mutex_);
    if (unknown_.empty()) return;
    throw not_ready(fmt::format("{} are not known: set or reset them ({})", what_, unknown_));
  }

  /// Saves the value and then runs `apply`, which calls take() or throws. If one of them fails, restores the
  /// saved value. Throws CallError (not ready) if the value cannot be saved. So a servant that is killed here
  /// leaves the value before or the wanted one, and the wanted one as soon as it is in force.
  void change(const std::optional<Value>& wanted, const std::function<void()>& apply) {
    const std::lock_guard one(change_mutex_);
    std::optional<std::string> before;
    write([&](const Store& store) { before = store.text(); });
    try {
      write([&](const Store& store) { store.save(wanted, arm_); });
      apply();
    } catch (const CallError&) {
      restore(before);
      throw;
    }
  }
  /// Puts the value in force.
  void take(const std::optional<Value>& wanted) {
    const std::lock_guard lock(mutex_);
    value_ = wanted;
    unknown_.clear();
  }

 private:
  /// Undoes a refused change on disk. A save can fail when the new file is in its place already. If the file
  /// cannot be restored, the value is unknown, since the refused one is there.
  void restore(const std::optional<std::string>& before) {
    try {
      write([&](const Store& store) {
        if (store.text() != before) store.put(before);
      });
    } catch (const CallError& failed) {
      const std::lock_guard lock(mutex_);
      unknown_ = failed.error.text;
    }
  }

  void write(const std::function<void(const Store&)>& how) const {
    std::optional<Store> store;
    {
      const std::lock_guard lock(mutex_);
      store = store_;
    }
    if (!store) throw not_ready(fmt::format("{} cannot be saved: the servant has no state directory", what_));
    try {
      how(*store);
    } catch (const std::system_error& error) {
      throw not_ready(fmt::format("{} cannot be saved: {}", what_, error.what()));
    }
  }

  const ArmModel& arm_;
  const std::string what_;
  std::mutex change_mutex_;   // one change at a time; locked before mutex_
  mutable std::mutex mutex_;  // guards the members below
  std::optional<Store> store_;
  std::optional<Value> value_;
  std::string unknown_;  ///< why the value is not known; "": it is known
};

/// Ranges that replace the profile's.
using SoftLimits = KeptSetting<SoftLimitsStore>;

}  // namespace corbot
