// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "corbot/arm/arm_model.h"
#include "rt/backends/bus/bus_device.h"
#include "rt/backends/can/drive_bus.h"
#include "rt/backends/can/drive_enabling.h"

namespace corbot::rt {

/// A joint's drive: count = zero_count + direction * counts_per_rad * angle.
struct JointDrive {
  std::uint8_t node;
  double counts_per_rad;
  double zero_count;
  double direction;  ///< +1 or -1
};

/// The gripper's drive, where it has one: from closed to open as the pulse goes.
struct GripperDrive {
  std::uint8_t node;
  double closed_count;
  double open_count;
};

struct Cia402Settings {
  std::string interface;
  std::uint32_t bit_rate{0};  ///< 0: ask the interface
  int heartbeat_ms{200};      ///< that the drives send; one is lost after three times as much
  int watch_ms{0};            ///< a drive reacts when corbot is silent for so long; 0: it is not asked to
  std::int64_t loop_ns{1'000'000};
  std::vector<JointDrive> joints;  ///< in the order of the joints
  std::optional<GripperDrive> gripper;
  GripperModel gripper_model{};
};

/// Drives on a CAN bus after CiA 402, in cyclic synchronous position mode: a drive a joint, and the gripper's
/// where there is one. Each cycle sends controlword and target position to every drive, then SYNC, at which
/// they take them and answer with statusword and position.
class Cia402Drives final : public BusDevice {
 public:
  explicit Cia402Drives(Cia402Settings settings);

  /// Drives that it has enabled are disabled again when it throws; those that held before go on holding.
  std::string open() override;
  void close() noexcept override;
  [[nodiscard]] std::int64_t period_ns() const noexcept override { return bus_.period_ns(); }
  /// Half a loop's period after the cycle: its frame is there, and the next one is far.
  [[nodiscard]] std::optional<std::int64_t> phase_ns() const noexcept override {
    return settings_.loop_ns / 2;
  }
  /// What is too far for one SYNC is a following error.
  [[nodiscard]] std::int64_t longest_gap_ns() const noexcept override { return 0; }
  [[nodiscard]] bool energises_at_open() const noexcept override { return true; }
  void send(const ServoFrame& frame, bool approach) override;
  BusReading measure(const ServoFrame& frame) override;
  [[nodiscard]] std::optional<DeviceError> warning() override;
  /// Voltage off, and the drives pre-operational.
  void relax() override;

  /// Target positions of a frame, in counts, joints first.
  [[nodiscard]] std::vector<std::int32_t> targets(const ServoFrame& frame) const;
  /// Angles and the gripper's pulse at these positions.
  [[nodiscard]] BusReading reading_of(const std::vector<std::int32_t>& positions) const;

 private:
  using Clock = DriveBus::Clock;

  [[nodiscard]] std::string choose_period();
  /// Returns the nodes, for the log.
  std::string set_up();
  /// One that has restarted since its set-up began, or nullptr.
  [[nodiscard]] const DriveReport* restarted() const;
  void start();
  void watch_masters(int watch_ms);
  void beat();
  /// Throws for what the drives or the bus report.
  void examine();
  [[nodiscard]] Clock::duration heartbeat_limit() const;
  /// From what age on process data are reported as missing.
  [[nodiscard]] Clock::duration stale_limit() const;
  [[nodiscard]] Clock::duration beat_period() const {
    return std::chrono::milliseconds(settings_.watch_ms) / 3;
  }

  const Cia402Settings settings_;
  DriveBus bus_;
  DriveEnabling enabling_;
  Clock::time_point last_beat_{};
  bool exchange_succeeded_{false};  ///< the last one
  std::vector<std::int32_t> last_targets_;
};

}  // namespace corbot::rt
