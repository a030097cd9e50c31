// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <thread>

#include "contract/device_fixture.h"
#include "corbot/channel/snapshot_cell.h"

namespace corbot::test {

/// A position that an arm should reach.
struct Pose {
  Joints position_q{};
  double opening{};
};

/// Stands in for the real-time cycle: writes a frame a millisecond, reads, gets the health, and holds while
/// the device is lost. After a loss it is in Error, in which power goes off, until it is cleared. While the
/// device stands by it follows the measured position. Its thread is watched for system calls.
class Driver {
 public:
  Driver(const ArmModel& arm, Backend& backend, DeviceFixture& fixture, const Pose& at);
  ~Driver() { end(); }
  Driver(const Driver&) = delete;
  Driver& operator=(const Driver&) = delete;

  /// The frame for a pose, as Backend::open() takes it.
  [[nodiscard]] static ServoFrame frame(const ArmModel& arm, const Pose& pose);

  void start();
  void end();
  /// A straight motion in joint space, from where it is now; 0 s: at once, even while the device is lost.
  void move(const Pose& to, double seconds);
  /// A loss ends a motion; whatever is asked for meanwhile is not begun.
  [[nodiscard]] Pose pose() const;
  /// Latches an emergency stop, or ends it, as the cycle does.
  void set_emergency_stop(bool latched) { emergency_stop_.store(latched); }
  /// A person stands beside the arm and clears what was lost as soon as it stands by, from here on. Until
  /// leave().
  void clear() { is_attended_.store(true); }
  /// No person clears from here on.
  void leave() { is_attended_.store(false); }
  /// No frames from here on, as when the cycle is frozen.
  void freeze(bool frozen);
  /// Frames written so far.
  [[nodiscard]] std::uint64_t cycles() const { return cycles_.load(); }
  [[nodiscard]] bool moving() const { return moving_.load(); }
  /// The longest that a frame was under way to the device, by what the backend says.
  [[nodiscard]] double oldest_s() const { return static_cast<double>(oldest_ns_.load()) * 1e-9; }
  [[nodiscard]] ServoFeedback feedback() const;
  /// Returns the outputs that the device should have now.
  [[nodiscard]] std::vector<double> wanted(bool joints) const;

 private:
  struct Motion {
    std::uint64_t number{};
    Pose to{};
    std::int64_t duration_ns{};
  };

  void run() noexcept;
  void follow(Pose& at) noexcept;

  const ArmModel arm_;
  Backend& backend_;
  DeviceFixture& fixture_;
  SnapshotCell<Motion> motion_;
  SnapshotCell<Pose> pose_;
  SnapshotCell<ServoFeedback> feedback_;
  std::atomic<std::uint64_t> begun_{0};
  std::atomic<bool> moving_{false};
  std::atomic<bool> emergency_stop_{false};
  std::atomic<bool> is_attended_{true};  ///< a machine that stands still loses devices
  std::atomic<bool> frozen_{false};
  std::atomic<bool> is_frozen_{false};
  std::atomic<std::uint64_t> cycles_{0};
  std::atomic<std::int64_t> oldest_ns_{0};
  std::atomic<bool> end_{false};
  std::uint64_t asked_{0};
  std::thread thread_;
};

}  // namespace corbot::test
