// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "rt/backends/can/cia402_setup.h"
#include "rt/backends/can/drive_bus.h"
#include "rt/backends/can/drive_enabling.h"
#include "rt/backends/can/drive_settings.h"

namespace corbot::rt {

/// Takes drives from an open bus to set up and operational, without energising them. Every failure throws
/// DeviceError.
class DrivePreparation {
 public:
  /// All arguments outlive this.
  DrivePreparation(const Cia402Settings& settings, DriveBus& bus, DriveEnabling& enabling)
      : settings_(settings), bus_(bus), enabling_(enabling) {}

  /// Chooses the period of SYNC by the load of the bus; returns a text about it.
  std::string choose_period();
  /// Sets up the drives and returns the nodes, for the log. `must_be_homed`: drives that lose their count
  /// with their power must be homed.
  std::string set_up(bool must_be_homed);
  void start();
  /// Returns 6065h of the gripper's drive from the last set_up(), if it is there.
  [[nodiscard]] std::optional<std::uint32_t> gripper_window() const { return gripper_window_; }
  /// Sets 1016h of all drives, if the profile requires it; 0: they await no heartbeat.
  void watch_masters(int watch_ms);
  /// Returns the time between two of corbot's heartbeats.
  [[nodiscard]] DriveBus::Clock::duration beat_period() const {
    return std::chrono::milliseconds(settings_.watch_ms) / 3;
  }

 private:
  using Clock = DriveBus::Clock;

  [[nodiscard]] DriveSetup setup_of(std::size_t drive, bool must_be_homed) const;
  std::string set_up_once(bool must_be_homed);
  /// Returns a drive that has restarted since its set-up began, or nullptr.
  [[nodiscard]] const DriveReport* restarted() const;

  const Cia402Settings& settings_;
  DriveBus& bus_;
  DriveEnabling& enabling_;
  std::optional<std::uint32_t> gripper_window_{};
};

}  // namespace corbot::rt
