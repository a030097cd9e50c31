// SPDX-License-Identifier: Apache-2.0
// Measures the time from a press of the emergency stop to the first set-point slower than planned, and until
// the power is off. The test runs whole processes, with a joint at some half of its speed each time. At some
// presses the servant or a cycle is frozen. CORBOT_PRESSES says how many presses there are. The times include
// the delay with which this program looks.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <vector>

#include "fault/stop_rig.h"
#include "support/traced_thread.h"

namespace corbot::test {
namespace {

enum class Frozen { kNothing, kServant, kCycle };

struct Pressed {
  std::optional<double> slower_ms;
  std::optional<double> off_ms;
};

class Press : public StopRig {
 protected:
  static constexpr double kMotion_s = 1.3;

  static int presses() {
    const std::string count = environment("CORBOT_PRESSES");
    return count.empty() ? 20 : std::max(10, static_cast<int>(std::strtol(count.c_str(), nullptr, 10)));
  }
  [[nodiscard]] Snapshot newest() const {
    Snapshot now{};
    EXPECT_TRUE(wait_until(within(30), [&] { return task_->task().snapshot.load(now); }));
    return now;
  }
  static Corbot::JointCoord base_at(double angle_deg) {
    Corbot::JointCoord target;
    target.length(4);
    for (CORBA::ULong i = 0; i < 4; ++i) target[i] = 0.0;
    target[0] = angle_deg;
    return target;
  }
  /// On its way as it was planned, far from its end.
  void set_in_motion() {
    ASSERT_TRUE(wait_until(within(300), [&] {
      settle();
      if (HasFatalFailure()) return true;
      const double at_deg = newest().position_q[0] * 180.0 / M_PI;
      try {
        // The first motion after a stop is slow, where the position is unverified.
        arm_->MoveJoints(base_at(at_deg > 0.0 ? at_deg - 3.0 : at_deg + 3.0), 0.0);
        (void)arm_->StartMoveJoints(base_at(at_deg > 0.0 ? -85.0 : 85.0), kMotion_s);
      } catch (const CORBA::Exception&) {
        return false;  // a gap that the machine has made
      }
      return wait_until(within(5), [&] {
        const Snapshot now = newest();
        return now.state == RtState::kMoving && now.virtual_rate == 1.0 && now.virtual_time_s > 0.35;
      });
    }));
  }
  Pressed press_once(Frozen frozen, bool has_power_line) {
    const Snapshot before = newest();
    std::optional<TracedThread> cycle;
    if (frozen == Frozen::kServant) freeze_servant();
    if (frozen == Frozen::kCycle) cycle.emplace(rt_->pid(), rt_->pid());
    Pressed result;
    const std::int64_t pressed_ns = now_ns();
    press(true);
    const bool is_done = wait_until_often([&] {
      Snapshot now{};
      const bool is_read = task_->task().snapshot.load(now) && now.cycle > before.cycle;
      const double after_ms = static_cast<double>(now_ns() - pressed_ns) * 1e-6;
      if (is_read && !result.slower_ms && now.virtual_rate < 1.0) result.slower_ms = after_ms;
      const bool is_off =
          has_power_line ? !is_high(kPowerLine) : is_read && (now.flags & kSnapshotPowerOff) != 0;
      if (is_off && !result.off_ms) result.off_ms = after_ms;
      return result.off_ms && (result.slower_ms || frozen == Frozen::kCycle);
    });
    EXPECT_TRUE(is_done) << "slower: " << result.slower_ms.value_or(-1)
                         << " off: " << result.off_ms.value_or(-1) << '\n'
                         << rt_->errors();
    cycle.reset();
    servant_->signal(SIGCONT);
    press(false);
    return result;
  }
  template <class Condition>
  static bool wait_until_often(Condition&& condition) {
    for (const Deadline deadline = within(30); !condition();) {
      if (std::chrono::steady_clock::now() > deadline) return false;
      const timespec pause{0, 50'000};
      ::nanosleep(&pause, nullptr);
    }
    return true;
  }
  static double at(std::vector<double> values, double share) {
    std::sort(values.begin(), values.end());
    const double index = share * static_cast<double>(values.size() - 1);
    return values.at(static_cast<std::size_t>(std::lround(index)));
  }
  static void print(const std::string& what, const std::vector<double>& values) {
    if (values.empty()) return;
    fmt::print("{:<52} {:5}  median {:8.2f}  p99 {:8.2f}  max {:8.2f} ms\n", what, values.size(),
               at(values, 0.5), at(values, 0.99), at(values, 1.0));
  }
  /// The robot is up.
  void measure(bool has_power_line, bool with_frozen_cycle) {
    task_ = std::make_unique<Observer>(Observer::of(name_));
    std::map<Frozen, std::vector<double>> slower_ms;
    std::map<Frozen, std::vector<double>> off_ms;
    const std::string off = has_power_line ? "power line off" : "kSnapshotPowerOff";
    const auto report = [&] {
      print("first slower set-point", slower_ms[Frozen::kNothing]);
      print("first slower set-point, servant frozen", slower_ms[Frozen::kServant]);
      print(off, off_ms[Frozen::kNothing]);
      print(off + ", servant frozen", off_ms[Frozen::kServant]);
      print(fmt::format("{}, cycle frozen ([stop] ramp_s = {})", off, kRamp_s), off_ms[Frozen::kCycle]);
      std::fflush(stdout);
    };
    for (int i = 0; i < presses(); ++i) {
      const Frozen frozen = i % 5 == 3                        ? Frozen::kServant
                            : i % 5 == 4 && with_frozen_cycle ? Frozen::kCycle
                                                              : Frozen::kNothing;
      set_in_motion();
      if (HasFatalFailure()) return;
      const Pressed result = press_once(frozen, has_power_line);
      if (HasFailure()) return;
      if (result.slower_ms && frozen != Frozen::kCycle) slower_ms[frozen].push_back(*result.slower_ms);
      off_ms[frozen].push_back(result.off_ms.value());
      if ((i + 1) % 100 == 0 && i + 1 < presses()) report();
    }
    report();
    for (const Frozen frozen : {Frozen::kNothing, Frozen::kServant}) {
      EXPECT_LT(at(slower_ms[frozen], 0.5), 300.0);
      EXPECT_LT(at(off_ms[frozen], 0.5), 1e3 * kRamp_s + 300.0);
    }
    if (!with_frozen_cycle) return;
    EXPECT_GE(at(off_ms[Frozen::kCycle], 0.0), 1e3 * kRamp_s) << "not before its time";
    EXPECT_LT(at(off_ms[Frozen::kCycle], 0.5), 1e3 * kRamp_s + 300.0);
  }

 private:
  std::unique_ptr<Observer> task_;
};

TEST_F(Press, OfADevicesInput) {
  begin(false, "");
  if (HasFatalFailure()) return;
  fmt::print("skipped: a frozen cycle: without a GPIO line the power is the device's own\n");
  measure(false, false);
}

TEST_F(Press, OfAGpioLine) {
  if (const std::string why = why_no_gpio(); !why.empty()) GTEST_SKIP() << why;
  if (const std::string why = why_not_traceable(); !why.empty()) GTEST_SKIP() << why;
  begin(true, stop_table() + table("power_enable", kPowerLine));
  if (HasFatalFailure()) return;
  ASSERT_TRUE(wait_until(within(30), [] { return is_high(kPowerLine); }));
  measure(true, true);
}

}  // namespace
}  // namespace corbot::test
