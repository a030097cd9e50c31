// SPDX-License-Identifier: Apache-2.0
// Kills the real-time task of an arm on a serial controller with SIGKILL, in mid-motion, again and again.
// Each new task takes its time to reach the device. Every motion that was accepted before or meanwhile ends,
// and its caller gets an answer.
#include <signal.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <map>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include <fmt/core.h>

#include "config/load_profile.h"
#include "fault/jump_watch.h"
#include "support/cases.h"
#include "support/serial_robot.h"

namespace corbot::test {
namespace {

constexpr double kSpeed_deg_s = 10.0;

class DeviceRestart : public SerialRobot {
 protected:
  void SetUp() override {
    plug_in({"ssc32"}, "ssc32");
    if (HasFatalFailure()) return;
    start();
    if (HasFatalFailure()) return;
    ASSERT_TRUE(wait_for(Corbot::Standby)) << rt_->errors();
    watch_ = std::make_unique<JumpWatch>(name_, load_profile(profile_).arm);
  }
  void TearDown() override {
    watch_.reset();
    SerialRobot::TearDown();
  }
  [[nodiscard]] double joint_deg(CORBA::ULong joint) const {
    Corbot::JointCoord_var joints = arm_->ArtiCoord();
    return joints[joint];
  }
  [[nodiscard]] Corbot::MotionState state_of(Corbot::Ticket ticket) const {
    Corbot::MotionInfo_var info = arm_->Progress(ticket);
    return info->state;
  }
  /// Waits for it.
  [[nodiscard]] Corbot::MotionState end_of(Corbot::Ticket ticket) const {
    Corbot::MotionInfo_var info = arm_->Wait(ticket, 60.0);
    return info->state;
  }
  /// By how much a pulse went further between two rows of the emulator's record than the motions may in that
  /// time, or in two frames of the servos.
  [[nodiscard]] double worst_step_us() const {
    constexpr double kFrames_s = 0.04;
    constexpr double kMost_us_s = 10.0 * kSpeed_deg_s * 4.0;  // of 10 us a degree; an approach is no faster
    std::map<std::uint32_t, DeviceRow> last;
    double worst = -HUGE_VAL;
    for (const DeviceRow& row : controller_->rows()) {
      const auto before = last.find(row.channel);
      // The first pulse of a servo is no step.
      if (before != last.end() && before->second.has_power && row.has_power) {
        const double seconds = static_cast<double>(row.time_ns - before->second.time_ns) * 1e-9;
        worst =
            std::max(worst, std::abs(row.given - before->second.given) - kMost_us_s * (seconds + kFrames_s));
      }
      last[row.channel] = row;
    }
    return worst;
  }

  std::unique_ptr<JumpWatch> watch_;
};

TEST_F(DeviceRestart, EveryAcceptedMotionEndsAndNoneNeedsAClear) {
  std::mt19937_64 random(test::drawn_seed());
  const char* const count = std::getenv("CORBOT_KILLS");
  const int kills = count != nullptr ? std::atoi(count) : 5;
  std::size_t accepted_meanwhile = 0;
  for (int round = 0; round < kills; ++round) {
    SCOPED_TRACE(fmt::format("round {}", round));
    const double by_deg = joint_deg(0) > 0.0 ? -40.0 : 40.0;
    const Corbot::Ticket running = arm_->StartDrive(0, by_deg, kSpeed_deg_s);
    const Corbot::Ticket queued = arm_->StartDrive(1, joint_deg(1) > 20.0 ? -5.0 : 5.0, kSpeed_deg_s);
    std::string called;
    std::atomic<bool> has_called{false};
    std::thread caller([&] {
      called = raised_by([&] { arm_->Drive(2, joint_deg(2) > 20.0 ? -5.0 : 5.0, kSpeed_deg_s); });
      has_called = true;
    });
    Corbot::MotionState waited = Corbot::MotionRunning;
    std::thread waiter([&] { waited = end_of(queued); });
    EXPECT_TRUE(wait_until(within(30), [&] {
      return state_of(running) == Corbot::MotionRunning &&
             raised_by([&] { (void)state_of(queued + 1); }).empty();
    }));
    const timespec pause{0, std::uniform_int_distribution<long>(0, 150'000'000)(random)};
    ::nanosleep(&pause, nullptr);
    rt_->signal(SIGKILL);
    EXPECT_TRUE(rt_->wait(within(30)));
    // While the next one approaches the device.
    std::atomic<bool> runs{false};
    std::vector<Corbot::Ticket> meanwhile;
    std::thread calls([&] {
      while (!runs) {
        (void)raised_by([&] { meanwhile.push_back(arm_->StartDelay(0.01)); });
        (void)arm_->Status();
      }
    });
    start_rt();
    runs = true;
    calls.join();
    caller.join();
    waiter.join();
    if (HasFatalFailure()) return;
    EXPECT_EQ(called, "NotReady");
    EXPECT_EQ(waited, Corbot::MotionFailed);
    EXPECT_EQ(end_of(running), Corbot::MotionFailed);
    for (const Corbot::Ticket ticket : meanwhile) {
      const Corbot::MotionState end = end_of(ticket);
      EXPECT_TRUE(end == Corbot::MotionDone || end == Corbot::MotionFailed) << ticket << " is " << end;
    }
    accepted_meanwhile += meanwhile.size();
    EXPECT_TRUE(wait_for(Corbot::Standby)) << "the device held the arm: nobody's Clear is needed";
    for (const Corbot::AlarmInfo& alarm : alarms())
      EXPECT_FALSE(alarm.active) << alarm.code << " " << alarm.text;
    const double before_deg = joint_deg(3);
    const double further_deg = before_deg > 0.0 ? -1.0 : 1.0;
    EXPECT_EQ(raised_by([&] { arm_->Drive(3, further_deg, kSpeed_deg_s); }), "");
    EXPECT_NEAR(joint_deg(3), before_deg + further_deg, 1e-6);
    if (HasFailure()) break;
  }
  fmt::print("{} motions accepted between the tasks\n", accepted_meanwhile);
  watch_->finish();
  EXPECT_GT(watch_->moving_cycles(), 0u);
  EXPECT_EQ(watch_->jumps(), 0) << watch_->first_jump();
  EXPECT_TRUE(std::isfinite(worst_step_us()));
  EXPECT_LE(worst_step_us(), 0.0);
}

}  // namespace
}  // namespace corbot::test
