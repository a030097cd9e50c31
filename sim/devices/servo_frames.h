// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "sim/servo_model.h"

namespace corbot::sim {

/// The period of servo frames, which begin at its multiples.
inline constexpr std::int64_t kServoFrame_ns = 20'000'000;

/// The outputs of a controller, and the servos at them. A new pulse width leaves only with the next frame, at
/// 50 Hz. A servo without pulses has no torque and stays at its position.
class ServoFrames {
 public:
  /// Returns the width that the controller commands at an instant; 0: no pulse. Called in the order of time.
  using PulseAt = std::function<double(std::size_t channel, std::int64_t time_ns)>;

  ServoFrames(std::size_t channels, const ServoModelOptions& servo, double shaft_us);

  /// Sends the frames that have begun since the last call.
  void advance(std::int64_t now_ns, const PulseAt& pulse_at);
  /// Stops all pulses from now on.
  void stop();

  [[nodiscard]] double pulse_us(std::size_t channel) const;
  /// Returns the shaft position at an instant within the latest frame.
  [[nodiscard]] double shaft_us(std::size_t channel, std::int64_t now_ns) const;

 private:
  struct Output {
    double pulse_us;
    ServoModel servo;
  };
  void send_frame(const PulseAt& pulse_at);
  void pass(double dt_s);

  ServoModelOptions servo_;
  std::vector<Output> outputs_;
  bool has_begun_{false};
  std::int64_t frame_ns_{0};
};

}  // namespace corbot::sim
