// SPDX-License-Identifier: Apache-2.0
// Tests a stop while a serial controller is under way, by the emulator's own record of its pulses. The pulses
// follow the frames of the ramp to their end and nowhere else. So they do if the controller interpolates
// between frames that are far apart.
#include <gmock/gmock.h>

#include <cmath>
#include <thread>
#include <vector>

#include "config/load_profile.h"
#include "corbot/units.h"
#include "support/serial_robot.h"

namespace corbot::test {
namespace {

struct Controller {
  std::string name;
  std::vector<std::string> emulator;
  std::string backend;
  std::string options;
  double unit_us;
};
void PrintTo(const Controller& controller, std::ostream* out) { *out << controller.name; }

class SerialStop : public SerialRobot, public ::testing::WithParamInterface<Controller> {
 protected:
  void SetUp() override {
    plug_in(GetParam().emulator, GetParam().backend, GetParam().options);
    if (has_input()) controller_->command("input A 0");
    base_ = load_profile(profile_).arm.servos[0];
    start();
    if (HasFatalFailure()) return;
    ASSERT_TRUE(wait_for(Corbot::Standby)) << rt_->errors();
  }
  [[nodiscard]] bool has_input() const { return GetParam().backend == "ssc32"; }
  /// All pulses of the base's servo so far.
  [[nodiscard]] std::vector<double> pulses() const {
    std::vector<double> values;
    for (const DeviceRow& row : controller_->rows()) {
      if (row.channel == base_.channel && row.has_power) values.push_back(row.given);
    }
    return values;
  }
  /// Returns the base's pulse at the angle that the robot reports.
  [[nodiscard]] double set_point_us() {
    Corbot::JointCoord_var joints = arm_->ArtiCoord();
    return base_.zero_us + base_.direction * base_.us_per_q * to_radians(joints[0]);
  }

  ServoMap base_;
};

TEST_P(SerialStop, FollowsTheRampAndGoesNoFurther) {
  double target_us = set_point_us();
  for (const bool is_pressed : {false, true}) {
    if (is_pressed && !has_input()) continue;
    const double begin_us = set_point_us();
    const std::size_t before = pulses().size();
    constexpr double kWay_deg = 60.0;
    const double way_deg = is_pressed ? -kWay_deg : kWay_deg;
    target_us = begin_us + base_.direction * base_.us_per_q * to_radians(way_deg);
    std::thread caller([&] { (void)raised_by([&] { arm_->Drive(0, way_deg, 20.0); }); });
    const double sign = target_us > begin_us ? 1.0 : -1.0;
    EXPECT_TRUE(wait_until(within(30), [&] { return sign * (pulses().back() - begin_us) > 50.0; }));
    if (is_pressed) {
      controller_->command("input A 1");
      EXPECT_TRUE(wait_for(Corbot::Error)) << rt_->errors();
    } else {
      arm_->Stop();
    }
    caller.join();
    double held_us = 0.0;
    EXPECT_TRUE(wait_until(within(30),
                           [&] {
                             held_us = set_point_us();
                             return std::abs(pulses().back() - held_us) <= GetParam().unit_us;
                           }))
        << pulses().back() << " is not " << held_us;
    const std::vector<double> all = pulses();
    double last_us = begin_us;
    for (std::size_t i = before; i < all.size(); ++i) {
      EXPECT_GE(sign * (all[i] - last_us), -GetParam().unit_us) << "backwards";
      EXPECT_LE(sign * (all[i] - held_us), GetParam().unit_us) << "beyond the last set-point";
      last_us = all[i];
    }
    EXPECT_GT(sign * (target_us - held_us), 20.0) << "short of its target";
  }
}

INSTANTIATE_TEST_SUITE_P(
    Controllers, SerialStop,
    ::testing::Values(
        Controller{"ssc32", {"ssc32", "--model", "ssc32"}, "ssc32", "stop_input = \"A\"\n", 1.0},
        Controller{"ssc32u_slow_line",
                   {"ssc32", "--baud", "9600"},
                   "ssc32",
                   "baud = 9600\nstop_input = \"A\"\n",
                   1.0},
        Controller{"maestro", {"maestro", "--timeout", "30000"}, "maestro", "", 0.5}),
    [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace corbot::test
