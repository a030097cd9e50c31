// SPDX-License-Identifier: Apache-2.0
// Tests a port that stays its own, which every test that starts a servant relies on.
#include "support/ports.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <set>
#include <vector>

namespace corbot::test {
namespace {

TEST(Ports, LieBelowThoseThatTheKernelGivesToConnections) {
  std::ifstream file("/proc/sys/net/ipv4/ip_local_port_range");
  int first = 0;
  if (!(file >> first)) GTEST_SKIP() << "the kernel does not say which ports it hands out";
  if (first < 12000) GTEST_SKIP() << "this kernel hands out ports from " << first;
  for (int i = 0; i < 100; ++i) EXPECT_LT(free_port(), first);
}

TEST(Ports, AreGivenToOneProgramOnly) {
  constexpr int kPrograms = 20;
  constexpr int kPorts = 20;
  int answers[2];
  int end[2];
  ASSERT_EQ(::pipe(answers), 0);
  ASSERT_EQ(::pipe(end), 0);
  std::vector<pid_t> programs;
  for (int i = 0; i < kPrograms; ++i) {
    const pid_t pid = ::fork();
    ASSERT_GE(pid, 0);
    if (pid == 0) {  // draws its ports and keeps them until all have drawn
      ::close(end[1]);
      for (int k = 0; k < kPorts; ++k) {
        const int port = free_port();
        if (::write(answers[1], &port, sizeof(port)) != sizeof(port)) ::_exit(1);
      }
      char byte = 0;
      (void)!::read(end[0], &byte, 1);
      ::_exit(0);
    }
    programs.push_back(pid);
  }
  ::close(answers[1]);
  std::set<int> ports;
  for (int i = 0; i < kPrograms * kPorts; ++i) {
    int port = 0;
    ASSERT_EQ(::read(answers[0], &port, sizeof(port)), static_cast<ssize_t>(sizeof(port)));
    EXPECT_TRUE(ports.insert(port).second) << "port " << port << " was given twice";
  }
  ::close(end[1]);
  for (const pid_t pid : programs) {
    int status = 0;
    EXPECT_EQ(::waitpid(pid, &status, 0), pid);
    EXPECT_EQ(status, 0);
  }
  ::close(answers[0]);
  ::close(end[0]);
}

}  // namespace
}  // namespace corbot::test
