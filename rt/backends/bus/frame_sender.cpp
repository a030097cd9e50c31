// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/bus/frame_sender.h"

#include <algorithm>
#include <chrono>

namespace corbot::rt {

void FrameSender::send(const ServoFrame& frame) {
  device_.send(frame, false);
  counted_.cycle = frame.cycle;
  if (frame.time_ns != 0) {
    counted_.age_ns = std::chrono::steady_clock::now().time_since_epoch().count() - frame.time_ns;
    counted_.age_max_ns = std::max(counted_.age_max_ns, counted_.age_ns);
  }
  count(frame);
}

void FrameSender::send_on_the_way(const ServoFrame& frame, bool approach) {
  device_.send(frame, approach);
  count(frame);
}

void FrameSender::count(const ServoFrame& frame) {
  last_ = frame;
  ++counted_.frames;
  times_.store(counted_);
}

BackendTimes FrameSender::times() const noexcept {
  BackendTimes times;
  return times_.load(times) ? times : BackendTimes{};
}

}  // namespace corbot::rt
