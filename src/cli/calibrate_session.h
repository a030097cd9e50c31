// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/calibration.h"
#include "cli/jog.h"

namespace corbot::cli {

/// The commands of `corbot calibrate`, a line each. A command that is wrong is answered in words and does
/// nothing; in a session that is not a terminal, too.
class CalibrateSession {
 public:
  struct Setting {
    Profile profile;
    std::string text;  ///< of the profile
    bool dry_run{false};
  };

  CalibrateSession(const Setting& setting, Jog& jog);

  void greet();
  void run(const std::string& line);
  [[nodiscard]] bool done() const noexcept { return done_; }
  [[nodiscard]] bool written() const noexcept { return written_; }

 private:
  using Words = std::vector<std::string>;
  void carry_out(const Words& words);
  void choose(const Words& words);
  void move(double pulse_us);
  void mark(const Words& words);
  void limit(const Words& words);
  void show();
  void write();
  void say_where();
  void say_news();
  /// The number that is the only argument; throws std::invalid_argument.
  static double number(const Words& words);
  [[nodiscard]] std::size_t chosen() const;
  [[nodiscard]] std::size_t gripper() const { return calibration_.joints(); }
  [[nodiscard]] std::string name(std::size_t servo) const;

  const Setting& setting_;
  Jog& jog_;
  Calibration calibration_;
  std::optional<std::size_t> servo_;
  bool done_{false};
  bool written_{false};
};

}  // namespace corbot::cli
