// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/cell_check.h"

#include <fmt/format.h>

#include <optional>
#include <utility>

#include "cell/arc.h"
#include "cli/arm/dry_run.h"
#include "cli/cell/cell_directory.h"
#include "cli/cell/cell_processes.h"
#include "client/client.h"
#include "client/failure.h"
#include "config/load_profile.h"

namespace corbot::cli {

using cell::CellConfig;
using cell::CellRobot;
using cell::Kind;
using client::ExitCode;
using client::Failure;
using client::Request;
using client::Verb;
using Eigen::Vector3d;

namespace {

constexpr double kReply_s = 10;  // of a robot that runs elsewhere

Profile parsed_profile(const CellConfig& cell, const CellRobot& robot) {
  try {
    return parse_profile(profile_text(cell, robot), robot.profile.string());
  } catch (const ConfigError& error) {
    throw Failure(ExitCode::kUsage, error.what());
  }
}

/// A possible position of a piece's foot, world frame, and a description of it for a person.
struct Spot {
  std::string name;
  Vector3d foot_m;
};

/// Returns every slot for the kind. For an area returns the outermost spots at which a whole piece fits,
/// those halfway, and the middle.
std::vector<Spot> spots_of(const cell::Place& place, const Kind& kind) {
  std::vector<Spot> spots;
  if (place.slots) {
    for (int slot = 0; slot < place.slots->count(); ++slot)
      if (place.slot_takes(slot, kind.name))
        spots.push_back({fmt::format("slot {}", slot), place.slot_position(slot)});
    return spots;
  }
  const Eigen::Vector2d half = (place.half_size_m().array() - kind.circle_m(kind.width_m) / 2).max(0);
  for (const int x : {-1, 0, 1}) {
    for (const int y : {-1, 0, 1}) {
      const Vector3d foot = place.frame.to_world({x * half.x(), y * half.y(), 0});
      spots.push_back({fmt::format("at ({:.3f}, {:.3f})", foot.x(), foot.y()), foot});
    }
  }
  return spots;
}

/// Plans for one robot, and collects the refusals.
class ReachPlans {
 public:
  ReachPlans(const CellConfig& cell, const CellRobot& robot) : cell_(cell), robot_(robot) {
    if (robot.profile.empty())
      elsewhere_.emplace(client::find_robot(cell.robot_uri(robot)), kReply_s);
    else
      waiting_.emplace(parsed_profile(cell, robot));
  }

  ReachCheck run() {
    result_.points = 1;
    (void)plans(waiting_, cell_.key_of(robot_) + ".wait_m",
                {"the motion", Verb::kMove, robot_.frame.to_local(robot_.wait_m)});
    for (const std::string& name : {robot_.from, robot_.to}) check(*cell_.place(name));
    return std::move(result_);
  }

 private:
  struct Motion {
    std::string name;
    Verb verb;
    Vector3d point_m;  ///< in the robot's frame
    double above_m{0};
    double time_s{0};
  };

  void check(const cell::Place& place) {
    for (const Kind& kind : cell_.kinds) {
      for (const Spot& spot : spots_of(place, kind))
        check(place, fmt::format("{} {}, {}, {}", cell_.key_of(place), place.name, spot.name, kind.name),
              robot_.frame.to_local(spot.foot_m + Vector3d(0, 0, kind.grasp_m)));
    }
  }

  /// Checks a worker's path to a grasp. The return path is the same line, and a free motion or the same arc.
  void check(const cell::Place& place, const std::string& key, const Vector3d& grasp_m) {
    result_.points += 2;
    if (robot_.moves_on_arc(place) && waiting_) check_arc(key, grasp_m + Vector3d(0, 0, robot_.above_m));
    std::optional<DryRun> robot = waiting_;
    if (elsewhere_) {  // the line would begin above the grasp, but the robot is elsewhere
      (void)plans(robot, key, {"the motion above the grasp", Verb::kMove, grasp_m, robot_.above_m});
      (void)plans(robot, key, {"a motion to the grasp", Verb::kMove, grasp_m});
    } else if (plans(robot, key, {"the motion above the grasp", Verb::kMove, grasp_m, robot_.above_m})) {
      (void)plans(robot, key,
                  {"the line to the grasp", Verb::kMoveS, grasp_m, 0, robot_.above_m / robot_.approach_m_s});
    }
  }

  /// Checks the arc from the wait pose, where only a robot without `reference` begins, to the approach.
  void check_arc(const std::string& key, const Vector3d& end_m) {
    ++result_.points;
    const Vector3d begin_m = robot_.frame.to_local(robot_.wait_m);
    const Vector3d middle_m = cell::middle_of_arc(begin_m, end_m);
    Request request{.verb = Verb::kMoveC, .numbers = {}};
    for (const Vector3d& point : {begin_m, middle_m, end_m})
      request.numbers.insert(request.numbers.end(), point.begin(), point.end());
    std::optional<DryRun> robot = waiting_;
    if (const auto why = robot->refusal_of(request))
      result_.refused.push_back({key, "the arc above the grasp", end_m, *why});
  }

  /// Returns why the robot elsewhere refuses, or nothing if it does not.
  std::optional<std::string> refusal_elsewhere(const Request& request) {
    try {
      (void)elsewhere_->plan(request);
      return std::nullopt;
    } catch (const Failure& failure) {
      if (failure.code() != ExitCode::kRefused) throw;
      return failure.what();
    }
  }

  /// `robot` is empty for a robot elsewhere.
  bool plans(std::optional<DryRun>& robot, const std::string& key, const Motion& motion) {
    const Vector3d& to = motion.point_m;
    const Request request{.verb = motion.verb,
                          .numbers = {to.x(), to.y(), to.z()},
                          .above_m = motion.above_m,
                          .time_s = motion.time_s};
    const auto why = robot ? robot->refusal_of(request) : refusal_elsewhere(request);
    if (why) result_.refused.push_back({key, motion.name, to + Vector3d(0, 0, motion.above_m), *why});
    return !why;
  }

  const CellConfig& cell_;
  const CellRobot& robot_;
  /// With the arm at its wait pose, or with all joints at 0 if that pose is refused.
  std::optional<DryRun> waiting_;
  std::optional<client::Client> elsewhere_;  ///< used if there is no profile
  ReachCheck result_;
};

}  // namespace

ReachCheck check_reach(const CellConfig& cell, const CellRobot& robot) {
  return ReachPlans(cell, robot).run();
}

namespace {

/// Prints the result for one robot; returns the number of refused motions.
std::size_t print_check(const CellRobot& robot, const ReachCheck& check) {
  if (check.refused.empty())
    fmt::print("{}: all {} points are reached{}\n", robot.name, check.points,
               robot.profile.empty() ? " from where it stands" : "");
  for (const RefusedPoint& point : check.refused)
    fmt::print("{}: {}: {} to ({:.3f}, {:.3f}, {:.3f}) m in the robot's frame would be refused: {}\n",
               robot.name, point.key, point.motion, point.point_m.x(), point.point_m.y(), point.point_m.z(),
               point.why);
  return check.refused.size();
}

}  // namespace

void cell_check(const cell::CellOptions& options) {
  const CellConfig cell = load_for_command(options);
  std::size_t count = 0;
  std::string silent;  // the first robot elsewhere that does not reply; the others are checked all the same
  for (const CellRobot& robot : cell.robots) {
    try {
      count += print_check(robot, check_reach(cell, robot));
    } catch (const Failure& failure) {
      if (failure.code() != ExitCode::kUnreachable) throw;
      fmt::print("{}: not checked: {}\n", robot.name, failure.what());
      if (silent.empty()) silent = robot.name;
    }
  }
  if (count > 0)
    throw Failure(ExitCode::kRefused,
                  fmt::format("{} motion{} would be refused; nothing moved", count, count == 1 ? "" : "s"));
  if (!silent.empty()) throw Failure(ExitCode::kUnreachable, silent + " was not checked");
}

}  // namespace corbot::cli
