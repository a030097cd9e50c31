// SPDX-License-Identifier: Apache-2.0
#include "sim/servo_model.h"

#include <algorithm>
#include <cmath>

namespace corbot::sim {

ServoModel::ServoModel(const ServoModelOptions& options, double position_us) noexcept
    : options_(options), target_us_(position_us), lagged_us_(position_us), position_us_(position_us) {}

void ServoModel::set_pulse(double pulse_us) noexcept {
  if (!std::isfinite(pulse_us)) return;
  const double step_us = options_.resolution_us;
  const double quantised_us = step_us > 0.0 ? std::round(pulse_us / step_us) * step_us : pulse_us;
  // The dead band is about the shaft's position, not about the last pulse: small steps add up and are
  // followed.
  if (std::abs(quantised_us - position_us_) <= options_.dead_band_us) return;
  target_us_ = quantised_us;
}

void ServoModel::step(double dt_s) noexcept {
  // Exact for a constant target, for any dt_s.
  const double share = options_.lag_s > 0.0 ? -std::expm1(-dt_s / options_.lag_s) : 1.0;
  lagged_us_ += share * (target_us_ - lagged_us_);
  const double most_us = options_.rate_us_per_s * dt_s;
  position_us_ += std::clamp(lagged_us_ - position_us_, -most_us, most_us);
}

}  // namespace corbot::sim
