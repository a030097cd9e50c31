// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "config/profile.h"
#include "corbot/channel/fingerprint.h"

namespace corbot {

/// Returns a fingerprint that servant and real-time task must share: the arm's model, its workspace, and the
/// device (`kind` of [backend]). A device therefore gets neither position nor Error from the segment of a
/// simulated arm. The simulator's fingerprint covers model and workspace alone.
[[nodiscard]] inline std::uint64_t segment_fingerprint(const Profile& profile) {
  const std::uint64_t model = fingerprint(profile.arm);
  const bool is_device = profile.backend.kind != "loopback";
  if (!is_device && profile.arm.workspace.count == 0) return model;
  Fnv1a hash;
  hash.add(model);
  if (is_device)
    for (const char letter : profile.backend.kind) hash.add(static_cast<std::uint64_t>(letter));
  add(hash, profile.arm.workspace);
  return hash.value();
}

}  // namespace corbot
