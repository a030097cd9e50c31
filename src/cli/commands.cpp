// SPDX-License-Identifier: Apache-2.0
#include "cli/commands.h"

#include <fmt/format.h>
#include <pwd.h>
#include <unistd.h>

#include <atomic>
#include <climits>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "cli/arm/dry_run.h"
#include "cli/arm/plan_text.h"
#include "cli/force_release.h"
#include "cli/frames_view.h"
#include "cli/pause_note.h"
#include "cli/plot/plan_plot.h"
#include "cli/run_program.h"
#include "cli/show.h"
#include "cli/speed_view.h"
#include "cli/status_picture.h"
#include "cli/stop_all.h"
#include "client/client.h"
#include "client/local_robots.h"
#include "client/local_stop.h"
#include "client/notice.h"
#include "client/stop_on_signal.h"
#include "config/load_profile.h"
#include "config/profile.h"
#include "corbot/arm/joint_units.h"
#include "corbot/channel/control_bounds.h"

namespace corbot::cli {

using client::Client;
using client::ExitCode;
using client::Failure;
using client::find_robot;
using client::OnSignal;
using client::Program;
using client::read_state;
using client::Request;
using client::spec_of;
using client::stop_on_this_machine;
using client::Verb;

namespace {

/// Stops a robot on this machine even if its servant does not reply. `robot` empty: the robot is elsewhere.
bool is_stopped_here(const std::string& robot, double timeout_s) {
  try {
    return !robot.empty() && stop_on_this_machine(robot, timeout_s);
  } catch (const Failure& failure) {
    client::notice(stderr, fmt::format("corbot: {}\n", failure.what()));
    return false;
  }
}

/// Runs `work` with a client whose arm stops on a signal. Throws with kStopped after a signal.
template <class Work>
void run_stoppable(const ClientOptions& options, Work&& work) {
  std::atomic<Client*> connected{nullptr};
  std::atomic<bool> stopped{false};
  std::optional<Client> client_here;  // outlives the signal's thread, which uses it
  // Precedes the client, whose ORB creates threads: they inherit the blocked signals.
  OnSignal on_signal([&] {
    Client* client = connected.load();
    if (client == nullptr) ::_exit(static_cast<int>(ExitCode::kStopped));  // nothing moves yet
    client->begin_cancel();  // first, or the next motion of a program would begin after the stop
    client::notice(stderr, "\ncorbot: stopping the arm\n");
    stopped = is_stopped_here(client->address().local, options.timeout_s);
    try {
      client->cancel();
      stopped = true;
    } catch (const Failure& failure) {
      if (!stopped) client::notice(stderr, fmt::format("corbot: THE STOP FAILED: {}\n", failure.what()));
    }
  });
  Client& client = client_here.emplace(find_robot(options.robot), options.timeout_s);
  connected = &client;
  try {
    work(client);
    if (on_signal.seen()) throw Failure(ExitCode::kStopped, "the command had already ended");
  } catch (const Failure& failure) {
    if (!on_signal.seen()) throw;
    on_signal.join();
    // Applies even if the servant could not report it: the task has stopped the arm.
    if (!stopped && failure.code() != ExitCode::kStopped) throw;
    throw Failure(ExitCode::kStopped,
                  fmt::format("the arm was stopped by {}: {}", on_signal.describe(), failure.what()));
  }
}

/// Returns the name of the robot on this machine, or "" for one elsewhere. Its servant need not reply.
std::string robot_here(const std::string& robot) {
  try {
    return find_robot(robot).local;
  } catch (const Failure&) {
    if (is_name(robot)) return robot;  // started by hand, or its servant is still starting
    throw;
  }
}

/// Tells whether several robots are up here and the caller has named none: in a hurry, a stop means all.
bool names_none_of_several(const std::string& robot) {
  const char* const given = std::getenv("CORBOT_ROBOT");
  return robot.empty() && (given == nullptr || *given == '\0') && client::robots_up().size() > 1;
}

/// Stops a robot on this machine by its stop segment, which needs no servant; else by the servant.
void stop(const ClientOptions& options) {
  client::stop_here_or(robot_here(options.robot), options.timeout_s,
                       [&] { Client(find_robot(options.robot), options.timeout_s).stop(); });
}

/// Returns true if a hold is in force, or counted until the task can carry it out.
bool is_held(Client& client) {
  try {
    return client.call([](auto& arm) {
      const Corbot::ControlInfo_var control = arm.Control();
      return static_cast<bool>(control->held);
    });
  } catch (const Failure&) {
    return false;
  }
}

/// Stops a robot on this machine at once, even if its servant does not reply, and requests the hold at the
/// same time. Only the hold needs the servant. The request is sent even if the task does not confirm the
/// stop.
void hold(const ClientOptions& options, const Request& request) {
  const std::string here = robot_here(options.robot);
  std::future<bool> stopping =
      std::async(std::launch::async, [&] { return is_stopped_here(here, options.timeout_s); });
  bool is_counted = false;
  try {
    Client client(find_robot(options.robot), options.timeout_s);
    try {
      (void)client.perform(request);
    } catch (const Failure&) {
      is_counted = is_held(client);
      throw;
    }
  } catch (const Failure& failure) {
    const bool stopped = stopping.get();
    if (!stopped || is_counted) throw;
    throw Failure(failure.code(), fmt::format("the arm was stopped, but is NOT HELD: {}", failure.what()));
  }
}

/// Returns USER@MACHINE, cut to the length that Acquire accepts.
std::string default_holder() {
  const passwd* user = ::getpwuid(::geteuid());
  char machine[HOST_NAME_MAX + 1] = "";
  ::gethostname(machine, sizeof(machine) - 1);
  return client::printable(user != nullptr ? fmt::format("{}@{}", user->pw_name, machine)
                                           : fmt::format("uid {}@{}", ::geteuid(), machine))
      .substr(0, kLongestHolderName);
}

void acquire(const ClientOptions& options, const Request& request) {
  Client client(find_robot(options.robot), options.timeout_s);
  fmt::print("{}\n", client.acquire(request.who.value_or(default_holder()), request.lease_s));
}

void force_release(const ClientOptions& options) {
  const client::Address address = find_robot(options.robot);
  if (address.local.empty()) {
    throw Failure(ExitCode::kUsage,
                  "--force sends a signal to the servant's process: run it on the robot's machine, with "
                  "--robot NAME if several are up");
  }
  Client client(address, options.timeout_s);
  const std::string holder = client::printable(release_by_force(client, address.local, options.timeout_s));
  if (client.call([](auto& arm) { return arm.Status(); }) != Corbot::Standby) {
    throw Failure(ExitCode::kRefused,
                  fmt::format("the control of '{}' has ended, but the arm moves or is in Error: see "
                              "'corbot status'",
                              holder));
  }
  fmt::print("the control of '{}' has ended, the arm is at rest\n", holder);
}

/// Reports that the first motion with an unverified position is slow: a higher override takes effect after
/// it.
void report_reduced_override(Client& client, double wanted_percent) {
  constexpr double kTolerance_percent = 1e-6;
  const double now_percent = client.call([](auto& arm) { return arm.OverridePercent(); });
  if (now_percent >= wanted_percent - kTolerance_percent) return;
  const Corbot::DeviceInfo_var device = client.call([](auto& arm) { return arm.Device(); });
  if (device->positionUncertain) {
    fmt::print(
        "override {:g} % until the first motion is done, because the position is unverified; after it {:g} "
        "%\n",
        now_percent, wanted_percent);
  }
}

/// Shows the frames in force after one was set. The frame stays set if they cannot be read.
void show_frames(Client& client) {
  try {
    fmt::print("{}'corbot frames --reset' restores the profile's\n", read_frames(client));
  } catch (const Failure& failure) {
    client::notice(stderr,
                   fmt::format("corbot: the frame is set, but cannot be shown: {}\n", failure.what()));
  }
}

/// Returns the name of a robot on this machine. An address must belong to a robot that is up here. The files
/// of a robot elsewhere are not here, whatever has its name on this machine. `reason`: why the command needs
/// them.
std::string local_robot(const std::string& robot, const char* reason) {
  const client::Address address = find_robot(robot);
  if (!address.local.empty()) return address.local;
  throw Failure(
      ExitCode::kUsage,
      fmt::format("{}, and {} is not the address of a robot that 'corbot up' supervises here. Run it on the "
                  "robot's machine, with --robot NAME if several are up",
                  reason, client::printable(address.where)));
}

}  // namespace

void run_request(const ClientOptions& options, const Request& request) {
  if (const std::string note = client::ratio_note(request); !note.empty())
    client::notice(stderr, fmt::format("corbot: {}\n", note));
  if (request.verb == Verb::kStop && (request.all || names_none_of_several(options.robot)))
    return stop_all(options.robot, options.timeout_s);
  if (request.verb == Verb::kStop) return stop(options);
  if (request.verb == Verb::kHold) return hold(options, request);
  if (request.verb == Verb::kAcquire) return acquire(options, request);
  if (request.verb == Verb::kFrames && !request.reset) {
    Client client(find_robot(options.robot), options.timeout_s);
    return fmt::print("{}", read_frames(client));
  }
  if (request.verb == Verb::kWorkspace && !request.reset && !request.shape) {
    Client client(find_robot(options.robot), options.timeout_s);
    return fmt::print("{}", read_workspace(client));
  }
  if (request.verb == Verb::kSpeed && request.numbers.empty()) {
    Client client(find_robot(options.robot), options.timeout_s);
    return fmt::print("{}\n", speeds_text(read_status(client)));
  }
  if (request.verb == Verb::kRelease && request.force) return force_release(options);
  if (!spec_of(request.verb).motion) {
    Client client(find_robot(options.robot), options.timeout_s);
    (void)client.perform(request);
    if (request.verb == Verb::kOverride) report_reduced_override(client, request.numbers[0]);
    if (request.verb == Verb::kTool || request.verb == Verb::kBase) show_frames(client);
    return;
  }
  run_stoppable(options, [&](Client& client) {
    PauseNote note(client);
    const std::string remark = client.perform(request, [&](double progress) {
      if (const std::string text = note(progress); !text.empty())
        client::notice(stderr, fmt::format("corbot: {}\n", text));
    });
    if (!remark.empty()) client::notice(stderr, fmt::format("corbot: {}\n", remark));
  });
}

namespace {

/// Describes how the profile's plan differs from the robot's. Returns "" if all values that both contain
/// agree.
std::string difference_of(const std::vector<Command>& drawn, const ArmModel& arm,
                          const Corbot::PlanInfo& of_robot, double planned_s) {
  constexpr double kSame_s = 1e-4, kSame = 1e-4;  // degrees or m
  double drawn_s = 0.0;
  for (const Command& command : drawn) drawn_s += command.duration_s;
  if (std::abs(drawn_s - planned_s) > kSame_s)
    return fmt::format("takes {:.4f} s, but the robot plans {:.4f} s", drawn_s, planned_s);
  // A motion with a given time takes that time to any target, so the ends are compared, too.
  for (CORBA::ULong i = 0; i < of_robot.end.length(); ++i) {
    const double end = to_shown(arm.kinematics.joint_kind(i), drawn.back().end_q[i]);
    if (std::abs(end - of_robot.end[i]) > kSame)
      return fmt::format("ends at {:.4f} of joint {}, but the robot plans {:.4f}", end, i, of_robot.end[i]);
  }
  return {};
}

/// Plans the same motion from the same joints by the profile. The plan differs if the robot's settings are
/// not the profile's.
void plot_same(const Request& request, const PlanOptions& options, const Corbot::PlanInfo& of_robot,
               double planned_s) {
  DryRun robot(options.profile);
  const Corbot::JointCoord& start = of_robot.start;
  std::vector<double> joints;
  for (CORBA::ULong i = 0; i < start.length(); ++i) joints.push_back(start[i]);
  robot.begin_at(joints);
  const auto refusal = robot.refusal_of(request);
  const std::string difference =
      refusal ? fmt::format("is refused: {}, but the robot plans {:.4f} s", *refusal, planned_s)
              : difference_of(std::get<std::vector<Command>>(robot.plans().back()), robot.profile().arm,
                              of_robot, planned_s);
  if (!difference.empty())
    throw Failure(
        ExitCode::kUsage,
        fmt::format(
            "'{}' was not drawn: by {} the motion {}. Give the profile that the robot was started "
            "with, or set speeds, frames, limits, workspace and orientation back to those of the profile",
            options.plot, options.profile, difference));
  charts::plot_plan(robot, to_string(request), options.plot);
}

}  // namespace

void show_plan(const ClientOptions& options, const Request& request, const PlanOptions& plan) {
  Client client(find_robot(options.robot), options.timeout_s);
  const Corbot::PlanInfo_var reply = client.plan(request);
  const std::vector<rate::PlanPart> parts = parts_of(reply.in());
  fmt::print("{}", plan_text(parts, request.verb));
  double planned_s = 0.0;
  for (const rate::PlanPart& part : parts) planned_s += part.duration_s;
  const std::string remark = client::lengthening(request.time_s, planned_s);
  if (!remark.empty()) client::notice(stderr, fmt::format("corbot: {}\n", remark));
  if (!plan.plot.empty()) plot_same(request, plan, reply.in(), planned_s);
}

void run_file(const ClientOptions& options, const RunOptions& run) {
  const Program program = load_program(run.file);
  for (const auto& statement : program.statements) {
    const std::string note = client::ratio_note(statement.request);
    if (!note.empty()) client::notice(stderr, fmt::format("{}:{}: {}\n", program.name, statement.line, note));
  }
  if (run.dry_run)
    return run.profile.empty() ? print_program(program) : check_reach(program, run.profile, run.plot);
  run_stoppable(options, [&](Client& client) { run_program(client, program); });
}

void show(const ClientOptions& options, View view, bool as_json, const std::string& svg) {
  Client client(find_robot(options.robot), options.timeout_s);
  std::string text;
  switch (view) {
    case View::kStatus: {
      const StatusReport report = read_status(client);
      if (!svg.empty())
        draw_status(client, local_robot(options.robot, "--svg needs the robot's profile"), report, svg);
      text = as_json ? status_json(report) : status_text(report);
      break;
    }
    case View::kAlarms: {
      const Corbot::AlarmList_var alarms = client.call([](auto& arm) { return arm.Alarms(); });
      text = as_json ? alarms_json(alarms.in()) : alarms_text(alarms.in());
      break;
    }
    case View::kDiagnostics: {
      const Corbot::LoopInfo_var info = client.call([](auto& arm) { return arm.Diagnostics(); });
      const Corbot::DeviceInfo_var device = client.call([](auto& arm) { return arm.Device(); });
      text = as_json ? diagnostics_json(info.in(), device.in()) : diagnostics_text(info.in(), device.in());
      break;
    }
  }
  fmt::print("{}", text);
}

void show_solutions(const ClientOptions& options, const std::vector<double>& pose, bool as_json) {
  Client client(find_robot(options.robot), options.timeout_s);
  fmt::print("{}", read_solutions(client, pose, as_json));
}

void run_watch(const ClientOptions& options, double interval_s, int count) {
  std::atomic<bool> connected{false};
  const OnSignal on_signal([&] {
    if (!connected) ::_exit(static_cast<int>(ExitCode::kOk));
  });
  Client client(find_robot(options.robot), options.timeout_s);
  connected = true;
  watch(client, on_signal, interval_s, count);
}

void run_record(const ClientOptions& options, RecordOptions record_options) {
  const OnSignal on_signal({});
  record_options.robot = local_robot(options.robot, "record reads shared memory");
  if (const auto state = read_state(record_options.robot)) {
    try {
      const Profile profile = load_profile(state->profile_in_use);
      record_options.joints.clear();
      for (std::size_t i = 0; i < profile.arm.dof; ++i)
        record_options.joints.push_back(profile.arm.kinematics.joint_kind(i));
      record_options.notes = csv_notes(profile);
    } catch (const ConfigError&) {
      // the copy has just been removed: write all columns
    }
  }
  record(record_options, on_signal);
}

}  // namespace corbot::cli
