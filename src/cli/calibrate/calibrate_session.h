// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "cli/calibrate/calibration.h"
#include "cli/calibrate/servo_positioner.h"

namespace corbot::cli {

/// The commands of `corbot calibrate`, a line each. At a terminal, a command that is wrong is answered in
/// words and does nothing; elsewhere nobody reads that, and it ends the session.
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

  void greet();
  /// Throws Failure when the device is lost, and where it is no terminal at a line that is refused.
  void run(const std::string& line);
  [[nodiscard]] bool done() const noexcept { return done_; }
  /// Says what was found and not written, unless that was told when the end was asked for.
  void say_end() const;
  /// What an end at once leaves behind, to follow other words: "; nothing is written".
  [[nodiscard]] std::string loss() const;

 private:
  using Words = std::vector<std::string>;
  void carry_out(const Words& words);
  void switch_on();
  void choose(const Words& words);
  void move(double pulse_us);
  void mark(const Words& words);
  void limit(const Words& words);
  void show();
  void write();
  void keep(const std::vector<NumberEdit>& edits);
  void quit();
  [[noreturn]] void lose_device();
  /// "2 joints were marked and not written"; empty: none.
  [[nodiscard]] std::string not_written() const;
  void say_where();
  void say_news();
  /// The number that is the only argument; throws std::invalid_argument.
  static double number(const Words& words);
  [[nodiscard]] std::size_t chosen() const;
  [[nodiscard]] std::size_t gripper() const { return calibration_.joints(); }
  [[nodiscard]] std::string name(std::size_t servo) const;

  const Setting& setting_;
  ServoPositioner& servos_;
  Calibration calibration_;
  std::optional<std::size_t> servo_;
  std::map<std::string, double> kept_;  ///< the edits that were written
  std::size_t line_{0};
  bool asked_{false};  ///< whether the end was meant
  bool done_{false};
  bool written_{false};
};

}  // namespace corbot::cli
