// SPDX-License-Identifier: Apache-2.0
// Kernel PWM on a tree of files that behaves like sysfs: a thread plays the kernel.
#include "rt/backends/pwm/pwm_sysfs.h"

#include <gmock/gmock.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <thread>

#include "support/fake_pwm_chip.h"
#include "support/wait_until.h"

namespace corbot::rt::pwm_sysfs_test {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Clock = std::chrono::steady_clock;
using test::wait_until;

std::string new_directory() {
  std::string path = testing::TempDir() + "corbot-pwm-XXXXXX";
  return ::mkdtemp(path.data());
}

class PwmSysfsTest : public ::testing::Test, protected test::FakePwmChip {
 protected:
  PwmSysfsTest() : FakePwmChip(new_directory()) {}
  ~PwmSysfsTest() override { fs::remove_all(root_); }

  std::unique_ptr<PwmSysfs> make(std::vector<std::uint32_t> channels = {0, 3}) {
    return std::make_unique<PwmSysfs>(
        PwmSysfsSettings{chip_.string(), std::move(channels), 50.0, std::chrono::milliseconds(5000)});
  }
  static ServoFrame frame(double first_us, double second_us) {
    ServoFrame frame;
    frame.servo_count = 2;
    frame.channel = {0, 3};
    frame.pulse_us = {first_us, second_us};
    return frame;
  }
};

/// Records the writes to the files of one output, in order.
class Recorder {
 public:
  explicit Recorder(const fs::path& directory) : fd_(::inotify_init1(IN_NONBLOCK | IN_CLOEXEC)) {
    ::inotify_add_watch(fd_, directory.c_str(), IN_MODIFY);
  }
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;
  ~Recorder() { ::close(fd_); }
  std::vector<std::string> take() const {
    std::vector<std::string> names;
    alignas(inotify_event) std::array<char, 4096> buffer{};
    ssize_t n = 0;
    while ((n = ::read(fd_, buffer.data(), buffer.size())) > 0) {
      for (ssize_t at = 0; at < n;) {
        const auto* event = reinterpret_cast<const inotify_event*>(buffer.data() + at);
        names.emplace_back(event->name);
        at += static_cast<ssize_t>(sizeof(inotify_event) + event->len);
      }
    }
    return names;
  }

 private:
  int fd_;
};

TEST_F(PwmSysfsTest, ExportsWaitsForPermissionAndSwitchesOnLast) {
  const auto device = make();
  EXPECT_THAT(device->open(), HasSubstr("2 of its 16 outputs, 50.0 frames a second"));
  EXPECT_EQ(of(0, "period"), "20000000");
  EXPECT_EQ(of(0, "enable"), "0") << "no pulse before its length is known";
  const Recorder first(chip_ / "pwm0");
  device->send(frame(1500.0, 612.3456), true);
  EXPECT_THAT(first.take(), ElementsAre("duty_cycle", "enable"));
  EXPECT_EQ(of(0, "duty_cycle"), "1500000");
  EXPECT_EQ(of(3, "duty_cycle"), "612346");
  EXPECT_EQ(of(3, "enable"), "1");
  EXPECT_FALSE(fs::exists(chip_ / "pwm1"));
}

TEST_F(PwmSysfsTest, WritesOnlyWhatHasChanged) {
  const auto device = make();
  (void)device->open();
  device->send(frame(1500.0, 1500.0), false);
  const Recorder first(chip_ / "pwm0");
  const Recorder second(chip_ / "pwm3");
  device->send(frame(1500.0, 999.0), false);
  device->send(frame(1500.0, 999.0), false);
  EXPECT_THAT(first.take(), ElementsAre());
  EXPECT_THAT(second.take(), ElementsAre("duty_cycle"));
  EXPECT_EQ(of(3, "duty_cycle"), "999000") << "shorter than what stood there before";
}

TEST_F(PwmSysfsTest, NeverExceedsThePeriod) {
  make_output("0");
  make_output("3");
  put(chip_ / "pwm0" / "period", "100000000");
  put(chip_ / "pwm0" / "duty_cycle", "50000000");
  const Recorder record(chip_ / "pwm0");
  const auto device = make();
  (void)device->open();
  EXPECT_THAT(record.take(), ElementsAre("duty_cycle", "period"))
      << "the kernel refuses it the other way round";
  device->send(frame(1e9, -5.0), false);
  EXPECT_EQ(of(0, "duty_cycle"), "20000000");
  EXPECT_EQ(of(3, "duty_cycle"), "0");
}

TEST_F(PwmSysfsTest, TurnsAnInvertedOutputOnlyWhileItIsOff) {
  make_output("0");
  make_output("3");
  put(chip_ / "pwm0" / "polarity", "inversed");
  put(chip_ / "pwm0" / "enable", "1");
  const Recorder record(chip_ / "pwm0");
  const auto device = make();
  (void)device->open();
  EXPECT_THAT(record.take(), ElementsAre("duty_cycle", "enable", "polarity", "period"));
  EXPECT_EQ(of(0, "polarity"), "normal");
}

TEST_F(PwmSysfsTest, HoldsAtTheEndAndIsFoundAgain) {
  {
    const auto device = make();
    (void)device->open();
    device->send(frame(1400.0, 1600.0), false);
    device->close();
  }
  EXPECT_EQ(of(0, "enable"), "1");
  const auto device = make();
  (void)device->open();
  const BusReading reading = device->measure(frame(0, 0));
  ASSERT_EQ(reading.unit, BusReading::Unit::kPulses);
  EXPECT_EQ(reading.value[0], 1400.0);
  EXPECT_EQ(reading.value[1], 1600.0);
}

TEST_F(PwmSysfsTest, ReportsByServoWhatIsOff) {
  make_output("0");
  make_output("3");
  put(chip_ / "pwm3" / "period", "20000000");
  put(chip_ / "pwm3" / "duty_cycle", "1600000");
  put(chip_ / "pwm3" / "enable", "1");
  const auto device = make();
  (void)device->open();
  const BusReading reading = device->measure(frame(0, 0));
  ASSERT_EQ(reading.unit, BusReading::Unit::kPulses) << "the other one is approached from its own pulse";
  EXPECT_EQ(reading.value[0], 0.0);
  EXPECT_EQ(reading.value[1], 1600.0);
}

TEST_F(PwmSysfsTest, RelaxesAndGivesBackWhatItExported) {
  make_output("3");
  const auto device = make();
  (void)device->open();
  device->send(frame(1500.0, 1500.0), false);
  EXPECT_EQ(device->measure(frame(0, 0)).unit, BusReading::Unit::kPulses);
  device->relax();
  EXPECT_TRUE(wait_until([&] { return !fs::exists(chip_ / "pwm0"); }));
  EXPECT_EQ(of(3, "enable"), "0") << "was exported by another program";
}

TEST_F(PwmSysfsTest, EndsThePulsesBeforeAnOutputIsDisabled) {
  make_output("0");
  make_output("3");
  const auto device = make();
  (void)device->open();
  device->send(frame(1500.0, 1500.0), false);
  const Recorder record(chip_ / "pwm0");
  device->relax();
  EXPECT_THAT(record.take(), ElementsAre("duty_cycle", "enable"));
  EXPECT_EQ(of(0, "duty_cycle"), "0");
  EXPECT_EQ(of(0, "enable"), "0");
}

TEST_F(PwmSysfsTest, RelaxesAllThatCanBeSwitchedOff) {
  make_output("0");
  make_output("3");
  const auto device = make();
  (void)device->open();
  device->send(frame(1500.0, 1500.0), false);
  fs::remove(chip_ / "pwm0" / "enable");
  EXPECT_THROW(device->relax(), DeviceError);
  EXPECT_EQ(of(3, "enable"), "0");
}

TEST_F(PwmSysfsTest, IsLostWithItsControllerAndFoundAgain) {
  const auto device = make();
  (void)device->open();
  device->send(frame(1500.0, 1500.0), false);
  unplug();
  try {
    device->send(frame(1500.0, 1500.0), false);
    FAIL() << "though there was nothing to write";
  } catch (const DeviceError& error) {
    EXPECT_EQ(error.cause(), DeviceCause::kHungUp);
    EXPECT_THAT(error.what(), HasSubstr("/enable"));
  }
  device->close();
  EXPECT_THROW((void)device->open(), DeviceError);
  plug_in();
  (void)device->open();
  EXPECT_EQ(device->measure(frame(0, 0)).unit, BusReading::Unit::kNothing);
  device->send(frame(1500.0, 1500.0), false);
  EXPECT_EQ(of(0, "duty_cycle"), "1500000");
}

TEST_F(PwmSysfsTest, NoticesThatAnotherProgramSwitchedAnOutputOff) {
  const auto device = make();
  (void)device->open();
  device->send(frame(1500.0, 1500.0), false);
  put(chip_ / "pwm3" / "enable", "0");
  EXPECT_THROW(
      {
        device->send(frame(1500.0, 1500.0), false);
        device->send(frame(1500.0, 1500.0), false);
      },
      DeviceError);
}

TEST_F(PwmSysfsTest, RefusesAnOutputThatTheControllerHasNot) {
  try {
    (void)make({0, 16})->open();
    FAIL();
  } catch (const DeviceError& error) {
    EXPECT_THAT(error.what(), HasSubstr("has 16 outputs, but a servo of the profile has channel 16"));
  }
}

}  // namespace
}  // namespace corbot::rt::pwm_sysfs_test
