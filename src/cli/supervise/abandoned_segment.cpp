// SPDX-License-Identifier: Apache-2.0
#include "cli/supervise/abandoned_segment.h"

#include <fcntl.h>
#include <sys/mman.h>

#include <algorithm>
#include <filesystem>

#include "shm/segment.h"

namespace corbot::cli {

namespace {

/// Whether no process holds the segment; removes it then if `remove`.
bool is_abandoned(const std::string& name, bool remove) noexcept {
  using namespace segment_detail;
  try {
    const File file = open_existing(name, O_RDWR);
    const Gate gate(file, name);  // no process attaches during the check
    if (file.status(name).st_nlink == 0) return false;
    if (file.held_by_other(LockByte::kRealTimeTask) || file.held_by_other(LockByte::kServant)) return false;
    return !remove || ::shm_unlink(shm_name(name).c_str()) == 0;
  } catch (const SegmentError&) {
    return false;  // absent, or not ours to remove
  }
}

}  // namespace

bool remove_abandoned_segment(const std::string& name) noexcept { return is_abandoned(name, true); }

std::vector<std::string> abandoned_segments() {
  const std::filesystem::path prefix = segment_detail::shm_path("");
  const std::string stem = prefix.filename().string();
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(prefix.parent_path(), error)) {
    const std::string file = entry.path().filename().string();
    if (!file.starts_with(stem)) continue;
    const std::string name = file.substr(stem.size());
    if (is_abandoned(name, false)) names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace corbot::cli
