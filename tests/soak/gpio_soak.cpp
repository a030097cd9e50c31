// SPDX-License-Identifier: Apache-2.0
#include "soak/gpio_soak.h"

#include <fmt/format.h>

#include <atomic>
#include <map>
#include <mutex>
#include <random>
#include <thread>

#include "rt/inputs/safety_lines.h"
#include "soak/evidence.h"
#include "soak/stall_watch.h"
#include "soak/tick_limits.h"
#include "support/fake_gpio.h"
#include "unit/rt/rig.h"

namespace corbot::soak {
namespace {

constexpr double kRamp_s = 1.0;
constexpr double kLineBack_s = 20.0;

/// The cycle, stepped by a thread of its own as the loop does it, over the simulator; it always has a motion
/// to run.
class RunningCycle {
 public:
  explicit RunningCycle(std::uint64_t seed) : random_(seed) { rig_.step(); }
  ~RunningCycle() { end(); }

  void begin() {
    thread_ = std::thread([this] { run(); });
  }
  void end() {
    end_ = true;
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] EmergencyStop& stop() { return *rig_.emergency_stop; }
  void freeze(bool is_frozen) { is_frozen_ = is_frozen; }
  void clear() { ++clears_wanted_; }
  [[nodiscard]] bool is_in_error() const { return is_in_error_; }
  [[nodiscard]] std::uint64_t motions() const { return motions_; }
  /// As rt/main.cpp shows it to the lines.
  [[nodiscard]] rt::CycleView view() const {
    Snapshot snapshot{};
    rt::CycleView seen{.in_error = true, .is_known = false};
    if (!rig_.task->snapshot.load(snapshot)) return seen;
    seen.cycle = snapshot.cycle;
    seen.in_error = snapshot.state == RtState::kError;
    seen.power_off = (snapshot.flags & kSnapshotPowerOff) != 0;
    seen.fault_stop = (snapshot.flags & kSnapshotFaultStop) != 0;
    seen.is_known = true;
    return seen;
  }
  [[nodiscard]] std::vector<std::string> faults() const { return faults_; }

 private:
  void run() {
    std::int64_t due_ns = now_ns();
    while (!end_) {
      due_ns = std::max(due_ns + rig_.arm.period_ns, now_ns() - rig_.arm.period_ns);
      if (const std::int64_t left_ns = due_ns - now_ns(); left_ns > 0) sleep_ns(left_ns);
      if (is_frozen_) continue;
      rig_.now_ns = now_ns() - rig_.arm.period_ns;  // step() adds a period
      step();
    }
  }
  void step() {
    for (; clears_done_ < clears_wanted_; ++clears_done_) rig_.clear();
    const bool is_idle = rig_.snapshot.state == RtState::kStandby && rig_.snapshot.command_id == 0;
    if (is_idle && rig_.queued() == 0) {
      Joints to{};
      for (std::size_t i = 0; i < 4; ++i) to[i] = std::uniform_real_distribution<double>(0.0, 1.0)(random_);
      if (rig_.submit(rig_.planner.move_joints(rig_.start(), {}, to, 0.0)) != 0) ++motions_;
    }
    const std::int64_t before_ns = rig_.snapshot.time_ns;
    rig_.step();
    while (rig_.completion()) {
    }
    while (rig_.alarm()) {
    }
    is_in_error_ = rig_.snapshot.state == RtState::kError;
    judge(before_ns);
  }
  /// Joints' limits at every set-point, the stop's ramp with them.
  void judge(std::int64_t before_ns) {
    constexpr std::int64_t kGapPeriods = 5;
    const bool is_free = (rig_.snapshot.flags & kSnapshotPowerOff) != 0;
    std::array<double, 4> theta_deg{};
    for (std::size_t i = 0; i < 4; ++i) theta_deg[i] = rig_.snapshot.position_q[i] * 180.0 / M_PI;
    const bool was_gap = rig_.snapshot.time_ns - before_ns > kGapPeriods * rig_.arm.period_ns;
    if (is_free || was_gap) {
      limits_.rest(theta_deg, rig_.snapshot.tool.position_m);
      return;
    }
    limits_.add(theta_deg, rig_.snapshot.tool.position_m);
    Peaks peaks;
    limits_.measure(rig_.snapshot.cycle, peaks);
    if (const std::string fault = limits_.joint_fault(peaks); !fault.empty() && faults_.size() < 20)
      faults_.push_back(fault);
  }

  test::Rig rig_;
  std::mt19937_64 random_;
  TickLimits limits_{rig_.arm};
  std::thread thread_;
  std::atomic<bool> end_{false};
  std::atomic<bool> is_frozen_{false};
  std::atomic<bool> is_in_error_{false};
  std::atomic<int> clears_wanted_{0};
  int clears_done_{0};
  std::atomic<std::uint64_t> motions_{0};
  std::vector<std::string> faults_;  ///< read when the thread has ended
};

class GpioSoak {
 public:
  GpioSoak(std::uint64_t seed, bool verbose)
      : seed_(seed),
        verbose_(verbose),
        cycle_(seed),
        lines_(settings(), board(), cycle_.stop(), [this] { return cycle_.view(); }) {}

  bool run(int faults) {
    lines_.start();
    lines_.allow_power();
    cycle_.begin();
    if (!clear()) return false;
    for (int i = 0; i < faults; ++i) {
      if (!step(i)) return false;
    }
    return true;
  }
  std::vector<std::string> verdict() {
    cycle_.end();
    events_.end_ns = now_ns();
    lines_.stop();
    events_.stalls = watch_.stalls();
    for (const auto& change : power_.changes()) events_.power.push_back({change.time_ns, change.values != 0});
    std::vector<std::string> faults = judge_power(events_, kRamp_s);
    const std::vector<std::string> limits = cycle_.faults();
    faults.insert(faults.end(), limits.begin(), limits.end());
    fmt::print("  {} motions, {} stops, {} switchings of the power, {} Clears\n", cycle_.motions(),
               events_.stops.size(), events_.power.size(), events_.clears.size());
    for (const auto& [what, count] : counts_) fmt::print("{:6} {}\n", count, what);
    return faults;
  }

 private:
  static rt::SafetySettings settings() {
    rt::SafetySettings settings;
    settings.stop = rt::GpioRequest{.chip = "stop", .lines = {"ESTOP"}};
    settings.power = rt::GpioRequest{.chip = "power", .lines = {"SERVO_POWER"}};
    settings.ramp_ns = nanoseconds(kRamp_s);
    return settings;
  }
  std::unique_ptr<rt::GpioChips> board() {
    return std::make_unique<test::FakeBoard>(
        std::map<std::string, test::FakeGpio*>{{"stop", &stop_}, {"power", &power_}});
  }
  int between(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  double real(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

  /// A person clears until the robot is well: what is in the way passes.
  bool clear() {
    const std::int64_t end_ns = now_ns() + nanoseconds(kLineBack_s);
    const std::uint64_t before = cycle_.motions();
    while (cycle_.is_in_error() || cycle_.motions() == before) {
      if (now_ns() > end_ns) return false;
      if (cycle_.is_in_error()) {
        events_.clears.push_back(now_ns());
        cycle_.clear();
      }
      sleep_ns(20'000'000);
    }
    return true;
  }
  bool step(int number) {
    std::seed_seq seeds{static_cast<std::uint32_t>(seed_), static_cast<std::uint32_t>(number)};
    random_.seed(seeds);
    sleep_ns(nanoseconds(real(0.02, 0.4)));
    const char* what = befall();
    ++counts_[what];
    if (verbose_) fmt::print("{} step {}: {}\n", now_ns(), number + 1, what);
    sleep_ns(nanoseconds(real(0.02, 0.3)));  // nobody clears
    if (clear()) return true;
    fmt::print("FAULT step {}: not back within {} s after: {}\n", number + 1, kLineBack_s, what);
    return false;
  }
  const char* befall() {
    const Interval begun{now_ns(), 0};
    const double lasts_s = between(0, 3) == 0 ? real(1.1, 1.5) : real(0.005, 0.4);
    const auto over = [&](std::vector<Interval>& of) { of.push_back({begun.begin_ns, now_ns()}); };
    switch (between(0, 5)) {
      case 0:
        stop_.press(true);
        sleep_ns(nanoseconds(lasts_s));
        stop_.press(false);
        over(events_.stops);
        return "press";
      case 1:
        stop_.tap();
        over(events_.stops);
        return "tap";
      case 2:
        cycle_.freeze(true);
        sleep_ns(nanoseconds(real(0.0, 0.05)));
        events_.stops.push_back({now_ns(), now_ns()});
        stop_.press(true);
        sleep_ns(nanoseconds(lasts_s + 1.0));
        stop_.press(false);
        cycle_.freeze(false);
        return "press in a frozen cycle";
      case 3:
        stop_.unplug();
        sleep_ns(nanoseconds(lasts_s));
        stop_.plug();
        over(events_.stops);
        return "chip of the input away";
      case 4:
        power_.unplug();
        sleep_ns(nanoseconds(lasts_s));
        power_.plug();
        sleep_ns(nanoseconds(0.3));  // requested again, and off
        over(events_.power_gone);
        return "chip of the switch away";
      default:
        cycle_.freeze(true);
        sleep_ns(nanoseconds(lasts_s));
        cycle_.freeze(false);
        return "frozen cycle";
    }
  }

  const std::uint64_t seed_;
  const bool verbose_;
  std::mt19937_64 random_;
  const StallWatch watch_;
  test::FakeGpio stop_;
  test::FakeGpio power_;
  RunningCycle cycle_;
  rt::SafetyLines lines_;
  GpioEvents events_;
  std::map<std::string, int> counts_;
};

}  // namespace

bool run_gpio(int faults, std::uint64_t seed, bool verbose) {
  fmt::print("gpio: {} faults, on emulated lines\n", faults);
  std::fflush(stdout);
  const std::int64_t begin_ns = now_ns();
  GpioSoak soak(seed, verbose);
  const bool is_good = soak.run(faults);
  const std::vector<std::string> found = soak.verdict();
  for (const std::string& fault : found) fmt::print("FAULT {}\n", fault);
  fmt::print("  {:.1f} s\n", seconds(begin_ns, now_ns()));
  std::fflush(stdout);
  return is_good && found.empty();
}

}  // namespace corbot::soak
