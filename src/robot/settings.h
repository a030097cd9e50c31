// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mutex>
#include <utility>

#include "corbot/channel/servant_state.h"
#include "planner/plan/plan.h"

namespace corbot {

/// The settings for the motions planned from now on, and their copy for the next servant. Thread-safe; every
/// lock is held briefly.
class Settings {
 public:
  /// `kept` outlives this.
  explicit Settings(DurableCell<SettingsRecord>& kept) : kept_(kept) {}

  [[nodiscard]] PlanSettings get() const;
  /// `how` changes a PlanSettings to values that were checked.
  template <class Change>
  void change(Change&& how) {
    const std::lock_guard lock(mutex_);
    std::forward<Change>(how)(settings_);
    keep();
  }
  /// Takes over the previous servant's settings. Settings that a client has already changed here stay.
  void inherit(const PlanSettings& former);

 private:
  void keep();  ///< the caller holds mutex_

  mutable std::mutex mutex_;
  DurableCell<SettingsRecord>& kept_;
  PlanSettings settings_;
};

/// Convert between settings and the record for the next servant.
[[nodiscard]] SettingsRecord to_record(const PlanSettings& settings);
[[nodiscard]] PlanSettings to_settings(const SettingsRecord& record);

}  // namespace corbot
