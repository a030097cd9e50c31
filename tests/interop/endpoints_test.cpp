// SPDX-License-Identifier: Apache-2.0
// Tests the addresses on which a servant listens: IPv6, Unix sockets that are their owner's, and no address
// that means all of them.
#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>

#include <fmt/core.h>

#include "net/endpoint.h"
#include "support/paths.h"
#include "support/ports.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

using ::testing::HasSubstr;

class Endpoints : public RobotRig {
 protected:
  void SetUp() override {
    name_ = unique_name("endpoints");
    port_ = free_port();
    start_rt();
  }
  /// Takes control, as clients do that know only this address, moves, and gives control back.
  static void use_control(Corbot::Arm_ptr arm) {
    Corbot::Arm_var control = arm->Acquire("endpoints", 600.0);
    control->Drive(0, 5, 60);
    EXPECT_EQ(raised_by([&] { arm->Drive(0, 5, 60); }), "NotReady");
    control->Release();
  }
  void serve(const std::vector<std::string>& where) {
    std::vector<std::string> command{servant_program(CORBOT_BIN_DIR), profile_, "--name", name_};
    command.insert(command.end(), where.begin(), where.end());
    servant_ = std::make_unique<Process>(command);
    const auto line = servant_->wait_line("ready ", within(30));
    ASSERT_TRUE(line) << servant_->errors();
    reference_ = line->substr(6);
  }
};

TEST_F(Endpoints, IPv6) {
  int bound = 0;
  char why[CORBOT_WHY];
  const int fd = corbot_listen("::1", 0, &bound, why);
  if (fd < 0) GTEST_SKIP() << "skipped: " << why;
  ::close(fd);
  serve({"--endpoint", fmt::format("[::1]:{}", port_)});
  if (HasFatalFailure()) return;
  EXPECT_EQ(reference_, fmt::format("corbaloc::[::1]:{}/{}", port_, name_));
  arm_ = connect();
  EXPECT_EQ(arm_->DoF(), 4);
  ASSERT_TRUE(wait_for(Corbot::Standby));
  arm_->Drive(0, 5, 60);
  use_control(arm_);
}

TEST_F(Endpoints, NoneThatMeansAllAddresses) {
  for (const char* host : {"0", "0.0.0.0", "0x0", "*", "[::]", "[::ffff:0.0.0.0]"}) {
    const RunResult result = run({servant_program(CORBOT_BIN_DIR), profile_, "--name", name_, "--endpoint",
                                  fmt::format("{}:{}", host, port_)});
    EXPECT_EQ(result.code, 2) << host;
    EXPECT_THAT(result.errors, HasSubstr("means all addresses of this machine")) << host;
  }
}

TEST_F(Endpoints, AUnixSocketIsItsOwnersOnly) {
  const std::string path = fmt::format("{}/{}", CORBOT_SCRATCH_DIR, name_);
  serve(on_orbit2()
            ? std::vector<std::string>{"--unix", path}
            : std::vector<std::string>{"--unix", path, "--endpoint", fmt::format("127.0.0.1:{}", port_)});
  if (HasFatalFailure()) return;
  struct stat status {};
  ASSERT_EQ(::stat(path.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600u);
  if (on_orbit2()) return;
  arm_ = connect(fmt::format("corbaloc:omniunix:{}:/{}", path, name_));
  EXPECT_EQ(arm_->DoF(), 4);
  ASSERT_TRUE(wait_for(Corbot::Standby));
  arm_->Drive(0, 5, 60);
  use_control(arm_);
}

}  // namespace
}  // namespace corbot::test
