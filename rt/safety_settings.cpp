// SPDX-License-Identifier: Apache-2.0
#include "rt/safety_settings.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

namespace corbot::rt {

SafetySettings safety_settings(const Profile& profile) {
  static constexpr std::array<std::pair<std::string_view, GpioBias>, 3> kBiases{
      {{"pull-up", GpioBias::kPullUp}, {"pull-down", GpioBias::kPullDown}, {"none", GpioBias::kDisabled}}};
  SafetySettings settings;
  const EmergencyStopOptions& stop = profile.emergency_stop;
  if (!stop.chip.empty()) {
    settings.stop = GpioRequest{stop.chip, {stop.line}, stop.active_low, GpioBias::kAsIs, "corbot stop"};
    for (const auto& [name, bias] : kBiases) {
      if (name == stop.bias) settings.stop->bias = bias;
    }
  }
  const PowerEnableOptions& power = profile.power_enable;
  if (!power.chip.empty()) {
    settings.power = GpioRequest{power.chip, {power.line}, power.active_low, GpioBias::kAsIs, "corbot power"};
  }
  settings.off_at_stop = power.off_at_stop;
  const WatchdogOptions& watchdog = profile.watchdog;
  if (!watchdog.chip.empty()) {
    settings.watchdog =
        GpioRequest{watchdog.chip, {watchdog.line}, watchdog.active_low, GpioBias::kAsIs, "corbot watchdog"};
    settings.watchdog_period_ns = watchdog.period_ns;
  }
  settings.category = profile.stop.category;
  settings.ramp_ns = static_cast<std::int64_t>(profile.stop.ramp_s * 1e9);
  settings.priority = std::max(profile.priority - 1, 1);
  return settings;
}

}  // namespace corbot::rt
