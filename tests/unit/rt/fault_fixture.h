// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>

#include "rt/fake_device.h"
#include "rt/rig.h"

namespace corbot::test {

inline const Joints kThere{0.8, 1.2, 1.5, 0.5};
inline constexpr int kLongestStop = 5000;  // cycles

/// Looks at set-points by their differences, from outside.
class Differences {
 public:
  Differences(const ArmModel& arm, const Joints& at_rest) : arm_(arm) { q_.fill(at_rest); }
  /// Greatest share of a limit in this cycle; of the speed's, the acceleration's and the jerk's.
  double see(const Joints& position_q) {
    std::rotate(q_.rbegin(), q_.rbegin() + 1, q_.rend());
    q_[0] = position_q;
    const double dt_s = static_cast<double>(arm_.period_ns) * 1e-9;
    double share = 0.0;
    for (std::size_t i = 0; i < arm_.dof; ++i) {
      const JointLimits& limits = arm_.joints[i];
      const double v = (q_[0][i] - q_[1][i]) / dt_s;
      const double a = (q_[0][i] - 2 * q_[1][i] + q_[2][i]) / (dt_s * dt_s);
      const double j = (q_[0][i] - 3 * q_[1][i] + 3 * q_[2][i] - q_[3][i]) / (dt_s * dt_s * dt_s);
      share = std::max({share, std::abs(v) / limits.speed_q_s, std::abs(a) / limits.acceleration_q_s2,
                        std::abs(j) / limits.jerk_q_s3});
      EXPECT_GE(position_q[i], limits.lower_q - 1e-9);
      EXPECT_LE(position_q[i], limits.upper_q + 1e-9);
    }
    return share;
  }

 private:
  ArmModel arm_;
  std::array<Joints, 4> q_{};
};

class FaultStops : public ::testing::Test {
 protected:
  FaultStops() { rig.step(); }

  std::uint64_t go(const Joints& there = kThere) {
    return rig.submit(rig.planner.move_joints(rig.start(), {}, there, 0.0));
  }
  void press(bool pressed) { rig.emergency_stop->set(StopSource::kGpio, pressed); }
  [[nodiscard]] bool is_off() const { return (rig.snapshot.flags & kSnapshotPowerOff) != 0; }
  [[nodiscard]] bool is_slowing_down() const { return (rig.snapshot.flags & kSnapshotFaultStop) != 0; }
  [[nodiscard]] bool is_unverified() const { return (rig.snapshot.flags & kSnapshotUnverified) != 0; }
  void until_rest() {
    for (int i = 0; i < kLongestStop && rig.snapshot.command_id != 0; ++i) rig.step();
    ASSERT_EQ(rig.snapshot.command_id, 0u);
  }
  void until_set_points_rest() {
    Joints before{};
    for (int i = 0; i < kLongestStop && rig.snapshot.position_q != before; ++i) {
      before = rig.snapshot.position_q;
      rig.step();
    }
    ASSERT_EQ(rig.snapshot.position_q, before);
  }
  void clear() {
    rig.clear();
    rig.step();
  }
  void begin_anew(const rt::CycleStart& start) {
    rig.task = std::make_unique<TaskSegment>();
    rig.servant = std::make_unique<ServantSegment>();
    rig.restart(start);
    rig.step();
  }

  FakeDevice device;
  Rig rig{device};
};

}  // namespace corbot::test
