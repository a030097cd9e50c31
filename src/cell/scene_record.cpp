// SPDX-License-Identifier: Apache-2.0
#include "cell/scene_record.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "client/failure.h"

namespace corbot::cell {
namespace {

using Eigen::Vector3d;
using nlohmann::json;

/// The last line of a truncated record.
constexpr const char* kCut = "{\"cut\":true}\n";

double rounded(double value) { return std::round(value * 1e4) / 1e4; }
Vector3d rounded(const Vector3d& v) { return {rounded(v.x()), rounded(v.y()), rounded(v.z())}; }

void round_all(SceneSample& sample) {
  for (RecordedArm& arm : sample.arms) {
    for (Vector3d& point : arm.points_m) point = rounded(point);
    arm.opening_m = rounded(arm.opening_m);
    arm.across_rad = rounded(arm.across_rad);
  }
  for (RecordedPiece& piece : sample.pieces) {
    piece.foot_m = rounded(piece.foot_m);
    piece.yaw_rad = rounded(piece.yaw_rad);
  }
}

json to_json(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Vector3d vector_of(const json& v) {
  return {v.at(0).get<double>(), v.at(1).get<double>(), v.at(2).get<double>()};
}

json to_json(std::size_t number, const RecordedArm& arm) {
  json points = json::array();
  for (const Vector3d& point : arm.points_m) points.push_back(to_json(point));
  return {
      {"n", number}, {"points", std::move(points)}, {"opening", arm.opening_m}, {"across", arm.across_rad}};
}

json to_json(std::size_t number, const RecordedPiece& piece) {
  json object{{"n", number}, {"foot", to_json(piece.foot_m)}};
  if (piece.hand) object["hand"] = *piece.hand;
  if (piece.is_fallen) object["fallen"] = true;
  if (piece.yaw_rad != 0) object["yaw"] = piece.yaw_rad;
  return object;
}

/// Returns the elements that differ from the previous sample's.
template <class T>
json changes(const std::vector<T>& from, const std::vector<T>& to) {
  json list = json::array();
  for (std::size_t i = 0; i < to.size(); ++i) {
    if (i >= from.size() || !(from[i] == to[i])) list.push_back(to_json(i, to[i]));
  }
  return list;
}

void take(const json& object, RecordedArm& arm) {
  arm.points_m.clear();
  for (const json& point : object.at("points")) arm.points_m.push_back(vector_of(point));
  arm.opening_m = object.at("opening");
  arm.across_rad = object.at("across");
}

void take(const json& object, RecordedPiece& piece) {
  piece = {.foot_m = vector_of(object.at("foot")),
           .hand = {},
           .is_fallen = object.value("fallen", false),
           .yaw_rad = object.value("yaw", 0.0)};
  if (object.contains("hand")) piece.hand = object.at("hand").get<std::size_t>();
}

template <class T>
void take_changes(const json& line, const char* key, std::vector<T>& state) {
  if (!line.contains(key)) return;
  for (const json& object : line.at(key)) take(object, state.at(object.at("n").get<std::size_t>()));
}

json line_at(double time_s) { return {{"t", std::round(time_s * 1e3) / 1e3}}; }

std::string text_of(const json& line) { return line.dump() + "\n"; }

}  // namespace

std::string SceneRecordText::counted(std::string text) {
  if (is_cut_) return "";
  if (bytes_ + text.size() + std::char_traits<char>::length(kCut) > limit_bytes_) {
    is_cut_ = true;
    return kCut;
  }
  bytes_ += text.size();
  return text;
}

std::string SceneRecordText::begin(const SceneCast& cast) {
  json arms = json::array();
  for (const SceneCast::Arm& arm : cast.arms) arms.push_back({{"name", arm.name}, {"radii", arm.radii_m}});
  return counted(text_of({{"arms", std::move(arms)}, {"pieces", cast.kinds}}));
}

std::string SceneRecordText::add(SceneSample sample) {
  round_all(sample);
  json line = line_at(sample.time_s);
  if (json arms = changes(last_.arms, sample.arms); !arms.empty()) line["arms"] = std::move(arms);
  if (json pieces = changes(last_.pieces, sample.pieces); !pieces.empty()) line["pieces"] = std::move(pieces);
  if (line.size() == 1) {
    unwritten_s_ = sample.time_s;
    return "";
  }
  std::string text = end() + text_of(line);
  last_ = std::move(sample);
  return counted(std::move(text));
}

std::string SceneRecordText::end() {
  const auto time_s = std::exchange(unwritten_s_, std::nullopt);
  return time_s ? text_of(line_at(*time_s)) : "";
}

SceneRecord read_scene_record(std::istream& text) {
  SceneRecord record;
  SceneSample state;
  std::string line;
  try {
    std::getline(text, line);
    const json first = json::parse(line);
    for (const json& arm : first.at("arms"))
      record.cast.arms.push_back({arm.at("name"), arm.at("radii").get<std::vector<double>>()});
    record.cast.kinds = first.at("pieces").get<std::vector<std::string>>();
    state.arms.resize(record.cast.arms.size());
    state.pieces.resize(record.cast.kinds.size());
    while (std::getline(text, line) && !text.eof()) {
      const json object = json::parse(line);
      record.is_cut = object.value("cut", false);
      if (record.is_cut) break;
      state.time_s = object.at("t");
      take_changes(object, "arms", state.arms);
      take_changes(object, "pieces", state.pieces);
      for (std::size_t i = 0; i < state.arms.size(); ++i) {
        if (state.arms[i].points_m.size() != record.cast.arms[i].radii_m.size() + 1)
          throw std::runtime_error("an arm has one point more than it has links");
      }
      record.samples.push_back(state);
    }
  } catch (const std::exception& error) {
    throw client::Failure(client::ExitCode::kInternal,
                          std::string("the scene's record cannot be read: ") + error.what());
  }
  return record;
}

}  // namespace corbot::cell
