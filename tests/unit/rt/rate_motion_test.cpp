// SPDX-License-Identifier: Apache-2.0
// Tests a line from the servant's segment to the set-points: all limits of every joint in every cycle. The
// line is also stopped, paused, overridden, cancelled and forged. The planner plans no such command yet.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <utility>
#include <variant>

#include "corbot/channel/alarms.h"
#include "corbot/motion/path.h"
#include "rt/rate_command.h"
#include "rt/rig.h"

namespace corbot::test::rate_motion_test {
namespace {

constexpr std::uint16_t kSlot = 7;

/// Its tool is so quick that the joints' limits count.
const ArmModel& puma() {
  static const ArmModel arm = [] {
    ArmModel quick = arm_of("puma560");
    for (double* limit : {&quick.path.speed_m_s, &quick.path.acceleration_m_s2, &quick.path.jerk_m_s3})
      *limit *= 10.0;
    return quick;
  }();
  return arm;
}
const Joints kBent{0.3, -0.8, 0.4, 0.2, 0.3, 0.1};

struct RateMotion : testing::Test {
  RateMotion() {
    rig.restart({.position_q = kBent, .position_known = true});
    rig.step();
    last_q_.fill(rig.snapshot.position_q);
  }

  /// As a servant would hand it over.
  Command handed_over(const Vector3& by_m, double t_s = 0.0) {
    const PlanStart from = rig.start();
    const Vector3 target_m = rig.arm.kinematics.forward(from.position_q).position_m + by_m;
    const PlanResult plan = rig.planner.move_s(from, {}, target_m, 0.0);
    if (const auto* refusal = std::get_if<PlanRefusal>(&plan)) throw std::runtime_error(refusal->text);
    return with_rate(rig, rig.stamp(std::get<std::vector<Command>>(plan).front()), kSlot, t_s);
  }
  RateSlot& slot() { return rig.servant->rates[kSlot]; }

  /// A cycle, and how near it comes to each limit.
  void step() {
    rig.step();
    const Joints& q = rig.snapshot.position_q;
    for (std::size_t i = 0; i < puma().dof; ++i) {
      const JointLimits& limits = puma().joints[i];
      const double one = q[i] - last_q_[0][i], two = one - (last_q_[0][i] - last_q_[1][i]);
      const double before = last_q_[0][i] - 2.0 * last_q_[1][i] + last_q_[2][i];
      greatest_ = std::max({greatest_, std::abs(one) / (1e-3 * limits.speed_q_s),
                            std::abs(two) / (1e-6 * limits.acceleration_q_s2),
                            (std::abs(two - before) - 2e-14) / (1e-9 * limits.jerk_q_s3)});
    }
    last_q_ = {q, last_q_[0], last_q_[1]};
  }
  /// Until the command has its verdict. `at`: called in every cycle, with the number of those that have
  /// moved.
  Verdict run(const std::function<void(int)>& at = {}) {
    int moved = 0;
    for (int cycle = 0; cycle < 20'000; ++cycle) {
      if (const auto done = rig.completion()) return done->verdict;
      if (rig.snapshot.command_id != 0) ++moved;
      if (at) at(moved);
      step();
    }
    throw std::runtime_error("no verdict");
  }
  [[nodiscard]] double off_line_m(const LineMotion& line) const {
    const Vector3 along = line.to_m - line.from_m, to = rig.snapshot.tool.position_m - line.from_m;
    return norm(to - (dot(to, along) / dot(along, along)) * along);
  }

  Rig rig{puma()};
  std::array<Joints, 3> last_q_{};
  double greatest_{};
  const Vector3 aside_{-0.1, 0.12, -0.1};
};

TEST_F(RateMotion, RunsAtItsLimitsAndOnItsLine) {
  const Command command = handed_over(aside_);
  ASSERT_TRUE(rig.push(command));
  double off_m = 0.0;
  EXPECT_EQ(run([&](int) { off_m = std::max(off_m, off_line_m(command.line)); }), Verdict::kDone);
  EXPECT_LE(off_m, 1e-6);
  EXPECT_EQ(rig.snapshot.position_q, command.end_q);
  EXPECT_LE(greatest_, 1.0001);
  EXPECT_GT(greatest_, 0.9);
  EXPECT_FALSE(rig.alarm());
}

TEST_F(RateMotion, IsStoppedPausedAndOverriddenWithinItsLimits) {
  for (const int when : {1, 100, 400, 700, 1400}) {
    for (const bool is_cancelled : {false, true}) {
      SCOPED_TRACE(when);
      const Command command = handed_over(aside_, 1.5);
      ASSERT_TRUE(rig.push(command));
      double off_m = 0.0;
      const Verdict verdict = run([&](int moved) {
        off_m = std::max(off_m, off_line_m(command.line));
        if (moved == when) is_cancelled ? rig.cancel(command.id, command.id) : rig.stop();
      });
      EXPECT_EQ(verdict, Verdict::kStopped);
      EXPECT_LE(off_m, 1e-6);
      if (when <= 700) {
        EXPECT_NE(rig.snapshot.position_q, command.end_q);
      }
      rig.restart({.position_q = kBent, .outranks_segment = true, .position_known = true});
      rig.step();
      last_q_.fill(rig.snapshot.position_q);
    }
  }
  EXPECT_LE(greatest_, 1.0001);
  EXPECT_FALSE(rig.alarm());
}

/// It begins by the curve of the whole motion, and goes on by what lies ahead.
TEST_F(RateMotion, StopsAsWhatLiesAheadAllows) {
  const Vector3 far{-0.3, 0.36, -0.1};
  const Command command = handed_over(far);
  const auto plan = std::get<rate::RatePlan>(
      rate::plan_rate(puma(), {}, command.line, command.start_q, command.duration_s));
  double all_s = 0.0, all_plain_s = 0.0;
  for (int when = 40; when < 1e3 * command.duration_s; when += 40) {
    SCOPED_TRACE(when);
    ASSERT_TRUE(rig.push(handed_over(far)));
    rate::RateGovernor plain;
    int stopping = 0;
    (void)run([&](int moved) {
      if (moved == when) {
        plain.begin(plan.curve, 1.0);
        plain.advance(rig.snapshot.virtual_time_s);
        plain.seek(0.0);
        rig.stop();
      }
      if (moved >= when) ++stopping;
    });
    int plain_cycles = 0;
    for (; !plain.is_at_rest() && plain.time_s() < command.duration_s; ++plain_cycles) plain.advance(1e-3);
    EXPECT_LE(stopping, plain_cycles + 3);
    all_s += stopping;
    all_plain_s += plain_cycles;
    rig.restart({.position_q = kBent, .outranks_segment = true, .position_known = true});
    rig.step();
    last_q_.fill(rig.snapshot.position_q);
  }
  EXPECT_LT(all_s, 0.93 * all_plain_s);
  EXPECT_LE(greatest_, 1.0001);
  EXPECT_FALSE(rig.alarm());
}

TEST_F(RateMotion, GoesOnAfterPauseAndOverride) {
  const Command command = handed_over(aside_, 1.5);
  ASSERT_TRUE(rig.push(command));
  bool has_paused = false;
  const Verdict verdict = run([&](int moved) {
    if (moved == 100) rig.override_to(0.3);
    if (moved == 700) rig.pause(true);
    has_paused = has_paused || rig.snapshot.state == RtState::kPaused;
    if (moved == 3000) rig.pause(false);
    if (moved == 3100) rig.override_to(1.0);
  });
  EXPECT_EQ(verdict, Verdict::kDone);
  EXPECT_TRUE(has_paused);
  EXPECT_EQ(rig.snapshot.position_q, command.end_q);
  EXPECT_LE(greatest_, 1.0001);
  EXPECT_FALSE(rig.alarm());
}

/// The arm stands still during a gap, and begins from rest.
TEST_F(RateMotion, GoesOnFromRestAfterAGap) {
  const Command command = handed_over(aside_, 1.5);
  ASSERT_TRUE(rig.push(command));
  const Verdict verdict = run([&](int moved) {
    if (moved != 400) return;
    rig.now_ns += 30'000'000;
    rig.step();
    EXPECT_LT(rig.snapshot.virtual_rate, 0.01);
    last_q_.fill(rig.snapshot.position_q);
  });
  EXPECT_EQ(verdict, Verdict::kDone);
  EXPECT_EQ(rig.snapshot.position_q, command.end_q);
  EXPECT_LE(greatest_, 1.0001);
  EXPECT_FALSE(rig.alarm());
}

TEST_F(RateMotion, IsItsOwnOnceItHasBegun) {
  const Command command = handed_over(aside_);
  ASSERT_TRUE(rig.push(command));
  const Verdict verdict = run([&](int moved) {
    if (moved == 5) slot() = {};
  });
  EXPECT_EQ(verdict, Verdict::kDone);
  EXPECT_EQ(rig.snapshot.position_q, command.end_q);
  EXPECT_LE(greatest_, 1.0001);
}

TEST_F(RateMotion, IsRefusedWhereItIsForged) {
  using Forgery = std::function<void(Command&, RateSlot&)>;
  const std::pair<Forgery, Verdict> forgeries[] = {
      {[](Command&, RateSlot& slot) { slot.knots[1].z[2] += 1e-5; }, Verdict::kMalformed},
      {[](Command&, RateSlot& slot) { slot.knots[1].rate[0] += 1e-4; }, Verdict::kMalformed},
      {[](Command&, RateSlot& slot) { slot.knots[1].bend[3] += 0.1; }, Verdict::kMalformed},
      {[](Command&, RateSlot& slot) { slot.knots[0].z[1] += 1e-9; }, Verdict::kDiscontinuous},
      {[](Command&, RateSlot& slot) { slot.knots[1].lambda_s = slot.knots[0].lambda_s; },
       Verdict::kMalformed},
      {[](Command&, RateSlot& slot) { slot.pieces[5].begin.a += 1e-3; }, Verdict::kMalformed},
      {[](Command&, RateSlot& slot) { slot.pieces[5].begin.v = std::nan(""); }, Verdict::kMalformed},
      {[](Command&, RateSlot& slot) { std::swap(slot.pieces[5], slot.pieces[6]); }, Verdict::kMalformed},
      {[](Command& command, RateSlot&) { command.duration_s *= 0.99; }, Verdict::kMalformed},
      {[](Command& command, RateSlot&) { command.end_q[1] += 1e-9; }, Verdict::kMalformed},
      {[](Command& command, RateSlot&) { command.line.knots.pieces = 113; }, Verdict::kMalformed},
      {[](Command& command, RateSlot&) { command.line.knots.count = 1; }, Verdict::kMalformed},
      {[](Command& command, RateSlot&) { command.line.knots.slot = 9999; }, Verdict::kMalformed},
      // All of it 5 % quicker: it fits together, and only the proof knows.
      {[](Command& command, RateSlot& slot) {
         command.duration_s /= 1.05;
         for (rate::Piece& piece : slot.pieces) {
           piece.begin_s /= 1.05;
           piece.begin.v *= 1.05;
           piece.begin.a *= 1.05 * 1.05;
           piece.begin.j *= 1.05 * 1.05 * 1.05;
         }
       },
       Verdict::kLimit}};
  int number = 0;
  for (const auto& [forge, verdict] : forgeries) {
    SCOPED_TRACE(number++);
    Command command = handed_over(aside_);
    forge(command, slot());
    ASSERT_TRUE(rig.push(command));
    EXPECT_EQ(run(), verdict);
    const auto alarm = rig.alarm();
    ASSERT_TRUE(alarm);
    EXPECT_EQ(alarm->code, AlarmCode::kCommandRefused);
    EXPECT_EQ(rig.snapshot.position_q, command.start_q);
  }
}

}  // namespace
}  // namespace corbot::test::rate_motion_test
