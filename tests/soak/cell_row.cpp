// SPDX-License-Identifier: Apache-2.0
#include "soak/cell_row.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "soak/cell_stage.h"

namespace corbot::soak {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kPlace = 12;            // pieces of the first place, and slots of the last one
constexpr int kFewLeft = 4;           // then a person refills
constexpr double kNextWithin_s = 90;  // a piece after another
constexpr std::chrono::milliseconds kLook{200};

/// The number after `key=`.
int count_of(const std::string& text, const std::string& key) {
  const auto at = text.find(key + "=");
  return at == std::string::npos ? -1 : std::stoi(text.substr(at + key.size() + 1));
}

/// A person beside the cell, until so many pieces have arrived.
class Person {
 public:
  Person(CellStage& stage, int wanted) : stage_(stage), wanted_(wanted) {}

  /// Empty, or what went wrong.
  std::string work() {
    for (last_ = Clock::now(); arrived_ < wanted_; std::this_thread::sleep_for(kLook)) {
      const std::string status = stage_.status();
      if (status.find("no person is needed") == std::string::npos) return "a person is needed:\n" + status;
      const std::string world = stage_.tell_world("count");
      const int there = count_of(world, "pallet2");
      if (taken_ + there > arrived_) last_ = Clock::now();
      arrived_ = std::max(arrived_, taken_ + there);
      if (std::chrono::duration<double>(Clock::now() - last_).count() > kNextWithin_s)
        return fmt::format("no piece arrived for {} s: {}\n{}", kNextWithin_s, world, status);
      if (status.find("pallet2 is full") != std::string::npos) take_away();
      if (count_of(world, "pallet1") <= kFewLeft && status.find("robot1 is in its zone") != std::string::npos)
        (void)stage_.tell_world("refill");
    }
    return "";
  }
  [[nodiscard]] int arrived() const { return arrived_; }
  [[nodiscard]] int taken() const { return taken_; }

 private:
  void take_away() {
    const std::string reply = stage_.tell_world("empty pallet2");
    if (reply.starts_with("ok ")) taken_ += std::stoi(reply.substr(3));
    (void)stage_.exchange("pallet2");
  }

  CellStage& stage_;
  const int wanted_;
  int arrived_{0};  ///< at the last place, taken away or there
  int taken_{0};
  Clock::time_point last_{};
};

/// What the coordinator's record says of the zone and of the pieces of robot2.
struct Pace {
  double seconds{};
  double zone_share{};
  double in_zone_s{};  ///< motions and looks of both robots in the zone, a piece
  double median_s{};   ///< from a piece of robot2 to the next one
};

struct Change {
  double time_s{};
  bool works{};  ///< a motion or a look
  bool in_zone{};
  std::uint64_t piece{};
};

Pace pace_of(const std::filesystem::path& activity) {
  std::map<std::string, Change> now;
  std::vector<double> ends_s;
  double begin_s = 0, time_s = 0, zone_s = 0, in_zone_s = 0;
  std::ifstream lines(activity);
  for (std::string line; std::getline(lines, line);) {
    const nlohmann::json object = nlohmann::json::parse(line);
    const double next_s = object.at("time");
    bool is_occupied = false;
    for (const auto& [robot, change] : now) {
      is_occupied = is_occupied || change.in_zone;
      if (change.in_zone && change.works && begin_s > 0) in_zone_s += next_s - time_s;
    }
    if (is_occupied && begin_s > 0) zone_s += next_s - time_s;
    time_s = next_s;
    const std::string robot = object.at("robot");
    const std::string activity_name = object.at("activity");
    const std::uint64_t piece = object.at("piece");
    if (begin_s == 0 && piece != 0) begin_s = next_s;
    if (robot == "robot2" && now[robot].piece != 0 && piece != now[robot].piece) ends_s.push_back(next_s);
    now[robot] = {next_s, activity_name == "move" || activity_name == "look",
                  !object.at("zone").get<std::string>().empty(), piece};
  }
  Pace pace;
  if (ends_s.size() < 2) return pace;
  pace.seconds = ends_s.back() - begin_s;
  pace.zone_share = zone_s / (time_s - begin_s);
  pace.in_zone_s = in_zone_s / static_cast<double>(ends_s.size());
  std::vector<double> gaps_s;
  for (std::size_t i = 1; i < ends_s.size(); ++i) gaps_s.push_back(ends_s[i] - ends_s[i - 1]);
  std::nth_element(gaps_s.begin(), gaps_s.begin() + static_cast<std::ptrdiff_t>(gaps_s.size() / 2),
                   gaps_s.end());
  pace.median_s = gaps_s[gaps_s.size() / 2];
  return pace;
}

}  // namespace

int run_row(const CellSoak& soak, int pieces) {
  CellStage stage(soak.programs, kPlace, static_cast<std::uint32_t>(soak.seed));
  Person person(stage, pieces);
  std::string wrong = person.work();
  const Pace pace = pace_of(stage.state_directory() / "activity.jsonl");
  const std::string counts = stage.end();
  if (wrong.empty() && (count_of(counts, "touches") != 0 || count_of(counts, "fallen") != 0 ||
                        count_of(counts, "elsewhere") != 0))
    wrong = "the world counts '" + counts + "'";
  if (!wrong.empty()) wrong += fmt::format("\nits files are in {}", stage.keep().string());
  fmt::print("{} pieces in {:.0f} s, {} taken away; zone in use {:.1f} % of the time\n", person.arrived(),
             pace.seconds, person.taken(), 100 * pace.zone_share);
  fmt::print("median {:.2f} s a piece; {:.2f} s of motions and looks in the zone a piece; ratio {:.3f}\n",
             pace.median_s, pace.in_zone_s, pace.median_s / pace.in_zone_s);
  fmt::print("{}\n", wrong.empty() ? "passed" : "FAILED: " + wrong);
  return wrong.empty() ? 0 : 1;
}

}  // namespace corbot::soak
