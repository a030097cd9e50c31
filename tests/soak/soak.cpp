// SPDX-License-Identifier: Apache-2.0
// Breaks a robot under `corbot up` at random, again and again, while clients move it. It kills, freezes and
// thaws client, servant, real-time task and supervisor, cuts connections or leaves them half open, and
// floods. Faults come alone and in pairs. It records every set-point and judges them afterwards (verdict.h).
// The seed repeats all decisions of this program and of its clients, not the instants of the threads.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <random>

#include "config/load_profile.h"
#include "soak/cell_row.h"
#include "soak/cell_soak.h"
#include "soak/device_soak.h"
#include "soak/kept.h"
#include "soak/stage.h"
#include "soak/stall_watch.h"
#include "soak/verdict.h"
#include "support/paths.h"

namespace corbot::soak {
namespace {

/// One thing broken: done at once, undone after a while.
struct Fault {
  std::string what;
  std::function<void()> undo;
  double lasts_s{0.0};
  int client{0};
};

class Soak {
 public:
  Soak(Stage& stage, std::uint64_t seed, bool verbose) : stage_(stage), seed_(seed), verbose_(verbose) {}

  /// False when the robot did not come back, or what can be seen only while it lives is wrong.
  bool run(int faults) {
    stage_.mend();
    if (!stage_.recover() || !look(false)) return false;
    for (int i = 0, looked = 0; i < faults;) {
      i += step();
      if (!back_) return false;
      if (i - looked < kFaultsBetweenLooks || i >= faults) continue;
      looked = i;
      good_ = look(false) && good_;
    }
    idle(1.0);  // what the last fault killed is dead by now, and is begun again
    return stage_.recover() && look(true) && good_;
  }

  [[nodiscard]] const std::vector<Break>& breaks() const { return breaks_; }
  [[nodiscard]] const std::map<std::string, int>& counts() const { return counts_; }

 private:
  static constexpr int kFaultsBetweenLooks = 100;
  static constexpr int kStepsBetweenGlances = 4;

  /// Breaks one thing, or two at once, and undoes it. Returns how many. Its choices depend on the seed and on
  /// its number alone.
  int step() {
    std::seed_seq seeds{static_cast<std::uint32_t>(seed_), static_cast<std::uint32_t>(seed_ >> 32),
                        static_cast<std::uint32_t>(++steps_)};
    random_.seed(seeds);
    const int stops = between(0, 9);
    const int breaks = between(1, 10) <= 3 ? 2 : 1;
    idle(real(0.05, 0.4));
    if (stage_.recording().is_in_error()) (void)stage_.recover();  // a client has held the arm
    if (stops < 2) stage_.stop_by_command();
    std::string what;
    std::vector<Fault> broken;
    for (int n = breaks; n > 0; --n) {
      const std::int64_t begin_ns = now_ns();
      broken.push_back(break_one());
      breaks_.push_back({{begin_ns, now_ns()}, broken.back().what, broken.back().client});
      what += (what.empty() ? "" : " + ") + broken.back().what;
      ++counts_[broken.back().what];
    }
    stage_.keep(fmt::format("# {} step {}: {}", now_ns(), steps_, what));
    if (verbose_) fmt::print("{:.1f} s, step {}: {}\n", seconds(start_ns_, now_ns()), steps_, what);
    std::fflush(stdout);
    if (stops == 2) stage_.stop_by_command();
    double lasts_s = 0.0;
    for (const Fault& fault : broken) lasts_s = std::max(lasts_s, fault.lasts_s);
    idle(lasts_s);
    for (std::size_t i = 0; i < broken.size(); ++i) {
      if (!broken[i].undo) continue;
      broken[i].undo();
      breaks_[breaks_.size() - broken.size() + i].end_ns = now_ns();
    }
    back_ = stage_.recover();
    if (!back_) fmt::print("the robot did not come back within a minute after: {}\n", what);
    if (back_ && steps_ % kStepsBetweenGlances == 0) glance();
    return breaks;
  }

  /// Checks what holds while clients go on: the robot knows all tickets, and no connection of clients is the
  /// task's or the supervisor's.
  void glance() {
    std::string found;
    for (const std::string& ticket : stage_.wrong_tickets(false)) found += ticket + "\n";
    found += stage_.check_rest({"task", "supervisor"});
    if (found.empty()) return;
    fmt::print("step {}: {}", steps_, found);
    good_ = false;
  }

  /// With every client between two calls.
  bool look(bool ended) {
    const std::int64_t begin_ns = now_ns();
    if (!stage_.quiesce()) {
      fmt::print("a caller has no answer\n");
      return false;
    }
    bool good = true;
    for (const std::string& ticket : stage_.wrong_tickets(ended)) {
      fmt::print("{}\n", ticket);
      good = false;
    }
    const std::string growth = stage_.check_rest({"servant", "task", "supervisor"});
    fmt::print("{}", growth);
    std::fflush(stdout);
    stage_.go_on();
    if (verbose_) fmt::print("looked at rest for {:.1f} s\n", seconds(begin_ns, now_ns()));
    return good && growth.empty();
  }

  int between(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  double real(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

  void idle(double seconds) {
    const std::int64_t end_ns = now_ns() + static_cast<std::int64_t>(seconds * 1e9);
    while (now_ns() < end_ns) {
      stage_.observe();
      sleep_ns(10'000'000);
    }
  }

  Fault kill_process(const std::string& what, pid_t pid) {
    if (pid > 0) ::kill(pid, SIGKILL);
    return {"kill " + what, {}, 0.0};
  }
  /// A quarter of them for less than counts as frozen.
  Fault freeze(const std::string& what, pid_t pid) {
    const double lasts_s = between(0, 3) == 0 ? real(0.006, 0.09) : real(0.09, 3.0);
    if (pid > 0) ::kill(pid, SIGSTOP);
    return {"freeze " + what,
            [pid] {
              if (pid > 0) ::kill(pid, SIGCONT);
            },
            lasts_s};
  }
  /// There may be no client if a supervisor was killed.
  Fault with_client(const std::function<Fault(pid_t)>& fault) {
    const double which = real(0.0, 1.0);
    if (stage_.clients() == 0) return fault(0);
    const auto index = static_cast<std::size_t>(which * static_cast<double>(stage_.clients()));
    Fault done = fault(stage_.client(index));
    done.client = stage_.client_number(index);
    return done;
  }

  Fault flood_with_connections() {
    std::vector<int> open;
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(stage_.port()));
    for (int i = 0; i < 400; ++i) {
      const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
      if (fd < 0) break;
      (void)::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address));
      open.push_back(fd);
    }
    return {"flood of connections",
            [open] {
              for (const int fd : open) ::close(fd);
            },
            real(0.2, 1.0)};
  }
  Fault flood_with_clients() {
    for (int i = 0; i < 12; ++i) stage_.add_client();
    return {"flood of clients",
            [this] {
              while (stage_.clients() > 4) {
                ::kill(stage_.client(stage_.clients() - 1), SIGKILL);
                stage_.observe();
                stage_.drop_last_client();
              }
            },
            real(0.5, 1.5)};
  }
  Fault half_open() {
    stage_.proxy().fall_silent();
    return {"half-open connections", [this] { stage_.proxy().cut(); }, real(0.1, 3.0)};
  }
  Fault cut() {
    stage_.proxy().cut();
    return {"cut connections", {}, 0.0};
  }

  Fault break_one() {
    switch (between(0, 11)) {
      case 0:
        return with_client([this](pid_t pid) { return kill_process("client", pid); });
      case 1:
        return kill_process("servant", stage_.servant());
      case 2:
        return kill_process("task", stage_.task());
      case 3:
        return kill_process("supervisor", stage_.supervisor());
      case 4:
        return with_client([this](pid_t pid) { return freeze("client", pid); });
      case 5:
        return freeze("servant", stage_.servant());
      case 6:
        return freeze("task", stage_.task());
      case 7:
        return freeze("supervisor", stage_.supervisor());
      case 8:
        return half_open();
      case 9:
        return flood_with_connections();
      case 10:
        return flood_with_clients();
      default:
        return cut();
    }
  }

  Stage& stage_;
  std::uint64_t seed_;
  const std::int64_t start_ns_{now_ns()};
  int steps_{0};
  std::mt19937_64 random_;
  bool verbose_;
  bool back_{true};
  bool good_{true};
  std::vector<Break> breaks_;
  std::map<std::string, int> counts_;
};

std::string outcomes(const Verdict::Answers& answers) {
  std::string text;
  for (const auto& [outcome, count] : answers.outcomes)
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", outcome, count);
  return text;
}

void print(const Evidence& evidence, const Verdict& verdict) {
  fmt::print(
      "calls, by kind: made, accepted, by clients killed before the answer; longest, and counted with its "
      "bound\n");
  for (const auto& [operation, a] : verdict.answers)
    fmt::print("  {:15} {:7} {:5}  {:8.3f} s  {:7.3f} of {:.3f} s; {}\n", operation, a.calls, a.unanswered,
               a.longest_s, a.longest_counted_s, a.bound_s, outcomes(a));
  fmt::print("{} motions, {} to their end:", verdict.motions, verdict.whole_motions);
  for (const auto& [kind, count] : verdict.motions_by_kind) fmt::print(" {} {};", count, kind);
  fmt::print("\n{} lines and arcs followed set-point by set-point\nstops confirmed:", verdict.paths);
  for (const auto& [kind, count] : verdict.stops) fmt::print(" {} {};", count, kind);
  fmt::print(" {} leases ran out undisturbed\n", verdict.expired);
  for (const auto& [cause, count] : verdict.clears) fmt::print("{:6} cleared: {}\n", count, cause);
  double stalled_s = 0.0;
  for (const Interval& stall : evidence.stalls) stalled_s += seconds(stall.begin_ns, stall.end_ns);
  fmt::print("{} set-points, {} interruptions of the recording; {} restarts of the task announced\n",
             evidence.recording.cycles(), evidence.recording.gaps(), evidence.restarts.size());
  fmt::print(
      "the machine stood still {} times, {:.1f} s; longest time without a cycle that nothing explains {:.3f} "
      "s\n",
      evidence.stalls.size(), stalled_s, verdict.longest_silence_s);
}

int report(const Evidence& evidence, bool good) {
  const Verdict verdict = judge(evidence);
  print(evidence, verdict);
  constexpr std::size_t kShown = 40;
  for (std::size_t i = 0; i < std::min(kShown, verdict.faults.size()); ++i)
    fmt::print("FAULT {}\n", verdict.faults[i]);
  if (verdict.faults.size() > kShown) fmt::print("and {} more faults\n", verdict.faults.size() - kShown);
  const bool passed = good && verdict.faults.empty() && verdict.whole_motions > 0;
  fmt::print("{}\n", passed ? "passed" : "FAILED");
  return passed ? 0 : 1;
}

int run(int faults, std::uint64_t seed, bool verbose, const StageOptions& options) {
  const Profile profile = load_profile(options.profile);
  fmt::print("{} faults, --seed {}, --orb {}\n", faults, seed, options.orb);
  std::fflush(stdout);
  const StallWatch watch;
  Stage stage(options, profile, seed);
  Soak soak(stage, seed, verbose);
  const bool good = soak.run(faults);
  const std::string left = stage.take_down();
  const Evidence evidence{profile,        stage.ledger(), stage.recording(), soak.breaks(),
                          watch.stalls(), stage.clears(), stage.restarts()};
  write_circumstances(evidence, [&](const std::string& line) { stage.keep(line); });
  for (const auto& [what, count] : soak.counts()) fmt::print("{:6} {}\n", count, what);
  fmt::print("{}\n", stage.rest_summary());
  if (!left.empty()) fmt::print("left behind:\n{}", left);
  return report(evidence, good && left.empty());
}

int judge_again(const std::string& file, const StageOptions& options) {
  const Profile profile = load_profile(options.profile);
  std::ifstream stream(file);
  if (!stream) throw std::runtime_error(file + " cannot be read");
  Kept kept(profile);
  kept.read(stream);
  return report({profile, kept.ledger, kept.recording, kept.breaks, kept.stalls, kept.clears, kept.restarts},
                true);
}

}  // namespace
}  // namespace corbot::soak

int main(int argc, char** argv) {
  CLI::App app{"Breaks a robot at random and judges every set-point and every answer", "soak"};
  int faults = 100;
  std::uint64_t seed = std::random_device{}();
  bool verbose = false;
  // Beside this program, so that a copy of a build can run while the next is made.
  const std::filesystem::path here = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  corbot::soak::StageOptions options{here.parent_path() / "bin", here / "soak_client", CORBOT_SHIPPED_PROFILE,
                                     "", "omniorb"};
  app.add_option("--faults", faults, "how many")->check(CLI::Range(1, 100'000))->capture_default_str();
  app.add_option("--seed", seed, "repeats the decisions of a run");
  app.add_option("--orb", options.orb)->check(CLI::IsMember({"omniorb", "orbit2"}))->capture_default_str();
  app.add_option("--profile", options.profile, "of the robot")->capture_default_str();
  app.add_option("--keep", options.kept, "keeps in this file what was broken, called and recorded");
  int devices = 0;
  std::string device;
  app.add_option("--devices", devices, "so many faults of emulated devices instead, see device_soak.h")
      ->check(CLI::Range(1, 100'000));
  app.add_option("--device", device, "with --devices: of this kind alone")
      ->check(CLI::IsMember({"ssc32", "maestro", "cia402", "gpio"}));
  corbot::soak::CellSoak cells{.programs = options.binaries, .results = here / "cell_soak.jsonl"};
  bool is_cell = false;
  app.add_flag("--cell", is_cell, "breaks a simulated cell instead, see cell_soak.h");
  app.add_option("--kills", cells.kills, "with --cell: how many")->check(CLI::Range(1, 100'000));
  app.add_option("--from", seed, "with --cell: the same as --seed");
  app.add_option("--pieces", cells.pieces, "with --cell: of a world")->check(CLI::Range(1, 12));
  int row = 0;
  CLI::Option* const in_a_row =
      app.add_option("--row", row,
                     "with --cell: so many pieces in a row, without a fault; the pace is of all but the last")
          ->check(CLI::Range(3, 100'000));
  app.add_option("--planted", cells.planted,
                 "with --cell: this fault is in the coordinator, and is to be found")
      ->check(CLI::IsMember({"late-intent", "held-unseen", "early-leave"}))
      ->excludes(in_a_row);
  app.add_option("--results", cells.results, "with --cell: the file to which each run adds its lines");
  std::string judged;
  app.add_option("--judge", judged, "runs nothing, and judges such a file");
  app.add_flag("--verbose", verbose, "say what is broken as it is");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  std::string scratch = here / "soak-XXXXXX";
  if (!is_cell && judged.empty() && (devices == 0 || !device.empty()))
    options.scratch = ::mkdtemp(scratch.data());
  ::signal(SIGPIPE, SIG_IGN);
  int status = 1;
  try {
    cells.seed = seed;
    cells.verbose = verbose;
    if (is_cell) return row > 0 ? corbot::soak::run_row(cells, row) : corbot::soak::run_cells(cells);
    if (devices > 0 && device.empty())
      return corbot::soak::run_all_devices(devices, seed, verbose, here / "run_soak", options.orb);
    status = devices > 0      ? corbot::soak::run_devices(devices, seed, verbose, device, options)
             : judged.empty() ? corbot::soak::run(faults, seed, verbose, options)
                              : corbot::soak::judge_again(judged, options);
  } catch (const std::exception& error) {
    fmt::print("FAILED: {}\n", error.what());
  }
  if (!options.scratch.empty()) std::filesystem::remove_all(options.scratch);
  return status;
}
