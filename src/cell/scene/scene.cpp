// SPDX-License-Identifier: Apache-2.0
#include "cell/scene/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

#include "cell/cell_rules.h"
#include "client/failure.h"
#include "config/load_profile.h"
#include "sim/devices/control_input.h"

namespace corbot::cell {

using client::ExitCode;
using client::Failure;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

/// The port of a profile whose servo controller the scene simulates.
constexpr std::string_view kPort = "unix:SCENE/NAME.servos";
/// The values of good servos.
constexpr sim::ServoModelOptions kServo{.dead_band_us = 2, .lag_s = 0.02};

constexpr double kHandRoom_m = 0.08;  // least distance between a new piece and a hand
constexpr std::string_view kElsewhere = "elsewhere";

}  // namespace

std::array<std::uint8_t, 3> label_bgr(const Kind& kind) {
  constexpr double kSaturation = 0.85;
  constexpr double kValue = 0.85;
  const auto [from, to] = kind.hue_deg;
  const double hue = std::fmod(from + std::fmod(to - from + 360, 360) / 2, 360);
  // https://en.wikipedia.org/wiki/HSL_and_HSV#HSV_to_RGB_alternative
  const auto part = [&](double n) {
    const double k = std::fmod(n + hue / 60, 6);
    return static_cast<std::uint8_t>(
        std::lround(255 * kValue * (1 - kSaturation * std::clamp(std::min(k, 4 - k), 0.0, 1.0))));
  };
  return {part(1), part(3), part(5)};
}

Scene::Scene(const CellConfig& cell, AfterTick after_tick) : cell_(cell), after_tick_(std::move(after_tick)) {
  if (!cell_.scene) throw Failure(ExitCode::kUsage, "the cell has no table 'scene': it is not simulated");
  for (const CellRobot& robot : cell_.robots) {
    if (!robot.simulated_profile().empty()) add_robot(robot);
  }
  pieces_ = std::make_unique<sim::Pieces>(scattered(cell_.scene->seed),
                                          [this](const Vector3d& point) { return surface_m(point); });
}

void Scene::add_robot(const CellRobot& robot) {
  const std::filesystem::path& file = robot.simulated_profile();
  std::string text = read_profile_text(file);
  const auto at = text.find(kPort);
  if (at == std::string::npos && robot.profile.empty()) {
    throw Failure(ExitCode::kUsage, fmt::format("{}: {}.scene_profile: its backend must have port = \"{}\"",
                                                file.string(), cell_.key_of(robot), kPort));
  }
  if (at == std::string::npos) return;
  const std::string socket = cell_.servo_socket(robot);
  text.replace(at, kPort.size(), "unix:" + socket);
  const Profile profile = parse_profile(text, file);
  if (profile.backend.kind != "ssc32" || profile.backend.serial.port != "unix:" + socket) return;
  sim::Ssc32Options options;
  options.baud = profile.backend.serial.baud;
  options.servo = kServo;
  robots_.push_back({robot.name,
                     profile.arm,
                     {robot.frame.position_m, robot.frame.yaw_rad},
                     robot.opening_m,
                     std::make_unique<sim::ServoSocket>(socket, options)});
}

std::vector<sim::Piece> Scene::scattered(std::uint64_t seed) const {
  const int count = cell_.scene->pieces;
  if (count == 0) return {};
  if (const std::string why = fault_of_pieces(cell_, count); !why.empty())
    throw Failure(ExitCode::kUsage, fmt::format("scene.pieces = {}: {}", count, why));
  const PieceRoom room = *piece_room(cell_);
  const auto points = sim::scatter(room.inside_m, room.spacing_m, static_cast<std::size_t>(count), seed);
  if (!points) throw Failure(ExitCode::kUsage, fmt::format("scene.pieces = {}: fewer fit", count));
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> any_yaw(-std::numbers::pi, std::numbers::pi);
  std::vector<sim::Piece> pieces;
  for (const Vector2d& point : *points) {
    sim::Piece piece;
    piece.kind = pieces.size() % cell_.kinds.size();
    const Kind& kind = cell_.kinds[piece.kind];
    piece.is_square = kind.is_square;
    piece.width_m = kind.width_m;
    piece.height_m = kind.height_m;
    if (piece.is_square) piece.yaw_rad = any_yaw(random);
    piece.foot_m = room.area->frame.to_world({point.x(), point.y(), 0});
    pieces.push_back(piece);
  }
  return pieces;
}

double Scene::surface_m(const Vector3d& point) const {
  const auto under = std::find_if(cell_.places.begin(), cell_.places.end(),
                                  [&](const Place& place) { return place.covers(point); });
  return under == cell_.places.end() ? 0 : under->frame.position_m.z();
}

void Scene::add_to(std::vector<pollfd>& fds) const {
  for (const Robot& robot : robots_) robot.servos->add_to(fds);
}

std::optional<std::int64_t> Scene::next_answer_ns() const {
  std::optional<std::int64_t> next;
  for (const Robot& robot : robots_) {
    const auto answer_ns = robot.servos->next_answer_ns();
    if (answer_ns) next = std::min(next.value_or(*answer_ns), *answer_ns);
  }
  return next;
}

void Scene::exchange(std::int64_t now_ns) {
  for (const Robot& robot : robots_) robot.servos->step(now_ns);
}

void Scene::tick(std::int64_t now_ns) {
  if (!first_ns_) first_ns_ = now_ns;
  time_ns_ = now_ns;
  arms_.clear();
  std::vector<sim::Hand> hands;
  for (const Robot& robot : robots_) {
    arms_.push_back(sim::arm_body(robot.model, robot.base, robot.opening_m, [&](std::size_t channel) {
      return robot.servos->device().shaft_us(channel, now_ns);
    }));
    hands.push_back(arms_.back().hand);
  }
  pieces_->step(hands);
  clearance_.check(arms_);
  if (after_tick_) after_tick_(*pieces_);
}

std::string Scene::command(std::string_view line) {
  const std::vector<std::string_view> words = sim::words_of(line);
  if (words.size() == 1 && words[0] == "refill") return refill();
  if (words.size() == 1 && words[0] == "count") return "ok " + summary();
  if (words.size() != 2 || words[0] != "empty") return "error: 'refill', 'empty PLACE' or 'count'";
  const Place* const place = cell_.place(std::string(words[1]));
  return place == nullptr ? fmt::format("error: no place '{}'", words[1]) : empty(*place);
}

/// Puts down new pieces up to the initial count, none under a hand or too close to another piece.
std::string Scene::refill() {
  const std::vector<sim::Piece> wanted = scattered(cell_.scene->seed + ++commands_);
  const std::optional<PieceRoom> room = piece_room(cell_);
  if (!room) return "error: no robot takes from an area";
  const double spacing_m = room->spacing_m;
  const auto& before = pieces_->all();
  const auto standing = std::count_if(before.begin(), before.end(), [&](const sim::Piece& piece) {
    return piece.state == sim::PieceState::kStanding && room->area->covers(piece.foot_m);
  });
  const auto is_near = [](const Vector3d& a, const Vector3d& b, double distance_m) {
    return (a - b).head<2>().norm() < distance_m;
  };
  std::int64_t count = 0;
  for (const sim::Piece& piece : wanted) {
    if (standing + count >= cell_.scene->pieces) break;
    const auto& all = pieces_->all();
    const bool is_free = std::none_of(all.begin(), all.end(),
                                      [&](const sim::Piece& other) {
                                        return is_near(other.foot_m, piece.foot_m, spacing_m);
                                      }) &&
                         std::none_of(arms_.begin(), arms_.end(), [&](const sim::ArmBody& arm) {
                           return is_near(arm.hand.tool_m, piece.foot_m, kHandRoom_m);
                         });
    if (!is_free) continue;
    pieces_->put_down(piece);
    ++count;
  }
  return fmt::format("ok {} put down", count);
}

std::string Scene::empty(const Place& place) {
  ++commands_;
  int count = 0;
  for (std::size_t i = pieces_->all().size(); i-- > 0;) {
    const sim::Piece& piece = pieces_->all()[i];
    if (piece.state == sim::PieceState::kHeld || piece.hand || !place.covers(piece.foot_m)) continue;
    pieces_->take_away(i);
    ++count;
  }
  return fmt::format("ok {} taken away", count);
}

SceneView Scene::view() const {
  SceneView view;
  view.time_ns = time_ns_;
  for (const sim::Piece& piece : pieces_->all()) {
    const Kind& kind = cell_.kinds[piece.kind];
    view.pieces.push_back({piece.foot_m, piece.width_m, piece.height_m, kind.label_m, label_bgr(kind),
                           piece.state == sim::PieceState::kFallen, piece.yaw_rad, kind.is_square});
  }
  for (const sim::ArmBody& arm : arms_) view.arms.insert(view.arms.end(), arm.links.begin(), arm.links.end());
  return view;
}

std::string Scene::place_of(const sim::Piece& piece) const {
  const auto under = std::find_if(cell_.places.begin(), cell_.places.end(),
                                  [&](const Place& place) { return place.covers(piece.foot_m); });
  return under == cell_.places.end() ? std::string(kElsewhere) : under->name;
}

SceneCast Scene::cast() const {
  SceneCast cast;
  for (std::size_t i = 0; i < robots_.size(); ++i) {
    cast.arms.push_back({robots_[i].name, {}});
    for (const sim::Capsule& link : arms_[i].links) cast.arms[i].radii_m.push_back(link.radius_m);
  }
  for (const sim::Piece& piece : pieces_->all()) cast.kinds.push_back(cell_.kinds[piece.kind].name);
  return cast;
}

SceneSample Scene::sample() const {
  SceneSample sample;
  sample.time_s = static_cast<double>(time_ns_ - first_ns_.value_or(time_ns_)) * 1e-9;
  for (const sim::ArmBody& arm : arms_) {
    RecordedArm& recorded = sample.arms.emplace_back();
    recorded.points_m.push_back(arm.links.front().from_m);
    for (const sim::Capsule& link : arm.links) recorded.points_m.push_back(link.to_m);
    recorded.opening_m = arm.hand.opening_m;
    recorded.across_rad = std::atan2(arm.hand.across.y(), arm.hand.across.x());
  }
  for (const sim::Piece& piece : pieces_->all()) {
    const bool is_held = piece.state == sim::PieceState::kHeld;
    sample.pieces.push_back({piece.foot_m, is_held ? piece.hand : std::nullopt,
                             piece.state == sim::PieceState::kFallen, piece.is_square ? piece.yaw_rad : 0});
  }
  return sample;
}

std::string Scene::summary() const {
  int held = 0;
  int fallen = 0;
  std::vector<std::string> where;
  for (const sim::Piece& piece : pieces_->all()) {
    held += piece.state == sim::PieceState::kHeld ? 1 : 0;
    fallen += piece.state == sim::PieceState::kFallen ? 1 : 0;
    if (piece.state == sim::PieceState::kStanding) where.push_back(place_of(piece));
  }
  std::string text;
  const auto add = [&](std::string_view place) {
    text += fmt::format("{}={} ", place, std::count(where.begin(), where.end(), place));
  };
  for (const Place& place : cell_.places) add(place.name);
  add(kElsewhere);
  const double nearest_m = clearance_.nearest_m();
  return text + fmt::format("held={} fallen={} touches={} nearest_mm={}", held, fallen, clearance_.touches(),
                            std::isfinite(nearest_m) ? fmt::format("{:.1f}", nearest_m * 1000) : "-");
}

}  // namespace corbot::cell
