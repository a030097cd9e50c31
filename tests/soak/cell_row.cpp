// SPDX-License-Identifier: Apache-2.0
#include "soak/cell_row.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <thread>

#include "soak/cell_pace.h"
#include "soak/cell_stage.h"
#include "support/process.h"

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

/// Reads from each servant what it plans, until it is destroyed.
class MotionWatch {
 public:
  MotionWatch(const CellSoak& soak, const CellStage& stage) {
    const std::string client = (soak.programs.parent_path() / "tests" / "soak_client").string();
    for (const char* robot : {"robot1", "robot2"})
      clients_.emplace(robot, test::Process({client, "corbaloc::1.2@" + stage.address(robot), "motions"}));
  }
  /// Empty, or which client has ended. It keeps their output from filling a pipe.
  std::string check() {
    for (auto& [robot, client] : clients_)
      if (!client.running())
        return fmt::format("the motions of {} are not known: {}", robot, client.output());
    return "";
  }
  PlannedMotions motions() {
    PlannedMotions all;
    for (auto& [robot, client] : clients_) {
      std::istringstream words(client.output());
      PlannedMotion motion;
      for (std::string word; words >> word >> motion.begin_s >> motion.duration_s;)
        all[robot].push_back(motion);
    }
    return all;
  }

 private:
  std::map<std::string, test::Process> clients_;
};

/// A person beside the cell, until so many pieces have arrived.
class Person {
 public:
  Person(CellStage& stage, MotionWatch& watch, int wanted) : stage_(stage), watch_(watch), wanted_(wanted) {}

  /// Empty, or what went wrong.
  std::string work() {
    for (last_ = Clock::now(); arrived_ < wanted_; std::this_thread::sleep_for(kLook)) {
      if (const std::string why = watch_.check(); !why.empty()) return why;
      const std::string status = stage_.status();
      const bool is_full = status.find("pallet2 is full") != std::string::npos;  // needs this person
      if (!is_full && status.find("no person is needed") == std::string::npos)
        return "a person is needed:\n" + status;
      const std::string world = stage_.tell_world("count");
      const int there = count_of(world, "pallet2");
      if (taken_ + there > arrived_) last_ = Clock::now();
      arrived_ = std::max(arrived_, taken_ + there);
      if (std::chrono::duration<double>(Clock::now() - last_).count() > kNextWithin_s)
        return fmt::format("no piece arrived for {} s: {}\n{}", kNextWithin_s, world, status);
      if (is_full) take_away();
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
  MotionWatch& watch_;
  const int wanted_;
  int arrived_{0};  ///< at the last place, taken away or there
  int taken_{0};
  Clock::time_point last_{};
};

}  // namespace

int run_row(const CellSoak& soak, int pieces) {
  CellStage stage(soak.programs, kPlace, static_cast<std::uint32_t>(soak.seed));
  std::optional<MotionWatch> watch(std::in_place, soak, stage);
  Person person(stage, *watch, pieces);
  std::string wrong = person.work();
  const Pace pace =
      pace_of(cell::read_activity(stage.state_directory() / "activity.jsonl"), watch->motions());
  watch.reset();
  const std::string counts = stage.end();
  if (wrong.empty() && (count_of(counts, "touches") != 0 || count_of(counts, "fallen") != 0 ||
                        count_of(counts, "elsewhere") != 0))
    wrong = "the world counts '" + counts + "'";
  if (wrong.empty()) wrong = missed_bounds(pace);
  if (!wrong.empty()) wrong += fmt::format("\nits files are in {}", stage.keep().string());
  fmt::print("{} pieces in {:.0f} s, {} taken away; zone in use {:.1f} % of the time\n", person.arrived(),
             pace.seconds, person.taken(), 100 * pace.zone_share);
  fmt::print(
      "median {:.2f} s a piece, {:.3f} times the {:.2f} s of planned motions and of looks in the zone a "
      "piece\n",
      pace.median_s, pace.median_s / pace.planned_s, pace.planned_s);
  fmt::print("as carried out these take {:.2f} s: ratio {:.3f}\n", pace.carried_out_s,
             pace.median_s / pace.carried_out_s);
  fmt::print("{}\n", wrong.empty() ? "passed" : "FAILED: " + wrong);
  return wrong.empty() ? 0 : 1;
}

}  // namespace corbot::soak
