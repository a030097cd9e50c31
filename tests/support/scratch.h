// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <string>

namespace corbot::test {

/// Returns the directory in which a test makes its own: `usual`, of the build tree, or the one that
/// CORBOT_SCRATCH names. The rig names its memory. There the build tree is slow, so an emulator that records
/// in it falls behind. The next boot would also find the files that one left.
inline std::string scratch_directory(const std::string& usual) {
  const char* named = std::getenv("CORBOT_SCRATCH");
  return named != nullptr ? named : usual;
}

}  // namespace corbot::test
