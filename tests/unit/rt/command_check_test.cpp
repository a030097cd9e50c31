// SPDX-License-Identifier: Apache-2.0
#include "rt/cycle/command_check.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "corbot/kinematics/tool_pose.h"
#include "rt/rig.h"

namespace corbot::test::command_check_test {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Field {
  std::string name;
  std::function<double&(Command&)> at;
};

struct Good {
  std::string name;
  Command command;
  std::vector<Field> fields;
};

const Joints kRest{0.1, 0.9, 1.2, 0.4};

void add_law(std::vector<Field>& fields, const std::string& name,
             const std::function<TimeLaw&(Command&)>& law) {
  fields.push_back({name + ".distance", [law](Command& c) -> double& { return law(c).distance; }});
  fields.push_back({name + ".t_jerk_s", [law](Command& c) -> double& { return law(c).t_jerk_s; }});
  fields.push_back({name + ".t_acc_s", [law](Command& c) -> double& { return law(c).t_acc_s; }});
  fields.push_back({name + ".t_cruise_s", [law](Command& c) -> double& { return law(c).t_cruise_s; }});
}

template <class Member>
void add_vector(std::vector<Field>& fields, const std::string& name, Member member) {
  for (std::size_t i = 0; i < 3; ++i) {
    fields.push_back({name, [member, i](Command& c) -> double& { return member(c)[i]; }});
  }
}

std::vector<Field> common_fields() {
  std::vector<Field> fields;
  fields.push_back({"duration_s", [](Command& c) -> double& { return c.duration_s; }});
  for (std::size_t i = 0; i < kMaxJoints; ++i) {
    fields.push_back({"start_q", [i](Command& c) -> double& { return c.start_q[i]; }});
    fields.push_back({"end_q", [i](Command& c) -> double& { return c.end_q[i]; }});
  }
  return fields;
}

Command planned(Rig& rig, const PlanResult& plan) {
  const auto* commands = std::get_if<std::vector<Command>>(&plan);
  if (commands == nullptr) throw std::runtime_error(std::get<PlanRefusal>(plan).text);
  return rig.stamp(commands->back());
}

/// One good command of each kind, with all fields that hold a number.
std::vector<Good> good_commands() {
  Rig rig;
  const PlanStart start{kRest, 0.0};
  PlanSettings settings;
  const ToolPose pose = tool_pose(rig.arm.kinematics, kRest);
  settings.tool_pitch_rad = pose.pitch_rad;
  const auto& p = pose.position_m;
  std::vector<Good> all;

  all.push_back({"joint", planned(rig, rig.planner.move_joints(start, settings, {0.5, 1.0, 1.0, 0.2}, 0.0)),
                 common_fields()});
  for (std::size_t i = 0; i < kMaxJoints; ++i) {
    add_law(all.back().fields, "law", [i](Command& c) -> TimeLaw& { return c.joint.law[i]; });
  }
  add_vector(
      all.back().fields, "base", [](Command & c) -> auto& { return c.joint.frames.base_T_0.position_m; });
  add_vector(
      all.back().fields, "hand", [](Command & c) -> auto& { return c.joint.frames.n_T_tool.position_m; });

  all.push_back({"line",
                 planned(rig, rig.planner.move_s(start, settings, {p[0] + 0.01, p[1] + 0.03, p[2]}, 0.0)),
                 common_fields()});
  auto& line = all.back().fields;
  add_vector(
      line, "from_m", [](Command & c) -> auto& { return c.line.from_m; });
  add_vector(
      line, "to_m", [](Command & c) -> auto& { return c.line.to_m; });
  line.push_back({"from_angles_rad", [](Command& c) -> double& { return c.line.tool.from_angles_rad[0]; }});
  line.push_back({"to_angles_rad", [](Command& c) -> double& { return c.line.tool.to_angles_rad[0]; }});

  all.push_back({"arc",
                 planned(rig, rig.planner.move_c(start, settings, p, {p[0] + 0.01, p[1] + 0.01, p[2]},
                                                 {p[0], p[1] + 0.02, p[2] + 0.005})),
                 common_fields()});
  auto& arc = all.back().fields;
  add_vector(
      arc, "centre_m", [](Command & c) -> auto& { return c.arc.centre_m; });
  add_vector(
      arc, "u", [](Command & c) -> auto& { return c.arc.u; });
  add_vector(
      arc, "v", [](Command & c) -> auto& { return c.arc.v; });
  arc.push_back({"radius_m", [](Command& c) -> double& { return c.arc.radius_m; }});
  arc.push_back({"angle_rad", [](Command& c) -> double& { return c.arc.angle_rad; }});
  arc.push_back({"from_angles_rad", [](Command& c) -> double& { return c.arc.tool.from_angles_rad[0]; }});
  arc.push_back({"to_angles_rad", [](Command& c) -> double& { return c.arc.tool.to_angles_rad[0]; }});

  all.push_back({"dwell", planned(rig, rig.planner.dwell(start, 0.5)), common_fields()});
  all.back().fields.push_back({"dwell", [](Command& c) -> double& { return c.dwell.duration_s; }});

  all.push_back({"gripper", planned(rig, rig.planner.gripper(start, 0.7)), common_fields()});
  add_law(all.back().fields, "law", [](Command& c) -> TimeLaw& { return c.gripper.law; });
  all.back().fields.push_back({"from", [](Command& c) -> double& { return c.gripper.from; }});
  return all;
}

rt::RestState rest_for(const Command& command) { return {command.id - 1, kRest, 0.0}; }

TEST(CommandCheck, AcceptsWhatThePlannerMakes) {
  for (const Good& good : good_commands()) {
    EXPECT_TRUE(rt::check_command(shipped_lynx5(), good.command, rest_for(good.command)).ok()) << good.name;
  }
}

TEST(CommandCheck, RefusesEveryFieldThatIsNotANumberOrFarOutOfRange) {
  for (const Good& good : good_commands()) {
    for (std::size_t i = 0; i < good.fields.size(); ++i) {
      for (const double hostile : {kNan, kInfinity, -kInfinity, 1e308, -1e308}) {
        Command command = good.command;
        good.fields[i].at(command) = hostile;
        EXPECT_FALSE(rt::check_command(shipped_lynx5(), command, rest_for(command)).ok())
            << good.name << " " << good.fields[i].name << " = " << hostile;
      }
    }
  }
}

struct Tampering {
  const char* name;
  std::size_t kind;  ///< index into good_commands()
  std::function<void(Command&)> tamper;
  Verdict verdict;
};

TEST(CommandCheck, NamesWhatIsWrong) {
  const std::vector<Good> good = good_commands();
  const std::vector<Tampering> table = {
      {"old number", 0, [](Command& c) { --c.id; }, Verdict::kMalformed},
      {"number 0", 0, [](Command& c) { c.id = 0; }, Verdict::kMalformed},
      {"number from nowhere", 0, [](Command& c) { c.id = ~std::uint64_t{0}; }, Verdict::kMalformed},
      {"unknown kind", 0, [](Command& c) { c.kind = static_cast<MotionKind>(6); }, Verdict::kMalformed},
      {"kind 0", 0, [](Command& c) { c.kind = static_cast<MotionKind>(0); }, Verdict::kMalformed},
      {"negative duration", 0, [](Command& c) { c.duration_s = -1; }, Verdict::kMalformed},
      {"duration of another law", 0, [](Command& c) { c.duration_s *= 1.001; }, Verdict::kMalformed},
      {"starts elsewhere", 0, [](Command& c) { c.start_q[1] += 2e-6; }, Verdict::kDiscontinuous},
      {"ends elsewhere", 0, [](Command& c) { c.end_q[1] += 2e-6; }, Verdict::kMalformed},
      {"ends out of range", 0,
       [](Command& c) {
         c.joint.law[0].distance += 9;
         c.end_q[0] += 9;
       },
       Verdict::kLimit},
      {"a joint too fast", 0,
       [](Command& c) {
         c.joint.law[0].distance *= 1.1;
         c.end_q[0] += 0.04;
       },
       Verdict::kLimit},
      {"joint the arm has not", 0, [](Command& c) { c.joint.law[5] = c.joint.law[0]; }, Verdict::kMalformed},
      {"joints of two durations", 0, [](Command& c) { c.joint.law[2].t_cruise_s += 1e-3; },
       Verdict::kMalformed},
      {"hand longer than 1", 0, [](Command& c) { c.joint.frames.n_T_tool.orientation.w += 1e-6; },
       Verdict::kMalformed},
      {"no solution", 1, [](Command& c) { c.line.solution = 4; }, Verdict::kMalformed},
      {"no knots", 1, [](Command& c) { c.line.knots.count = 0; }, Verdict::kMalformed},
      {"more knots than there can be", 1, [](Command& c) { c.line.knots.count = kMostKnots + 1; },
       Verdict::kMalformed},
      {"no pieces", 1, [](Command& c) { c.line.knots.pieces = 0; }, Verdict::kMalformed},
      {"more pieces than there can be", 2, [](Command& c) { c.arc.knots.pieces = rate::kMostPieces + 1; },
       Verdict::kMalformed},
      {"a slot that is none", 2, [](Command& c) { c.arc.knots.slot = kKnotSlots; }, Verdict::kMalformed},
      {"frame not of unit length", 2,
       [](Command& c) {
         for (double& x : c.arc.u) x *= 1 + 1e-6;
       },
       Verdict::kMalformed},
      {"frame not at right angles", 2, [](Command& c) { c.arc.v = c.arc.u; }, Verdict::kMalformed},
      {"no radius", 2, [](Command& c) { c.arc.radius_m = 0; }, Verdict::kMalformed},
      {"negative radius", 2, [](Command& c) { c.arc.radius_m = -1; }, Verdict::kMalformed},
      {"no angle", 2, [](Command& c) { c.arc.angle_rad = 0; }, Verdict::kMalformed},
      {"more than a turn", 2, [](Command& c) { c.arc.angle_rad = 6.3; }, Verdict::kMalformed},
      {"negative dwell", 3, [](Command& c) { c.dwell.duration_s = c.duration_s = -0.5; },
       Verdict::kMalformed},
      {"dwell beyond an hour", 3, [](Command& c) { c.dwell.duration_s = c.duration_s = 3601; },
       Verdict::kMalformed},
      {"dwell of two minds", 3, [](Command& c) { c.dwell.duration_s = 1; }, Verdict::kMalformed},
      {"dwell that goes away", 3, [](Command& c) { c.end_q[0] += 0.1; }, Verdict::kMalformed},
      {"gripper wider than open", 4, [](Command& c) { c.gripper.law.distance = 1.1; }, Verdict::kMalformed},
      {"gripper from elsewhere", 4, [](Command& c) { c.gripper.from = 0.1; }, Verdict::kDiscontinuous},
      {"gripper too fast", 4,
       [](Command& c) {
         c.gripper.law = {0.7, .01, 0, 0};
         c.duration_s = .04;
       },
       Verdict::kLimit},
  };
  for (const Tampering& row : table) {
    Command command = good[row.kind].command;
    const rt::RestState rest = rest_for(command);
    row.tamper(command);
    EXPECT_EQ(rt::check_command(shipped_lynx5(), command, rest).verdict, row.verdict) << row.name;
  }
}

TEST(CommandCheck, WhatIsRefusedDoesNotMoveTheArm) {
  Rig rig;
  rig.submit(rig.planner.move_joints({}, {}, kRest, 0.0));
  rig.step(5000);
  ASSERT_EQ(rig.snapshot.last_done_id, 1u);
  while (rig.completion()) {
  }
  const auto pulses = rig.snapshot.pulse_us;
  for (const Good& good : good_commands()) {
    for (const Field& field : good.fields) {
      Command command = rig.stamp(good.command);
      command.start_q = rig.snapshot.position_q;
      field.at(command) = kNan;
      ASSERT_TRUE(rig.push(command));
      rig.step(3);
      const auto verdict = rig.completion();
      ASSERT_TRUE(verdict.has_value());
      EXPECT_EQ(verdict->id, command.id);
      EXPECT_NE(verdict->verdict, Verdict::kDone) << good.name << " " << field.name;
      EXPECT_EQ(rig.snapshot.pulse_us, pulses);
      EXPECT_EQ(rig.snapshot.state, RtState::kStandby);
      const auto alarm = rig.alarm();
      ASSERT_TRUE(alarm.has_value());
      EXPECT_EQ(alarm->code, AlarmCode::kCommandRefused);
    }
  }
  // And the arm still takes commands.
  rig.submit(rig.planner.move_joints(rig.start(), {}, {}, 0.0));
  rig.step(5000);
  EXPECT_EQ(rig.completion()->verdict, Verdict::kDone);
}

}  // namespace
}  // namespace corbot::test::command_check_test
