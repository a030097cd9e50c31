// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/bus/frame_sender.h"

#include <algorithm>
#include <chrono>

namespace corbot::rt {

bool FrameSender::send(const ServoFrame& frame) {
  if (!device_.send(frame, false)) return false;
  counted_.cycle = frame.cycle;
  if (frame.time_ns != 0) {
    counted_.age_ns = std::chrono::steady_clock::now().time_since_epoch().count() - frame.time_ns;
    counted_.age_max_ns = std::max(counted_.age_max_ns, counted_.age_ns);
  }
  count(frame);
  return true;
}

bool FrameSender::send_on_the_way(const ServoFrame& frame, bool approach) {
  if (!device_.send(frame, approach)) return false;
  count(frame);
  return true;
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
