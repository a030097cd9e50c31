// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/cell_check.h"

#include <fmt/format.h>

#include <utility>

#include "cli/arm/dry_run.h"
#include "cli/cell/cell_directory.h"
#include "cli/cell/cell_processes.h"
#include "client/failure.h"
#include "config/load_profile.h"

namespace corbot::cli {

using cell::CellConfig;
using cell::CellRobot;
using cell::Kind;
using cell::Place;
using client::ExitCode;
using client::Failure;
using client::Request;
using client::Verb;
using Eigen::Vector3d;

namespace {

Profile parsed_profile(const CellConfig& cell, const CellRobot& robot) {
  try {
    return parse_profile(profile_text(cell, robot), robot.profile.string());
  } catch (const ConfigError& error) {
    throw Failure(ExitCode::kUsage, error.what());
  }
}

/// Where the foot of a piece may be, world, and how a person finds the spot at its place.
struct Spot {
  std::string name;
  Vector3d foot_m;
};

/// Every slot; of an area the outermost spots at which a piece stands on it whole, those halfway, and the middle.
std::vector<Spot> spots_of(const Place& place, const Kind& kind) {
  std::vector<Spot> spots;
  if (place.slots) {
    for (int slot = 0; slot < place.slots->count(); ++slot)
      spots.push_back({fmt::format("slot {}", slot), place.slot_position(slot)});
    return spots;
  }
  const Eigen::Vector2d half = (place.half_size_m().array() - kind.diameter_m / 2).max(0);
  for (const int x : {-1, 0, 1}) {
    for (const int y : {-1, 0, 1}) {
      const Vector3d foot = place.frame.to_world({x * half.x(), y * half.y(), 0});
      spots.push_back({fmt::format("at ({:.3f}, {:.3f})", foot.x(), foot.y()), foot});
    }
  }
  return spots;
}

/// Plans for one robot, and collects what is refused.
class ReachPlans {
 public:
  ReachPlans(const CellConfig& cell, const CellRobot& robot)
      : cell_(cell), robot_(robot), waiting_(parsed_profile(cell, robot)) {}

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

  void check(const Place& place) {
    for (const Kind& kind : cell_.kinds) {
      for (const Spot& spot : spots_of(place, kind))
        check(fmt::format("{} {}, {}, {}", cell_.key_of(place), place.name, spot.name, kind.name),
              robot_.frame.to_local(spot.foot_m + Vector3d(0, 0, kind.grasp_m)));
    }
  }

  /// The way of a worker to a grasp. The way back is the same line, and a free motion.
  void check(const std::string& key, const Vector3d& grasp_m) {
    result_.points += 2;
    DryRun robot = waiting_;
    if (plans(robot, key, {"the motion above the grasp", Verb::kMove, grasp_m, robot_.above_m}))
      (void)plans(robot, key,
                  {"the line to the grasp", Verb::kMoveS, grasp_m, 0, robot_.above_m / robot_.approach_m_s});
  }

  bool plans(DryRun& robot, const std::string& key, const Motion& motion) {
    const Vector3d& to = motion.point_m;
    const auto why = robot.refusal_of(Request{.verb = motion.verb,
                                              .numbers = {to.x(), to.y(), to.z()},
                                              .above_m = motion.above_m,
                                              .time_s = motion.time_s});
    if (why) result_.refused.push_back({key, motion.name, to + Vector3d(0, 0, motion.above_m), *why});
    return !why;
  }

  const CellConfig& cell_;
  const CellRobot& robot_;
  DryRun waiting_;  ///< with the arm at its wait pose, or where all joints are 0 if that is refused
  ReachCheck result_;
};

}  // namespace

std::optional<ReachCheck> check_reach(const CellConfig& cell, const CellRobot& robot) {
  if (robot.profile.empty()) return std::nullopt;
  return ReachPlans(cell, robot).run();
}

void cell_check(const cell::CellOptions& options) {
  const CellConfig cell = load_for_command(options);
  std::size_t count = 0;
  for (const CellRobot& robot : cell.robots) {
    const auto check = check_reach(cell, robot);
    if (!check) {
      fmt::print("{}: not checked: it runs elsewhere, and the cell has no profile of its arm\n", robot.name);
      continue;
    }
    if (check->refused.empty()) fmt::print("{}: all {} points are reached\n", robot.name, check->points);
    for (const RefusedPoint& point : check->refused)
      fmt::print("{}: {}: {} to ({:.3f}, {:.3f}, {:.3f}) m in the robot's frame would be refused: {}\n",
                 robot.name, point.key, point.motion, point.point_m.x(), point.point_m.y(), point.point_m.z(),
                 point.why);
    count += check->refused.size();
  }
  if (count == 0) return;
  throw Failure(ExitCode::kRefused,
                fmt::format("{} motion{} would be refused; nothing moved", count, count == 1 ? "" : "s"));
}

}  // namespace corbot::cli
