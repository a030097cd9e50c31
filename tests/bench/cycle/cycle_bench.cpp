// SPDX-License-Identifier: Apache-2.0
// Measures one real-time cycle with the loopback backend: flags, evaluation, inverse kinematics, checks,
// pulses, forward kinematics, snapshot and trace. Fails when the median during a motion is not below 2 µs.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "../../support/arm_motions.h"
#include "../../support/bench_workspace.h"
#include "corbot/kinematics/tool_pose.h"
#include "rt/rig.h"

namespace corbot::test {
namespace {

constexpr double kMedianBound_us = 2.0;
constexpr std::size_t kCycles = 200'000;
enum class Ramps { kNone, kOverride, kStops };
const Joints kThere{0.8, 1.2, 1.5, 0.5};

PlanResult joint_motion(const Rig& rig, bool out) {
  return rig.planner.move_joints(rig.start(), {}, out ? Joints{} : kThere, 0.0);
}

PlanSettings level(const Rig& rig) {
  PlanSettings settings;
  settings.tool_pitch_rad = tool_pose(rig.arm.kinematics, rig.start().position_q).pitch_rad;
  return settings;
}

PlanResult line_motion(const Rig& rig, bool out) {
  auto p = tool_pose(rig.arm.kinematics, rig.start().position_q).position_m;
  p[1] += out ? -0.05 : 0.05;
  return rig.planner.move_s(rig.start(), level(rig), p, 0.0);
}

PlanResult arc_motion(const Rig& rig, bool out) {
  const auto p = tool_pose(rig.arm.kinematics, rig.start().position_q).position_m;
  const double y = out ? -0.02 : 0.02;
  return rig.planner.move_c(rig.start(), level(rig), p, {p[0] + 0.01, p[1] + y, p[2]},
                            {p[0], p[1] + 2 * y, p[2] + 0.001 * (out ? -1 : 1)});
}

/// Percentiles of `kCycles` cycles. `next` plans a motion whenever the arm rests;
/// only cycles in motion count. Sets `median_us`, if there is one.
bool measure(const char* name, const std::function<PlanResult(const Rig&, bool)>& next, Ramps ramps,
             const ArmModel& arm = shipped_lynx5(), const Joints& there_q = kThere,
             double* median_us = nullptr) {
  Rig rig(arm);
  rig.step();
  if (next) {
    const std::uint64_t id = rig.submit(rig.planner.move_joints(rig.start(), {}, there_q, 0.0));
    while (rig.snapshot.last_done_id != id) rig.step();
  }
  bool out = false;
  std::vector<double> times_us;
  times_us.reserve(kCycles);
  std::vector<double> checks_us;  // of cycles that take or check knots
  for (std::uint64_t i = 0; times_us.size() < kCycles; ++i) {
    const bool at_rest = rig.snapshot.command_id == 0 && rig.snapshot.waiting_id == 0;
    if (next && at_rest && rig.queued() == 0) {
      rig.submit(next(rig, out));
      out = !out;
    }
    // Every 5 cycles another target: the governor seeks a ramp in nearly each cycle.
    if (ramps == Ramps::kOverride && i % 5 == 0) rig.override_to(i % 10 == 0 ? 1.0 : 0.3);
    // At ever new instants of the motion and of the ramps before.
    if (ramps == Ramps::kStops && i % 37 == 0) rig.pause(i % 111 == 0);
    rig.now_ns += rig.arm.period_ns;
    const auto begin = std::chrono::steady_clock::now();
    (void)rig.cycle->step(rig.now_ns, rig.now_ns);
    const auto end = std::chrono::steady_clock::now();
    (void)rig.task->snapshot.load(rig.snapshot);
    while (rig.completion()) {
    }
    const double took_us = std::chrono::duration<double, std::micro>(end - begin).count();
    if (!next || rig.snapshot.command_id != 0) times_us.push_back(took_us);
    if (rig.snapshot.waiting_id != 0 && !arm.kinematics.has_closed_form()) checks_us.push_back(took_us);
  }
  if (!checks_us.empty()) {
    std::sort(checks_us.begin(), checks_us.end());
    fmt::print("{:<22} median {:6.3f}  p99 {:6.3f}  max {:8.3f} us\n", "  checking knots",
               checks_us[checks_us.size() / 2], checks_us[checks_us.size() * 99 / 100], checks_us.back());
  }
  std::sort(times_us.begin(), times_us.end());
  const auto at = [&](double share) { return times_us[static_cast<std::size_t>(share * (kCycles - 1))]; };
  fmt::print("{:<22} median {:6.3f}  p90 {:6.3f}  p99 {:6.3f}  p99.9 {:7.3f}  max {:8.3f} us\n", name,
             at(0.5), at(0.9), at(0.99), at(0.999), at(1.0));
  if (median_us != nullptr) *median_us = at(0.5);
  return ramps != Ramps::kNone || at(0.5) < kMedianBound_us;
}

/// A line to and fro, 50 mm long, the tool's orientation kept.
bool measure_line(const std::string& name) {
  const ArmModel arm = arm_of(name);
  const ArmMotions motions = motions_of(arm, 0.05);
  if (!motions.line_to_m) {
    fmt::print("{}: no line was found\n", name);
    return false;
  }
  const auto from_m = tool_pose(arm.kinematics, motions.there_q).position_m;
  const auto next = [&](const Rig& rig, bool out) {
    return rig.planner.move_s(rig.start(), motions.settings, out ? from_m : *motions.line_to_m, 0.0);
  };
  return measure(("line, " + name).c_str(), next, Ramps::kNone, arm, motions.there_q);
}

/// The joint motion without a workspace, and among a floor and four boxes beyond its reach.
bool measure_workspace() {
  double free_us = 0.0;
  bool good = measure("joint motion alone", joint_motion, Ramps::kNone, shipped_lynx5(), kThere, &free_us);
  for (const auto& [name, parts] :
       {std::pair("floor, boxes, points", kPoints), std::pair("floor, boxes, links", kPointsAndLinks)}) {
    double checked_us = 0.0;
    const ArmModel arm = among_posts(shipped_lynx5(), 1.5, parts);
    good = measure(name, joint_motion, Ramps::kNone, arm, kThere, &checked_us) && good;
    fmt::print("with this check a cycle takes {:.2f} times as long\n", checked_us / free_us);
  }
  return good;
}

}  // namespace
}  // namespace corbot::test

int main() {
  using namespace corbot::test;
  bool good = measure("idle", nullptr, Ramps::kNone);
  good = measure("joint motion", joint_motion, Ramps::kNone) && good;
  good = measure("line", line_motion, Ramps::kNone) && good;
  good = measure("arc", arc_motion, Ramps::kNone) && good;
  for (const char* arm :
       {"puma560", "irb2400", "ur5e", "xarm6", "stanford", "al5d_wr", "scara_gx4", "cartesian_pppr"})
    good = measure_line(arm) && good;
  good = measure_workspace() && good;
  (void)measure("joints, ramp search", joint_motion, Ramps::kOverride);
  (void)measure("line, ramp search", line_motion, Ramps::kOverride);
  (void)measure("joints, stops", joint_motion, Ramps::kStops);
  (void)measure("line, stops", line_motion, Ramps::kStops);
  if (!good) fmt::print("the median of a cycle is not below {} us\n", kMedianBound_us);
  return good ? 0 : 1;
}
