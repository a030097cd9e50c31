// SPDX-License-Identifier: Apache-2.0
#include "cli/supervise/abandoned_segment.h"

#include "shm/run_directory.h"

namespace corbot::cli {

bool remove_abandoned_segment(const std::string& name) noexcept { return remove_left_behind(name); }

std::vector<std::string> abandoned_segments() {
  try {
    const auto directory = RunDirectory::open(false);
    return directory ? directory->left_behind() : std::vector<std::string>{};
  } catch (const SegmentError&) {
    return {};  // another user's: none of ours
  }
}

}  // namespace corbot::cli
