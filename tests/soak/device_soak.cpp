// SPDX-License-Identifier: Apache-2.0
#include "soak/device_soak.h"

#include <fmt/format.h>

#include <algorithm>
#include <list>
#include <map>

#include "config/load_profile.h"
#include "corbot/units.h"
#include "soak/device_checks.h"
#include "soak/device_faults.h"
#include "soak/device_rig.h"
#include "soak/gpio_soak.h"
#include "soak/stall_watch.h"

namespace corbot::soak {
namespace {

namespace fs = std::filesystem;

constexpr DeviceKind kKinds[] = {DeviceKind::kSsc32, DeviceKind::kMaestro, DeviceKind::kCia402};
constexpr std::size_t kTogether = 2;
constexpr double kBack_s = 60.0;   // from the end of what was broken, with Clears, to a robot that is ready
constexpr double kPaused_s = 5.0;  // longer than any client pauses it
constexpr double kMoves_s = 40.0;  // from there to the next motion

/// One robot with one device.
class DeviceSoak {
 public:
  DeviceSoak(DeviceKind kind, std::uint64_t seed, bool verbose, const StageOptions& options,
             const std::string& device_directory)
      : seed_(seed + static_cast<std::uint64_t>(kind)),
        verbose_(verbose),
        rig_(kind, options.binaries + "/corbot-sim", device_directory, options.profile),
        profile_(load_profile(rig_.profile())),
        stage_(with_device(options), profile_, seed_) {}

  /// False when the robot did not come back, or does not move any more.
  bool run(int faults) {
    rig_.start();
    stage_.mend();
    if (!stage_.recover()) return false;
    for (int i = 0; i < faults && back_;) i += step();
    return back_ && reaches_an_end();
  }
  /// Ends the robot and the device. Returns a list of their remains; empty: none.
  std::string take_down() {
    stage_.go_on();
    std::string left = stage_.take_down();
    if (const int code = rig_.stop(); code != 0) left += fmt::format("corbot-sim ended with code {}\n", code);
    return left;
  }
  /// Returns the stalls of the machine, and those of the emulator alone while other programs had its
  /// processor.
  [[nodiscard]] std::vector<Interval> stalls() const {
    std::vector<Interval> all = watch_.stalls();
    all.insert(all.end(), rig_.late().begin(), rig_.late().end());
    return all;
  }
  [[nodiscard]] Verdict verdict() const {
    std::vector<Break> breaks(faults_.begin(), faults_.end());
    const Evidence base{profile_, stage_.ledger(), stage_.recording(), std::move(breaks),
                        stalls(), stage_.clears(), stage_.restarts()};
    const DeviceLog log = rig_.log(profile_.arm);
    DeviceEvidence evidence{base, log, track_, faults_, profile_.stop.ramp_s, {}};
    for (const FollowingLimits& limits : profile_.following)
      evidence.goal_deg.push_back(to_degrees(limits.goal_q));
    Verdict found = judge_devices(evidence);
    fmt::print("  {} set-points, {} states of the device, {} motions, {} to their end, {} times in Error\n",
               track_.ticks().size(), log.size(), found.motions, found.whole_motions,
               episodes(track_).size());
    for (const auto& [what, count] : counts_) fmt::print("{:6} {}\n", count, what);
    for (const auto& [cause, count] : found.clears) fmt::print("{:6} cleared: {}\n", count, cause);
    return found;
  }

 private:
  StageOptions with_device(StageOptions options) {
    options.profile = rig_.profile();
    options.clients = 3;
    options.on_cycle = [this](const Cycle& cycle) {
      track_.add(cycle);
      rig_.look();
    };
    return options;
  }
  int between(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  double real(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  void idle(double seconds) {
    const std::int64_t end_ns = now_ns() + nanoseconds(seconds);
    while (now_ns() < end_ns) {
      stage_.observe();
      sleep_ns(5'000'000);
    }
  }
  /// Breaks one thing, or more at once. Its choices depend on the seed and on its number alone.
  int step() {
    std::seed_seq seeds{static_cast<std::uint32_t>(seed_), static_cast<std::uint32_t>(seed_ >> 32),
                        static_cast<std::uint32_t>(++steps_)};
    random_.seed(seeds);
    idle(real(0.05, 0.4));
    if (stage_.recording().is_in_error())
      (void)stage_.recover();  // a client has held the arm, or the machine stood still
    Troubles troubles(stage_, rig_, random_);
    std::vector<Trouble> all;
    all.push_back(between(0, 3) == 0 ? troubles.of_process() : troubles.of_device());
    if (between(0, 9) < 3) all.push_back(all[0].is_emulator ? troubles.of_process() : troubles.of_device());
    const double unasked_s = real(0.05, 1.2);  // in which nobody clears
    const bool is_quiet = between(0, 1) == 0;
    const std::string what = befall(all);
    idle(unasked_s);
    if (is_quiet) stage_.hold_clients();
    return_to_work(what, is_quiet);
    return static_cast<int>(all.size());
  }
  /// Whatever came between: at the end it carries out what it is asked for.
  bool reaches_an_end() {
    const std::int64_t begin_ns = now_ns();
    while (stage_.quiesce() && stage_.recover()) {
      if (stage_.drive_by_command(0, track_.ticks().back().theta_deg[0] < 0.0f)) return true;
      const Interval time{begin_ns, now_ns()};
      if (seconds(time.begin_ns, time.end_ns) - covered_s(watch_.stalls(), time) > kBack_s) break;
    }
    fmt::print("FAULT at the end: no motion reaches its end\n");
    return false;
  }
  std::string befall(std::vector<Trouble>& all) {
    std::string what;
    double lasts_s = 0.0;
    for (Trouble& trouble : all) {
      trouble.fault.begin_ns = now_ns();
      trouble.begin();
      what += (what.empty() ? "" : " + ") + trouble.fault.what;
      lasts_s = std::max(lasts_s, trouble.lasts_s);
      ++counts_[trouble.fault.what];
    }
    if (verbose_) fmt::print("{} step {}: {}\n", now_ns(), steps_, what);
    std::fflush(stdout);
    idle(lasts_s);
    for (Trouble& trouble : all) {
      // If two things are broken, the one that the robot sees first is unknown.
      if (all.size() > 1) trouble.fault.name.clear();
      const bool is_disturbed = all.size() > 1;
      if (is_disturbed) trouble.fault.error_within_s = 0.0;
      if (trouble.undo) trouble.undo();
      trouble.fault.end_ns = now_ns();
      faults_.push_back(trouble.fault);
    }
    return what;
  }
  void return_to_work(const std::string& what, bool is_quiet) {
    const std::int64_t undone_ns = now_ns();
    // Time that the machine gave to other programs does not count.
    const auto took_s = [&] {
      const Interval time{undone_ns, now_ns()};
      return seconds(time.begin_ns, time.end_ns) - covered_s(watch_.stalls(), time);
    };
    do {
      back_ = stage_.recover();
    } while (!back_ && took_s() < kBack_s);
    if (!back_ || took_s() > kBack_s) {
      fmt::print("FAULT step {}: the robot was not back within {:.0f} s after: {}\n", steps_, took_s(), what);
      back_ = false;
      return;
    }
    if (is_quiet) {
      idle(0.3);
      // A small motion verifies the position; what comes then is fast.
      if (!track_.ticks().empty() && track_.ticks().back().is_unverified)
        (void)stage_.drive_by_command(0, track_.ticks().back().theta_deg[0] < 0.0f);
    }
    stage_.go_on();
    const std::int64_t back_ns = now_ns();
    if (verbose_) fmt::print("{} back after {:.1f} s\n", back_ns, took_s());
    while (!has_moved_since(back_ns)) {
      idle(0.02);
      if (stage_.recording().is_in_error()) return;  // judged, and cleared by the next step
      const Interval time{back_ns, now_ns()};
      const double waited_s = seconds(time.begin_ns, time.end_ns) - covered_s(watch_.stalls(), time);
      // A client whose Resume came in an Error does not ask again, and all others wait for their motions.
      if (waited_s > kPaused_s && stage_.recording().is_paused()) (void)stage_.resume();
      if (waited_s < kMoves_s) continue;
      fmt::print("FAULT step {}: nothing moves within {:.0f} s after: {}\n", steps_, kMoves_s, what);
      back_ = false;
      return;
    }
  }
  [[nodiscard]] bool has_moved_since(std::int64_t time_ns) const {
    const auto& moving = stage_.recording().moving();
    return !moving.empty() && moving.back().end_ns > time_ns;
  }

  const std::uint64_t seed_;
  const bool verbose_;
  const StallWatch watch_;
  DeviceRig rig_;
  const Profile profile_;
  Track track_;
  Stage stage_;
  int steps_{0};
  std::mt19937_64 random_;
  bool back_{true};
  std::vector<DeviceFault> faults_;
  std::map<std::string, int> counts_;
};

bool run_one(DeviceKind kind, int faults, std::uint64_t seed, bool verbose, const StageOptions& options) {
  constexpr std::size_t kShown = 25;
  fmt::print("{}: {} faults\n", to_string(kind), faults);
  std::fflush(stdout);
  const std::int64_t begin_ns = now_ns();
  StageOptions own = options;
  own.scratch = options.scratch + "/" + to_string(kind);
  // The device is not what the robot leaves behind.
  const std::string device_directory = options.scratch + "/device-" + to_string(kind);
  fs::create_directory(own.scratch);
  fs::create_directory(device_directory);
  DeviceSoak soak(kind, seed, verbose, own, device_directory);
  const bool is_good = soak.run(faults);
  const std::string left = soak.take_down();
  const Verdict found = soak.verdict();
  for (std::size_t i = 0; i < std::min(kShown, found.faults.size()); ++i)
    fmt::print("FAULT {}\n", found.faults[i]);
  if (found.faults.size() > kShown) fmt::print("and {} more faults\n", found.faults.size() - kShown);
  if (!left.empty()) fmt::print("left behind:\n{}", left);
  fmt::print("  {:.1f} s; the machine stood still {} times\n", seconds(begin_ns, now_ns()),
             soak.stalls().size());
  std::fflush(stdout);
  return is_good && left.empty() && found.faults.empty() && found.whole_motions > 0;
}

}  // namespace

int run_devices(int faults, std::uint64_t seed, bool verbose, const std::string& only,
                const StageOptions& options) {
  bool is_good = false;
  if (only == "gpio") is_good = run_gpio(faults, seed, verbose);
  for (const DeviceKind kind : kKinds) {
    if (only == to_string(kind)) is_good = run_one(kind, faults, seed, verbose, options);
  }
  fmt::print("{}\n", is_good ? "passed" : "FAILED");
  return is_good ? 0 : 1;
}

int run_all_devices(int faults, std::uint64_t seed, bool verbose, const std::string& program,
                    const std::string& orb) {
  fmt::print("{} faults of devices, --seed {}, --orb {}\n", faults, seed, orb);
  std::fflush(stdout);
  std::vector<std::string> kinds{"gpio"};
  for (const DeviceKind kind : kKinds) kinds.emplace_back(to_string(kind));
  std::list<test::Process> running;
  bool is_good = true;
  int left = faults;
  while (!kinds.empty() || !running.empty()) {
    if (!kinds.empty() && running.size() < kTogether) {
      const int share = std::max(1, left / static_cast<int>(kinds.size()));
      left -= share;
      std::vector<std::string> words{program,      "--devices", std::to_string(share), "--device",
                                     kinds.back(), "--seed",    std::to_string(seed),  "--orb",
                                     orb};
      if (verbose) words.emplace_back("--verbose");
      running.emplace_back(words);
      kinds.pop_back();
    }
    running.remove_if([&](test::Process& process) {
      (void)process.output();  // else it would wait for its reader
      if (process.running()) return false;
      fmt::print("{}{}", process.output(), process.errors());
      std::fflush(stdout);
      is_good = process.wait(test::within(0)).value_or(-1) == 0 && is_good;
      return true;
    });
    sleep_ns(20'000'000);
  }
  fmt::print("{}\n", is_good ? "all passed" : "FAILED");
  return is_good ? 0 : 1;
}

}  // namespace corbot::soak
