// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <string>

namespace corbot::test {

/// Where a test makes its directory: in `usual`, of the build tree, or in what CORBOT_SCRATCH names. The rig names its memory: there
/// the build tree is slow, an emulator that records each frame in it falls behind, and what a boot leaves the next one finds.
inline std::string scratch_directory(const std::string& usual) {
  const char* named = std::getenv("CORBOT_SCRATCH");
  return named != nullptr ? named : usual;
}

}  // namespace corbot::test
