// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "config/profile.h"
#include "config/profile_edit.h"

namespace corbot::cli {

/// In what a joint is measured, and what is plausible: degrees where it turns, millimetres where it slides.
struct MarkUnit {
  const char* name;        ///< "degrees", "mm"
  const char* one;         ///< "degree", "mm"
  const char* scale_key;   ///< of the profile, microseconds a unit
  const char* range_key;   ///< of the profile, degrees or metres
  double range_key_units;  ///< units in one of range_key
  double q_per_unit;       ///< rad or m
  double least, better;    ///< marks that are closer turn the error of reading one into an error of the scale
  double scale_min, scale_max;
  double widest;
};
[[nodiscard]] const MarkUnit& unit_of(JointKind kind) noexcept;

/// A pulse and the joint's value that was measured at it, in the joint's MarkUnit.
struct Mark {
  double value{};
  double pulse_us{};
};

/// pulse = zero_us + direction * us_per_unit * value, as in a profile.
struct ServoLine {
  double zero_us{};
  double us_per_unit{};
  int direction{1};

  [[nodiscard]] double pulse_us(double value) const { return zero_us + direction * us_per_unit * value; }
  [[nodiscard]] double value(double pulse_us) const {
    return (pulse_us - zero_us) / (direction * us_per_unit);
  }
};

/// The line through two marks, rounded to 0.01 us and 0.001 us a unit; or the reason why there is none.
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
  /// By the marks: two give a line, one moves its zero only, none leaves it as the profile has it.
  [[nodiscard]] ServoLine line(std::size_t joint) const;
  /// In this are marks, and range().
  [[nodiscard]] const MarkUnit& unit(std::size_t joint) const { return *joints_[joint].unit; }
  [[nodiscard]] std::array<double, 2> range(std::size_t joint) const;
  [[nodiscard]] double gripper_us(bool open) const { return open ? open_us_ : closed_us_; }

  /// Takes a mark beside the last one of another value. Returns the fault; empty: none.
  [[nodiscard]] std::string mark(std::size_t joint, const Mark& mark);
  /// An end of the joint's range: where a pulse brings it. Returns the fault;
  /// empty: none.
  [[nodiscard]] std::string limit(std::size_t joint, bool upper, double pulse_us);
  void mark_gripper(bool open, double pulse_us);
  /// Undoes the last of these; false when there is none.
  bool undo();

  /// The ends of ranges that the servo cannot reach, and other reasons against writing it; empty: none.
  [[nodiscard]] std::vector<std::string> faults() const;
  /// The numbers that differ from the profile's.
  [[nodiscard]] std::vector<NumberEdit> edits() const;
  [[nodiscard]] std::string text(std::size_t joint) const;

 private:
  struct Joint {
    std::string name;
    const MarkUnit* unit{};
    ServoLine line;  ///< the profile's
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
