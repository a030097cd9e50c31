// SPDX-License-Identifier: Apache-2.0
// GPIO lines as `corbot doctor` sees them: level and consumer, and no line driven.
#include <gmock/gmock.h>

#include "cli/doctor/device_findings.h"
#include "support/fake_gpio.h"

namespace corbot::cli {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::Field;
using testing::HasSubstr;
using testing::Not;

auto has(Level level, const std::string& text) {
  return Contains(AllOf(Field(&Finding::level, level), Field(&Finding::text, HasSubstr(text))));
}

class DoctorLines : public testing::Test {
 protected:
  DoctorLines() {
    access_.gpio = gpio_.chips();
    profile_.emergency_stop.chip = "/dev/null";  // which can be opened
    profile_.emergency_stop.line = "ESTOP";
  }
  Findings examine(bool is_up = false) {
    Findings findings;
    examine_lines(profile_, access_, is_up, findings);
    for (const Finding& finding : findings) {
      EXPECT_EQ(finding.fix.empty(), finding.level == Level::kOk) << finding.text;
    }
    EXPECT_TRUE(gpio_.changes().empty()) << "a line was driven";
    return findings;
  }

  test::FakeGpio gpio_;
  DeviceAccess access_;
  Profile profile_;
};

TEST_F(DoctorLines, TheEmergencyStopsLevelIsRead) {
  EXPECT_THAT(examine(), has(Level::kOk, "emergency stop: line ESTOP is not pressed"));
  gpio_.press(true);
  EXPECT_THAT(examine(), has(Level::kWarn, "emergency stop: line ESTOP is pressed"));
  EXPECT_EQ(gpio_.last_request().bias, rt::GpioBias::kPullUp) << "as the profile says";
  gpio_.unplug();
  EXPECT_THAT(examine(), has(Level::kFail, "gone"));
}

TEST_F(DoctorLines, ALineThatIsTakenNamesItsConsumer) {
  gpio_.set_info("ESTOP", {"somebody else", false});
  EXPECT_THAT(examine(), has(Level::kFail, "line ESTOP is held by \"somebody else\""));
  EXPECT_THAT(examine(true), has(Level::kFail, "line ESTOP is held by \"somebody else\""));
  gpio_.set_info("ESTOP", {"", false});
  EXPECT_THAT(examine(), has(Level::kFail, "line ESTOP is held by the kernel or a nameless program"));
  gpio_.set_info("ESTOP", {"corbot stop", false});
  EXPECT_THAT(examine(), has(Level::kFail, "held by \"corbot stop\"")) << "another robot's";
  EXPECT_THAT(examine(true), has(Level::kOk, "held by \"corbot stop\""));
  EXPECT_EQ(gpio_.requests(), 0) << "a robot that is up holds its lines";
}

TEST_F(DoctorLines, ServoPowerWithoutCorbotIsReported) {
  profile_.emergency_stop.chip.clear();
  profile_.power_enable.chip = "/dev/null";
  profile_.power_enable.line = "POWER";
  EXPECT_THAT(examine(), has(Level::kOk, "power enable: line POWER is free, and inactive"));
  gpio_.press(true);
  EXPECT_THAT(examine(),
              has(Level::kWarn, "power enable: line POWER is active while corbot does not drive it"));
  gpio_.set_info("POWER", {std::nullopt, true});
  const int requests = gpio_.requests();
  EXPECT_THAT(examine(), has(Level::kOk, "line POWER is free, and an output"));
  EXPECT_EQ(gpio_.requests(), requests) << "what drives is left as it is";
}

TEST_F(DoctorLines, TheWatchdogsLineIsLookedAt) {
  profile_.watchdog.chip = "/dev/null";
  profile_.watchdog.line = "WATCHDOG";
  EXPECT_THAT(examine(), has(Level::kOk, "watchdog: line WATCHDOG is free, and inactive"));
  gpio_.set_info("WATCHDOG", {"somebody else", true});
  EXPECT_THAT(examine(), has(Level::kFail, "line WATCHDOG is held by \"somebody else\""));
}

TEST_F(DoctorLines, OfPulsesAreCounted) {
  profile_.emergency_stop.chip.clear();
  profile_.backend.kind = "gpiod";
  profile_.backend.gpiod.chip = "/dev/null";
  profile_.backend.gpiod.lines = {"1", "2", "3"};
  gpio_.set_info("2", {"somebody else", true});
  EXPECT_THAT(examine(), AllOf(has(Level::kOk, "2 lines are free"), has(Level::kFail, "line 2 is held by")));
  EXPECT_EQ(gpio_.requests(), 0);
  profile_.backend.gpiod.chip = "/nonexistent/gpiochip0";
  EXPECT_THAT(examine(), AllOf(has(Level::kFail, "/nonexistent/gpiochip0: No such file"),
                               Not(has(Level::kOk, "lines are free"))));
}

}  // namespace
}  // namespace corbot::cli
