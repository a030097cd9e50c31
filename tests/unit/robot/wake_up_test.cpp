// SPDX-License-Identifier: Apache-2.0
// The loop wakes one thread, however many wait at the robot.
#include <linux/futex.h>
#include <sys/syscall.h>

#include <climits>

#include "robot/task_fixture.h"

namespace corbot::test::wake_up_test {
namespace {

constexpr int kWaiting = 200;

/// Threads that the kernel has asleep on the segment's futex word.
long wake_everyone(TaskSegment& layout) {
  return ::syscall(SYS_futex, &layout.wake, FUTEX_WAKE, INT_MAX, nullptr, nullptr, 0);
}

TEST_F(TaskTest, OneThreadIsAsleepOnTheFutexWhateverWaits) {
  FakeTask task(name_, profile_.arm);
  task.run();
  open_robot();
  std::vector<std::thread> callers;
  for (int i = 0; i < kWaiting; ++i) callers.emplace_back([&] { robot_->stop(); });
  ASSERT_TRUE(wait_until(within(60), [&] { return task.stop_count() == kWaiting; }));
  for (int i = 0; i < 100; ++i) {
    EXPECT_LE(wake_everyone(task.task()), 1);
    const timespec pause{0, 1'000'000};
    ::nanosleep(&pause, nullptr);
  }
  task.change([](Snapshot& now) { now.stops_done = kWaiting; });
  for (std::thread& caller : callers) caller.join();
  robot_.reset();
}

/// The futex word counts the wake-ups that the loop has made.
TEST_F(TaskTest, TheLoopWakesAsOftenForTwoHundredAsForOne) {
  LoopTask task(name_, profile_.arm);
  open_robot();
  const auto wakes_of_a_motion = [&](int waiting) {
    const std::uint32_t before = task.task().wake.load();
    const Outcome outcome = try_accept(DriveRequest{0, 0.2, 0.5});
    EXPECT_EQ(outcome.status, CORBOT_OK) << outcome.text;
    std::vector<std::thread> callers;
    for (int i = 0; i < waiting; ++i) {
      callers.emplace_back([&] { EXPECT_EQ(robot_->wait(outcome.ticket, 60.0).state, CORBOT_MOTION_DONE); });
    }
    for (std::thread& caller : callers) caller.join();
    return task.task().wake.load() - before;
  };
  const std::uint32_t one = wakes_of_a_motion(1);
  EXPECT_GT(one, 0u);
  // An alarm for missed periods, on a loaded machine, is one wake-up more, once a minute.
  EXPECT_LE(wakes_of_a_motion(kWaiting), one + 1);
  robot_.reset();
}

}  // namespace
}  // namespace corbot::test::wake_up_test
