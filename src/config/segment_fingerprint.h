// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>

#include "config/profile.h"
#include "corbot/channel/fingerprint.h"

namespace corbot {

/// Returns the fingerprint of a simulated arm: model and workspace. Link radii count without shapes, too:
/// clients' shapes use them.
[[nodiscard]] inline std::uint64_t segment_fingerprint(const ArmModel& arm) noexcept {
  const std::uint64_t model = fingerprint(arm);
  const auto& radii_m = arm.workspace.link_radius_m;
  const bool is_thin =
      std::all_of(radii_m.begin(), radii_m.end(), [](double each_m) { return each_m == 0.0; });
  if (arm.workspace.count == 0 && is_thin) return model;
  Fnv1a hash;
  hash.add(model);
  add(hash, arm.workspace);
  return hash.value();
}

/// Returns a fingerprint that servant and real-time task must share: the arm's model, its workspace, and the
/// device (`kind` of [backend]). A device therefore gets neither position nor Error from the segment of a
/// simulated arm.
[[nodiscard]] inline std::uint64_t segment_fingerprint(const Profile& profile) {
  const std::uint64_t simulated = segment_fingerprint(profile.arm);
  if (profile.backend.kind == "loopback") return simulated;
  Fnv1a hash;
  hash.add(simulated);
  for (const char letter : profile.backend.kind) hash.add(static_cast<std::uint64_t>(letter));
  return hash.value();
}

}  // namespace corbot
