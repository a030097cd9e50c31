// SPDX-License-Identifier: Apache-2.0
#include "cli/segment_left_over.h"

#include "corbot/channel/segment.h"

namespace corbot::cli {

bool remove_abandoned_segment(const std::string& name) noexcept {
  using namespace segment_detail;
  try {
    const File file = open_existing(name, O_RDWR);
    const Gate gate(file, name);  // nobody enters while it is looked at
    if (file.status(name).st_nlink == 0) return false;
    if (file.held_by_other(LockByte::kRealTimeTask) || file.held_by_other(LockByte::kServant)) return false;
    return ::shm_unlink(shm_name(name).c_str()) == 0;
  } catch (const SegmentError&) {
    return false;  // absent, or not ours to remove
  }
}

}  // namespace corbot::cli
