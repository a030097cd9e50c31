// SPDX-License-Identifier: Apache-2.0
#include "cell/cell_rules.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace corbot::cell {

using Eigen::Vector2d;

namespace {

/// The distance from a piece's rim to the edge of the area.
constexpr double kEdge_m = 0.002;

bool has_hue(const Kind& kind, double hue_deg) {
  const auto [first, last] = kind.hue_deg;
  const double length = last >= first ? last - first : last - first + 360;
  for (const double turn_deg : {-360.0, 0.0, 360.0})
    if (hue_deg + turn_deg >= first && hue_deg + turn_deg <= first + length) return true;
  return false;
}

bool is_control(char c) { return static_cast<unsigned char>(c) < ' ' || c == 0x7f; }

}  // namespace

bool is_reference(std::string_view text) {
  constexpr std::array<std::string_view, 3> kSchemes{"corbaloc:", "corbaname:", "IOR:"};
  return std::any_of(kSchemes.begin(), kSchemes.end(),
                     [&](std::string_view scheme) { return text.substr(0, scheme.size()) == scheme; });
}

bool is_word_of_scene(std::string_view name) {
  constexpr std::array<std::string_view, 6> kWords{"elsewhere", "held",       "fallen",
                                                   "touches",   "nearest_mm", "overruns"};
  return std::find(kWords.begin(), kWords.end(), name) != kWords.end();
}

bool share_hue(const Kind& a, const Kind& b) { return has_hue(a, b.hue_deg[0]) || has_hue(b, a.hue_deg[0]); }

/// Two rectangles are apart if an axis of one of them separates their corners.
bool overlap(const Place& a, const Place& b) {
  const auto corners_seen_from = [](const Place& from, const Place& place) {
    Eigen::AlignedBox2d box;
    for (const double x : {-1.0, 1.0})
      for (const double y : {-1.0, 1.0}) {
        const Vector2d corner = place.half_size_m().cwiseProduct(Vector2d(x, y));
        box.extend(
            Vector2d(from.frame.to_local(place.frame.to_world({corner.x(), corner.y(), 0})).head<2>()));
      }
    return box;
  };
  const auto touches = [&](const Place& one, const Place& other) {
    const Eigen::AlignedBox2d own(-one.half_size_m(), one.half_size_m());
    return !own.intersection(corners_seen_from(one, other)).isEmpty();
  };
  return touches(a, b) && touches(b, a);
}

bool is_plain_file_name(const std::filesystem::path& name) {
  return !name.empty() && name.filename() == name && name != "." && name != "..";
}

bool has_special_character(std::string_view path) {
  return std::any_of(path.begin(), path.end(),
                     [](char c) { return c == '"' || c == '\\' || c == '$' || is_control(c); });
}

std::string shown_text(std::string text) {
  std::replace_if(text.begin(), text.end(), is_control, '?');
  return text;
}

std::filesystem::path longest_socket(const CellConfig& cell) {
  std::vector<std::filesystem::path> sockets{cell.picture_socket(), cell.state_directory / "notify.sock"};
  for (const CellRobot& robot : cell.robots)
    if (!robot.simulated_profile().empty()) sockets.push_back(cell.servo_socket(robot));
  return *std::max_element(sockets.begin(), sockets.end(), [](const auto& a, const auto& b) {
    return a.native().size() < b.native().size();
  });
}

bool shows(const CameraModel& camera, const Place& place, const Kind& kind) {
  const Vector2d half = place.half_size_m().array() + kind.circle_m(kind.label_m) / 2;
  const Vector2d last(camera.size_px[0], camera.size_px[1]);
  for (const Vector2d& sign : {Vector2d(-1, -1), Vector2d(-1, 1), Vector2d(1, -1), Vector2d(1, 1)}) {
    const Vector2d corner = half.cwiseProduct(sign);
    const auto pixel = camera.project(place.frame.to_world({corner.x(), corner.y(), kind.height_m}));
    if (!pixel || !((pixel->array() >= 0).all() && (pixel->array() < last.array()).all())) return false;
  }
  return true;
}

std::string place_that_keeps(const CellConfig& cell, const Kind& kind) {
  for (const Place& place : cell.places) {
    const auto takes = [&](const CellRobot& robot) { return robot.from == place.name; };
    const auto brings = [&](const CellRobot& robot) {
      return takes(robot) && cell.place(robot.to)->takes(kind.name);
    };
    const auto& robots = cell.robots;
    if (place.takes(kind.name) && std::any_of(robots.begin(), robots.end(), takes) &&
        std::none_of(robots.begin(), robots.end(), brings))
      return place.name;
  }
  return "";
}

std::string unseen_places(const CellConfig& cell) {
  std::string names;
  for (const Place& place : cell.places) {
    const bool is_seen = std::all_of(cell.kinds.begin(), cell.kinds.end(),
                                     [&](const Kind& kind) { return shows(cell.camera, place, kind); });
    if (!is_seen) names += (names.empty() ? "" : ", ") + place.name;
  }
  return names;
}

double widest_m(const std::vector<Kind>& kinds) {
  double widest = 0;
  for (const Kind& kind : kinds) widest = std::max(widest, kind.circle_m(kind.width_m));
  return widest;
}

int PieceRoom::most() const {
  if (inside_m.minCoeff() < 0) return 0;
  const Vector2d cells =
      (inside_m / spacing_m).array().floor() + 1;  // sim::scatter puts each piece into one cell
  return static_cast<int>(std::min(cells.prod(), 1e6));
}

std::optional<PieceRoom> piece_room(const CellConfig& cell) {
  const auto takes_from_area = [&](const CellRobot& robot) {
    const Place* place = cell.place(robot.from);
    return place != nullptr && place->size_m;
  };
  const auto robot = std::find_if(cell.robots.begin(), cell.robots.end(), takes_from_area);
  if (robot == cell.robots.end() || cell.kinds.empty()) return std::nullopt;
  const double widest = widest_m(cell.kinds);
  const Place* area = cell.place(robot->from);
  return PieceRoom{area, *area->size_m - Vector2d::Constant(widest + 2 * kEdge_m), widest + kRimSpacing_m};
}

std::string fault_of_pieces(const CellConfig& cell, int count) {
  if (count == 0) return "";
  const auto room = piece_room(cell);
  if (!room) return "must be 0: no robot takes from an area";
  if (count <= room->most()) return "";
  return fmt::format("at most {} fit on {}, {:.6g} x {:.6g} m, with {:.6g} m between their axes",
                     room->most(), room->area->name, room->area->size_m->x(), room->area->size_m->y(),
                     room->spacing_m);
}

}  // namespace corbot::cell
