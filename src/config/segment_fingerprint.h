// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "config/profile.h"
#include "corbot/channel/fingerprint.h"

namespace corbot {

/// Returns a fingerprint that servant and real-time task must share: the arm's model and the device (`kind`
/// of [backend]). A device therefore gets neither position nor Error from the segment of a simulated arm. The
/// simulator's fingerprint covers the model alone.
[[nodiscard]] inline std::uint64_t segment_fingerprint(const Profile& profile) {
  const std::uint64_t model = fingerprint(profile.arm);
  if (profile.backend.kind == "loopback") return model;
  Fnv1a hash;
  hash.add(model);
  for (const char letter : profile.backend.kind) hash.add(static_cast<std::uint64_t>(letter));
  return hash.value();
}

}  // namespace corbot
