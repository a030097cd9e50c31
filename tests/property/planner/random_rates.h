// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <variant>
#include <vector>

#include "planner/planner.h"
#include "planner/rate/rate_planner.h"
#include "random_settings.h"
#include "support/cases.h"
#include "support/test_arms.h"

// Random lines and arcs of one arm, and where a plan has led at a time.

namespace corbot::test {

/// z of a plan at a time, clamped to its duration.
inline rate::State state_of(const rate::RatePlan& plan, double t_s) {
  return rate::state_at(plan.knots, plan.law.at(t_s).lambda_s);
}
inline Joints joints_in(const rate::State& z) {
  Joints q{};
  std::copy_n(z.begin(), q.size(), q.begin());
  return q;
}

/// Over the names of arms.
class RandomRates : public testing::TestWithParam<const char*> {
 protected:
  double in(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  Vector3 near(const Vector3& p, double size) {
    return {p[0] + in(-size, size), p[1] + in(-size, size), p[2] + in(-size, size)};
  }
  /// Every fourth case starts with all joints at 0, where most arms are stretched.
  PlanStart start(int i) {
    PlanStart from;
    for (std::size_t k = 0; i % 4 != 0 && k < arm_.dof; ++k)
      from.position_q[k] = in(arm_.joints[k].lower_q, arm_.joints[k].upper_q);
    return from;
  }
  PlanSettings settings(int i, const PlanStart& from) {
    return random_settings(arm_, i, from, [this](double low, double high) { return in(low, high); });
  }

  /// Two lines in three cases, and an arc.
  struct Case {
    PlanSettings settings;
    std::vector<Command> commands;  ///< none: refused
  };
  Case random_case(int i) {
    const PlanStart from = start(i);
    Case c{settings(i, from), {}};
    const Vector3 here = arm_.kinematics.forward(from.position_q).position_m;
    const double size = i % 8 < 4 ? 0.1 : 0.02;
    const Vector3 p2 = near(here, size), p3 = near(here, size);
    const Planner planner(arm_);
    PlanResult result = i % 3 < 2 ? planner.move_s(from, c.settings, p2, 0.0)
                                  : planner.move_c(from, c.settings, here, p2, p3);
    if (auto* commands = std::get_if<std::vector<Command>>(&result)) c.commands = std::move(*commands);
    return c;
  }

  ArmModel arm_ = arm_of(GetParam());
  std::mt19937_64 random_{seed() + 11};
};

}  // namespace corbot::test
