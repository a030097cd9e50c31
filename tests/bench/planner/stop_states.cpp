// SPDX-License-Identifier: Apache-2.0
// Prints stops of the task at random instants of random lines and arcs, for stop_ratio.py. Each line on
// standard output is a JSON object. It has the path, its limits without the reserves, the state at the
// request, and the stop. Usage: stop_states [SEED]
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "corbot/kinematics/tool_pose.h"
#include "planner/planner.h"
#include "planner/rate/proof.h"
#include "rt/cycle/motion_rate.h"
#include "test_arms.h"

namespace {

using namespace corbot;
using nlohmann::json;

constexpr int kOfEachKind = 25;  // lines, and as many arcs, of each arm
constexpr int kMostTries = 100'000;
constexpr int kMostCycles = 100'000;

class Stops {
 public:
  Stops(const std::string& name, std::mt19937_64& random)
      : name_(name), arm_(test::arm_of(name)), planner_(arm_), random_(random) {}

  void put(bool is_arc) {
    for (int count = 0, tries = 0; count < kOfEachKind; ++tries) {
      if (tries > kMostTries) throw std::runtime_error("hardly any path of " + name_ + " is planned");
      const PlanResult result = plan(is_arc);
      if (!std::holds_alternative<std::vector<Command>>(result) || result.rates.empty() ||
          result.rates.front().knots.empty())
        continue;
      Command command = std::get<std::vector<Command>>(result).front();
      command.id = ++id_;
      put_stop(command, result.rates.front());
      ++count;
    }
  }

 private:
  double in(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  Vector3 near(const Vector3& p, double size_m) {
    return {p[0] + in(-size_m, size_m), p[1] + in(-size_m, size_m), p[2] + in(-size_m, size_m)};
  }

  /// At full speed; one in four turns the tool.
  PlanResult plan(bool is_arc) {
    PlanStart start;
    for (std::size_t i = 0; i < arm_.dof; ++i)
      start.position_q[i] = in(arm_.joints[i].lower_q, arm_.joints[i].upper_q);
    const Pose here = arm_.kinematics.forward(start.position_q);
    PlanSettings settings;
    const double turn_rad = in(0.0, 1.0) < 0.25 ? in(-0.5, 0.5) : 0.0;
    if (arm_.kinematics.follows() == Follows::kPitch)
      settings.tool_pitch_rad = tool_pose(arm_.kinematics, start.position_q).pitch_rad + turn_rad;
    if (arm_.kinematics.follows() == Follows::kFull)
      settings.tool_orientation = about({0.0, 0.6, 0.8}, turn_rad) * here.orientation;
    const double size_m = is_arc ? 0.1 : 0.2;
    const Vector3 p2 = near(here.position_m, size_m), p3 = near(here.position_m, size_m);
    return is_arc ? planner_.move_c(start, settings, here.position_m, p2, p3)
                  : planner_.move_s(start, settings, p2, 0.0);
  }

  /// Has the path pass the task's check, which finds the curve of its stops.
  void check(const Command& command, const rate::RatePath& path) {
    for (int call = 0; call < kMostCycles; ++call) {
      const auto verdict = check_->step(arm_, command, path);
      if (verdict && verdict->verdict != Verdict::kDone) throw std::runtime_error("refused: " + name_);
      if (verdict) return;
    }
    throw std::runtime_error("the check of a path has no end: " + name_);
  }

  void put_stop(const Command& command, const PlannedRate& planned) {
    const rate::RatePath path{planned.knots,
                              {planned.pieces, command.duration_s, planned.knots.back().lambda_s}};
    check(command, path);
    const double dt_s = static_cast<double>(arm_.period_ns) * 1e-9;
    const int request = std::uniform_int_distribution<int>(
        1, std::max(1, static_cast<int>(command.duration_s / dt_s) - 1))(random_);
    rt::MotionRate& motion = *motion_;
    motion.rest();
    motion.set_target(1.0);
    motion.begin(path, *check_);
    for (int cycle = 0; cycle < request; ++cycle) motion.advance(dt_s);
    const rate::RateState state = path.law.at(motion.virtual_time_s());
    std::vector<std::array<double, 2>> way{{state.lambda_s, state.v}};
    motion.set_target(0.0);
    while (!motion.holding() && !motion.finished()) {
      if (way.size() > kMostCycles) throw std::runtime_error("a stop has no end: " + name_);
      motion.advance(dt_s);
      const rate::RateState now = path.law.at(motion.virtual_time_s());
      way.push_back({now.lambda_s, now.v * motion.rate()});
    }
    print(command, path, state, dt_s, way, other_stops_s(path, request, dt_s));
  }

  /// The time of the same stop by the curve of the whole motion, and by the curve that is sought, without the
  /// cycles of its search.
  [[nodiscard]] std::array<double, 2> other_stops_s(const rate::RatePath& path, int request,
                                                    double dt_s) const {
    rate::RateGovernor slow;
    slow.begin(check_->curve(), 1.0);
    for (int cycle = 0; cycle < request; ++cycle) slow.advance(dt_s);
    rate::RateGovernor quick = slow;
    slow.seek(0.0);
    quick.seek(0.0);
    const auto search = std::make_unique<rate::StopSearch>();
    const rate::RateLimits limits(check_->limits());
    search->begin(slow, path.law, check_->shares().first(path.law.pieces.size()), limits.view());
    while (!search->step()) continue;
    if (search->found() != nullptr) quick.stop(*search->found());
    const auto takes_s = [&](rate::RateGovernor governor) {
      int cycles = 0;
      for (; !governor.is_at_rest() && governor.time_s() < path.law.duration_s; ++cycles)
        governor.advance(dt_s);
      return cycles * dt_s;
    };
    return {takes_s(slow), takes_s(quick)};
  }

  void print(const Command& command, const rate::RatePath& path, const rate::RateState& state, double dt_s,
             const std::vector<std::array<double, 2>>& way, const std::array<double, 2>& others_s) const {
    const bool is_arc = command.kind == MotionKind::kArc;
    const rate::Limits limits =
        is_arc ? rate::limits_of(arm_, command.arc) : rate::limits_of(arm_, command.line);
    json knots = json::array();
    for (const rate::Knot& knot : path.knots) knots.push_back({knot.lambda_s, knot.z, knot.rate, knot.bend});
    // A quantity without a limit becomes null.
    const json line{{"arm", name_},
                    {"kind", is_arc ? "arc" : "line"},
                    {"knots", std::move(knots)},
                    {"speed", limits.speed},
                    {"acceleration", limits.acceleration},
                    {"jerk", limits.jerk},
                    {"angle_rad", limits.angle_rad},
                    {"arc_acceleration", limits.arc_acceleration},
                    {"arc_jerk", limits.arc_jerk},
                    {"state", {state.lambda_s, state.v, state.a}},
                    {"stop_s", static_cast<double>(way.size() - 1) * dt_s},
                    {"by_whole_motion_s", others_s[0]},
                    {"at_once_s", others_s[1]},
                    {"ends", motion_->finished()},
                    {"way", way}};
    std::printf("%s\n", line.dump().c_str());
  }

  std::string name_;
  ArmModel arm_;
  Planner planner_;
  std::mt19937_64& random_;
  std::uint64_t id_{0};
  std::unique_ptr<rt::RateCheck> check_{std::make_unique<rt::RateCheck>()};
  std::unique_ptr<rt::MotionRate> motion_{std::make_unique<rt::MotionRate>()};
};

}  // namespace

int main(int argc, char** argv) {
  std::mt19937_64 random(argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 1751);
  for (const char* name : {"lynx5", "al5d_wr", "puma560", "scara_gx4", "stanford", "cartesian_ppp"}) {
    Stops stops(name, random);
    stops.put(false);
    stops.put(true);
  }
}
