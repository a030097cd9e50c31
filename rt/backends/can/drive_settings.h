// SPDX-License-Identifier: Apache-2.0
// The profile's settings of drives on a CAN bus.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "corbot/arm/arm_model.h"

namespace corbot::rt {

/// The identity 1018h:1 to 4: vendor, product, revision and serial number, if they are to be checked.
using DriveIdentity = std::array<std::optional<std::uint32_t>, 4>;

/// The homing of a drive that loses its count with its power. Speeds are in counts a second, as the drive
/// takes them.
struct HomingSettings {
  int method;                                  ///< 6098h
  std::uint32_t search_counts_per_s;           ///< 6099h:1
  std::uint32_t creep_counts_per_s;            ///< 6099h:2
  std::optional<std::uint32_t> counts_per_s2;  ///< 609Ah
  std::int32_t offset;                         ///< 607Ch
};

/// A joint's drive: count = zero_count + direction * counts_per_q * q.
struct JointDrive {
  std::uint8_t node;
  double counts_per_q;
  double zero_count;
  double direction;  ///< +1 or -1
  DriveIdentity identity{};
  bool reports_following{true};  ///< by bit 12 of its statusword, as CiA 402-2 requires
  std::optional<HomingSettings> homing{};
  JointKind kind{JointKind::kRotary};
};

/// The gripper's drive, if there is one: from closed to open as the pulse goes.
struct GripperDrive {
  std::uint8_t node;
  double closed_count;
  double open_count;
  DriveIdentity identity{};
  bool reports_following{true};
};

struct Cia402Settings {
  std::string interface;
  std::uint32_t bit_rate{0};  ///< 0: read it from the interface
  int heartbeat_ms{200};      ///< period of the drives' heartbeats; a drive is lost after three times as much
  int watch_ms{0};            ///< a drive reacts if corbot is silent for this time; 0: it does not
  int stagger_ms{0};          ///< between the enabling of two drives; 0: all at once
  std::int64_t loop_ns{1'000'000};
  /// The age at which the cycle's frames count as stale: set-points no longer arrive; 0: never.
  std::int64_t stale_ns{0};
  std::string home_command{"corbot home PROFILE"};  ///< the command that a person types
  std::vector<JointDrive> joints{};                 ///< in the order of the joints
  std::optional<GripperDrive> gripper{};
  GripperModel gripper_model{};
};

/// Returns the nodes of all drives, joints first.
[[nodiscard]] inline std::vector<std::uint8_t> nodes_of(const Cia402Settings& settings) {
  std::vector<std::uint8_t> nodes;
  for (const JointDrive& joint : settings.joints) nodes.push_back(joint.node);
  if (settings.gripper) nodes.push_back(settings.gripper->node);
  return nodes;
}

}  // namespace corbot::rt
