// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

#include "corbot/arm/arm_model.h"

namespace corbot {

/// The last position commanded to an arm. Hobby servos have no encoders: after a power-down this is all that
/// is known. Nothing here is real-time safe.
struct LastPosition {
  std::string robot;            ///< its name
  std::string device;           ///< kind of the backend that it was commanded to
  std::uint64_t fingerprint{};  ///< of what gives it its meaning, position_fingerprint()
  std::string boot_id;          ///< of the machine's run in which it was written
  std::int64_t saved_s{};       ///< since the Unix epoch
  bool at_rest{};               ///< false: written in the middle of a motion
  bool held{};                  ///< by StopAndHold, and not cleared
  bool in_error{};              ///< for whatever reason, and not cleared
  Joints position_q{};
  double opening{};  ///< of the gripper, 0 closed … 1 open
};

/// Stem of the files of a robot on this device (`kind` of [backend]): "lynx5", "lynx5.loopback". The simulator
/// has files of its own: what it leaves is never taken for a device's, and does not replace it.
[[nodiscard]] std::string state_file_stem(std::string_view robot, std::string_view device);

/// What is wrong with a saved position. One whose file is damaged does not prove that the arm
/// was not in Error; only one that is whole, and of this robot with another profile or device, proves it.
class PositionError : public std::runtime_error {
 public:
  explicit PositionError(const std::string& what, bool held = false, bool in_error = true)
      : std::runtime_error(what), held_(held), in_error_(in_error) {}
  /// It is this robot's all the same, and says that a StopAndHold is in force.
  [[nodiscard]] bool held() const noexcept { return held_; }
  /// The arm is in Error, and that was not cleared, or nobody knows.
  [[nodiscard]] bool in_error() const noexcept { return in_error_; }

 private:
  bool held_;
  bool in_error_;
};

inline constexpr std::size_t kMaxPositionBytes = 4096;

/// Of everything on which it depends how the arm stands at a set-point: the arm's model, and the servo map,
/// which the segment's fingerprint leaves out. A servo that was calibrated anew stands elsewhere.
[[nodiscard]] std::uint64_t position_fingerprint(const ArmModel& arm);

/// TOML, for a person to read, too.
[[nodiscard]] std::string position_text(const LastPosition& position, const ArmModel& arm);

/// Reads what position_text() wrote. Trusts no byte: throws PositionError unless it is of this robot, this device
/// and this model of its arm, finite and within the joints' ranges.
[[nodiscard]] LastPosition parse_position(std::string_view text, std::string_view robot,
                                          std::string_view device, const ArmModel& arm);

/// "2026-11-21 10:00:00 UTC"
[[nodiscard]] std::string utc_text(std::int64_t epoch_s);

}  // namespace corbot
