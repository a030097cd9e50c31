// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "corbot/arm/joint_ranges.h"
#include "corbot/kinematics/joints.h"
#include "corbot/motion/command.h"
#include "corbot/motion/rate_knots.h"
#include "corbot/motion/rate_pieces.h"

namespace corbot {

// What goes into a plan besides the request, and what comes out.

/// This says what the numbers of a refusal measure, and so gives their unit.
enum class Quantity {
  kNumber,      ///< a count, a ratio or an index; also where a refusal gives no numbers
  kLength,      ///< m
  kAngle,       ///< rad
  kTime,        ///< s
  kJointValue,  ///< of the refusal's joint: rad where it turns, m where it slides
  kJointSpeed,  ///< the same, a second
};

/// Why a motion was not planned. Numbers in SI units (metres, radians, seconds);
/// `text` speaks degrees and metres.
struct PlanRefusal {
  enum class Kind { kBadParameter, kUnreachable, kLimitExceeded };
  PlanRefusal(Kind the_kind, std::string the_parameter, Quantity the_quantity)
      : kind(the_kind), parameter(std::move(the_parameter)), quantity(the_quantity) {}

  Kind kind;
  std::string parameter;  ///< argument or quantity at fault, e.g. "t", "joint range"
  Quantity quantity;      ///< of `value`, `lower` and `upper`
  int joint{-1};          ///< −1 where no joint is concerned
  double value{};         ///< offending value
  double lower{};         ///< what is allowed
  double upper{};
  std::array<double, 3> target_m{};  ///< the point that cannot be reached, base frame
  std::string text;                  ///< one sentence, ASCII
};

/// Of a line or an arc.
struct PlannedRate {
  std::vector<rate::Knot> knots;
  std::vector<rate::Piece> pieces;
};

/// One or two commands in the order of execution; `id`, `epoch` and the slots of knots are 0 and the caller's to fill.
/// All or nothing. It is read as the variant that it is.
struct PlanResult : std::variant<std::vector<Command>, PlanRefusal> {
  using variant::variant;
  /// Of lines and arcs, for each command; else empty.
  std::vector<PlannedRate> rates;
};

/// What Speed, AllSpeed, ArtSpeed, SetToolPitch, SetToolOrientation, SetToolFrame and SetBaseFrame have set. Ratios in (0, 1].
struct PlanSettings {
  double speed_ratio{1.0};
  std::array<double, kMaxJoints> joint_speed_ratio{1.0, 1.0, 1.0, 1.0, 1.0, 1.0};
  /// How lines, arcs and motions to a point end, one of the two at most. Without either a four-axis arm has a tool pitch of 0, any
  /// other keeps what the tool has when the motion begins.
  std::optional<double> tool_pitch_rad{};
  std::optional<Quaternion> tool_orientation{};  ///< of base_T_tool, unit length
  /// In place of the model's: flange to tool centre point, and where the arm stands in the frame of the positions that are given.
  std::optional<Pose> tool_frame{};
  std::optional<Pose> base_frame{};
  /// Within the model's ranges, and kept instead of them by every motion that is planned.
  std::optional<JointRanges> soft_limits{};
};

/// Where the arm will rest when the motion begins.
struct PlanStart {
  Joints position_q{};
  double gripper{};  ///< 0 closed … 1 open
  friend bool operator==(const PlanStart&, const PlanStart&) = default;
};

}  // namespace corbot
