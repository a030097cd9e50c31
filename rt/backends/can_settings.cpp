// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/can_settings.h"

#include <algorithm>
#include <cmath>

namespace corbot::rt {
namespace {

std::uint32_t counts(double q, const CanDrive& drive) {
  return static_cast<std::uint32_t>(std::clamp(std::round(q * drive.counts_per_q), 1.0, 4294967295.0));
}

std::optional<HomingSettings> homing_of(const CanDrive& drive) {
  const CanHoming& homing = drive.homing;
  if (homing.method == 0) return std::nullopt;
  HomingSettings settings{homing.method, counts(homing.speed_q_s, drive), counts(homing.creep_q_s, drive),
                          std::nullopt, static_cast<std::int32_t>(std::lround(homing.offset))};
  if (homing.acceleration_q_s2 > 0.0) settings.counts_per_s2 = counts(homing.acceleration_q_s2, drive);
  return settings;
}

}  // namespace

Cia402Settings cia402_settings(const Profile& profile) {
  const SocketCanOptions& options = profile.backend.socketcan;
  Cia402Settings settings;
  settings.interface = options.interface;
  settings.bit_rate = static_cast<std::uint32_t>(options.bit_rate);
  settings.heartbeat_ms = options.heartbeat_ms;
  settings.watch_ms = options.watch_ms;
  settings.stagger_ms = profile.backend.common.stagger_ms;
  settings.loop_ns = profile.arm.period_ns;
  settings.stale_ns = profile.gap_fault_ns;  // from there on the cycle itself does not go on without a Clear
  settings.gripper_model = profile.arm.gripper;
  for (const CanDrive& drive : options.drives) {
    settings.joints.push_back({static_cast<std::uint8_t>(drive.node), drive.counts_per_q, drive.zero_count,
                               drive.direction, drive.identity, drive.reports_following, homing_of(drive),
                               profile.arm.kinematics.joint_kind(settings.joints.size())});
  }
  if (options.gripper_node > 0) {
    settings.gripper =
        GripperDrive{static_cast<std::uint8_t>(options.gripper_node), options.gripper_closed_count,
                     options.gripper_open_count, options.gripper_identity, options.gripper_reports_following};
  }
  return settings;
}

}  // namespace corbot::rt
