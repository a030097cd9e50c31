// SPDX-License-Identifier: Apache-2.0
#include "cell/cell_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "net/ports.h"

namespace corbot::cell {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

template <class Items>
const typename Items::value_type* find_named(const Items& items, const std::string& name) {
  const auto found =
      std::find_if(items.begin(), items.end(), [&](const auto& item) { return item.name == name; });
  return found == items.end() ? nullptr : &*found;
}

std::string uri(const CellConfig& cell, const std::string& reference, int port, const std::string& key) {
  return reference.empty() ? "corbaloc::" + net::endpoint_text(cell.host, port) + "/" + key : reference;
}

}  // namespace

Vector3d Place::slot_position(int slot) const {
  const int column = slot % slots->columns;
  const int row = slot / slots->columns;
  const Vector2d from_middle(column - 0.5 * (slots->columns - 1), row - 0.5 * (slots->rows - 1));
  const Vector2d local = from_middle.cwiseProduct(slots->pitch_m);
  return frame.to_world({local.x(), local.y(), 0});
}

bool Place::slot_takes(int slot, const std::string& kind) const {
  return row_kinds.empty() || row_kinds[static_cast<std::size_t>(slot / slots->columns)] == kind;
}

bool Place::takes_at(const Vector3d& point, const std::string& kind) const {
  if (!slots) return true;
  const double from_edge_m = frame.to_local(point).y() + half_size_m().y();
  const int row = std::clamp(static_cast<int>(from_edge_m / slots->pitch_m.y()), 0, slots->rows - 1);
  return slot_takes(row * slots->columns, kind);
}

bool Place::takes(const std::string& kind) const {
  return row_kinds.empty() || std::find(row_kinds.begin(), row_kinds.end(), kind) != row_kinds.end();
}

Vector2d Place::half_size_m() const {
  if (size_m) return *size_m / 2;
  return Vector2d(slots->columns, slots->rows).cwiseProduct(slots->pitch_m) / 2;
}

bool Place::covers(const Vector3d& point, double margin_m) const {
  const Vector3d local = frame.to_local(point);
  const Vector2d half = half_size_m();
  return std::abs(local.x()) <= half.x() + margin_m && std::abs(local.y()) <= half.y() + margin_m;
}

bool Place::carries(const Vector3d& foot) const {
  return covers(foot, kOnPlace_m) && std::abs(foot.z() - frame.position_m.z()) <= kOnPlace_m;
}

const Place* CellConfig::place(const std::string& wanted) const { return find_named(places, wanted); }
const CellRobot* CellConfig::robot(const std::string& wanted) const { return find_named(robots, wanted); }
const Kind* CellConfig::kind(const std::string& wanted) const { return find_named(kinds, wanted); }

std::string CellConfig::key_of(const Place& place) const {
  return fmt::format("place[{}]", &place - places.data());
}
std::string CellConfig::key_of(const CellRobot& robot) const {
  return fmt::format("robot[{}]", &robot - robots.data());
}

bool CellConfig::is_last(const Place& place) const {
  const auto brings = [&](const CellRobot& robot) { return robot.to == place.name; };
  const auto takes = [&](const CellRobot& robot) { return robot.from == place.name; };
  return std::any_of(robots.begin(), robots.end(), brings) &&
         std::none_of(robots.begin(), robots.end(), takes);
}

std::string CellConfig::store_uri() const { return uri(*this, store_reference, store_port(), kStoreKey); }
std::string CellConfig::camera_uri() const { return uri(*this, camera_reference, camera_port(), kCameraKey); }
std::string CellConfig::coordinator_uri() const {
  return uri(*this, coordinator_reference, coordinator_port(), kCoordinatorKey);
}
std::string CellConfig::robot_uri(const CellRobot& robot) const {
  return uri(*this, robot.reference, robot_port(robot), robot_name(robot));
}

int CellConfig::robot_port(const CellRobot& robot) const {
  int port = ports + 3;
  for (const CellRobot& other : robots) {
    if (other.name == robot.name) break;
    if (!other.profile.empty()) ++port;
  }
  return port;
}

std::filesystem::path CellConfig::servo_socket(const CellRobot& robot) const {
  return state_directory / (robot.name + ".servos");
}

}  // namespace corbot::cell
