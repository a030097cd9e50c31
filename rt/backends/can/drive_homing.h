// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "rt/backends/can/drive_bus.h"
#include "rt/backends/can/drive_enabling.h"
#include "rt/backends/can/drive_preparation.h"
#include "rt/backends/can/drive_settings.h"

namespace corbot::rt {

/// Homes drives that lose their count with their power, one after the other (CiA 402-2, homing mode), while
/// all others hold their positions. It replaces the backend, for a person who stands by. Every failure throws
/// DeviceError. stop() then stops powered drives, and takes their voltage off.
class DriveHoming {
 public:
  explicit DriveHoming(const Cia402Settings& settings);

  /// Sets up all drives, and the homing of those that have one; energises nothing.
  std::string open();
  /// Energises all drives, which hold their positions. False: it was stopped meanwhile, and has disabled what
  /// it had enabled.
  [[nodiscard]] bool energise(const std::function<bool()>& is_stopped);
  /// Homes a drive. False: `goes_on`, polled every cycle, was false; the drive has been halted, or has not
  /// begun.
  [[nodiscard]] bool home(std::size_t joint, const std::function<bool()>& goes_on);
  /// Returns the drive's present count; position_q() returns its joint's position by the profile.
  [[nodiscard]] std::int32_t count(std::size_t joint) const {
    return bus_.drives().at(joint).process.position;
  }
  [[nodiscard]] double position_q(std::size_t joint) const;

  /// Ends properly: the drives go on holding.
  void leave() noexcept { bus_.close(); }
  /// Takes the voltage off.
  void relax();
  /// Stops after a failure: quick stop, then voltage off, if energise() was called.
  void stop() noexcept;

 private:
  using Clock = DriveBus::Clock;

  /// Sends SYNC with this word for one drive; all others hold. Throws for faults that the drives report.
  void exchange(std::size_t joint, std::uint16_t word);
  /// Does so for the given time.
  void exchange_for(std::size_t joint, std::uint16_t word, Clock::duration time);
  void halt(std::size_t joint);
  void set_mode(std::size_t joint, std::uint8_t mode);
  [[noreturn]] void fail(std::size_t joint, const std::string& what) const;

  const Cia402Settings settings_;
  DriveBus bus_;
  DriveEnabling enabling_;
  DrivePreparation preparation_;
  std::vector<std::int32_t> targets_;
  Clock::time_point due_{};
  bool is_energised_{false};
};

}  // namespace corbot::rt
