// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "corbot/backend/backend.h"

namespace corbot::test {

/// A device in a test's hands: what it says of itself is what the test has written, and what it was given
/// last is kept.
class FakeDevice final : public Backend {
 public:
  /// Measures its own frame less `lag_q`, as a device with encoders does.
  void measure() {
    feedback = {
        .measured = true, .time_ns = frame.time_ns, .position_q = frame.position_q, .opening = opening};
    for (std::size_t i = 0; i < kMaxJoints; ++i) feedback.position_q[i] -= lag_q[i];
  }

  void open(const ServoFrame& first) override { frame = first; }
  void close() noexcept override { now = BackendHealth::kClosed; }
  void write(const ServoFrame& given) noexcept override {
    frame = given;
    if (takes) {
      times_now.cycle = given.cycle;
      ++times_now.frames;
    }
    if (has_thread && !is_still) ++beats_now;
    if (measures) measure();
    // Stands by as a drive does: its energy goes, and comes back slowly.
    if (stands_by && frame.power_off && now != BackendHealth::kLost) now = BackendHealth::kStandby;
  }
  [[nodiscard]] ServoFeedback read() noexcept override { return feedback; }
  [[nodiscard]] bool has_encoders() const noexcept override { return encoders; }
  [[nodiscard]] BackendHealth health() const noexcept override { return now; }
  [[nodiscard]] DeviceCause cause() const noexcept override { return why; }
  [[nodiscard]] BackendTimes times() const noexcept override { return times_now; }
  [[nodiscard]] std::uint32_t beats() const noexcept override { return beats_now; }
  [[nodiscard]] const char* name() const noexcept override { return "fake"; }

  ServoFrame frame{};
  ServoFeedback feedback{};
  Joints lag_q{};
  double opening{-1.0};  ///< of the gripper, as it is measured; negative: it is not
  BackendTimes times_now{};
  BackendHealth now{BackendHealth::kOpen};
  DeviceCause why{DeviceCause::kNone};
  bool takes{true};
  bool encoders{false};
  bool measures{false};
  bool stands_by{false};
  bool has_thread{false};
  bool is_still{false};  ///< its thread
  std::uint32_t beats_now{0};
};

}  // namespace corbot::test
