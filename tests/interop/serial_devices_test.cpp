// SPDX-License-Identifier: Apache-2.0
// The messages for a serial line that cannot be opened.
#include <gmock/gmock.h>

#include "support/paths.h"
#include "support/serial_robot.h"

namespace corbot::test {
namespace {

class SerialDevices : public SerialRobot {
 protected:
  void SetUp() override {
    plug_in({"ssc32"}, "ssc32");
    if (!HasFatalFailure()) start_rt();
  }
};

TEST_F(SerialDevices, ReportTheFaultAtTheStart) {
  const std::string rt = std::string(CORBOT_BIN_DIR) + "/corbot-rt";
  const RunResult second = run({rt, profile_, "--name", name_ + "b"});
  EXPECT_EQ(second.code, 1);
  EXPECT_THAT(second.errors, ::testing::HasSubstr(controller_->line())) << "names the device";
  EXPECT_EQ(rt_->terminate(), 0);
  EXPECT_EQ(controller_->stop(), 0);
  const RunResult absent = run({rt, profile_, "--name", name_ + "b"});
  EXPECT_EQ(absent.code, 1);
  EXPECT_THAT(absent.errors, ::testing::HasSubstr(controller_->line() + ": No such file or directory"));
  EXPECT_FALSE(channel_exists(name_ + "b"));
  controller_->start();
  start_rt();
}

}  // namespace
}  // namespace corbot::test
