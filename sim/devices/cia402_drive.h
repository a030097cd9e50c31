// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "sim/devices/homing_sequence.h"

namespace corbot::sim {

/// Options in counts and seconds. The defaults are those of a joint drive of some 1000 counts a degree.
struct Cia402DriveOptions {
  double lag_s{0.002};                   ///< lag of the shaft behind the demand
  double most_counts_per_s{1e6};         ///< speed limit of the shaft
  double quick_stop_counts_per_s2{5e6};  ///< 6085h
  double following_window{20'000};       ///< 6065h
  double following_timeout_s{0.05};      ///< 6066h
  std::int32_t position{0};              ///< initial position of the shaft
};

/// Power stage, motor and position loop of a drive after CiA 402, without its bus. It has cyclic synchronous
/// position mode and homing mode. It is given the time, in nanoseconds of any clock that does not run
/// backwards.
class Cia402Drive {
 public:
  /// The values are those of the statusword's state bits.
  enum class State : std::uint16_t {
    kNotReady = 0x00,
    kSwitchOnDisabled = 0x40,
    kReadyToSwitchOn = 0x21,
    kSwitchedOn = 0x23,
    kOperationEnabled = 0x27,
    kQuickStopActive = 0x07,
    kFaultReactionActive = 0x0F,
    kFault = 0x08,
  };
  static constexpr std::uint16_t kFollowingError = 0x8611;
  static constexpr int kModeHoming = 6;
  static constexpr int kModeCyclicPosition = 8;

  explicit Cia402Drive(const Cia402DriveOptions& options);

  void advance(std::int64_t now_ns);
  /// Takes the controlword, 6040h.
  void control(std::uint16_t controlword);
  /// Sets the target, 607Ah; it is reached after the interpolation time.
  void set_target(std::int32_t target);
  /// Sets the mode, 6060h.
  void set_mode(int mode);
  void set_interpolation_s(double interpolation_s) { interpolation_s_ = interpolation_s; }
  /// Sets the position limits, 607Dh.
  void set_limits(std::int32_t lowest, std::int32_t highest);
  /// Sets 605Ah: 0 voltage off at once, 2 ramp and then off, 6 ramp and stay.
  void set_quick_stop_option(int option) { quick_stop_option_ = option; }
  void set_following(double window, double timeout_s);
  void set_quick_stop_ramp(double counts_per_s2) { options_.quick_stop_counts_per_s2 = counts_per_s2; }
  /// Sets safe torque off: there is no voltage as long as it is on.
  void set_sto(bool is_on);
  /// Changes from operation enabled to switch on disabled, without a controlword.
  void leave_operation();
  /// Turns the shaft by hand; false: the motor holds it.
  bool turn(double counts);
  /// Sets 6098h, 6099h, 609Ah; they take effect when homing starts.
  void set_homing(const HomingOptions& homing) { homing_options_ = homing; }
  /// Sets 607Ch: the count at the home position.
  void set_home_offset(std::int32_t offset) { home_offset_ = offset; }
  void set_switches(const AxisSwitches& switches) { switches_ = switches; }
  [[nodiscard]] const AxisSwitches& switches() const { return switches_; }
  void set_warning(bool is_on) { has_warning_ = is_on; }
  /// Blocks the shaft against any torque.
  void set_blocked(bool is_on) { is_blocked_ = is_on; }
  /// Puts a piece in the shaft's way, on its present side: the shaft gets as far as this count. Empty:
  /// removes the piece.
  void set_piece(std::optional<std::int32_t> count);
  /// Makes the drive stay in operation enabled and ignore its targets; bit 12 of the statusword shows that.
  void set_ignoring(bool is_on);
  /// Ramps down; then the drive is in fault until it is reset. The code is an EMCY's.
  void fail(std::uint16_t code);
  /// Switches the power off and on; the shaft stays. `counts_from_0`: the drive has no absolute encoder.
  void power_cycle(bool counts_from_0 = false);

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] std::uint16_t statusword() const;
  [[nodiscard]] std::uint16_t error_code() const { return error_code_; }
  [[nodiscard]] int mode() const { return mode_; }
  [[nodiscard]] std::int32_t position() const;
  [[nodiscard]] std::int32_t demand() const;
  [[nodiscard]] std::int32_t target() const { return target_; }
  /// The motor has current.
  [[nodiscard]] bool has_power() const;

 private:
  void step(double dt_s);
  void step_demand(double dt_s);
  void step_homing(double dt_s);
  void step_ramp(double dt_s);
  void control_homing(std::uint16_t before);
  void hold_here();
  /// Moves the shaft as far as nothing is in the way.
  void move_shaft(double count);
  /// Tells whether the shaft presses against a piece, by the current that the motor may have.
  [[nodiscard]] bool is_pressing() const;
  void watch_following(double dt_s);
  void enter(State state);

  Cia402DriveOptions options_;
  State state_{State::kSwitchOnDisabled};
  std::uint16_t controlword_{0};
  std::uint16_t error_code_{0};
  int mode_{0};
  int quick_stop_option_{2};
  double interpolation_s_{0.001};
  std::int32_t lowest_;
  std::int32_t highest_;
  std::int32_t target_;
  double demand_;
  double speed_{0.0};   ///< speed of the demand, counts a second
  double left_s_{0.0};  ///< time until the demand is at the target
  double position_;
  double following_s_{0.0};  ///< time for which the error has been outside the window
  HomingSequence homing_;
  HomingOptions homing_options_{};
  AxisSwitches switches_{};
  double home_offset_{0.0};
  double count_0_{0.0};  ///< position of the shaft when the drive counts 0
  std::int64_t now_ns_{0};
  bool is_limited_{false};
  bool has_warning_{false};
  bool is_sto_{false};
  bool is_blocked_{false};
  std::optional<double> piece_{};
  bool is_above_piece_{false};
  bool is_ignoring_{false};
};

}  // namespace corbot::sim
