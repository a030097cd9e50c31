// SPDX-License-Identifier: Apache-2.0
#include "cell/coordinator/work_status.h"

#include <gtest/gtest.h>

#include <chrono>
#include <future>

namespace corbot::test {
namespace {

/// Coordinator.State reads the status, and a Stop waits for State.
TEST(WorkStatus, IsReadWhileTheDiskTakesAChange) {
  std::promise<void> disk;
  std::promise<void> waits;
  cell::WorkStatus status(
      "robot1", [](const std::string&) {},
      [&](const cell::ActivityChange&) {
        waits.set_value();
        disk.get_future().wait();
      });
  auto change = std::async(std::launch::async, [&] { status.set(Corbot::WorkMoving, ""); });
  waits.get_future().wait();
  auto read = std::async(std::launch::async, [&] { return status.get().state; });
  EXPECT_EQ(read.wait_for(std::chrono::seconds(1)), std::future_status::ready);
  disk.set_value();
  change.get();
  EXPECT_EQ(read.get(), Corbot::WorkMoving);
}

}  // namespace
}  // namespace corbot::test
