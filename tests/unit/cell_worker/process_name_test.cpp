// SPDX-License-Identifier: Apache-2.0
#include "cell/coordinator/process_name.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string>

namespace corbot::test {
namespace {

using ::testing::EndsWith;
using ::testing::SizeIs;
using ::testing::StartsWith;

/// Returns the output of a shell without the newline.
std::string printed_by(const std::string& command) {
  FILE* const pipe = ::popen(command.c_str(), "r");
  std::array<char, 256> text{};
  const std::size_t size = std::fread(text.data(), 1, text.size(), pipe);
  ::pclose(pipe);
  return std::string(text.data(), size).substr(0, size - 1);
}

TEST(ProcessName, HasBootProcessAndStart) {
  const std::string name = cell::process_name();
  EXPECT_THAT(name, SizeIs(::testing::Le(64U)));
  EXPECT_THAT(name, StartsWith(program_invocation_short_name + ("@" + printed_by("hostname").substr(0, 10))));
  const std::string boot = printed_by("cut -c1-8 /proc/sys/kernel/random/boot_id");
  const std::string start = printed_by(fmt::format("cut -d' ' -f22 /proc/{}/stat", ::getpid()));
  EXPECT_THAT(name, EndsWith(fmt::format("/{}/{}/{}", boot, ::getpid(), start)));
  EXPECT_EQ(cell::process_name(), name);
}

TEST(ProcessName, TellsWhetherItsProcessHasEnded) {
  const std::string own = cell::process_name();
  EXPECT_FALSE(cell::is_of_dead_process(own));
  EXPECT_FALSE(cell::is_of_dead_process(cell::waiting_name(own)));
  EXPECT_TRUE(cell::is_of_dead_process(cell::waiting_name(own + "1")));
  EXPECT_TRUE(cell::is_of_dead_process(own + "1")) << "the id was given again: another start";
  const std::string machine = own.substr(0, own.rfind('/', own.rfind('/') - 1) + 1);
  EXPECT_TRUE(cell::is_of_dead_process(machine + "999999999/1"));
  const std::string ended = own.substr(own.find('@')) + "1";
  EXPECT_TRUE(cell::is_of_dead_process("corbot-camera" + ended)) << "a process of another program";
  EXPECT_FALSE(cell::is_of_dead_process("corbot-coordinator@elsewhere/12345678/999999999/1")) << "not known";
  for (const char* rest : {"", "x/1", "12", "0/1", "-1/1", "99999999999/1"})
    EXPECT_FALSE(cell::is_of_dead_process(machine + rest)) << rest;
}

TEST(ProcessName, AProcessThatProcHidesIsNotDead) {
  constexpr int kNotAllowed = 2;
  const std::string name = cell::process_name();
  const std::string directory = fmt::format("/proc/{}", ::getpid());
  const pid_t child = ::fork();
  if (child == 0) {
    if (::unshare(CLONE_NEWUSER | CLONE_NEWNS) != 0 ||
        ::mount("none", directory.c_str(), "tmpfs", 0, nullptr) != 0)
      ::_exit(kNotAllowed);
    ::_exit(cell::is_of_dead_process(name) ? 1 : 0);
  }
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  if (WEXITSTATUS(status) == kNotAllowed) GTEST_SKIP() << "no mount is allowed in a user name space";
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST(ProcessName, AnotherProcessHasAnother) {
  const std::string name = cell::process_name();
  const pid_t child = ::fork();
  if (child == 0) ::_exit(cell::process_name() == name ? 1 : 0);
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace corbot::test
