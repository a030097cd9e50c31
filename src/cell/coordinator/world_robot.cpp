// SPDX-License-Identifier: Apache-2.0
#include "cell/coordinator/world_robot.h"

#include <fmt/format.h>

#include <utility>

#include "cell/arc.h"
#include "cell/coordinator/attention.h"
#include "client/explain.h"

namespace corbot::cell {

std::string describe(const Eigen::Vector3d& point) {
  return fmt::format("({:.3f}, {:.3f}, {:.3f}) m", point.x(), point.y(), point.z());
}

std::string ToolGoal::name() const { return key.substr(0, key.find(".position_m")); }

WorldRobot::WorldRobot(const CellRobot& robot, RobotPort& port, std::stop_token stop)
    : robot_(robot), port_(port), stop_(std::move(stop)) {}

template <class F>
void WorldRobot::command(const char* where, const ToolGoal& goal, F&& f) {
  const Eigen::Vector3d local = robot_.frame.to_local(goal.point);
  const auto text = [&](const client::Failure& cause) {
    return fmt::format("{} {}, {}, in the frame of {} {}: {}", where, goal.name(), describe(goal.point),
                       robot_.name, describe(local), cause.what());
  };
  const auto refusal = [&](const client::Failure& cause) {
    return fmt::format("{}; check {} in cell.toml", text(cause), goal.key);
  };
  if (stop_.stop_requested()) throw WorkEnded();
  try {
    client::call_user([&] {
      try {
        f(local);
      } catch (const Corbot::Unreachable& e) {
        throw PointRefused(refusal(client::explain(e)));
      } catch (const Corbot::LimitExceeded& e) {
        throw PointRefused(refusal(client::explain(e)));
      } catch (const Corbot::Stopped& e) {
        throw RobotStopped(text(client::explain(e)));
      }
    });
  } catch (const client::Failure& e) {
    throw MotionFault(text(e));
  }
}

void WorldRobot::speed(const ToolGoal& at) {
  command("at", at, [&](const auto&) { port_.speed(robot_.speed_percent); });
}

void WorldRobot::open(const ToolGoal& at) {
  command("at", at, [&](const auto&) { port_.open(); });
}

void WorldRobot::close(const ToolGoal& at) {
  command("at", at, [&](const auto&) { port_.close(); });
}

void WorldRobot::settle(const ToolGoal& at) {
  command("at", at, [&](const auto&) { port_.delay(robot_.settle_s); });
}

void WorldRobot::move(const ToolGoal& goal) {
  command("on the way to", goal, [&](const auto& point) { port_.move(point, 0); });
}

void WorldRobot::move_above(const ToolGoal& goal) {
  command("on the way to", goal, [&](const auto& point) { port_.move(point, robot_.above_m); });
}

void WorldRobot::move_on_arc(const ToolGoal& from, const ToolGoal& to) {
  const Eigen::Vector3d begin = robot_.frame.to_local(from.point);
  command("on the arc to", to, [&](const auto& end) {
    try {
      port_.move_c(begin, middle_of_arc(begin, end), end);
    } catch (const Corbot::BadParameter& e) {
      throw PointRefused(fmt::format("on the arc to {}: {}", to.name(), client::explain(e).what()));
    }
  });
}

ToolGoal WorldRobot::above(const ToolGoal& goal) const {
  return {goal.point + Eigen::Vector3d(0, 0, robot_.above_m), goal.key};
}

void WorldRobot::descend(const ToolGoal& goal) {
  command("on the way to", goal,
          [&](const auto& point) { port_.move_s(point, 0, robot_.above_m / robot_.approach_m_s); });
}

void WorldRobot::ascend(const ToolGoal& goal) {
  command("on the way to", goal, [&](const auto& point) {
    port_.move_s(point, robot_.above_m, robot_.above_m / robot_.approach_m_s);
  });
}

void WorldRobot::rise(const Eigen::Vector3d& tool, double height_m, const ToolGoal& to) {
  const Eigen::Vector3d local = robot_.frame.to_local({tool.x(), tool.y(), height_m});
  const double duration_s = (height_m - tool.z()) / robot_.approach_m_s;
  command("straight up, on the way to", to, [&](const auto&) { port_.move_s(local, 0, duration_s); });
}

Eigen::Vector3d WorldRobot::rest_position() {
  try {
    return robot_.frame.to_world(client::call_user([&] { return port_.rest_position(); }));
  } catch (const client::Failure& e) {
    throw Fault(e.what());
  }
}

bool WorldRobot::is_at(const ToolGoal& goal, double tolerance_m) {
  return (rest_position() - goal.point).norm() <= tolerance_m;
}

}  // namespace corbot::cell
