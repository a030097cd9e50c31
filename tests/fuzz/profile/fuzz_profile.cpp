// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "config/load_profile.h"

namespace {

/// Returns true if the profile keeps all that an accepted one must keep, whatever its text was.
bool is_sound(const corbot::Profile& profile) {
  const corbot::ArmModel& arm = profile.arm;
  if (arm.dof < 1 || arm.dof > corbot::kMaxJoints) return false;
  if (arm.period_ns < 250'000 || arm.period_ns > 20'000'000) return false;
  for (std::size_t i = 0; i < arm.dof; ++i) {
    const corbot::JointLimits& joint = arm.joints[i];
    const corbot::ServoMap& servo = arm.servos[i];
    const bool limits_sound = joint.lower_q <= 0 && joint.upper_q >= 0 && joint.lower_q < joint.upper_q &&
                              joint.speed_q_s > 0 && joint.acceleration_q_s2 > 0 && joint.jerk_q_s3 > 0;
    if (!limits_sound) return false;
    for (const double angle : {joint.lower_q, joint.upper_q}) {
      const double pulse = servo.zero_us + servo.direction * servo.us_per_q * angle;
      if (!std::isfinite(pulse) || pulse < 499.999 || pulse > 2500.001) return false;
    }
  }
  return true;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text{reinterpret_cast<const char*>(data), size};
  try {
    if (!is_sound(corbot::parse_profile(text, "fuzz.toml"))) std::abort();
  } catch (const corbot::ConfigError& error) {
    for (const corbot::ConfigFault& fault : error.faults()) {
      if (fault.allowed.empty() || fault.text().empty()) std::abort();
    }
  }
  return 0;
}
