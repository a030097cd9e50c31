// SPDX-License-Identifier: Apache-2.0
#include "corbot/channel/wake.h"

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <string>
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

/// Is this thread of ours asleep in the kernel? The third field of its stat file, after "(name)".
bool asleep(pid_t thread) {
  std::ifstream file("/proc/self/task/" + std::to_string(thread) + "/stat");
  std::string text;
  std::getline(file, text);
  const auto after = text.rfind(')');
  return after != std::string::npos && text.size() > after + 2 && text[after + 2] == 'S';
}

TEST(Wake, EndsAWaitThatWouldTakeAMinute) {
  std::atomic<std::uint32_t> word{0};
  std::atomic<pid_t> thread{0};
  std::uint64_t published = 0;  // what the wake-up announces: plain, so that TSan checks the order
  const auto begin = std::chrono::steady_clock::now();
  std::thread waiter([&] {
    thread.store(static_cast<pid_t>(::syscall(SYS_gettid)));
    while (!wait_change(word, 0, 60'000'000'000)) {
    }
    EXPECT_EQ(published, 42u);
  });
  while (thread.load() == 0 || !asleep(thread.load())) std::this_thread::yield();
  published = 42;
  wake_one(word);
  waiter.join();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(50))
      << "woken by the timeout, not by wake_one";
}

}  // namespace
}  // namespace corbot
