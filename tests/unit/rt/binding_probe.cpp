// SPDX-License-Identifier: Apache-2.0
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <variant>

#include "../../support/arm_motions.h"
#include "corbot/kinematics/tool_pose.h"
#include "rt/rig.h"

// Runs the cycle of the named arm through motions of every kind, a pause, an override, an emergency stop and
// a lost device. It prints a line on standard error before and after, and the loader writes its bindings
// between the two (LD_DEBUG=bindings). A child plans the motions. So the cycle is the first to call its
// functions of the mathematical library, as in corbot-rt.

namespace {

using namespace corbot;
using namespace corbot::test;

/// A command and, of a path, its knots and pieces.
struct Planned {
  Command command;
  RateSlot rate;
};

std::vector<Command> plan(Rig& rig) {
  const ArmMotions motions = motions_of(rig.arm);
  std::vector<Command> commands =
      std::get<std::vector<Command>>(rig.planner.move_joints(rig.start(), {}, motions.there_q, 0.0));
  const auto add = [&](const PlanResult& more) {
    const std::vector<Command> planned = rig.with_knots(more);
    commands.insert(commands.end(), planned.begin(), planned.end());
  };
  if (motions.line_to_m) {
    const auto p = tool_pose(rig.arm.kinematics, motions.there_q).position_m;
    add(rig.planner.move_c({motions.there_q, 0.0}, motions.settings, p, motions.arc_m[0], motions.arc_m[1]));
    add(rig.planner.move_s({commands.back().end_q, 0.0}, motions.settings, p, 0.0));
  }
  const Joints end = commands.back().end_q;
  add(rig.planner.gripper({end, 0.0}, 0.5));
  add(rig.planner.dwell({end, 0.5}, 0.1));
  return commands;
}

bool write_whole(int to, const Planned& one) {
  return write(to, &one, sizeof(one)) == static_cast<ssize_t>(sizeof(one));
}
bool read_whole(int from, Planned& one) {
  std::size_t got = 0;
  for (ssize_t more = 1; more > 0 && got < sizeof(one);
       got += static_cast<std::size_t>(std::max<ssize_t>(more, 0)))
    more = read(from, reinterpret_cast<char*>(&one) + got, sizeof(one) - got);
  return got == sizeof(one);
}

/// The commands as a child planned them; empty when that failed.
std::vector<Planned> planned_elsewhere(const ArmModel& arm) {
  int ends[2];
  if (pipe(ends) != 0) return {};
  const pid_t child = fork();
  if (child == 0) {
    Rig rig(arm);
    rig.step();
    bool whole = true;
    for (const Command& command : plan(rig)) {
      const KnotRange* const range = knots_of(command);
      whole =
          whole &&
          write_whole(ends[1], {command, range == nullptr ? RateSlot{} : rig.servant->rates[range->slot]});
    }
    _exit(whole ? 0 : 1);
  }
  close(ends[1]);
  std::vector<Planned> planned;
  for (Planned one{}; read_whole(ends[0], one);) planned.push_back(one);
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  return status == 0 ? planned : std::vector<Planned>{};
}

void mark(const char* line) { (void)!write(STDERR_FILENO, line, std::char_traits<char>::length(line)); }

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const ArmModel arm = arm_of(argv[1]);
  const std::vector<Planned> planned = planned_elsewhere(arm);
  Rig rig(arm);
  std::vector<Command> commands;
  for (const Planned& one : planned) {
    commands.push_back(one.command);
    if (const KnotRange* const range = knots_of(one.command)) rig.servant->rates[range->slot] = one.rate;
  }
  const std::uint64_t last = rig.submit(commands);
  mark("cycle begins\n");
  rig.step(50);
  rig.pause(true);
  rig.step(400);
  rig.pause(false);
  rig.override_to(0.5);
  rig.step(200);
  rig.override_to(1.0);
  for (int i = 0; i < 100'000 && rig.snapshot.last_done_id != last; ++i) rig.step();
  const bool is_done = rig.snapshot.last_done_id == last;
  rig.emergency_stop->set(StopSource::kGpio, true);
  rig.step(3);
  rig.emergency_stop->set(StopSource::kGpio, false);
  rig.step();
  rig.clear();
  rig.step();
  rig.backend.set_plugged(false);
  rig.step(3);
  const bool is_stopped = rig.snapshot.state == RtState::kError;
  mark("cycle ends\n");
  return !commands.empty() && is_done && is_stopped ? 0 : 1;
}
