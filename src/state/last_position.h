// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

#include "corbot/arm/arm_model.h"

namespace corbot {

/// The last position commanded to an arm. Hobby servos have no encoders: after a power-down this is the only
/// information. Nothing here is real-time safe.
struct LastPosition {
  std::string robot;            ///< the robot's name
  std::string device;           ///< kind of the backend that received the command
  std::uint64_t fingerprint{};  ///< position_fingerprint() of the model and map that the values depend on
  std::string boot_id;          ///< of the machine's boot in which it was written
  std::int64_t saved_s{};       ///< since the Unix epoch
  bool at_rest{};               ///< false: written during a motion
  bool held{};                  ///< by StopAndHold, and not cleared
  bool in_error{};              ///< for any reason, and not cleared
  Joints position_q{};
  double opening{};  ///< of the gripper, 0 closed … 1 open
};

/// Returns the stem of the files of a robot on this device (`kind` of [backend]): "lynx5", "lynx5.loopback".
/// The simulator has files of its own, which never count as a device's and never replace them.
[[nodiscard]] std::string state_file_stem(std::string_view robot, std::string_view device);

/// A fault of a saved position. A damaged file counts as "in Error". Only a valid file of this robot, with
/// another profile or device, can prove that the arm was not in Error.
class PositionError : public std::runtime_error {
 public:
  explicit PositionError(const std::string& what, bool held = false, bool in_error = true)
      : std::runtime_error(what), held_(held), in_error_(in_error) {}
  /// Returns true if the file is this robot's nevertheless, and says that a StopAndHold is in force.
  [[nodiscard]] bool held() const noexcept { return held_; }
  /// Returns true if the arm is in an Error that was not cleared, or if that is not known.
  [[nodiscard]] bool in_error() const noexcept { return in_error_; }

 private:
  bool held_;
  bool in_error_;
};

inline constexpr std::size_t kMaxPositionBytes = 4096;

/// Returns the fingerprint of everything that determines the arm's position at a set-point. It covers the
/// arm's model, and the servo map, which the segment's fingerprint omits. A recalibrated servo has another
/// position.
[[nodiscard]] std::uint64_t position_fingerprint(const ArmModel& arm);

/// Returns the position as TOML, which a person can read, too.
[[nodiscard]] std::string position_text(const LastPosition& position, const ArmModel& arm);

/// Reads the output of position_text() without trusting any byte. Throws PositionError unless the position is
/// of this robot, this device and this model of its arm, finite and within the joints' ranges.
[[nodiscard]] LastPosition parse_position(std::string_view text, std::string_view robot,
                                          std::string_view device, const ArmModel& arm);

/// Returns "2026-11-21 10:00:00 UTC".
[[nodiscard]] std::string utc_text(std::int64_t epoch_s);

}  // namespace corbot
