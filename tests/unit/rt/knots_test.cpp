// SPDX-License-Identifier: Apache-2.0
// Lines and arcs: knots and pieces through the segment, and what the cycle makes of forged ones.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <list>
#include <string>
#include <utility>
#include <vector>

#include "corbot/channel/alarms.h"
#include "corbot/motion/path.h"
#include "rt/rig.h"
#include "support/paths.h"

namespace corbot::test::knots_test {
namespace {

const ArmModel& xarm6() {
  static const ArmModel arm = load_profile(std::filesystem::path(CORBOT_PROFILES) / "xarm6.toml").arm;
  return arm;
}

struct Knots : testing::Test {
  Knots() { rig.step(); }

  [[nodiscard]] Vector3 tool_m(const Joints& q) const { return rig.arm.kinematics.forward(q).position_m; }
  [[nodiscard]] PlanResult line(const Joints& from, const Vector3& by) const {
    return rig.planner.move_s({from, 0.0}, {}, tool_m(from) + by, 0.0);
  }
  /// A plan of one command as the servant would hand it over, with the parts that a test may forge.
  struct Handed {
    Command command;
    RateSlot* slot;
  };
  Handed hand_over(const PlanResult& plan) {
    EXPECT_TRUE(std::holds_alternative<std::vector<Command>>(plan));
    Command command = rig.stamp(std::get<std::vector<Command>>(plan).front());
    knots_of(command)->slot = 7;
    const PlannedRate& rate = plan.rates.front();
    RateSlot& slot = rig.servant->rates[7];
    std::copy(rate.knots.begin(), rate.knots.end(), slot.knots.begin());
    std::copy(rate.pieces.begin(), rate.pieces.end(), slot.pieces.begin());
    return {command, &slot};
  }
  std::optional<Verdict> verdict(int cycles = 20'000) {
    for (int i = 0; i < cycles; ++i) {
      if (const auto done = rig.completion()) return done->verdict;
      rig.step();
    }
    return std::nullopt;
  }

  Rig rig{xarm6()};
  const Vector3 aside_{0.02, 0.15, -0.08};
};

TEST_F(Knots, LeadTheToolAlongItsLineWithinAMicrometre) {
  const PlanResult plan = line({}, aside_);
  const Handed handed = hand_over(plan);
  const LineMotion& path = handed.command.line;
  ASSERT_TRUE(rig.push(handed.command));
  const Pose start = rig.arm.kinematics.forward({});
  double off_m = 0.0, off_rad = 0.0;
  int moving = 0;
  while (!rig.completion()) {
    ASSERT_LT(moving, 20'000);
    rig.step();
    if (rig.snapshot.command_id == 0) continue;
    ++moving;
    const Vector3 along = path.to_m - path.from_m;
    const Vector3 away = rig.snapshot.tool.position_m - path.from_m;
    off_m = std::max(off_m, norm(cross(away, along)) / norm(along));
    off_rad = std::max(off_rad, angle_between(rig.snapshot.tool.orientation, start.orientation));
  }
  EXPECT_GT(moving, 500);
  EXPECT_LT(off_m, 1e-6);
  EXPECT_LT(off_rad, 1e-6);
  EXPECT_LT(norm(rig.snapshot.tool.position_m - path.to_m), 1e-9);
  EXPECT_FALSE(rig.alarm());
}

TEST_F(Knots, AStopOnTheWayStaysOnTheLine) {
  const PlanResult plan = line({}, aside_);
  rig.submit(plan);
  rig.step(30);
  ASSERT_EQ(rig.snapshot.state, RtState::kMoving);
  rig.stop();
  EXPECT_EQ(verdict(), Verdict::kStopped);
  const LineMotion path = std::get<std::vector<Command>>(plan).front().line;
  const Vector3 along = path.to_m - path.from_m, away = rig.snapshot.tool.position_m - path.from_m;
  EXPECT_LT(norm(cross(away, along)) / norm(along), 1e-6);
  EXPECT_GT(norm(away), 1e-3);
  EXPECT_LT(norm(away), 0.9 * norm(along));
}

TEST_F(Knots, AnArcIsFollowed) {
  const Vector3 p1 = tool_m({});
  const PlanResult plan =
      rig.planner.move_c(rig.start(), {}, p1, p1 + Vector3{0.03, 0.06, 0.0}, p1 + Vector3{0.0, 0.12, -0.02});
  const Handed handed = hand_over(plan);
  ASSERT_EQ(handed.command.kind, MotionKind::kArc);
  ASSERT_TRUE(rig.push(handed.command));
  const ArcMotion& arc = handed.command.arc;
  double off_m = 0.0;
  std::optional<Completion> done;
  for (int i = 0; i < 20'000 && !done; ++i) {
    rig.step();
    done = rig.completion();
    off_m = std::max(off_m, std::abs(norm(rig.snapshot.tool.position_m - arc.centre_m) - arc.radius_m));
  }
  ASSERT_TRUE(done);
  EXPECT_EQ(done->verdict, Verdict::kDone);
  EXPECT_LT(off_m, 1e-6);
  EXPECT_LT(norm(rig.snapshot.tool.position_m - (p1 + Vector3{0.0, 0.12, -0.02})), 1e-9);
}

struct Forgery {
  std::string name;
  std::function<void(Command&, RateSlot&)> forge;
};

std::vector<Forgery> forgeries() {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr double kTurn = 6.283185307179586;
  const auto middle = [](const Command& c) { return static_cast<std::size_t>(c.line.knots.count / 2); };
  std::vector<Forgery> all{
      {"no knots", [](Command& c, RateSlot&) { c.line.knots.count = 0; }},
      {"one knot", [](Command& c, RateSlot&) { c.line.knots.count = 1; }},
      {"one less", [](Command& c, RateSlot&) { --c.line.knots.count; }},
      {"one more", [](Command& c, RateSlot&) { ++c.line.knots.count; }},
      {"more than there can be", [](Command& c, RateSlot&) { c.line.knots.count = kMostKnots + 1; }},
      {"all", [](Command& c, RateSlot&) { c.line.knots.count = 65535; }},
      {"a slot that is none", [](Command& c, RateSlot&) { c.line.knots.slot = kKnotSlots; }},
      {"a slot far away", [](Command& c, RateSlot&) { c.line.knots.slot = 65535; }},
      {"another slot", [](Command& c, RateSlot&) { c.line.knots.slot = 8; }},
      {"a solution", [](Command& c, RateSlot&) { c.line.solution = 1; }},
      {"nothing", [](Command&, RateSlot& k) { k = {}; }},
      {"another line", [](Command& c, RateSlot&) { c.line.to_m[2] += 1e-5; }},
      {"another orientation", [](Command& c, RateSlot&) { c.line.tool.turn_rad[1] += 1e-5; }},
      {"no pieces", [](Command& c, RateSlot&) { c.line.knots.pieces = 0; }},
      {"one piece less", [](Command& c, RateSlot&) { --c.line.knots.pieces; }},
      {"one piece more", [](Command& c, RateSlot&) { ++c.line.knots.pieces; }},
      {"half the time", [](Command& c, RateSlot&) { c.duration_s *= 0.5; }},
      {"another end", [](Command& c, RateSlot&) { c.end_q[3] += 1e-4; }},
      {"a jump to another turn",
       [middle](Command& c, RateSlot& k) {
         for (std::size_t i = middle(c); i < c.line.knots.count; ++i) k.knots[i].z[5] += kTurn;
         c.end_q[5] += kTurn;
       }},
      {"back",
       [middle](Command& c, RateSlot& k) {
         k.knots[middle(c)].z[rate::kPath] = k.knots[middle(c) - 1].z[rate::kPath];
       }},
      {"a wiggle of rates",
       [middle](Command& c, RateSlot& k) {
         k.knots[middle(c)].rate[2] += 1.0;
         k.knots[middle(c) + 1].rate[2] -= 1.0;
       }},
      {"a wiggle of bends", [middle](Command& c, RateSlot& k) {
         k.knots[middle(c)].bend[2] += 10.0;
         k.knots[middle(c) + 1].bend[2] -= 10.0;
       }}};
  constexpr int kStates = static_cast<int>(kMaxJoints) + 1;
  const auto field = [](rate::Knot& knot, int which) -> double& {
    if (which == 0) return knot.lambda_s;
    const auto k = static_cast<std::size_t>((which - 1) % kStates);
    return which <= kStates ? knot.z[k] : which <= 2 * kStates ? knot.rate[k] : knot.bend[k];
  };
  for (int which = 0; which <= 3 * kStates; ++which) {
    for (const double value : {kNan, kInfinity, -1e308, 7.0}) {
      for (const bool at_end : {false, true}) {
        all.push_back(
            {"field " + std::to_string(which) + " = " + std::to_string(value) + (at_end ? " at the end" : ""),
             [=](Command& c, RateSlot& k) {
               field(k.knots[at_end ? static_cast<std::size_t>(c.line.knots.count - 1) : middle(c)], which) =
                   value;
             }});
      }
    }
  }
  for (int which = 1; which <= 6; ++which) {
    all.push_back({"off by 1e-4 in joint " + std::to_string(which - 1),
                   [=](Command& c, RateSlot& k) { field(k.knots[middle(c)], which) += 1e-4; }});
  }
  return all;
}

TEST_F(Knots, ForgedOnesAreRefusedWithAnAlarmAndNothingMoves) {
  for (const Forgery& forgery : forgeries()) {
    SCOPED_TRACE(forgery.name);
    Handed handed = hand_over(line({}, aside_));
    forgery.forge(handed.command, *handed.slot);
    ASSERT_TRUE(rig.push(handed.command));
    const auto refused = verdict(100);
    ASSERT_TRUE(refused);
    EXPECT_TRUE(*refused == Verdict::kMalformed || *refused == Verdict::kLimit);
    const auto alarm = rig.alarm();
    ASSERT_TRUE(alarm);
    EXPECT_EQ(alarm->code, AlarmCode::kCommandRefused);
    EXPECT_EQ(rig.snapshot.position_q, Joints{});
    EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
  }
  rig.submit(line({}, aside_));
  EXPECT_EQ(verdict(), Verdict::kDone) << "a good one after them";
}

/// The cycle works on its own copy: what the other process does to the slot afterwards changes nothing.
TEST_F(Knots, WhatIsWrittenAfterTheyWereTakenIsNotRead) {
  const Handed handed = hand_over(line({}, aside_));
  ASSERT_TRUE(rig.push(handed.command));
  rig.step();
  for (rate::Knot& knot : handed.slot->knots) knot.z.fill(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(verdict(), Verdict::kDone);
  EXPECT_LT(norm(rig.snapshot.tool.position_m - (tool_m({}) + aside_)), 1e-9);
}

TEST_F(Knots, AStopWhileTheyAreCheckedRefusesThePath) {
  const PlanResult plan = line({}, aside_);
  rig.submit(plan);
  rig.step();
  ASSERT_EQ(rig.snapshot.command_id, 0u);
  ASSERT_NE(rig.snapshot.waiting_id, 0u);
  rig.stop();
  EXPECT_EQ(verdict(100), Verdict::kStopped);
  EXPECT_EQ(rig.snapshot.position_q, Joints{});
  rig.submit(line({}, aside_));
  EXPECT_EQ(verdict(), Verdict::kDone);
}

/// Servants come and go: paths that were accepted are carried out from the task's own memory.
TEST_F(Knots, OutliveTheirServants) {
  std::list<std::unique_ptr<ServantSegment>> former;
  std::list<ServantOffer> offers;
  const auto replace = [&] {
    former.push_back(std::move(rig.servant));
    rig.servant = std::make_unique<ServantSegment>();
    rig.servant->next_command_id.store(former.back()->next_command_id.load());
    rig.servant->task_id.store(former.back()->task_id.load());
    rig.servants.post(offers.emplace_back(ServantOffer{rig.servant.get(), ++rig.session}));
    rig.step();
    for (RateSlot& slot : former.back()->rates) slot = {};  // unmapped, or worse
  };
  Joints q{};
  const auto go = [&](const Vector3& by) {
    const PlanResult plan = line(q, by);
    ASSERT_TRUE(std::holds_alternative<std::vector<Command>>(plan)) << std::get<PlanRefusal>(plan).text;
    ASSERT_NE(rig.submit(plan), 0u);
    q = std::get<std::vector<Command>>(plan).back().end_q;
  };
  ASSERT_NO_FATAL_FAILURE(go(aside_));
  ASSERT_NO_FATAL_FAILURE(go({0.0, -0.1, 0.0}));
  rig.step(200);
  ASSERT_EQ(rig.snapshot.state, RtState::kMoving);
  replace();
  ASSERT_NO_FATAL_FAILURE(go({0.0, 0.0, 0.05}));
  ASSERT_NO_FATAL_FAILURE(go({-0.02, 0.05, 0.0}));
  replace();
  ASSERT_NO_FATAL_FAILURE(go({0.02, 0.0, -0.03}));
  rig.step(30'000);
  EXPECT_EQ(rig.snapshot.last_done_id, rig.servant->next_command_id.load() - 1);
  EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
  EXPECT_LT(norm(rig.snapshot.tool.position_m - tool_m(q)), 1e-9);
  EXPECT_LT(norm(tool_m(q) - (tool_m({}) + aside_ + Vector3{0.0, -0.05, 0.02})), 1e-8);
}

TEST_F(Knots, OfACommandThatWaitsOutliveItsServant) {
  rig.pause(true);
  rig.step(10);
  rig.submit(line({}, aside_));
  rig.step(10);
  ASSERT_NE(rig.snapshot.waiting_id, 0u);
  const std::unique_ptr<ServantSegment> former =
      std::exchange(rig.servant, std::make_unique<ServantSegment>());
  rig.servant->next_command_id.store(former->next_command_id.load());
  rig.pause(true);
  const ServantOffer offer{rig.servant.get(), ++rig.session};
  rig.servants.post(offer);
  rig.step();
  for (RateSlot& slot : former->rates) slot = {};
  rig.pause(false);
  EXPECT_EQ(verdict(), Verdict::kDone);
  EXPECT_LT(norm(rig.snapshot.tool.position_m - (tool_m({}) + aside_)), 1e-9);
}

/// As many as ring and backlog can hold, each with slots of its own.
TEST_F(Knots, EveryCommandThatFitsHasASlot) {
  Joints q{};
  std::size_t handed = 0;
  for (; rig.queued() < rig.servant->commands.capacity(); ++handed) {
    const double side = handed % 2 == 0 ? 1.0 : -1.0;
    const PlanResult plan = line(q, side * Vector3{0.002, 0.01 + 1e-4 * static_cast<double>(handed), 0.0});
    ASSERT_TRUE(std::holds_alternative<std::vector<Command>>(plan));
    ASSERT_NE(rig.submit(plan), 0u);
    q = std::get<std::vector<Command>>(plan).back().end_q;
    if (handed == 0) rig.step();  // one leaves the ring
  }
  EXPECT_EQ(handed, rig.servant->commands.capacity() + 1);
  for (std::size_t i = 0; i < handed; ++i) EXPECT_EQ(verdict(), Verdict::kDone) << i;
  EXPECT_LT(norm(rig.snapshot.tool.position_m - tool_m(q)), 1e-9);
}

}  // namespace
}  // namespace corbot::test::knots_test
