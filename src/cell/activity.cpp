// SPDX-License-Identifier: Apache-2.0
#include "cell/activity.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <utility>

#include <nlohmann/json.hpp>

namespace corbot::cell {
namespace {

constexpr std::array<const char*, 5> kNames{"idle", "move", "wait_zone", "look", "wait_piece"};

}  // namespace

std::string to_line(const ActivityChange& change) {
  const nlohmann::ordered_json line{{"time", change.time_s},
                                    {"robot", change.robot},
                                    {"activity", kNames.at(static_cast<std::size_t>(change.activity))},
                                    {"piece", change.piece},
                                    {"zone", change.zone}};
  return line.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

std::optional<ActivityChange> parse_activity(std::string_view line) {
  try {
    const auto json = nlohmann::json::parse(line);
    const auto name = json.at("activity").get<std::string>();
    const auto* const found = std::find(kNames.begin(), kNames.end(), name);
    if (found == kNames.end()) return std::nullopt;
    return ActivityChange{json.at("time").get<double>(), json.at("robot").get<std::string>(),
                          static_cast<Activity>(std::distance(kNames.begin(), found)),
                          json.at("piece").get<std::uint64_t>(), json.at("zone").get<std::string>()};
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  }
}

std::vector<ActivityChange> read_activity(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::vector<ActivityChange> changes;
  for (std::string line; std::getline(stream, line);) {
    if (auto change = parse_activity(line)) changes.push_back(std::move(*change));
  }
  std::stable_sort(changes.begin(), changes.end(),
                   [](const auto& a, const auto& b) { return a.time_s < b.time_s; });
  return changes;
}

void ActivityRecord::add(const ActivityChange& change) {
  const std::string line = to_line(change) + "\n";
  const std::lock_guard lock(mutex_);
  std::ofstream(file_, std::ios::app) << line;  // one write: the line is shorter than the buffer
}

}  // namespace corbot::cell
