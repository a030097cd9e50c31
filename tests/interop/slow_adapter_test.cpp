// SPDX-License-Identifier: Apache-2.0
// Tests an FTDI adapter as delivered, which hands over its received bytes every 16 ms. The rate reached is
// thus not the announced one, and corbot reports the difference. The arm slows down on its path instead of
// cutting its corners.
#include <gmock/gmock.h>

#include <chrono>

#include "config/load_profile.h"
#include "corbot/units.h"
#include "support/serial_robot.h"

namespace corbot::test {
namespace {

using ::testing::HasSubstr;

constexpr double kPatience_s = 120.0;

class SlowAdapter : public SerialRobot {
 protected:
  void SetUp() override {
    plug_in({"ssc32"}, "ssc32", "readback = true\nstop_input = \"A\"\n");
    controller_->command("input A 0");
    start();
    if (HasFatalFailure()) return;
    ASSERT_TRUE(wait_for(Corbot::Standby)) << rt_->errors();
  }
  [[nodiscard]] bool was_logged(const std::string& text) const {
    return wait_until(within(kPatience_s), [&] { return rt_->errors().find(text) != std::string::npos; });
  }
};

TEST_F(SlowAdapter, IsReportedAndTheArmIsSlowed) {
  EXPECT_THAT(rt_->errors(), HasSubstr("50.0 frames a second"));
  controller_->command("batch 16");
  ASSERT_TRUE(was_logged("frames a second, but announced 50.0; the arm moves slower")) << rt_->errors();
  constexpr double kWay_deg = 60.0;
  constexpr double kSpeed_percent = 50.0;
  const double speed_deg_s =
      to_degrees(load_profile(profile_).arm.joints[0].speed_q_s) * kSpeed_percent / 100.0;
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(raised_by([&] { arm_->Drive(0, kWay_deg, kSpeed_percent); }), "");
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  // 31 frames a second of 50. A busy machine makes it slower only.
  EXPECT_GE(took.count(), 1.4 * kWay_deg / speed_deg_s);
  controller_->command("batch 0");
  EXPECT_TRUE(was_logged("moves at full speed again")) << rt_->errors();
}

}  // namespace
}  // namespace corbot::test
