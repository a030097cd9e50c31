// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "corbot/arm/arm_model.h"
#include "corbot/motion/bounds.h"
#include "corbot/motion/command.h"
#include "planner/request.h"

namespace corbot {

/// Why a motion was not planned. Numbers in SI units (metres, radians, seconds); `text` speaks degrees and
/// metres.
struct PlanRefusal {
  enum class Kind { kBadParameter, kUnreachable, kLimitExceeded };
  Kind kind{Kind::kBadParameter};
  std::string parameter;  ///< argument or quantity at fault, e.g. "t", "joint range"
  int joint{-1};          ///< −1 where no joint is concerned
  double value{};         ///< offending value
  double lower{};         ///< what is allowed
  double upper{};
  std::array<double, 3> target_m{};  ///< the point that cannot be reached, base frame
  std::string text;                  ///< one sentence, ASCII
};

/// One or two commands in the order of execution; `id` and `epoch` are 0 and the caller's to fill. All or
/// nothing.
using PlanResult = std::variant<std::vector<Command>, PlanRefusal>;

/// What Speed, AllSpeed, ArtSpeed and the tool pitch have set. Ratios in (0, 1].
struct PlanSettings {
  double speed_ratio{1.0};
  std::array<double, kMaxJoints> joint_speed_ratio{1.0, 1.0, 1.0, 1.0, 1.0, 1.0};
  double tool_pitch_rad{0.0};
};

/// Where the arm will rest when the motion begins.
struct PlanStart {
  Joints position_rad{};
  double gripper{};  ///< 0 closed … 1 open
};

/// Plans whole motions from rest to rest and proves them before anything moves. Stateless and thread-safe.
/// `t_s` = 0 asks for the shortest time the limits allow; a t_s the limits forbid stretches to what they
/// allow.
class Planner {
 public:
  explicit Planner(const ArmModel& model) : model_(model) {}

  /// The arguments alone, which need not know where the arm is: names, finite numbers, ranges, speeds.
  [[nodiscard]] std::optional<PlanRefusal> check(const PlanSettings& settings,
                                                 const MotionRequest& request) const;
  /// Checks the arguments and plans, by the request's kind one of the following.
  [[nodiscard]] PlanResult plan(const PlanStart& start, const PlanSettings& settings,
                                const MotionRequest& request) const;

  /// Free, synchronised joint motion to the point. The present branch is kept where its joint ranges allow,
  /// otherwise the quickest feasible one is taken.
  [[nodiscard]] PlanResult move(const PlanStart& start, const PlanSettings& settings,
                                const std::array<double, 3>& target_m, double t_s) const;
  /// Straight line of the TCP, on the present branch.
  [[nodiscard]] PlanResult move_s(const PlanStart& start, const PlanSettings& settings,
                                  const std::array<double, 3>& target_m, double t_s) const;
  /// Arc p1 → p2 → p3; if the TCP is not at p1, a line to p1 first.
  [[nodiscard]] PlanResult move_c(const PlanStart& start, const PlanSettings& settings,
                                  const std::array<double, 3>& p1_m, const std::array<double, 3>& p2_m,
                                  const std::array<double, 3>& p3_m) const;
  /// Synchronised joint motion to given joints.
  [[nodiscard]] PlanResult move_joints(const PlanStart& start, const PlanSettings& settings,
                                       const Joints& target_rad, double t_s) const;
  /// One joint by an increment, at a speed of its own.
  [[nodiscard]] PlanResult drive(const PlanStart& start, const PlanSettings& settings, int joint,
                                 double increment_rad, double speed_rad_s) const;
  /// All joints to 0.
  [[nodiscard]] PlanResult ready(const PlanStart& start, const PlanSettings& settings) const;
  /// Stand still.
  [[nodiscard]] PlanResult dwell(const PlanStart& start, double t_s) const;
  /// Gripper to an opening, 0 closed … 1 open.
  [[nodiscard]] PlanResult gripper(const PlanStart& start, double opening) const;

 private:
  ArmModel model_;
};

}  // namespace corbot
