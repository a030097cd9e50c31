// SPDX-License-Identifier: Apache-2.0
// Random lines and arcs of four arms as the planner times them, for toppra_bench.py: on standard output one
// JSON object a line. Each path is planned twice, with all limits of the profile, and with jerk and the tool
// lifted. path_times [SEED]
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <random>
#include <stdexcept>
#include <string>

#include "corbot/kinematics/tool_pose.h"
#include "corbot/motion/path.h"
#include "inverse_at_pitch.h"
#include "planner/planner.h"
#include "planner/rate/rate_planner.h"
#include "planner/reasons.h"
#include "sampling.h"
#include "test_arms.h"

namespace {

using namespace corbot;
using nlohmann::json;

constexpr int kOfEachKind = 125;  // lines, and as many arcs, of each arm
constexpr int kMostTries = 100'000;
constexpr double kLift = 1e6;      // a limit of the tool times this is none
constexpr double kLiftJerk = 1e3;  // with this a joint takes 0.1 ms to its full acceleration

/// The same arm, of which speed and acceleration of the joints alone are limited.
ArmModel lifted(ArmModel arm) {
  for (JointLimits& joint : arm.joints) joint.jerk_q_s3 *= kLiftJerk;
  PathLimits& path = arm.path;
  for (double* limit : {&path.speed_m_s, &path.acceleration_m_s2, &path.jerk_m_s3, &path.rotation_speed_rad_s,
                        &path.rotation_acceleration_rad_s2, &path.rotation_jerk_rad_s3})
    *limit *= kLift;
  return arm;
}

/// The longest time that a joint or the tool takes to its full acceleration.
double ramp_s(const ArmModel& arm) {
  double longest_s = std::max(arm.path.acceleration_m_s2 / arm.path.jerk_m_s3,
                              arm.path.rotation_acceleration_rad_s2 / arm.path.rotation_jerk_rad_s3);
  for (std::size_t i = 0; i < arm.dof; ++i)
    longest_s = std::max(longest_s, arm.joints[i].acceleration_q_s2 / arm.joints[i].jerk_q_s3);
  return longest_s;
}

/// Returns the names of the limits that bound each stretch of time.
json reasons(const ArmModel& arm, const PlanSettings& settings, const Command& command,
             const PlannedRate& rate) {
  constexpr std::array<const char*, 3> kLimits{"speed", "acceleration", "jerk"};
  json all = json::array();
  for (const rate::ReasonStretch& part : rate::reasons_of(arm, settings, command, rate)) {
    std::string mover = "joint " + std::to_string(part.reason.joint + 1);
    if (part.reason.mover == rate::Mover::kToolTravel) mover = "tool";
    if (part.reason.mover == rate::Mover::kToolTurn) mover = "turn of the tool";
    mover += std::string(" ") + kLimits[static_cast<std::size_t>(part.reason.limit)];
    all.push_back({{"limit", mover}, {"time_s", part.end_s - part.begin_s}, {"share", part.share}});
  }
  return all;
}

/// A planned path: null if it was refused.
json described(const ArmModel& arm, const PlanSettings& settings, const PlanResult& result) {
  if (!std::holds_alternative<std::vector<Command>>(result)) return nullptr;
  const Command& command = std::get<std::vector<Command>>(result).front();
  const PlannedRate& rate = result.rates.front();
  const bool is_arc = command.kind == MotionKind::kArc;
  const rate::Limits limits = rate::reserved(is_arc ? rate::limits_of(arm, settings, command.arc)
                                                    : rate::limits_of(arm, settings, command.line));
  json knots = json::array();
  for (const rate::Knot& knot : rate.knots) knots.push_back({knot.lambda_s, knot.z, knot.rate, knot.bend});
  json plan{{"time_s", command.duration_s}, {"angle_rad", limits.angle_rad},
            {"speed", limits.speed},        {"acceleration", limits.acceleration},
            {"knots", std::move(knots)},    {"arc_acceleration", limits.arc_acceleration},
            {"pieces", rate.pieces.size()}, {"reasons", reasons(arm, settings, command, rate)}};
  if (const auto nearest = rate::nearest_singularity(arm, command, rate.knots))
    plan["pivot"] = nearest->pivot;
  return plan;
}

bool is_path(const PlanResult& result) {
  return std::holds_alternative<std::vector<Command>>(result) && !result.rates.empty() &&
         !result.rates.front().knots.empty();
}

class Paths {
 public:
  Paths(const std::string& name, std::mt19937_64& random)
      : name_(name), arm_(test::arm_of(name)), planner_(arm_), lifted_(lifted(arm_)), random_(random) {}

  void put_random(bool is_arc) {
    for (int put = 0, tries = 0; put < kOfEachKind; ++tries) {
      if (tries > kMostTries) throw std::runtime_error("hardly any path of " + name_ + " is planned");
      PlanStart start;
      for (std::size_t i = 0; i < arm_.dof; ++i)
        start.position_q[i] = in(arm_.joints[i].lower_q, arm_.joints[i].upper_q);
      const auto here = arm_.kinematics.forward(start.position_q).position_m;
      const double size_m = is_arc ? 0.1 : 0.2;
      const auto p2 = near(here, size_m), p3 = near(here, size_m);
      const PlanSettings settings = turned(start);
      if (put_path(is_arc ? "arc" : "line", settings, [&](const Planner& planner) {
            return is_arc ? planner.move_c(start, settings, here, p2, p3)
                          : planner.move_s(start, settings, p2, 0.0);
          }))
        ++put;
    }
  }
  /// True if it is planned.
  template <class Plan>
  bool put_path(const char* kind, const PlanSettings& settings, Plan&& plan) {
    const double begin_ns = bench::thread_ns();
    const PlanResult result = plan(planner_);
    const double spent_ns = bench::thread_ns() - begin_ns;
    if (!is_path(result)) return false;
    const json line{{"arm", name_},
                    {"kind", kind},
                    {"joints", arm_.dof},
                    {"ramp_s", ramp_s(arm_)},
                    {"plan_us", 1e-3 * spent_ns},
                    {"all", described(arm_, settings, result)},
                    {"lifted", described(lifted_, settings, plan(Planner(lifted_)))}};
    std::printf("%s\n", line.dump().c_str());
    return true;
  }

 private:
  double in(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  std::array<double, 3> near(const std::array<double, 3>& p, double size_m) {
    return {p[0] + in(-size_m, size_m), p[1] + in(-size_m, size_m), p[2] + in(-size_m, size_m)};
  }
  /// One path in four turns the tool.
  PlanSettings turned(const PlanStart& from) {
    PlanSettings settings;
    const double turn_rad = in(0.0, 1.0) < 0.25 ? in(-0.5, 0.5) : 0.0;
    if (arm_.kinematics.follows() == Follows::kPitch)
      settings.tool_pitch_rad = tool_pose(arm_.kinematics, from.position_q).pitch_rad + turn_rad;
    if (arm_.kinematics.follows() == Follows::kFull)
      settings.tool_orientation =
          about({0.0, 0.6, 0.8}, turn_rad) * arm_.kinematics.forward(from.position_q).orientation;
    return settings;
  }

  std::string name_;
  ArmModel arm_;
  Planner planner_;
  ArmModel lifted_;
  std::mt19937_64& random_;
};

/// A line of the Lynx 5 that misses the axis of the base by 3 mm.
void put_line_past_axis(Paths& lynx5) {
  PlanSettings settings;
  settings.tool_pitch_rad = 0.25;
  const IkSolution start =
      test::inverse_at_pitch(test::arm_of("lynx5").kinematics, {0.003, -0.06, 0.3}, 0.25, 0, {});
  if (!lynx5.put_path("past the axis", settings, [&](const Planner& planner) {
        return planner.move_s({start.joints_q, 0.0}, settings, {0.003, 0.06, 0.3}, 0.0);
      }))
    throw std::runtime_error("the line past the axis is refused");
}

}  // namespace

int main(int argc, char** argv) {
  std::mt19937_64 random(argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 1751);
  for (const char* name : {"lynx5", "puma560", "scara_gx4", "stanford"}) {
    Paths paths(name, random);
    if (std::string(name) == "lynx5") put_line_past_axis(paths);
    paths.put_random(false);
    paths.put_random(true);
  }
}
