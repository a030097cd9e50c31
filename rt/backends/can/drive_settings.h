// SPDX-License-Identifier: Apache-2.0
// What a profile says of drives on a CAN bus.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "corbot/arm/arm_model.h"

namespace corbot::rt {

/// 1018h:1 to 4: vendor, product, revision and serial number, where they are to be checked.
using DriveIdentity = std::array<std::optional<std::uint32_t>, 4>;

/// Of a drive that loses its count with its power. Speeds in counts a second, as the drive takes them.
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
  bool reports_following{true};  ///< by bit 12 of its statusword, as CiA 402-2 demands
  std::optional<HomingSettings> homing{};
  JointKind kind{JointKind::kRotary};
};

/// The gripper's drive, where it has one: from closed to open as the pulse goes.
struct GripperDrive {
  std::uint8_t node;
  double closed_count;
  double open_count;
  DriveIdentity identity{};
  bool reports_following{true};
};

struct Cia402Settings {
  std::string interface;
  std::uint32_t bit_rate{0};  ///< 0: ask the interface
  int heartbeat_ms{200};      ///< that the drives send; one is lost after three times as much
  int watch_ms{0};            ///< a drive reacts when corbot is silent for so long; 0: it is not asked to
  int stagger_ms{0};          ///< between the enabling of two drives; 0: all at once
  std::int64_t loop_ns{1'000'000};
  /// The cycle's frames count as standing still after so long: set-points no longer arrive; 0: never.
  std::int64_t stale_ns{0};
  std::string home_command{"corbot home PROFILE"};  ///< that a person types
  std::vector<JointDrive> joints{};                 ///< in the order of the joints
  std::optional<GripperDrive> gripper{};
  GripperModel gripper_model{};
};

/// Of all drives, joints first.
[[nodiscard]] inline std::vector<std::uint8_t> nodes_of(const Cia402Settings& settings) {
  std::vector<std::uint8_t> nodes;
  for (const JointDrive& joint : settings.joints) nodes.push_back(joint.node);
  if (settings.gripper) nodes.push_back(settings.gripper->node);
  return nodes;
}

}  // namespace corbot::rt
