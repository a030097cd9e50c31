// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "cli/calibrate/calibration.h"
#include "cli/calibrate/servo_positioner.h"

namespace corbot::cli {

/// The commands of `corbot calibrate`, one a line. At a terminal, a wrong command prints an error and changes
/// nothing; from a pipe it ends the session.
class CalibrateSession {
 public:
  struct Setting {
    Profile profile;
    std::string name;  ///< of the robot
    std::string text;  ///< of the profile
    bool terminal{false};
    bool dry_run{false};
  };

  CalibrateSession(const Setting& setting, ServoPositioner& servos);

  void print_introduction();
  /// Throws Failure when the device is lost, and where it is no terminal at a line that is refused.
  void run(const std::string& line);
  [[nodiscard]] bool done() const noexcept { return done_; }
  /// Reports the joints that were marked and not written, unless `quit` has done so.
  void report_unwritten() const;
  /// What would be lost by ending now, to be appended to a message: "; nothing is written".
  [[nodiscard]] std::string unwritten_note() const;

 private:
  using Words = std::vector<std::string>;
  void execute(const Words& words);
  /// `on`: asks for `yes` first where it takes the servos to stored angles.
  void begin_to_switch_on();
  void switch_on();
  void choose(const Words& words);
  void move(double pulse_us);
  void mark(const Words& words);
  void limit(const Words& words);
  void show();
  void write();
  void remember_written(const std::vector<NumberEdit>& edits);
  void quit();
  [[noreturn]] void fail_lost_device();
  /// "2 joints were marked and not written"; empty: none.
  [[nodiscard]] std::string unwritten() const;
  void print_position();
  /// "base 0.0 degrees, gripper 1900 us": where the servos are by their pulses.
  [[nodiscard]] std::string positions() const;
  void print_log();
  void require_pulses() const;  ///< throws std::invalid_argument before `on`
  /// The number that is the only argument; throws std::invalid_argument.
  static double number(const Words& words);
  [[nodiscard]] std::size_t chosen() const;
  [[nodiscard]] std::size_t gripper() const { return calibration_.joints(); }
  [[nodiscard]] std::string name(std::size_t servo) const;

  const Setting& setting_;
  ServoPositioner& servos_;
  Calibration calibration_;
  std::optional<std::size_t> servo_;
  std::map<std::string, double> written_edits_;  ///< by their paths
  std::size_t line_{0};
  std::string lost_text_;   ///< the device's last report that it is lost, printable
  bool awaits_yes_{false};  ///< `on` has asked
  bool quit_once_{false};   ///< `quit` has warned of what is not written
  bool done_{false};
  bool written_{false};
};

}  // namespace corbot::cli
