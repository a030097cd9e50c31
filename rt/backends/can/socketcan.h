// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "rt/backends/bus/bus_device.h"
#include "rt/backends/can/drive_bus.h"
#include "rt/backends/can/drive_enabling.h"
#include "rt/backends/can/drive_preparation.h"
#include "rt/backends/can/drive_settings.h"
#include "rt/backends/can/frame_age.h"
#include "rt/backends/can/grip_limit.h"

namespace corbot::rt {

/// Drives on a CAN bus after CiA 402, in cyclic synchronous position mode: one for each joint, and the
/// gripper's if there is one. Each cycle sends controlword and target position to every drive, then SYNC. At
/// SYNC the drives take both and answer with statusword and position. While the cycle's frames stand still no
/// heartbeat is sent.
class Cia402Drives final : public BusDevice {
 public:
  explicit Cia402Drives(Cia402Settings settings);

  /// Opens the bus. Drives that hold their loads go on holding.
  std::string open() override;
  /// Energises the drives. If it throws, it disables the drives that it has enabled; those that held before
  /// go on holding.
  bool energise(const std::function<bool()>& is_stopped) override;
  /// Takes the voltage off; process data go on.
  bool de_energise() override;
  /// Ends properly: the drives go on as they are, and no longer await a heartbeat. After a failed exchange it
  /// ends as after any fault.
  void close() noexcept override;
  /// Ends after set-points no longer arrive: enabled drives stop by themselves (quick stop), then the voltage
  /// goes off. Heartbeats stay awaited.
  void close_after_fault() noexcept override;
  [[nodiscard]] std::int64_t period_ns() const noexcept override { return bus_.period_ns(); }
  /// Returns half a loop period: the cycle's frame is there, and the next one is far.
  [[nodiscard]] std::optional<std::int64_t> phase_ns() const noexcept override {
    return settings_.loop_ns / 2;
  }
  /// A step too far for one SYNC is a following error.
  [[nodiscard]] std::int64_t longest_gap_ns() const noexcept override { return 0; }
  [[nodiscard]] bool has_encoders() const noexcept override { return true; }
  bool send(const ServoFrame& frame, bool approach) override;
  BusReading measure(const ServoFrame& frame) override;
  [[nodiscard]] std::optional<BusReading> held() const override;
  [[nodiscard]] std::optional<DeviceError> warning() override;
  /// Takes the voltage off, and makes the drives pre-operational.
  void relax() override;

  /// Returns target positions of a frame, in counts, joints first.
  [[nodiscard]] std::vector<std::int32_t> targets(const ServoFrame& frame) const;
  /// Returns the angles and the gripper's pulse at these positions.
  [[nodiscard]] BusReading reading_of(const std::vector<std::int32_t>& positions) const;

 private:
  using Clock = DriveBus::Clock;

  void beat();
  /// Limits the gripper's target for its drive: see GripLimit.
  void limit_grip(std::vector<std::int32_t>& targets) const;
  /// Looks at the newest frame: throws while the motors have power and the cycle stands still.
  void check_age(const ServoFrame& frame);
  [[noreturn]] void fail_stale() const;
  /// Throws for faults that the drives or the bus report.
  void examine();
  [[nodiscard]] Clock::duration heartbeat_limit() const;
  /// Returns the age from which process data are reported as missing.
  [[nodiscard]] Clock::duration stale_limit() const;

  const Cia402Settings settings_;
  DriveBus bus_;
  DriveEnabling enabling_;
  DrivePreparation preparation_;
  FrameAge frame_age_;
  std::optional<GripLimit> grip_limit_{};
  Clock::time_point last_beat_{};
  bool exchange_succeeded_{false};  ///< the last exchange
  bool is_energised_{false};        ///< by energise(): another state than 'operation enabled' is a fault
  std::vector<std::int32_t> last_targets_;
};

}  // namespace corbot::rt
