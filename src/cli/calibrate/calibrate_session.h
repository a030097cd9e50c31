// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "cli/calibrate/calibration.h"
#include "cli/calibrate/servo_positioner.h"

namespace corbot::cli {

/// The commands of `corbot calibrate`, one per line. At a terminal, a wrong command prints an error and
/// changes nothing; from a pipe it ends the session.
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
  /// Executes a line. Throws Failure if the device is lost. Without a terminal, also throws Failure for a
  /// refused line.
  void run(const std::string& line);
  [[nodiscard]] bool done() const noexcept { return done_; }
  /// Reports the joints that were marked and not written, unless `quit` has done so.
  void report_unwritten() const;
  /// Returns the loss on ending now, as an appendix to a message: "; nothing is written".
  [[nodiscard]] std::string unwritten_note() const;

 private:
  using Words = std::vector<std::string>;
  void execute(const Words& words);
  /// Runs `on`: first requests `yes` if it would move the servos to stored angles.
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
  /// Returns "2 joints were marked and not written", or "" if there are none.
  [[nodiscard]] std::string unwritten() const;
  void print_position();
  /// Returns the positions by the pulses: "base 0.0 degrees, gripper 1900 us".
  [[nodiscard]] std::string positions() const;
  void print_log();
  void require_pulses() const;  ///< throws std::invalid_argument before `on`
  /// Returns the only argument as a number; throws std::invalid_argument.
  static double number(const Words& words);
  [[nodiscard]] std::size_t chosen() const;
  [[nodiscard]] std::size_t gripper() const { return calibration_.joints(); }
  [[nodiscard]] std::string name(std::size_t servo) const;

  const Setting& setting_;
  ServoPositioner& servos_;
  Calibration calibration_;
  std::optional<std::size_t> servo_;
  std::map<std::string, double> written_edits_;  ///< by path
  std::size_t line_{0};
  std::string lost_text_;   ///< the device's last report of its loss, printable
  bool awaits_yes_{false};  ///< `on` has requested `yes`
  bool quit_once_{false};   ///< `quit` has warned of unwritten marks
  bool done_{false};
  bool written_{false};
};

}  // namespace corbot::cli
