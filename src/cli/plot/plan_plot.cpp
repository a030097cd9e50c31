// SPDX-License-Identifier: Apache-2.0
#include "cli/plot/plan_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <variant>

#include "cli/plot/plot.h"
#include "client/failure.h"
#include "client/write_file.h"
#include "corbot/arm/joint_units.h"
#include "corbot/motion/rate_knots.h"
#include "corbot/motion/rate_pieces.h"
#include "rt/cycle/path_evaluation.h"

namespace corbot::cli::charts {
namespace {

using client::ExitCode;
using client::Failure;

constexpr double kPeriod_s = 0.001;
constexpr double kLeastStep_m = 5e-5;  // between two points of the path

class Sampler {
 public:
  explicit Sampler(const Profile& profile) : arm_(profile.arm) {
    samples_.motion.profile = profile.name;
    for (std::size_t i = 0; i < arm_.dof; ++i) {
      const JointLimits& limits = arm_.joints[i];
      const JointKind kind = arm_.kinematics.joint_kind(i);
      const auto shown = [kind](double value) { return to_shown(kind, value); };
      samples_.motion.joints.push_back(
          {kind, profile.joint_names[i],
           RecordedLimits{shown(limits.lower_q), shown(limits.upper_q), shown(limits.speed_q_s),
                          shown(limits.acceleration_q_s2), shown(limits.jerk_q_s3)}});
    }
    samples_.motion.rows = ReducedRows(samples_.rate() + 1);
    rates_.fill({0.0, 0.0, 0.0});
  }

  void run(const PlanResult& plan) {
    const auto& commands = std::get<std::vector<Command>>(plan);
    for (std::size_t i = 0; i < commands.size(); ++i) {
      run(commands[i], i < plan.rates.size() ? plan.rates[i] : PlannedRate());
    }
  }
  PlanSamples take() { return std::move(samples_); }

 private:
  void run(const Command& command, const PlannedRate& rate) {
    if (samples_.motion.cycles == 0) add(command.start_q, kNoValue);
    const rt::SetPoint base{command.start_q};
    const auto count = static_cast<long>(std::ceil(command.duration_s / kPeriod_s - 1e-9));
    for (long tick = 1; tick <= count; ++tick) {
      const double t_s = std::min(static_cast<double>(tick) * kPeriod_s, command.duration_s);
      if (rate.pieces.empty()) {
        add(rt::evaluate_command(arm_, command, base, t_s).position_q, kNoValue);
        continue;
      }
      const rate::RatePieces law{rate.pieces, command.duration_s, rate.knots.back().lambda_s};
      const rate::RateState now = law.at(t_s);
      const rate::State z = rate::state_at(rate.knots, now.lambda_s);
      Joints q{};
      std::copy_n(z.begin(), q.size(), q.begin());
      add(q, now.v);
    }
  }

  void add(const Joints& q, double rate) {
    Recording& motion = samples_.motion;
    values_.assign(samples_.rate() + 1, kNoValue);
    values_.back() = rate;
    for (std::size_t i = 0; i < arm_.dof; ++i) {
      const auto at = [&](Quantity quantity) -> double& {
        return values_[Recording::series_of(i, quantity)];
      };
      const double shown = to_shown(motion.joints[i].kind, q[i]);
      const double speed = motion.cycles == 0 ? 0.0 : (shown - before_[i]) / kPeriod_s;
      rates_[i] = rates_[i].next(speed, kPeriod_s);
      before_[i] = at(Quantity::kSetPoint) = shown;
      at(Quantity::kSpeed) = rates_[i].speed;
      at(Quantity::kAcceleration) = rates_[i].acceleration;
      at(Quantity::kJerk) = rates_[i].jerk;
    }
    motion.rows.add(kPeriod_s * static_cast<double>(motion.cycles), values_);
    ++motion.cycles;
    const Vector3 point_m = arm_.kinematics.forward(q).position_m;
    auto& points_m = samples_.points_m;
    if (points_m.empty() || norm(point_m - points_m.back()) >= kLeastStep_m) points_m.push_back(point_m);
  }

  const ArmModel& arm_;
  PlanSamples samples_;
  std::array<JointRates, kMaxJoints> rates_{};
  std::array<double, kMaxJoints> before_{};
  std::vector<double> values_;
};

}  // namespace

PlanSamples sample(const Profile& profile, std::span<const PlanResult> plans) {
  Sampler sampler(profile);
  for (const PlanResult& plan : plans) sampler.run(plan);
  return sampler.take();
}

void plot_plan(const DryRun& robot, const std::string& name, const std::string& file) {
  const PlanSamples samples = sample(robot.profile(), robot.plans());
  if (samples.motion.cycles < 2)
    throw Failure(ExitCode::kUsage, name + ": no line moves the arm, so there is nothing to draw");
  ChartSheet sheet = sheet_of(samples.motion, std::filesystem::path(name).filename().string());
  sheet.subtitle = fmt::format("profile '{}', {:.6g} s as planned, from {}; nothing moved",
                               samples.motion.profile, samples.motion.duration_s(), robot.begins());
  sheet.charts.push_back({"rate of lambda along lines and arcs, 1", {{"rate", samples.rate()}}, {}, 0.1});
  for (const std::size_t up : {1, 2}) {
    PathView view{up == 1 ? "path from above: y over x, m" : "path from the side: z over x, m", {}};
    for (const Vector3& point_m : samples.points_m) view.points_m.push_back({point_m[0], point_m[up]});
    sheet.views.push_back(std::move(view));
  }
  client::write_file(file, chart_svg(sheet, samples.motion.rows));
}

}  // namespace corbot::cli::charts
