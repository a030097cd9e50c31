// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <random>
#include <string>

#include "corbot/kinematics/tool_pose.h"
#include "corbot/motion/longest_stop.h"
#include "corbot/motion/path.h"
#include "corbot/motion/rate_proof.h"
#include "motion/motion_cases.h"
#include "motion/motion_results.h"
#include "motion/stop_judge.h"
#include "motion/watcher.h"
#include "rt/rig.h"

// Random motions through planner, ring, cycle and loopback backend, every tick watched from outside.
// CORBOT_MOTIONS: how many in total (default 5000, fewer under sanitizers); CORBOT_SEED: the seed;
// CORBOT_MOTION_RESULTS: a file to which the run adds a line with its figures.

namespace corbot::test::property_motion_test {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr int kDefaultMotions = 800;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
constexpr int kDefaultMotions = 800;
#else
constexpr int kDefaultMotions = 5000;
#endif
#else
constexpr int kDefaultMotions = 5000;
#endif
constexpr std::uint64_t kDefaultSeed = 20260101;
/// The share of a limit that a motion may reach, with the watcher's allowance for rounding.
constexpr double kMostShare = 1.00001;

enum class Interruption {
  kNone,
  kStop,
  kPauseResume,
  kOverride,
  kOverrideThenStop,
  kPauseThenStop,
  kCancel,
  kPauseThenCancel,
  kPress,  ///< the emergency stop
  kPauseThenPress,
  kResumeThenStop,  ///< after a pause
  kCount
};

std::uint64_t environment(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

const char* results_file() { return std::getenv("CORBOT_MOTION_RESULTS"); }

class ResultsFile : public ::testing::Environment {
 public:
  void TearDown() override {
    const char* file = results_file();
    if (file == nullptr || run_results().counts.empty()) return;
    const std::uint64_t seed = environment("CORBOT_SEED", kDefaultSeed);
    const int breaches = ::testing::UnitTest::GetInstance()->failed_test_count();
    run_results().counts["batches"] = 1;
    run_results().counts["breaches"] = static_cast<std::uint64_t>(breaches);
    if (breaches > 0) {
      fmt::print(
          "FAILED: seed {}; repeat: CORBOT_SEED={} CORBOT_MOTIONS={} build/release/tests/test_motion "
          "--gtest_filter='Random/*Motions.*'\n",
          seed, seed, environment("CORBOT_MOTIONS", kDefaultMotions));
    }
    fmt::print("{} in all: {}\n", file, to_string(add_to_file(file, seed, run_results())));
  }
};
[[maybe_unused]] const auto* const adds_results = ::testing::AddGlobalTestEnvironment(new ResultsFile);

bool is_path(const Command& command) { return knots_of(command) != nullptr; }

rate::Limits path_limits(const ArmModel& arm, const Command& command) {
  return command.kind == MotionKind::kArc ? rate::limits_of(arm, command.arc)
                                          : rate::limits_of(arm, command.line);
}

bool is_press(Interruption interruption) {
  return interruption == Interruption::kPress || interruption == Interruption::kPauseThenPress;
}

class Motions : public ::testing::TestWithParam<Case> {
 protected:
  double uniform(double from, double to) { return std::uniform_real_distribution<double>(from, to)(random_); }
  int dice(int sides) { return std::uniform_int_distribution<int>(0, sides - 1)(random_); }
  /// Mostly of the order of 1, sometimes tiny.
  double size() { return dice(3) == 0 ? std::pow(10.0, uniform(-6.0, 0.0)) : uniform(0.05, 1.0); }

  PlanSettings settings() {
    PlanSettings settings;
    if (dice(3) == 0) settings.speed_ratio = uniform(0.05, 1.0);
    if (dice(4) == 0) {
      settings.joint_speed_ratio[static_cast<std::size_t>(dice(static_cast<int>(rig_.arm.dof)))] =
          uniform(0.1, 1.0);
    }
    // The tool stays as it is, or turns with the path.
    const bool turns = dice(3) == 0;
    const Kinematics& arm = rig_.arm.kinematics;
    if (has_tool_pitch(arm)) {
      settings.tool_pitch_rad = tool_pose(arm, rig_.start().position_q).pitch_rad;
      if (turns) *settings.tool_pitch_rad += uniform(-0.5, 0.5);
    } else if (arm.follows() == Follows::kFull && turns) {
      const Vector3 axis{uniform(-1.0, 1.0), uniform(-1.0, 1.0), uniform(-1.0, 1.0)};
      settings.tool_orientation = about((1.0 / norm(axis)) * axis, uniform(-0.5, 0.5)) *
                                  arm.forward(rig_.start().position_q).orientation;
    }
    return settings;
  }

  Joints random_joints(double reach) {
    Joints target = rig_.start().position_q;
    for (std::size_t i = 0; i < rig_.arm.dof; ++i) {
      const JointLimits& limits = rig_.arm.joints[i];
      const double goal = dice(20) == 0 ? limits.upper_q : uniform(limits.lower_q, limits.upper_q);
      if (dice(6) != 0) target[i] += reach * (goal - target[i]);
      target[i] = std::clamp(target[i], limits.lower_q, limits.upper_q);
    }
    return target;
  }

  std::array<double, 3> near_tcp(double reach_m) {
    std::array<double, 3> point = tool_pose(rig_.arm.kinematics, rig_.start().position_q).position_m;
    for (double& x : point) x += uniform(-reach_m, reach_m);
    return point;
  }

  PlanResult plan(Kind kind) {
    const double t_s = dice(4) == 0 ? uniform(0.1, 2.0) : 0.0;
    const double reach_m = 0.25 * size();
    switch (kind) {
      case Kind::kJoint:
        return rig_.planner.move_joints(rig_.start(), settings(), random_joints(size()), t_s);
      case Kind::kLine:
        return rig_.planner.move_s(rig_.start(), settings(), near_tcp(reach_m), t_s);
      case Kind::kArc: {
        const auto p1 = tool_pose(rig_.arm.kinematics, rig_.start().position_q).position_m;
        return rig_.planner.move_c(rig_.start(), settings(), p1, near_tcp(reach_m), near_tcp(reach_m));
      }
    }
    return PlanRefusal(PlanRefusal::Kind::kBadParameter, "kind", Quantity::kNumber);
  }

  void one_motion(Kind kind);
  bool run(const Command& command, Interruption interruption);
  bool interrupt(Interruption interruption, int tick);
  void pause(bool on);
  [[nodiscard]] double ramp_scale_s(const Command& command) const;
  bool check_stop(const Command& command, int ticks);
  bool check_end(const Command& command);
  bool clear_after_press();
  void count(const Command& command, const Watcher& watcher);
  void report() const;

  std::mt19937_64 random_{};
  Rig rig_{arm_of(GetParam().arm)};
  const double longest_rate_stop_s_ = rate::longest_stop_s(rig_.arm);
  Shares joint_{};
  Shares path_{};
  Shares rotation_{};
  StopJudge judge_{rig_.arm};
  double deviation_m_{0}, stop_share_{0};
  int done_{0}, stopped_{0}, pressed_{0};
  std::uint64_t ticks_{0};
  std::string error_;
  int stop_tick_{-1};
  std::uint64_t id_{0};
  std::array<int, 3> instants_{};
  /// Interruptions come by turns, so that a run of few motions, too, sees each of them.
  int turn_{0};
};

/// v/a + a/j of the slowest law of the command, by the limits of the arm.
double Motions::ramp_scale_s(const Command& command) const {
  double scale_s = 0.0;
  if (is_path(command)) {
    for (const rate::RateLimit& limit : rate::RateLimits(path_limits(rig_.arm, command)))
      scale_s = std::max(scale_s, limit.speed / limit.acceleration + limit.acceleration / limit.jerk);
    return scale_s;
  }
  if (command.kind == MotionKind::kJoint) {
    for (std::size_t i = 0; i < rig_.arm.dof; ++i) {
      const JointLimits& limits = rig_.arm.joints[i];
      if (command.joint.law[i].distance == 0.0) continue;
      scale_s = std::max(
          scale_s, limits.speed_q_s / limits.acceleration_q_s2 + limits.acceleration_q_s2 / limits.jerk_q_s3);
    }
    return scale_s;
  }
  const PathLimits& limits = rig_.arm.path;
  return std::max(limits.speed_m_s / limits.acceleration_m_s2 + limits.acceleration_m_s2 / limits.jerk_m_s3,
                  limits.rotation_speed_rad_s / limits.rotation_acceleration_rad_s2 +
                      limits.rotation_acceleration_rad_s2 / limits.rotation_jerk_rad_s3);
}

void Motions::pause(bool on) {
  rig_.pause(on);
  on ? judge_.request() : judge_.withdraw();
}

bool Motions::interrupt(Interruption interruption, int tick) {
  const bool first = tick == instants_[0];
  const bool second = tick == instants_[1];
  const bool third = tick == instants_[2];
  if (!first && !second && !third) return false;
  bool stops = false;
  switch (interruption) {
    case Interruption::kStop:
    case Interruption::kCancel:
    case Interruption::kPress:
      stops = first;
      break;
    case Interruption::kPauseResume:
      if (!third) pause(first);
      break;
    case Interruption::kResumeThenStop:
      if (!third) pause(first);
      stops = third;
      break;
    case Interruption::kOverride:
      if (!third) rig_.override_to(first ? uniform(0.05, 1.0) : 1.0);
      break;
    case Interruption::kOverrideThenStop:
      if (first) rig_.override_to(uniform(0.05, 1.0));
      stops = second;
      break;
    case Interruption::kPauseThenStop:
    case Interruption::kPauseThenCancel:
    case Interruption::kPauseThenPress:
      if (first) pause(true);
      stops = second;
      break;
    default:
      break;
  }
  if (!stops) return false;
  judge_.request();
  stop_tick_ = tick;
  if (interruption == Interruption::kCancel || interruption == Interruption::kPauseThenCancel) {
    rig_.cancel(id_, id_);
  } else if (is_press(interruption)) {
    rig_.emergency_stop->set(StopSource::kGpio, true);
  } else {
    rig_.stop();
  }
  return true;
}

bool Motions::check_stop(const Command& command, int ticks) {
  const double taken_s = ticks * static_cast<double>(rig_.arm.period_ns) * 1e-9;
  const double scale_s = ramp_scale_s(command);
  if (scale_s > 0.0) stop_share_ = std::max(stop_share_, taken_s / scale_s);
  // Two cycles: one to see the request, one to report.
  const double bound_s = is_path(command) ? longest_rate_stop_s_ : scale_s * rt::Governor::kStopBound;
  run_results().see("stop_of_bound", taken_s / (bound_s + 3e-3));
  if (taken_s <= bound_s + 3e-3) return true;
  error_ = fmt::format("stop took {} s, {} times v/a + a/j", taken_s, taken_s / scale_s);
  return false;
}

bool Motions::check_end(const Command& command) {
  for (std::size_t i = 0; i < rig_.arm.dof; ++i) {
    const double miss = rig_.snapshot.position_q[i] - command.end_q[i];
    const bool by_joint = command.kind == MotionKind::kJoint;
    if (by_joint) run_results().see("end_off_q", std::abs(miss));
    if (by_joint && !(std::abs(miss) <= 1e-9)) {
      error_ = fmt::format("joint {} ends {} off", i, miss);
      return false;
    }
  }
  if (command.kind == MotionKind::kJoint) return true;
  const auto end = rig_.snapshot.tool.position_m;
  const PathPoint target =
      command.kind == MotionKind::kLine ? point_at(command.line, 1.0) : point_at(command.arc, 1.0);
  const double miss_m =
      std::hypot(end[0] - target.position_m[0], end[1] - target.position_m[1], end[2] - target.position_m[2]);
  run_results().see("end_off_m", miss_m);
  if (miss_m <= 1e-9) return true;
  error_ = fmt::format("TCP ends {} m off", miss_m);
  return false;
}

/// The press was a moment: the energy goes when the arm is at rest, and comes back by a Clear, without a
/// motion.
bool Motions::clear_after_press() {
  rig_.emergency_stop->set(StopSource::kGpio, false);
  const Joints at_rest = rig_.snapshot.position_q;
  const std::uint32_t flags = rig_.snapshot.flags;
  rig_.step();
  rig_.clear();
  rig_.step();
  if (rig_.snapshot.state != RtState::kStandby) error_ = "not cleared";
  if ((flags & kSnapshotPowerOff) == 0 || (flags & kSnapshotFaultStop) != 0) error_ = "not off at rest";
  if (rig_.snapshot.position_q != at_rest) error_ = "moved by a Clear";
  return error_.empty();
}

void Motions::count(const Command& command, const Watcher& watcher) {
  const auto raise = [](Shares& most, const Shares& seen) {
    most = {std::max(most.speed, seen.speed), std::max(most.acceleration, seen.acceleration),
            std::max(most.jerk, seen.jerk)};
  };
  raise(joint_, watcher.joint);
  raise(path_, watcher.path);
  raise(rotation_, watcher.rotation);
  deviation_m_ = std::max(deviation_m_, watcher.deviation_m);
  auto& counts = run_results().counts;
  ++counts["motions"];
  ++counts["of_" + GetParam().arm];
  ++counts[command.kind == MotionKind::kJoint  ? "joint_motions"
           : command.kind == MotionKind::kLine ? "lines"
                                               : "arcs"];
}

void Motions::report() const {
  if (results_file() == nullptr || HasFailure()) {
    fmt::print(
        "{} done, {} stopped, {} of them by a press, {} ticks; greatest share of the limits: joint motions v "
        "{:.6f} a {:.6f} j "
        "{:.6f}, "
        "path v {:.6f} a {:.6f} j {:.6f}; deviation {:.2e} m; stop {:.3f} (v/a + a/j), {:.3f} of the "
        "shortest "
        "one; faster after it by {:.3f} (a²/2j), {} of {} took over {} of the shortest\n",
        done_, stopped_, pressed_, ticks_, joint_.speed, joint_.acceleration, joint_.jerk, path_.speed,
        path_.acceleration, path_.jerk, deviation_m_, stop_share_, judge_.greatest_share,
        judge_.greatest_rise, judge_.long_stops, judge_.stops, StopJudge::kNearlyAll);
  }
  const auto see = [](const std::string& of, const Shares& shares) {
    for (const auto& [what, share] :
         {std::pair("_speed", shares.speed), std::pair("_acceleration", shares.acceleration),
          std::pair("_jerk", shares.jerk)}) {
      run_results().see(of + what, share);
      EXPECT_LE(share, kMostShare) << of << what;
    }
  };
  see("joint", joint_);
  see("tool", path_);
  see("tool_rotation", rotation_);
  run_results().see("off_path_m", deviation_m_);
  run_results().see("stop_of_shortest", judge_.greatest_share);
  run_results().counts["ticks"] += ticks_;
  run_results().counts["stopped"] += static_cast<std::uint64_t>(stopped_);
}

bool Motions::run(const Command& command, Interruption interruption) {
  Watcher watcher(rig_.arm, rig_.snapshot);
  watcher.begin(command);
  judge_.begin(command);
  id_ = rig_.submit(std::vector<Command>{command});
  const int natural_ticks =
      static_cast<int>(command.duration_s * 1e9 / static_cast<double>(rig_.arm.period_ns)) + 2;
  instants_[0] = 1 + dice(natural_ticks);
  instants_[1] = instants_[0] + 1 + dice(dice(2) == 0 ? 20 : natural_ticks);
  instants_[2] = instants_[1] + 1 + dice(dice(2) == 0 ? 20 : natural_ticks);
  stop_tick_ = -1;
  double remaining_s = 0.0;
  Verdict verdict{};
  int tick = 0;
  // A rate of 5 % takes twenty times as long; beyond any ramp besides that something hangs.
  const int patience = 25 * natural_ticks + 20000;
  for (; tick < patience; ++tick) {
    if (interrupt(interruption, tick)) {
      if (is_press(interruption)) watcher.expect_fault();
      const double rate = rig_.snapshot.virtual_rate;
      remaining_s = rate > 0.0 ? (command.duration_s - rig_.snapshot.virtual_time_s) / rate : 0.0;
    }
    rig_.step();
    ++ticks_;
    if (!watcher.see(rig_.snapshot)) error_ = watcher.error;
    if (!judge_.see(rig_.snapshot)) error_ = judge_.error;
    if (rig_.snapshot.virtual_rate == 0.0 && !judge_.rest()) error_ = judge_.error;
    if (!error_.empty()) break;
    if (const auto completion = rig_.completion()) {
      if (completion->id != id_) error_ = fmt::format("verdict for {} instead of {}", completion->id, id_);
      verdict = completion->verdict;
      break;
    }
  }
  if (error_.empty() && tick == patience) error_ = "never ended";
  if (error_.empty() && !judge_.rest()) error_ = judge_.error;
  if (error_.empty() && stop_tick_ >= 0 && !check_stop(command, tick - stop_tick_)) return false;
  // A path slows down at once, also where it then reaches its end.
  if (error_.empty() && stop_tick_ >= 0 && !is_path(command) &&
      (interruption == Interruption::kStop || interruption == Interruption::kCancel) &&
      (tick - stop_tick_) * 1e-3 > remaining_s + 3e-3) {
    error_ = fmt::format("stop took {} s, the motion would have ended in {} s", (tick - stop_tick_) * 1e-3,
                         remaining_s);
  }
  rig_.pause(false);
  rig_.override_to(1.0);
  // At rest nothing creeps on.
  for (int i = 0; i < 3 && error_.empty(); ++i) {
    rig_.step();
    if (!watcher.see(rig_.snapshot)) error_ = watcher.error;
  }
  if (error_.empty() && stop_tick_ >= 0 && is_press(interruption)) {
    // Pressed in the very cycle of the end, it may still be done, and is a fault at rest.
    if (!clear_after_press()) return false;
    ++pressed_;
    if (verdict == Verdict::kFault) verdict = Verdict::kStopped;
  }
  count(command, watcher);
  if (!error_.empty()) return false;
  (verdict == Verdict::kDone ? done_ : stopped_)++;
  if (verdict == Verdict::kDone) return check_end(command);
  if (verdict == Verdict::kStopped && stop_tick_ >= 0) return true;
  error_ = fmt::format("verdict {}", static_cast<int>(verdict));
  return false;
}

void Motions::one_motion(Kind kind) {
  for (int attempt = 0;; ++attempt) {
    // If a path finds no room, the arm goes elsewhere by its joints.
    const PlanResult planned = plan(attempt % 8 == 7 ? Kind::kJoint : kind);
    if (const auto* refusal = std::get_if<PlanRefusal>(&planned)) {
      // A refusal for too many knots says more of the planner than of the arm.
      run_results().counts["paths_without_knots"] +=
          refusal->text.find(" knots") != std::string::npos ? 1 : 0;
      continue;
    }
    const std::vector<Command> commands = rig_.with_knots(planned);
    const bool interrupted = dice(2) == 0;
    for (const Command& command : commands) {
      const auto interruption =
          interrupted ? static_cast<Interruption>(turn_++ % static_cast<int>(Interruption::kCount))
                      : Interruption::kNone;
      if (!run(command, interruption)) {
        ADD_FAILURE() << error_ << "; interruption " << static_cast<int>(interruption) << " at tick "
                      << instants_[0] << ", " << instants_[1] << "; kind " << static_cast<int>(command.kind)
                      << ", duration " << command.duration_s;
        return;
      }
      if (stop_tick_ >= 0) return;
    }
    if (attempt % 8 != 7) return;
  }
}

TEST_P(Motions, KeepEveryLimitAndStayOnThePath) {
  const auto& [arm, kind, shard] = GetParam();
  const std::uint64_t seed = environment("CORBOT_SEED", kDefaultSeed) * 100 +
                             static_cast<std::uint64_t>(kind) * 10 + static_cast<std::uint64_t>(shard);
  const auto shares = static_cast<std::uint64_t>(shares_of(arm));
  // Fewer would not see each interruption come while the arm still moves.
  const std::uint64_t motions =
      std::max<std::uint64_t>((environment("CORBOT_MOTIONS", kDefaultMotions) + shares - 1) / shares, 100);
  random_.seed(seed);
  if (results_file() == nullptr)
    fmt::print("seed {} (CORBOT_SEED, kind, shard), {} motions\n", seed, motions);
  rig_.step();
  for (std::uint64_t i = 0; i < motions && !HasFailure(); ++i) one_motion(kind);
  report();
  EXPECT_GT(done_, 0);
  EXPECT_GT(stopped_, 0);
  EXPECT_GT(pressed_, 0);
  EXPECT_LE(judge_.long_stops, 3 + judge_.stops / 20);
}

INSTANTIATE_TEST_SUITE_P(Random, Motions, ::testing::ValuesIn(motion_cases()),
                         [](const auto& test) { return name_of(test.param); });

}  // namespace
}  // namespace corbot::test::property_motion_test
