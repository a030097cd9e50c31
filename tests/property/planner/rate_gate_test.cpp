// SPDX-License-Identifier: Apache-2.0
// The task's gate for lines and arcs: every plan passes, and what passes with altered bytes keeps its path
// and all limits.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <iostream>
#include <limits>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "corbot/motion/path.h"
#include "limit_ticks.h"
#include "random_rates.h"
#include "rt/cycle/path_check.h"
#include "rt/cycle/path_evaluation.h"
#include "rt/cycle/rate_check.h"
#include "rt/cycle/set_point_check.h"

namespace corbot::property_rate_gate_test {
namespace {

/// As it lies in the task's memory.
struct Sent {
  Command command{};
  std::vector<rate::Knot> knots;
  std::vector<rate::Piece> pieces;

  [[nodiscard]] rate::RatePath path() const {
    return {knots, {pieces, command.duration_s, knots.back().lambda_s}};
  }
  [[nodiscard]] Joints at(double t_s) const {
    return test::joints_in(rate::state_at(knots, path().law.at(t_s).lambda_s));
  }
};

class RateGate : public test::RandomRates {
 protected:
  std::optional<Sent> sent(const PlanSettings& s, const Command& command) const {
    const auto planned = command.kind == MotionKind::kArc
                             ? rate::plan_rate(arm_, s, command.arc, command.start_q, 0.0)
                             : rate::plan_rate(arm_, s, command.line, command.start_q, 0.0);
    if (!std::holds_alternative<rate::RatePlan>(planned)) return std::nullopt;
    const auto& plan = std::get<rate::RatePlan>(planned);
    if (plan.law.length_s() == 0.0) return std::nullopt;  // a dwell
    Sent sent{command, plan.knots, plan.law.pieces()};
    sent.command.id = ++id_;
    sent.command.duration_s = plan.law.duration_s();
    sent.command.end_q = test::joints_in(plan.knots.back().z);
    KnotRange& range = *knots_of(sent.command);
    range = {0, static_cast<std::uint16_t>(plan.knots.size()),
             static_cast<std::uint16_t>(plan.law.pieces().size())};
    return sent;
  }

  /// Returns the gate's verdict, as the cycle gets it.
  rt::CommandVerdict verdict(const Sent& sent) {
    const rt::CommandVerdict fields =
        rt::check_command(arm_, sent.command, {sent.command.id - 1, sent.command.start_q, 0.0});
    if (!fields.ok()) return fields;
    for (std::size_t i = 0; i <= kMostKnots + rate::kMostPieces; ++i) {
      if (const auto verdict = check_.step(arm_, sent.command, sent.path())) return *verdict;
    }
    ADD_FAILURE() << "no end";
    return {};
  }

  template <class Motion>
  void expect_good(const Sent& sent, const Motion& motion) const {
    const auto set_points = [&](double t_s) { return std::optional(sent.at(t_s)); };
    const test::TickShares shares =
        test::LimitTicks(arm_, {}, true, sent.command.duration_s, set_points).run();
    EXPECT_LE(shares.joint().greatest(), 1.0001);
    for (int k = 0; k <= 50; ++k) {
      const double lambda_s = sent.path().law.at(k * sent.command.duration_s / 50).lambda_s;
      const rate::State z = rate::state_at(sent.knots, lambda_s);
      const Vector3 there_m = arm_.kinematics.forward(test::joints_in(z)).position_m;
      EXPECT_LE(norm(there_m - point_at(motion, z[rate::kPath]).position_m), 1e-5);
    }
  }

  /// Checks that forward and inverse kinematics agree, as the cycle does.
  void expect_agreement(const Sent& sent) {
    const bool is_arc = sent.command.kind == MotionKind::kArc;
    Kinematics framed = arm_.kinematics;
    rt::take_frames(sent.command, framed);
    rt::PathCheck agreement;
    agreement.begin(is_arc ? sent.command.arc.solution : sent.command.line.solution);
    for (int k = 0; k <= 300; ++k) {
      const double lambda_s = sent.path().law.at(k * sent.command.duration_s / 300).lambda_s;
      const rate::State z = rate::state_at(sent.knots, lambda_s);
      const double s = z[rate::kPath];
      const PathPoint point = is_arc ? point_at(sent.command.arc, s) : point_at(sent.command.line, s);
      ASSERT_TRUE(agreement.agrees(framed, point, test::joints_in(z))) << s;
    }
  }

  std::uint64_t below(std::uint64_t count) { return random_() % count; }
  /// One byte, one bit, or one number that is made a little greater or less, or something strange.
  void alter(Sent& sent) {
    const std::size_t knots = sent.knots.size() * sizeof(rate::Knot) / sizeof(double);
    const std::size_t pieces = sent.pieces.size() * sizeof(rate::Piece) / sizeof(double);
    const std::size_t which = below(2) == 0 ? below(knots) : knots + below(pieces);
    auto* const bytes =
        which < knots
            ? reinterpret_cast<unsigned char*>(sent.knots.data()) + which * sizeof(double)
            : reinterpret_cast<unsigned char*>(sent.pieces.data()) + (which - knots) * sizeof(double);
    double value{};
    std::memcpy(&value, bytes, sizeof value);
    switch (below(4)) {
      case 0: {
        constexpr std::array<double, 6> kStrange{0.0,    -1.0,   1e308,
                                                 -1e308, 1e-308, std::numeric_limits<double>::quiet_NaN()};
        value = kStrange[below(kStrange.size())];
        break;
      }
      case 1:
        value += std::pow(10.0, in(-12.0, 2.0)) * (below(2) == 0 ? 1.0 : -1.0);
        break;
      default: {
        std::uint64_t bits{};
        std::memcpy(&bits, &value, sizeof bits);
        bits ^= std::uint64_t{1} << below(64);
        std::memcpy(&value, &bits, sizeof value);
      }
    }
    std::memcpy(bytes, &value, sizeof value);
  }

  void check(const Sent& good) {
    const rt::CommandVerdict plain = verdict(good);
    ASSERT_TRUE(plain.ok()) << static_cast<int>(plain.verdict) << " joint " << plain.joint << " "
                            << plain.value;
    ++passed_;
    expect_agreement(good);
    for (int k = 0; k < 20; ++k) {
      Sent bad = good;
      bad.command.id = ++id_;
      alter(bad);
      if (!verdict(bad).ok()) {
        ++refused_;
        continue;
      }
      ++harmless_;
      if (bad.command.kind == MotionKind::kArc) {
        expect_good(bad, bad.command.arc);
      } else {
        expect_good(bad, bad.command.line);
      }
      ASSERT_FALSE(HasFailure());
    }
  }

  mutable std::uint64_t id_{0};
  rt::RateCheck check_;
  int passed_{}, refused_{}, harmless_{};
};

TEST_P(RateGate, TakesEveryPlanAndNothingElse) {
  const int cases = test::cases(200);
  for (int i = 0; i < cases; ++i) {
    SCOPED_TRACE(i);
    const auto [s, commands] = random_case(i);
    for (const Command& command : commands) {
      if (knots_of(command) == nullptr) continue;
      const std::optional<Sent> good = sent(s, command);
      if (good) {
        ASSERT_NO_FATAL_FAILURE(check(*good));
      }
    }
  }
  std::cout << passed_ << " pass, " << refused_ << " altered ones are refused, " << harmless_ << " are not\n";
  EXPECT_GT(passed_, cases / 8);
  EXPECT_GT(refused_, harmless_) << "the others change what nobody sees";
}

/// Rounding grows with lambda, which counts the seconds that full speed takes.
TEST_P(RateGate, TakesPathsOfManyMinutes) {
  const PlanSettings slow{.speed_ratio = 0.001};
  int taken = 0;
  for (int i = 0; i < 40; ++i) {
    const PlanStart from = start(i);
    const Vector3 here = arm_.kinematics.forward(from.position_q).position_m;
    const PlanResult plan = Planner(arm_).move_s(from, slow, near(here, 0.2), 0.0);
    if (std::holds_alternative<PlanRefusal>(plan)) continue;
    const std::optional<Sent> sent = this->sent(slow, std::get<std::vector<Command>>(plan).front());
    if (!sent) continue;
    const rt::CommandVerdict found = verdict(*sent);
    EXPECT_TRUE(found.ok()) << sent->command.duration_s << " s: " << found.value;
    ++taken;
  }
  EXPECT_GT(taken, 0);
}

INSTANTIATE_TEST_SUITE_P(Arms, RateGate,
                         testing::Values("lynx5", "al5d_wr", "puma560", "scara_gx4", "stanford",
                                         "cartesian_ppp", "cylindrical_rpp", "polar_rrp", "xarm6"),
                         [](const auto& arm) { return std::string(arm.param); });

}  // namespace
}  // namespace corbot::property_rate_gate_test
