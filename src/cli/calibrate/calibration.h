// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "config/profile.h"
#include "config/profile_edit.h"

namespace corbot::cli {

/// The unit of a joint's measurements and its plausible values: degrees for a rotary joint, millimetres for a
/// sliding one.
struct MarkUnit {
  const char* name;        ///< "degrees", "mm"
  const char* one;         ///< "degree", "mm"
  const char* scale_key;   ///< key in the profile, microseconds per unit
  const char* range_key;   ///< key in the profile, degrees or metres
  double range_key_units;  ///< units in one unit of range_key
  double q_per_unit;       ///< rad or m
  /// least and better distance of two marks: a small one turns a reading error into a scale error
  double least, better;
  double scale_min, scale_max;
  double widest;
};
[[nodiscard]] const MarkUnit& unit_of(JointKind kind) noexcept;

/// A pulse and the joint's value measured at it, in the joint's MarkUnit.
struct Mark {
  double value{};
  double pulse_us{};
};

/// The map pulse = zero_us + direction * us_per_unit * value, like in a profile.
struct ServoLine {
  double zero_us{};
  double us_per_unit{};
  int direction{1};

  [[nodiscard]] double pulse_us(double value) const { return zero_us + direction * us_per_unit * value; }
  [[nodiscard]] double value(double pulse_us) const {
    return (pulse_us - zero_us) / (direction * us_per_unit);
  }
};

/// The line through two marks, rounded to 0.01 us and 0.001 us per unit, or the reason why there is none.
struct LineResult {
  std::optional<ServoLine> line;
  std::string fault;
};
[[nodiscard]] LineResult line_through(const Mark& a, const Mark& b, const MarkUnit& unit);

/// The calibration of the servos of one profile. Pure: no device, no file.
class Calibration {
 public:
  explicit Calibration(const Profile& profile);

  [[nodiscard]] std::size_t joints() const noexcept { return joints_.size(); }
  /// Returns the line by the marks. Two marks give a line, one moves only its zero, none leaves the profile's
  /// line.
  [[nodiscard]] ServoLine line(std::size_t joint) const;
  /// Returns the unit of the marks and of range().
  [[nodiscard]] const MarkUnit& unit(std::size_t joint) const { return *joints_[joint].unit; }
  [[nodiscard]] std::array<double, 2> range(std::size_t joint) const;
  [[nodiscard]] double gripper_us(bool open) const { return open ? open_us_ : closed_us_; }

  /// Takes a mark in addition to the last one of another value. Returns the fault, or "".
  [[nodiscard]] std::string mark(std::size_t joint, const Mark& mark);
  /// Sets an end of the joint's range to the value at a pulse. Returns the fault, or "".
  [[nodiscard]] std::string limit(std::size_t joint, bool upper, double pulse_us);
  void mark_gripper(bool open, double pulse_us);
  /// Undoes the last of these; returns false if there is none.
  bool undo();

  /// Returns the ends of ranges that the servo cannot reach, and other reasons not to write the calibration.
  [[nodiscard]] std::vector<std::string> faults() const;
  /// Returns the numbers that differ from the profile's.
  [[nodiscard]] std::vector<NumberEdit> edits() const;
  [[nodiscard]] std::string text(std::size_t joint) const;

 private:
  struct Joint {
    std::string name;
    const MarkUnit* unit{};
    ServoLine line;  ///< in the profile
    std::array<double, 2> range{};
    std::array<double, 2> pulse_range_us{};
    std::vector<Mark> marks;  ///< at most two
    std::array<std::optional<double>, 2> limit_us;
  };
  struct State {
    std::vector<Joint> joints;
    double closed_us{};
    double open_us{};
  };
  void remember();

  std::vector<Joint> joints_;
  double closed_us_{};
  double open_us_{};
  std::array<double, 2> profile_gripper_us_{};
  std::vector<State> before_;
};

}  // namespace corbot::cli
