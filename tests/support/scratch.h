// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <string>

namespace corbot::test {

/// Where a test makes its directory: in `usual`, of the build tree, or in what CORBOT_SCRATCH names. The rig
/// names its memory. There the build tree is slow, so an emulator that records in it falls behind; and the
/// next boot finds what one left.
inline std::string scratch_directory(const std::string& usual) {
  const char* named = std::getenv("CORBOT_SCRATCH");
  return named != nullptr ? named : usual;
}

}  // namespace corbot::test
