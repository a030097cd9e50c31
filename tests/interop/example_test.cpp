// SPDX-License-Identifier: Apache-2.0
// The example client in C, as it is printed to a person.
#include <gmock/gmock.h>

#include <filesystem>

#include <fmt/core.h>

#include "support/robot_rig.h"

namespace corbot::test {
namespace {

using ::testing::HasSubstr;

class Example : public RobotRig {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(CORBOT_HELLO_ARM)) GTEST_SKIP() << "skipped: ORBit2 not found";
    RobotRig::SetUp();
    sockets_ = fmt::format("{}/{}", CORBOT_SCRATCH_DIR, name_);
    std::filesystem::create_directory(sockets_);
    std::filesystem::permissions(sockets_, std::filesystem::perms::owner_all);
  }
  void TearDown() override {
    if (sockets_.empty()) return;
    std::filesystem::remove_all(sockets_);
    RobotRig::TearDown();
  }
  RunResult hello(const std::string& reference) {
    return run({CORBOT_HELLO_ARM, reference}, 60.0, {"ORBIT_SOCKETDIR=" + sockets_});
  }
  std::string sockets_;
};

TEST_F(Example, InCMovesTheArm) {
  const RunResult result = hello(reference_);
  EXPECT_EQ(result.code, 0) << result.output << result.errors;
  EXPECT_THAT(result.output, HasSubstr("an arm of 4 articulations that reaches 0.340 m\n"));
  EXPECT_THAT(result.output, HasSubstr("joints 14.04 "));
  EXPECT_THAT(result.output, HasSubstr("(0.9, 0, 0.1) m is out of reach: the target"));
  EXPECT_THAT(result.output, HasSubstr("joints 0.00 0.00 0.00 0.00 degrees\n"));
}

TEST_F(Example, InCSaysWhatIsWrong) {
  EXPECT_EQ(hello("nonsense").code, 1);
  const RunResult nobody = hello(fmt::format("corbaloc::127.0.0.1:{}/{}", free_port(), name_));
  EXPECT_EQ(nobody.code, 1);
  EXPECT_THAT(nobody.output, HasSubstr("asking: IDL:"));
}

}  // namespace
}  // namespace corbot::test
