// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace corbot::sim {

struct ServoModelOptions {
  double rate_us_per_s{2400.0};  ///< slew at full speed, in pulse width
  double dead_band_us{0.0};      ///< a servo ignores smaller differences
  double lag_s{0.0};             ///< time constant of a first-order lag before the slew, 0 = none
  double resolution_us{1.0};     ///< pulses come in steps of this, 0 = any width
};

/// A hobby servo; a pulse width gives its shaft position. It takes the pulse in steps of its resolution,
/// ignores differences within its dead band, lags, and slews no faster than its rate. Real-time safe.
class ServoModel {
 public:
  ServoModel() = default;
  ServoModel(const ServoModelOptions& options, double position_us) noexcept;

  /// Sets a new pulse, which is kept until the next. A pulse that is not finite is ignored.
  void set_pulse(double pulse_us) noexcept;
  /// Lets time pass; dt_s ≥ 0.
  void step(double dt_s) noexcept;

  [[nodiscard]] double position_us() const noexcept { return position_us_; }
  /// Returns the pulse that the servo follows, after resolution and dead band.
  [[nodiscard]] double target_us() const noexcept { return target_us_; }

 private:
  ServoModelOptions options_{};
  double target_us_{1500.0};
  double lagged_us_{1500.0};
  double position_us_{1500.0};
};

}  // namespace corbot::sim
