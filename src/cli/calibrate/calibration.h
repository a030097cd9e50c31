// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "config/profile.h"
#include "config/profile_edit.h"

namespace corbot::cli {

/// A pulse and the angle of the joint that was measured at it.
struct Mark {
  double angle_deg{};
  double pulse_us{};
};

/// pulse = zero_us + direction * us_per_degree * angle, as in a profile.
struct ServoLine {
  double zero_us{};
  double us_per_degree{};
  int direction{1};

  [[nodiscard]] double pulse_us(double angle_deg) const {
    return zero_us + direction * us_per_degree * angle_deg;
  }
  [[nodiscard]] double angle_deg(double pulse_us) const {
    return (pulse_us - zero_us) / (direction * us_per_degree);
  }
};

/// The line through two marks, rounded to 0.01 us and 0.001 us a degree; or the reason why there is none.
struct LineResult {
  std::optional<ServoLine> line;
  std::string fault;
};
[[nodiscard]] LineResult line_through(const Mark& a, const Mark& b);

/// The calibration of the servos of one profile. Pure: no device, no file.
class Calibration {
 public:
  explicit Calibration(const Profile& profile);

  [[nodiscard]] std::size_t joints() const noexcept { return joints_.size(); }
  /// By the marks: two give a line, one moves its zero only, none leaves it as the profile has it.
  [[nodiscard]] ServoLine line(std::size_t joint) const;
  [[nodiscard]] std::array<double, 2> range_deg(std::size_t joint) const;
  [[nodiscard]] double gripper_us(bool open) const { return open ? open_us_ : closed_us_; }

  /// Takes a mark beside the last one of another angle. Returns the fault; empty: none.
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
    ServoLine line;  ///< the profile's
    std::array<double, 2> range_deg{};
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
