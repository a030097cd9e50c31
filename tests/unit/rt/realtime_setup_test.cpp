// SPDX-License-Identifier: Apache-2.0
#include "rt/realtime_setup.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <cstdint>

namespace corbot::test::realtime_setup_test {
namespace {

constexpr int kNotPermitted = 77;
constexpr int kNotEnded = 78;
constexpr int kNotBounded = 79;

std::int64_t now_s() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return time.tv_sec;
}

/// In a process of its own, which is real-time from here on: what became of it, as of waitpid(2).
template <class Body>
int status_of(Body&& body) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    const rlimit no_core{};
    ::setrlimit(RLIMIT_CORE, &no_core);
    int latency_fd = -1;
    const rt::RealtimeResult result = rt::make_realtime({10, -1}, latency_fd);
    ::_exit(body(result));
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return status;
}

TEST(RealtimeSetup, BoundsWhatARealTimeThreadMayCompute) {
  const int status = status_of([](const rt::RealtimeResult& result) {
    rlimit limit{};
    ::getrlimit(RLIMIT_RTTIME, &limit);
    return result.bounded && limit.rlim_cur <= 500'000 ? 0 : kNotBounded;
  });
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST(RealtimeSetup, ATaskThatSpinsIsEndedByTheKernel) {
  const int status = status_of([](const rt::RealtimeResult& result) {
    if (!result.scheduled) return kNotPermitted;
    const std::int64_t end_s = now_s() + 20;
    while (now_s() < end_s) {
    }
    return kNotEnded;
  });
  if (WIFEXITED(status) && WEXITSTATUS(status) == kNotPermitted)
    GTEST_SKIP() << "SCHED_FIFO is not permitted here";
  ASSERT_TRUE(WIFSIGNALED(status)) << WEXITSTATUS(status);
  EXPECT_EQ(WTERMSIG(status), SIGXCPU);
}

TEST(RealtimeSetup, OneThatSleepsEachPeriodIsNot) {
  const int status = status_of([](const rt::RealtimeResult& result) {
    if (!result.scheduled) return kNotPermitted;
    // Two seconds of computing in all, in portions.
    for (int i = 0; i < 40; ++i) {
      timespec begin{}, now{};
      clock_gettime(CLOCK_THREAD_CPUTIME_ID, &begin);
      do {
        clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
      } while ((now.tv_sec - begin.tv_sec) * 1'000'000'000 + now.tv_nsec - begin.tv_nsec < 50'000'000);
      const timespec pause{0, 1'000'000};
      ::nanosleep(&pause, nullptr);
    }
    return 0;
  });
  if (WIFEXITED(status) && WEXITSTATUS(status) == kNotPermitted)
    GTEST_SKIP() << "SCHED_FIFO is not permitted here";
  ASSERT_TRUE(WIFEXITED(status)) << WTERMSIG(status);
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace corbot::test::realtime_setup_test
