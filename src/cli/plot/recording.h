// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cli/plot/reduced_rows.h"
#include "corbot/kinematics/joints.h"

namespace corbot::cli::charts {

/// Limits of a joint as a recording's first lines name them: degrees or m, and seconds.
struct RecordedLimits {
  double lower{}, upper{}, speed{}, acceleration{}, jerk{};
};

struct RecordedJoint {
  JointKind kind{JointKind::kRotary};
  std::string name;  ///< empty where the recording has none
  std::optional<RecordedLimits> limits;
  [[nodiscard]] const char* unit() const noexcept { return kind == JointKind::kRotary ? "deg" : "m"; }
};

/// What a recording has of each joint. Accelerations and jerks are difference quotients of the speeds of cycles that follow each
/// other.
enum class Quantity { kSetPoint, kMeasured, kSpeed, kAcceleration, kJerk, kPulse };
inline constexpr std::size_t kQuantities = 6;

/// Of a joint in one cycle.
struct JointRates {
  double speed{kNoValue}, acceleration{kNoValue}, jerk{kNoValue};
  /// `period_s` later.
  [[nodiscard]] JointRates next(double next_speed, double period_s) const noexcept {
    const double next_acceleration = (next_speed - speed) / period_s;
    return {next_speed, next_acceleration, (next_acceleration - acceleration) / period_s};
  }
};

/// A file of `corbot record`, or a planned motion, reduced.
struct Recording {
  std::string profile;  ///< empty where the file does not name it
  std::vector<RecordedJoint> joints;
  std::uint64_t cycles{};
  std::uint64_t missing{};  ///< between cycles of one task
  ReducedRows rows{0};

  [[nodiscard]] static std::size_t series_of(std::size_t joint, Quantity quantity) noexcept {
    return joint * kQuantities + static_cast<std::size_t>(quantity);
  }
  [[nodiscard]] std::size_t gripper_pulse() const noexcept { return joints.size() * kQuantities; }
  [[nodiscard]] double duration_s() const noexcept { return rows.rows().back().end_s; }
};

/// Throws Failure, kUsage with "FILE:LINE: reason", where the file is no recording of two cycles at least.
[[nodiscard]] Recording read_recording(const std::string& file);

}  // namespace corbot::cli::charts
