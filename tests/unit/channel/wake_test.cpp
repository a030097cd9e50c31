// SPDX-License-Identifier: Apache-2.0
#include "corbot/channel/wake.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

namespace corbot {
namespace {

TEST(Wake, ReturnsAtOnceWhenTheWordHasChanged) {
  std::atomic<std::uint32_t> word{3};
  EXPECT_TRUE(wait_change(word, 2, 3'600'000'000'000));
}

TEST(Wake, TimesOut) {
  const std::atomic<std::uint32_t> word{3};
  const auto begin = std::chrono::steady_clock::now();
  // A signal may end one wait early; the sum of the waits must still come to the time asked for.
  while (std::chrono::steady_clock::now() - begin < std::chrono::milliseconds(20)) {
    EXPECT_FALSE(wait_change(word, 3, 20'000'000));
  }
  EXPECT_FALSE(wait_change(word, 3, 0));
  EXPECT_FALSE(wait_change(word, 3, -1));
}

TEST(Wake, EndsAWaitThatWouldTakeAnHour) {
  std::atomic<std::uint32_t> word{0};
  std::uint64_t published = 0;  // what the wake-up announces: plain, so that TSan checks the order
  std::thread waiter([&] {
    while (!wait_change(word, 0, 3'600'000'000'000)) {
    }
    EXPECT_EQ(published, 42u);
  });
  published = 42;
  wake_all(word);
  waiter.join();
}

}  // namespace
}  // namespace corbot
