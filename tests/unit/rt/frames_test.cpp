// SPDX-License-Identifier: Apache-2.0
// Lines of different tools in one queue, and records whose frames no planner writes.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "corbot/kinematics/tool_pose.h"
#include "corbot/motion/path.h"
#include "planner/frame_settings.h"
#include "rt/cycle/command_check.h"
#include "rt/rig.h"
#include "support/gate.h"

namespace corbot::test::frames_test {
namespace {

const Joints kRest{0.1, 0.9, 1.2, 0.4};

Pose own_tool() { return frames_of(shipped_lynx5().kinematics).n_T_tool; }

/// A longer tool, and one that looks down.
PlanSettings with_tool(double ahead_m, double tilt_rad, double pitch_rad) {
  PlanSettings settings;
  settings.tool_frame = own_tool() * Pose{{ahead_m, 0.0, 0.0}, about({0.0, 1.0, 0.0}, tilt_rad)};
  settings.tool_pitch_rad = pitch_rad;
  return settings;
}

class FramedCycle : public ::testing::Test {
 protected:
  void SetUp() override {
    rig_.step();
    rig_.submit(rig_.planner.move_joints(rig_.start(), {}, kRest, 0.0));
    run_until_done();
  }
  void run_until_done() {
    for (int i = 0; i < 20000 && (rig_.queued() > 0 || rig_.snapshot.command_id != 0 || i < 50); ++i)
      rig_.step();
    ASSERT_EQ(rig_.snapshot.state, RtState::kStandby);
  }
  /// A line of the tool by `by_m` along y, from `start`.
  Command line(const PlanStart& start, const PlanSettings& settings, double by_m) {
    Vector3 target = in_frames(rig_.arm.kinematics, settings).forward(start.position_q).position_m;
    target[1] += by_m;
    const PlanResult plan = Planner(rig_.arm).move_s(start, settings, target, 0.0);
    if (const auto* refusal = std::get_if<PlanRefusal>(&plan)) throw std::runtime_error(refusal->text);
    rate_ = plan.rates.front();
    return rig_.with_knots(plan).front();
  }
  double pitch_of(const PlanSettings& settings, const Joints& q) {
    const Kinematics arm = in_frames(rig_.arm.kinematics, settings);
    return arm.followed().at(q)[0] - angle_of_pitch(arm, 0.0);
  }

  Rig rig_;
  PlannedRate rate_;  ///< of the last line
};

TEST_F(FramedCycle, LinesOfDifferentToolsInOneQueueAreEachTheirTools) {
  PlanSettings first = with_tool(0.05, 0.3, 0.0), second = with_tool(-0.02, -0.2, 0.0);
  second.base_frame = Pose{{3.0, -1.0, 0.5}, about({0.0, 0.0, 1.0}, 0.8)};
  first.tool_pitch_rad = pitch_of(first, kRest);
  second.tool_pitch_rad = pitch_of(second, kRest);
  const Command one = rig_.stamp(line(rig_.start(), first, 0.04));
  const Command two = rig_.stamp(line({one.end_q, 0.0}, second, -0.06));
  const Command plain = rig_.stamp(line(
      {two.end_q, 0.0},
      [&] {
        PlanSettings own;
        own.tool_pitch_rad = pitch_of(own, two.end_q);
        return own;
      }(),
      0.02));
  for (const Command& command : {one, two, plain}) ASSERT_TRUE(rig_.push(command));
  int seen[3] = {};
  for (int i = 0; i < 20000 && rig_.snapshot.last_done_id < plain.id; ++i) {
    rig_.step();
    const Command* const running[] = {&one, &two, &plain};
    for (int k = 0; k < 3; ++k) {
      const Command& command = *running[k];
      if (rig_.snapshot.command_id != command.id) continue;
      ++seen[k];
      Kinematics arm = rig_.arm.kinematics;
      arm.set_frames(command.line.frames.base_T_0, command.line.frames.n_T_tool);
      const Vector3 tcp = arm.forward(rig_.snapshot.position_q).position_m;
      const Vector3 along = command.line.to_m - command.line.from_m;
      const Vector3 off = tcp - command.line.from_m;
      ASSERT_LT(norm(cross(along, off)) / norm(along), 1e-6) << k;
    }
  }
  EXPECT_GT(seen[0], 50);
  EXPECT_GT(seen[1], 50);
  EXPECT_GT(seen[2], 20);
  EXPECT_EQ(rig_.snapshot.last_done_id, plain.id);
  while (const auto ended = rig_.completion()) EXPECT_EQ(ended->verdict, Verdict::kDone);
}

TEST_F(FramedCycle, TheSnapshotsToolStaysTheProfiles) {
  PlanSettings settings = with_tool(0.05, 0.3, 0.0);
  settings.tool_pitch_rad = pitch_of(settings, kRest);
  const Command command = rig_.stamp(line(rig_.start(), settings, 0.04));
  ASSERT_TRUE(rig_.push(command));
  int seen = 0;
  while (rig_.snapshot.last_done_id < command.id) {
    rig_.step();
    seen += rig_.snapshot.command_id == command.id;
    const Pose profile = rig_.arm.kinematics.forward(rig_.snapshot.position_q);
    ASSERT_EQ(rig_.snapshot.tool.position_m, profile.position_m);
  }
  EXPECT_GT(seen, 50);
}

TEST_F(FramedCycle, FramesThatNoPlannerWritesAreRefused) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  PlanSettings settings = with_tool(0.05, 0.3, 0.0);
  settings.tool_pitch_rad = pitch_of(settings, kRest);
  const Command good = rig_.stamp(line(rig_.start(), settings, 0.04));
  ASSERT_EQ(gate(rig_.arm, good, rate_), Verdict::kDone);
  using Field = std::function<double&(Frames&)>;
  std::vector<Field> fields;
  for (std::size_t i = 0; i < 3; ++i) {
    fields.emplace_back([i](Frames& f) -> double& { return f.base_T_0.position_m[i]; });
    fields.emplace_back([i](Frames& f) -> double& { return f.n_T_tool.position_m[i]; });
  }
  for (double Quaternion::*const part : {&Quaternion::w, &Quaternion::x, &Quaternion::y, &Quaternion::z}) {
    fields.emplace_back([part](Frames& f) -> double& { return f.base_T_0.orientation.*part; });
    fields.emplace_back([part](Frames& f) -> double& { return f.n_T_tool.orientation.*part; });
  }
  for (std::size_t i = 0; i < fields.size(); ++i) {
    for (const double hostile : {kNan, kInfinity, -kInfinity, 1e308, -1e308, 100.5, 2.0}) {
      Command forged = good;
      fields[i](forged.line.frames) = hostile;
      EXPECT_NE(gate(rig_.arm, forged, rate_), Verdict::kDone) << i << " = " << hostile;
    }
  }
  const std::vector<std::pair<const char*, std::function<void(Frames&)>>> lies{
      {"another tool", [](Frames& f) { f.n_T_tool.position_m[0] += 1e-3; }},
      {"another base", [](Frames& f) { f.base_T_0.position_m[2] += 1e-3; }},
      {"all zero",
       [](Frames& f) {
         f = {{{}, {0.0, 0.0, 0.0, 0.0}}, {{}, {0.0, 0.0, 0.0, 0.0}}};
       }},
      {"a longer quaternion", [](Frames& f) { f.n_T_tool.orientation.w *= 1.0 + 1e-6; }},
      {"an arm that is elsewhere", [](Frames& f) {
         f.base_T_0.position_m = {50.0, 0.0, 0.0};
       }}};
  for (const auto& [name, lie] : lies) {
    Command forged = good;
    lie(forged.line.frames);
    EXPECT_NE(gate(rig_.arm, forged, rate_), Verdict::kDone) << name;
  }
}

TEST_F(FramedCycle, AForgedToolFaultsNoMotionAfterIt) {
  PlanSettings settings = with_tool(0.05, 0.3, 0.0);
  settings.tool_pitch_rad = pitch_of(settings, kRest);
  Command forged = rig_.stamp(line(rig_.start(), settings, 0.04));
  forged.line.frames.n_T_tool.position_m[2] = std::numeric_limits<double>::quiet_NaN();
  ASSERT_TRUE(rig_.push(forged));
  rig_.step(3);
  const auto refused = rig_.completion();
  ASSERT_TRUE(refused);
  while (const auto more = rig_.completion()) EXPECT_EQ(more->verdict, Verdict::kMalformed);
  EXPECT_EQ(rig_.snapshot.state, RtState::kStandby);
  const Command good = rig_.stamp(line(rig_.start(), settings, 0.04));
  ASSERT_TRUE(rig_.push(good));
  run_until_done();
  EXPECT_EQ(rig_.snapshot.last_done_id, good.id);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(rig_.snapshot.position_q[i], good.end_q[i], 1e-9);
}

}  // namespace
}  // namespace corbot::test::frames_test
