// SPDX-License-Identifier: Apache-2.0
#include "client/stop_on_signal.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <latch>
#include <utility>

#include "client/failure.h"

namespace corbot::client {
namespace {

/// OnSignal blocks the signals for the thread that has it. The tests restore the thread's mask. They may run
/// under nohup.
class OnSignalTest : public testing::Test {
 protected:
  OnSignalTest() : hang_up_(::signal(SIGHUP, SIG_DFL)) { pthread_sigmask(SIG_BLOCK, nullptr, &mask_); }
  ~OnSignalTest() override {
    pthread_sigmask(SIG_SETMASK, &mask_, nullptr);
    ::signal(SIGHUP, hang_up_);
  }

 private:
  sighandler_t hang_up_;
  sigset_t mask_{};
};

TEST_F(OnSignalTest, ActsOnceOnTheFirstAndNamesIt) {
  for (const auto& [signal, name] : {std::pair{SIGINT, "Ctrl-C"}, std::pair{SIGTERM, "SIGTERM"},
                                     std::pair{SIGHUP, "the end of the terminal (SIGHUP)"}}) {
    std::atomic<int> acts{0};
    const OnSignal on_signal([&] { ++acts; });
    EXPECT_FALSE(on_signal.wait(0));
    ::kill(::getpid(), signal);
    EXPECT_TRUE(on_signal.wait(20));
    on_signal.join();
    EXPECT_EQ(acts, 1);
    EXPECT_EQ(on_signal.describe(), name);
  }
}

TEST_F(OnSignalTest, UnderNohupAHangUpIsNone) {
  ::signal(SIGHUP, SIG_IGN);
  const OnSignal on_signal([] {});
  ::kill(::getpid(), SIGHUP);
  ::kill(::getpid(), SIGINT);
  EXPECT_TRUE(on_signal.wait(20));
  EXPECT_EQ(on_signal.describe(), "Ctrl-C");
}

TEST_F(OnSignalTest, WithoutASignalItNeverActs) {
  std::atomic<int> acts{0};
  {
    const OnSignal on_signal([&] { ++acts; });
  }
  EXPECT_EQ(acts, 0);
}

/// As if the action could not reach a robot that does not answer.
TEST_F(OnSignalTest, TheSecondEndsTheProgramThoughTheActionHangs) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto hang = [] {
    std::latch began(1), never(1);
    const OnSignal on_signal([&] {
      began.count_down();
      never.wait();
    });
    ::kill(::getpid(), SIGINT);
    began.wait();
    ::kill(::getpid(), SIGINT);
    ::sleep(20);
  };
  EXPECT_EXIT(hang(), testing::ExitedWithCode(static_cast<int>(ExitCode::kStopped)), "");
}

}  // namespace
}  // namespace corbot::client
