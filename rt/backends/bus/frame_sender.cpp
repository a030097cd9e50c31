// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/bus/frame_sender.h"

#include <algorithm>
#include <chrono>

namespace corbot::rt {

void FrameSender::send(const ServoFrame& frame, bool approach) {
  device_.send(frame, approach);
  last_ = frame;
  ++counted_.frames;
  if (!approach && frame.time_ns != 0) {
    counted_.age_ns = std::chrono::steady_clock::now().time_since_epoch().count() - frame.time_ns;
    counted_.age_max_ns = std::max(counted_.age_max_ns, counted_.age_ns);
  }
  times_.store(counted_);
}

BackendTimes FrameSender::times() const noexcept {
  BackendTimes times;
  return times_.load(times) ? times : BackendTimes{};
}

}  // namespace corbot::rt
