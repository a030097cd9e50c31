// SPDX-License-Identifier: Apache-2.0
#include "soak/cell_soak.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

#include "soak/cell_stage.h"

namespace corbot::soak {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kWorksWithin_s = 30;  // from the last fault to work, or to a person
constexpr double kWorksFor_s = 1;      // a worker notices a fault at its next call
constexpr std::size_t kCauses = 6;
constexpr double kPlaced_s = 240;
constexpr int kMostFailures = 3;  // then the soak ends
constexpr double kLook_s = 0.25;  // between two looks at the cell; each takes 0.05 s of processor time

struct CellFault {
  std::string victim;
  double frozen_s{0};  ///< 0: killed
  pid_t pid{0};
  [[nodiscard]] std::string text() const {
    return frozen_s > 0 ? fmt::format("freeze {} {:.1f} s", victim, frozen_s) : "kill " + victim;
  }
};

double seconds_from(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

void sleep_for_s(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

/// A person may be asked to clear a robot whose task or supervisor ended, or stood still.
bool may_need_clear(const std::vector<CellFault>& faults, const std::string& robot) {
  return std::any_of(faults.begin(), faults.end(), [&](const CellFault& fault) {
    return fault.victim == "cell up" || fault.victim == robot + " up" || fault.victim == robot + " task";
  });
}

/// One world with its cell, until its pieces have arrived or the kills are used up.
class CellRunOfSoak {
 public:
  CellRunOfSoak(const CellSoak& soak, std::uint32_t run)
      : soak_(soak),
        run_(run),
        stage_(soak.programs, soak.pieces, static_cast<std::uint32_t>(soak.seed) + run, soak.planted) {}

  /// Returns the fault that was found; empty: none.
  std::string go(int most_kills) {
    std::string wrong;
    while (kills_ < most_kills && wrong.empty() && !has_all_placed(stage_.status())) wrong = step();
    const auto begin = Clock::now();
    while (wrong.empty() && !has_all_placed(stage_.status())) {
      sleep_for_s(kLook_s);
      if (seconds_from(begin) > kPlaced_s) wrong = "the pieces did not arrive:\n" + stage_.status();
    }
    if (wrong.empty()) wrong = ends();
    if (!wrong.empty()) wrong += fmt::format("\nits files are in {}", stage_.keep().string());
    return wrong;
  }
  [[nodiscard]] int kills() const { return kills_; }
  [[nodiscard]] int clears() const { return clears_; }
  [[nodiscard]] double longest_back_s() const { return longest_back_s_; }

 private:
  [[nodiscard]] bool has_all_placed(const std::string& status) const {
    return status.find(fmt::format("; {} pieces on pallet2\n", soak_.pieces)) != std::string::npos;
  }
  /// Breaks one thing. Its choices depend on the seed, the world's number and its own number alone.
  std::string step() {
    std::seed_seq seeds{static_cast<std::uint32_t>(soak_.seed), static_cast<std::uint32_t>(soak_.seed >> 32),
                        run_, ++steps_};
    std::mt19937_64 random(seeds);
    const auto real = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    sleep_for_s(real(0.2, 7.0));
    std::vector<CellFault> faults(real(0, 1) < 0.2 ? 2 : 1);
    for (CellFault& fault : faults) {
      const std::vector<std::string> all = CellStage::victims();
      fault.victim = all[std::min(static_cast<std::size_t>(real(0, 1) * static_cast<double>(all.size())),
                                  all.size() - 1)];
      if (real(0, 1) < 0.4) fault.frozen_s = real(0.1, 12);
      fault.pid = stage_.pid_of(fault.victim);
    }
    std::vector<std::string> texts;
    for (const CellFault& fault : faults) {
      if (fault.pid > 0) (void)::kill(fault.pid, fault.frozen_s > 0 ? SIGSTOP : SIGKILL);
      texts.push_back(fault.text() + (fault.pid > 0 ? "" : " (does not run)"));
      kills_ += fault.pid > 0 ? 1 : 0;
    }
    const std::string what = fmt::format("{}", fmt::join(texts, " + "));
    thaw(faults);
    const auto begin = Clock::now();
    causes_.insert(causes_.end(), faults.begin(), faults.end());
    if (causes_.size() > kCauses) causes_.erase(causes_.begin(), causes_.end() - kCauses);
    std::string wrong = recover();
    if (wrong.empty()) wrong = harm();
    longest_back_s_ = std::max(longest_back_s_, seconds_from(begin));
    if (soak_.verbose) {
      fmt::print("world {} step {}: {}; {:.1f} s\n", run_, steps_, what, seconds_from(begin));
      std::fflush(stdout);
    }
    return wrong.empty() ? "" : fmt::format("step {}: {}: {}", steps_, what, wrong);
  }

  static void thaw(std::vector<CellFault>& faults) {
    std::sort(faults.begin(), faults.end(),
              [](const CellFault& a, const CellFault& b) { return a.frozen_s < b.frozen_s; });
    double slept_s = 0;
    for (const CellFault& fault : faults) {
      if (fault.frozen_s <= 0 || fault.pid <= 0) continue;
      sleep_for_s(fault.frozen_s - slept_s);
      slept_s = fault.frozen_s;
      (void)::kill(fault.pid, SIGCONT);
    }
  }

  /// Until the cell works; a person does what the table asks for.
  std::string recover() {
    std::string status;
    auto works_since = Clock::now();
    for (auto begin = Clock::now(); seconds_from(begin) < kWorksWithin_s;) {
      if (!stage_.is_started()) {
        if (const std::string why = stage_.start(); !why.empty()) return why;
        begin = works_since = Clock::now();
      }
      status = stage_.status();
      if (has_all_placed(status)) return "";
      for (const char* robot : {"robot1", "robot2"}) {
        if (status.find(fmt::format("{} is in Error", robot)) == std::string::npos) {
          if (!status.empty()) cleared_.erase(robot);
          continue;
        }
        if (!may_need_clear(causes_, robot)) return "a person is asked without a cause:\n" + status;
        if (stage_.clear(robot) && cleared_.insert(robot).second) ++clears_;
      }
      const bool works = status.find(" works;") != std::string::npos &&
                         status.find(" idle ") == std::string::npos &&
                         status.find("no person is needed") != std::string::npos;
      if (!works) works_since = Clock::now();
      if (seconds_from(works_since) > kWorksFor_s) return "";
      sleep_for_s(kLook_s);
    }
    return fmt::format("after {:.0f} s:\n{}", kWorksWithin_s, status);
  }

  /// Returns the damage that the world has counted and no later step can undo; empty: none.
  std::string harm() {
    const std::string counts = stage_.tell_world("count");
    const bool is_well = counts.find(" fallen=0 touches=0 ") != std::string::npos;
    return is_well ? "" : fmt::format("the world counts '{}'", counts);
  }

  std::string ends() {
    const std::string status = stage_.status();
    const std::string counts = stage_.end();
    const std::string wanted =
        fmt::format("pallet1=0 store1=0 pallet2={} elsewhere=0 held=0 fallen=0 touches=0 ", soak_.pieces);
    if (!counts.starts_with(wanted)) return fmt::format("the world counts '{}', not '{}'", counts, wanted);
    const std::string slots = fmt::format("{} of 12 slots have a piece, 0 reserved\n", soak_.pieces);
    if (status.find(slots) == std::string::npos) return "the ledger differs from the world:\n" + status;
    return "";
  }

  const CellSoak& soak_;
  const std::uint32_t run_;
  CellStage stage_;
  std::uint32_t steps_{0};
  std::vector<CellFault> causes_;  ///< the last ones
  int kills_{0};
  std::set<std::string> cleared_;  ///< the status still shows their Error
  int clears_{0};
  double longest_back_s_{0};
};

/// Adds a line, and prints the sum of all lines.
void add_to_results(const std::filesystem::path& file, const nlohmann::json& line) {
  if (!(std::ofstream(file, std::ios::app) << line.dump() << '\n').flush())
    throw std::runtime_error(file.string() + " cannot be written");
  std::map<std::string, int> sums;
  std::ifstream stream(file);
  for (std::string text; std::getline(stream, text);) {
    const nlohmann::json past = nlohmann::json::parse(text);
    for (const char* key : {"kills", "pieces", "clears", "failures"}) sums[key] += past.at(key).get<int>();
  }
  fmt::print("{} in all: {} kills, {} pieces, {} clears, {} failures\n", file.string(), sums["kills"],
             sums["pieces"], sums["clears"], sums["failures"]);
  std::fflush(stdout);
}

}  // namespace

namespace {

/// The first fault ends it.
int find_planted(const CellSoak& soak) {
  int kills = 0;
  for (std::uint32_t run = 0; kills < soak.kills; ++run) {
    CellRunOfSoak world(soak, run);
    const std::string wrong = world.go(soak.kills - kills);
    kills += world.kills();
    if (wrong.empty()) continue;
    fmt::print("{}: found after {} kills: world {}: {}\n", soak.planted, kills, run, wrong);
    return 0;
  }
  fmt::print("{}: NOT found in {} kills\n", soak.planted, kills);
  return 1;
}

}  // namespace

int run_cells(const CellSoak& soak) {
  fmt::print("{} kills, --from {}\n", soak.kills, soak.seed);
  if (!soak.planted.empty()) return find_planted(soak);
  int kills = 0;
  int failures = 0;
  int clears = 0;
  int worlds = 0;
  double longest_s = 0;
  for (std::uint32_t run = 0; kills < soak.kills && failures < kMostFailures; ++run) {
    CellRunOfSoak world(soak, run);
    const std::string wrong = world.go(soak.kills - kills);
    if (!wrong.empty()) fmt::print("FAULT world {}: {}\n", run, wrong);
    failures += wrong.empty() ? 0 : 1;
    kills += world.kills();
    clears += world.clears();
    ++worlds;
    longest_s = std::max(longest_s, world.longest_back_s());
    add_to_results(soak.results, {{"seed", soak.seed},
                                  {"world", run},
                                  {"kills", world.kills()},
                                  {"pieces", wrong.empty() ? soak.pieces : 0},
                                  {"clears", world.clears()},
                                  {"failures", wrong.empty() ? 0 : 1}});
  }
  fmt::print("{} kills in {} worlds of {} pieces, {} clears by a person, at most {:.1f} s to the work\n{}\n",
             kills, worlds, soak.pieces, clears, longest_s, failures == 0 ? "passed" : "FAILED");
  return failures == 0 ? 0 : 1;
}

}  // namespace corbot::soak
