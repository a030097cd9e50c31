// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "corbot/arm/joint_ranges.h"
#include "corbot/arm/workspace_limits.h"
#include "corbot/kinematics/joints.h"
#include "corbot/motion/command.h"
#include "corbot/motion/rate_knots.h"
#include "corbot/motion/rate_pieces.h"

namespace corbot {

// Inputs of a plan besides the request, and its results.

/// The quantity that the numbers of a refusal measure, which gives their unit.
enum class Quantity {
  kNumber,      ///< a count, a ratio or an index; also where a refusal gives no numbers
  kLength,      ///< m
  kAngle,       ///< rad
  kTime,        ///< s
  kJointValue,  ///< of the refusal's joint: rad for a rotary one, m for a sliding one
  kJointSpeed,  ///< of the refusal's joint: rad/s or m/s
};

/// The reason why a motion was not planned. Numbers are in SI units (metres, radians, seconds); `text` uses
/// degrees and metres.
struct PlanRefusal {
  enum class Kind { kBadParameter, kUnreachable, kLimitExceeded };
  PlanRefusal(Kind the_kind, std::string the_parameter, Quantity the_quantity)
      : kind(the_kind), parameter(std::move(the_parameter)), quantity(the_quantity) {}

  Kind kind;
  std::string parameter;  ///< wrong argument or quantity, e.g. "t", "joint range"
  Quantity quantity;      ///< of `value`, `lower` and `upper`
  int joint{-1};          ///< −1 if no joint is concerned
  double value{};         ///< invalid value
  double lower{};         ///< allowed range
  double upper{};
  std::array<double, 3> target_m{};  ///< the point that cannot be reached, base frame
  std::string text;                  ///< one sentence, ASCII
};

/// Knots and pieces of a line or an arc.
struct PlannedRate {
  std::vector<rate::Knot> knots;
  std::vector<rate::Piece> pieces;
};

/// One or two commands in the order of execution, or a refusal. The caller fills in `id`, `epoch` and the
/// slots of knots, which are 0. Read it like the variant.
struct PlanResult : std::variant<std::vector<Command>, PlanRefusal> {
  using variant::variant;
  /// One for each command of a line or an arc, else empty.
  std::vector<PlannedRate> rates;
};

/// Settings made by Speed, AllSpeed, ArtSpeed, SetToolPitch, SetToolOrientation, SetToolFrame and
/// SetBaseFrame. Ratios are in (0, 1].
struct PlanSettings {
  double speed_ratio{1.0};
  std::array<double, kMaxJoints> joint_speed_ratio{1.0, 1.0, 1.0, 1.0, 1.0, 1.0};
  /// Tool orientation at the end of lines, arcs and motions to a point; at most one of the two is set. If
  /// none is, a four-axis arm has a tool pitch of 0. Any other arm then keeps the tool's orientation at the
  /// beginning of the motion.
  std::optional<double> tool_pitch_rad{};
  std::optional<Quaternion> tool_orientation{};  ///< of base_T_tool, unit length
  /// Replace the model's frames: flange to tool centre point, and the arm's base in the frame of the given
  /// positions.
  std::optional<Pose> tool_frame{};
  std::optional<Pose> base_frame{};
  /// Replace the model's ranges, and lie within them, for every planned motion.
  std::optional<JointRanges> soft_limits{};
  /// Hold beside the shapes of the model's workspace, in the frame of the given positions.
  std::optional<FurtherShapes> further_shapes{};
};

/// The arm's rest state when the motion begins.
struct PlanStart {
  Joints position_q{};
  double gripper{};  ///< 0 closed … 1 open
  friend bool operator==(const PlanStart&, const PlanStart&) = default;
};

}  // namespace corbot
