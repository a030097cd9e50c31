// SPDX-License-Identifier: Apache-2.0
#include "planner/planner.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "corbot/arm/joint_units.h"
#include "corbot/interface_words.h"
#include "corbot/motion/law_evaluation.h"
#include "planner/arc.h"
#include "planner/frame_settings.h"
#include "planner/joint_planner.h"
#include "planner/path_planner.h"
#include "planner/plan/refusal.h"
#include "planner/time_law_planner.h"
#include "planner/tool_goal.h"
#include "planner/workspace_proof.h"

namespace corbot {
namespace {

constexpr double kAtP1_m = 1e-9;  // the TCP is at P1 if it is nearer than this

using Refusal = std::optional<PlanRefusal>;

/// Checks the arguments of each kind of motion, as far as possible without the arm's position.
struct ArgumentCheck {
  const ArmModel& model;
  const PlanSettings& settings;

  Refusal operator()(const MoveRequest& request) const { return check_target(request.target_m, request.t_s); }
  Refusal operator()(const MoveSRequest& request) const {
    return check_target(request.target_m, request.t_s);
  }

  Refusal operator()(const MoveCRequest& request) const {
    if (auto refusal = check_tool(settings)) return refusal;
    if (auto refusal = check_point(request.p1_m, "P1")) return refusal;
    if (auto refusal = check_point(request.p2_m, "P2")) return refusal;
    if (auto refusal = check_point(request.p3_m, "P3")) return refusal;
    const auto circle = arc_through(request.p1_m, request.p2_m, request.p3_m);
    if (const auto* refusal = std::get_if<PlanRefusal>(&circle)) return *refusal;
    return std::nullopt;
  }

  Refusal operator()(const MoveJointsRequest& request) const {
    if (auto refusal = check_time(request.t_s)) return refusal;
    for (std::size_t i = 0; i < model.dof; ++i) {
      const double target_q = request.target_q[i];
      const JointLimits& limits = model.joints[i];
      const int joint = static_cast<int>(i);
      if (!std::isfinite(target_q)) {
        return bad_parameter("angle", Quantity::kJointValue, target_q, limits.lower_q, limits.upper_q,
                             fmt::format("the value of joint {} is not a finite number", i), joint);
      }
      if (!in_range(limits, target_q)) return joint_range(model, i, target_q, "at the target");
    }
    return std::nullopt;
  }

  Refusal operator()(const DriveRequest& request) const {
    const int dof = static_cast<int>(model.dof);
    if (request.joint < 0 || request.joint >= dof) {
      // The interface uses this name of the parameter.
      return bad_parameter("articulation", Quantity::kNumber, request.joint, 0.0, dof - 1,
                           fmt::format("joint {}, allowed 0 to {}", request.joint, dof - 1), request.joint);
    }
    const JointLimits& limits = model.joints[static_cast<std::size_t>(request.joint)];
    const double widest_q = limits.upper_q - limits.lower_q;
    if (!std::isfinite(request.increment_q)) {
      return bad_parameter("increment", Quantity::kJointValue, request.increment_q, -widest_q, widest_q,
                           "the increment is not a finite number", request.joint);
    }
    return check_speed(request);
  }

  Refusal operator()(const ReadyRequest&) const { return (*this)(MoveJointsRequest{}); }
  Refusal operator()(const DwellRequest& request) const { return check_time(request.t_s); }

  Refusal operator()(const GripperRequest& request) const {
    if (request.opening >= 0.0 && request.opening <= 1.0) return std::nullopt;
    return bad_parameter("opening", Quantity::kNumber, request.opening, 0.0, 1.0,
                         fmt::format("opening {:.6g}, allowed 0 to 1", request.opening));
  }

  Refusal operator()(const MovePoseRequest& request) const {
    return check_pose_motion(request.target, "target", request.t_s);
  }
  Refusal operator()(const MoveRelativeRequest& request) const {
    if (request.frame != OffsetFrame::kBase && request.frame != OffsetFrame::kTool) {
      const double value = static_cast<double>(request.frame);
      return bad_parameter("frame", Quantity::kNumber, value, 0.0, 1.0,
                           fmt::format("frame {:.6g}, allowed 0 and 1", value));
    }
    return check_pose_motion(request.offset, "offset", request.t_s);
  }

 private:
  Refusal check_pose_motion(const Pose& pose, const std::string& name, double t_s) const {
    if (auto refusal = check_tool(settings)) return refusal;
    if (auto refusal = check_pose(pose, name)) return refusal;
    return check_time(t_s);
  }

  Refusal check_target(const std::array<double, 3>& target_m, double t_s) const {
    if (auto refusal = check_tool(settings)) return refusal;
    if (auto refusal = check_point(target_m, "P")) return refusal;
    return check_time(t_s);
  }

  Refusal check_speed(const DriveRequest& request) const {
    const auto joint = static_cast<std::size_t>(request.joint);
    const JointKind kind = model.kinematics.joint_kind(joint);
    const double limit_q_s = JointPlanner(model, settings).speed_q_s(joint);
    if (!std::isfinite(request.speed_q_s) || request.speed_q_s <= 0.0) {
      return bad_parameter(
          kSpeedWord, Quantity::kJointSpeed, request.speed_q_s, 0.0, limit_q_s,
          fmt::format("speed {0:.6g} {2}/s, allowed above 0 to {1:.6g} {2}/s",
                      to_shown(kind, request.speed_q_s), to_shown(kind, limit_q_s), unit_name(kind)),
          request.joint);
    }
    // The conversion from radians to degrees and back rounds, so the limit itself must pass.
    if (request.speed_q_s <= limit_q_s * (1.0 + 1e-12)) return std::nullopt;
    PlanRefusal refusal(PlanRefusal::Kind::kLimitExceeded, kSpeedWord, Quantity::kJointSpeed);
    refusal.joint = request.joint;
    refusal.value = request.speed_q_s;
    refusal.upper = limit_q_s;
    refusal.text = fmt::format("speed {0:.6g} {3}/s of joint {1}, allowed up to {2:.6g} {3}/s",
                               to_shown(kind, request.speed_q_s), request.joint, to_shown(kind, limit_q_s),
                               unit_name(kind));
    return refusal;
  }
};

/// Joins the paths, or returns the first refusal.
PlanResult sequence(const std::vector<PathPlan>& paths) {
  std::vector<Command> commands;
  std::vector<PlannedRate> rates;
  for (const PathPlan& path : paths) {
    if (const auto* refusal = std::get_if<PlanRefusal>(&path)) return *refusal;
    commands.push_back(std::get<Command>(path));
    rates.push_back(path.rate);
  }
  PlanResult result = commands;
  result.rates = std::move(rates);
  return result;
}

/// Plans the motion, with arguments that have been checked.
struct Planning {
  const ArmModel& model;  ///< with the soft limits for ranges
  const ArmModel& whole;  ///< with its own ranges
  const PlanSettings& settings;
  const PlanStart& start;

  PlanResult operator()(const MoveRequest& request) const {
    return JointPlanner(model, settings).reach(start, request.target_m, request.t_s);
  }

  PlanResult operator()(const MoveSRequest& request) const {
    return sequence({PathPlanner(model, whole, settings).line(start, request.target_m, request.t_s)});
  }

  PlanResult operator()(const MoveCRequest& request) const {
    const auto circle = arc_through(request.p1_m, request.p2_m, request.p3_m);
    if (const auto* refusal = std::get_if<PlanRefusal>(&circle)) return *refusal;
    const ArcMotion& arc = std::get<ArcMotion>(circle);
    const PathPlanner planner(model, whole, settings);
    const std::array<double, 3>& p1_m = request.p1_m;
    const auto tcp_m = model.kinematics.forward(start.position_q).position_m;
    if (std::hypot(tcp_m[0] - p1_m[0], tcp_m[1] - p1_m[1], tcp_m[2] - p1_m[2]) <= kAtP1_m) {
      const PathPlan plan = planner.arc(start, arc);
      const auto* refusal = std::get_if<PlanRefusal>(&plan);
      if (refusal == nullptr || leaves_workspace(*refusal)) return sequence({plan});
      // Next to a singularity a nanometre is too far for the joints: plan a line to P1, as for any distance.
    }
    const PathPlan approach = planner.line(start, p1_m, 0.0);
    if (const auto* refusal = std::get_if<PlanRefusal>(&approach)) return *refusal;
    PlanStart at_p1 = start;
    at_p1.position_q = std::get<Command>(approach).end_q;
    return sequence({approach, planner.arc(at_p1, arc)});
  }

  PlanResult operator()(const MoveJointsRequest& request) const {
    return JointPlanner(model, settings).to(start, request.target_q, request.t_s);
  }
  PlanResult operator()(const DriveRequest& request) const {
    return JointPlanner(model, settings).drive(start, request);
  }
  PlanResult operator()(const ReadyRequest&) const { return (*this)(MoveJointsRequest{}); }

  PlanResult operator()(const DwellRequest& request) const {
    Command command = blank_command(MotionKind::kDwell, start);
    command.dwell.duration_s = request.t_s;
    command.duration_s = request.t_s;
    return std::vector<Command>{command};
  }

  PlanResult operator()(const GripperRequest& request) const {
    // A full travel lasts travel_s and shares it evenly between jerk, acceleration and cruise. Its peaks are
    // the limits for a part of the travel.
    const double eighth_s = model.gripper.travel_s / 8.0;
    const LawPeaks full = peaks({1.0, eighth_s, eighth_s, 2.0 * eighth_s});
    Command command = blank_command(MotionKind::kGripper, start);
    command.gripper.from = start.gripper;
    command.gripper.law =
        plan_law(request.opening - start.gripper, {full.velocity, full.acceleration, full.jerk});
    command.duration_s = command.gripper.law.duration_s();
    return std::vector<Command>{command};
  }

  PlanResult operator()(const MovePoseRequest& request) const {
    return to_pose(goal_at(settings, request.target), request.t_s, request.straight);
  }
  PlanResult operator()(const MoveRelativeRequest& request) const {
    return to_pose(goal_by(model.kinematics, settings, start.position_q, request), request.t_s,
                   request.straight);
  }

 private:
  PlanResult to_pose(const PoseGoal& goal, double t_s, bool straight) const {
    const Planning planning{model, whole, goal.settings, start};
    return straight ? planning(MoveSRequest{goal.target_m, t_s}) : planning(MoveRequest{goal.target_m, t_s});
  }
};

/// The arm with the settings applied. Copies the model only if the settings change it.
class ArmInForce {
 public:
  ArmInForce(const ArmModel& model, const PlanSettings& settings) : whole_(&model) {
    if (settings.tool_frame || settings.base_frame || settings.further_shapes) {
      framed_ = model;
      if (settings.further_shapes) add_shapes(framed_->workspace, *settings.further_shapes);
      framed_->kinematics = in_frames(model.kinematics, settings);
      whole_ = &*framed_;
    }
    narrow_ = whole_;
    if (!settings.soft_limits) return;
    limited_ = *whole_;
    for (std::size_t i = 0; i < limited_->dof; ++i) {
      limited_->joints[i].lower_q = settings.soft_limits->lower_q[i];
      limited_->joints[i].upper_q = settings.soft_limits->upper_q[i];
    }
    narrow_ = &*limited_;
  }
  ArmInForce(const ArmInForce&) = delete;
  ArmInForce& operator=(const ArmInForce&) = delete;
  ~ArmInForce() = default;

  /// Return the arm with its own ranges, and with the soft limits instead.
  [[nodiscard]] const ArmModel& whole() const noexcept { return *whole_; }
  [[nodiscard]] const ArmModel& narrow() const noexcept { return *narrow_; }

 private:
  std::optional<ArmModel> framed_, limited_;
  const ArmModel* whole_;
  const ArmModel* narrow_;
};

}  // namespace

std::optional<PlanRefusal> Planner::check(const PlanSettings& settings, const MotionRequest& request) const {
  const ArmInForce arm(model_, settings);
  return std::visit(ArgumentCheck{arm.narrow(), settings}, request);
}

PlanResult Planner::plan(const PlanStart& start, const PlanSettings& settings,
                         const MotionRequest& request) const {
  const ArmInForce arm(model_, settings);
  if (auto refusal = std::visit(ArgumentCheck{arm.narrow(), settings}, request)) return *refusal;
  return std::visit(Planning{arm.narrow(), arm.whole(), settings, start}, request);
}

PlanResult Planner::move(const PlanStart& start, const PlanSettings& settings,
                         const std::array<double, 3>& target_m, double t_s) const {
  return plan(start, settings, MoveRequest{target_m, t_s});
}

PlanResult Planner::move_s(const PlanStart& start, const PlanSettings& settings,
                           const std::array<double, 3>& target_m, double t_s) const {
  return plan(start, settings, MoveSRequest{target_m, t_s});
}

PlanResult Planner::move_c(const PlanStart& start, const PlanSettings& settings,
                           const std::array<double, 3>& p1_m, const std::array<double, 3>& p2_m,
                           const std::array<double, 3>& p3_m) const {
  return plan(start, settings, MoveCRequest{p1_m, p2_m, p3_m});
}

PlanResult Planner::move_joints(const PlanStart& start, const PlanSettings& settings, const Joints& target_q,
                                double t_s) const {
  return plan(start, settings, MoveJointsRequest{target_q, t_s});
}

PlanResult Planner::drive(const PlanStart& start, const PlanSettings& settings, int joint, double increment_q,
                          double speed_q_s) const {
  return plan(start, settings, DriveRequest{joint, increment_q, speed_q_s});
}

PlanResult Planner::ready(const PlanStart& start, const PlanSettings& settings) const {
  return plan(start, settings, ReadyRequest{});
}

PlanResult Planner::dwell(const PlanStart& start, double t_s) const {
  return plan(start, {}, DwellRequest{t_s});
}

PlanResult Planner::gripper(const PlanStart& start, double opening) const {
  return plan(start, {}, GripperRequest{opening});
}

}  // namespace corbot
