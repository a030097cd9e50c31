// SPDX-License-Identifier: Apache-2.0
// GPIO of a real kernel: pulses seen from outside, an emergency stop pulled from outside.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <mutex>
#include <vector>

#include "rig_devices/rig_device.h"
#include "rt/backends/bus/bus_backend.h"
#include "rt/backends/bus/device_error.h"
#include "rt/backends/gpio/gpiod.h"
#include "rt/inputs/safety_lines.h"

namespace corbot::test {
namespace {

using namespace rt;
namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kStopLine = 6;
constexpr int kPowerLine = 7;
constexpr double kLooking_us = 150.0;

std::int64_t now_ns() { return std::chrono::steady_clock::now().time_since_epoch().count(); }

class RigGpio : public ::testing::Test {
 protected:
  void SetUp() override {
    CORBOT_NEEDS("CORBOT_RIG_GPIOCHIP");
    CORBOT_NEEDS("CORBOT_RIG_GPIO_SIM");
    chip_ = rig("CORBOT_RIG_GPIOCHIP");
  }
  static std::string file(int line, const std::string& name) {
    return rig("CORBOT_RIG_GPIO_SIM") + "/sim_gpio" + std::to_string(line) + "/" + name;
  }
  static void pull(int line, const std::string& to) { std::ofstream(file(line, "pull")) << to << std::endl; }
  static bool is_high(int line) { return line_of(file(line, "value")) == "1"; }

  /// Widths of the pulses at a line, as seen by looking again and again.
  static std::vector<std::int64_t> watch(int line, std::int64_t for_ns) {
    std::vector<std::int64_t> widths;
    const int fd = ::open(file(line, "value").c_str(), O_RDONLY | O_CLOEXEC);
    const std::int64_t end = now_ns() + for_ns;
    std::int64_t rose_ns = 0;
    bool was_high = true;  // the first may have begun before
    for (std::int64_t now = now_ns(); now < end; now = now_ns()) {
      char value = '0';
      if (::pread(fd, &value, 1, 0) != 1) break;
      if (value == '1' && !was_high) rose_ns = now;
      if (value == '0' && was_high && rose_ns != 0) widths.push_back(now - rose_ns);
      was_high = value == '1';
      const timespec pause{0, 20'000};  // lets the pulses' thread run on one processor
      ::nanosleep(&pause, nullptr);
    }
    ::close(fd);
    std::sort(widths.begin(), widths.end());
    return widths;
  }
  std::string chip_;
};

TEST_F(RigGpio, MakesPulses) {
  for (const PulseOrder order : {PulseOrder::kStaggered, PulseOrder::kTogether}) {
    GpiodSettings settings;
    settings.chip = chip_;
    settings.lines = {"0", "1", "2", "3", "4"};
    settings.order = order;
    settings.priority = 81;
    Gpiod servos(settings, kernel_gpio());
    std::cout << servos.open() << std::endl;
    ServoFrame frame;
    frame.servo_count = 5;
    frame.channel = {0, 1, 2, 3, 4};
    frame.pulse_us = {600.0, 1000.0, 1500.0, 2000.0, 2400.0};
    servos.send(frame, false);
    for (int line = 0; line < 5; ++line) {
      const auto widths = watch(line, 1'000'000'000);
      ASSERT_GE(widths.size(), 10u) << "line " << line;
      const double median_us = static_cast<double>(widths[widths.size() / 2]) / 1000.0;
      std::cout << "line " << line << ": " << widths.size() << " pulses in 1 s, median " << median_us
                << " us of " << frame.pulse_us[static_cast<std::size_t>(line)] << " us" << std::endl;
      // A reading by sysfs is late itself, and a machine that shares its processors later still: then a
      // pulse is long. Where time is counted by instructions, only the looking blurs it.
      const double wanted_us = frame.pulse_us[static_cast<std::size_t>(line)];
      EXPECT_GE(median_us, wanted_us - kLooking_us);
      const double longest_us = rig("CORBOT_RIG_BOOT") == "counted" ? wanted_us + kLooking_us : HUGE_VAL;
      EXPECT_LE(median_us, longest_us);
    }
    servos.close();
    std::cout << servos.drain_log() << std::endl;
    for (int line = 0; line < 5; ++line) EXPECT_FALSE(is_high(line));
  }
}

TEST_F(RigGpio, NamesTheConsumerOfALine) {
  const auto chips = kernel_gpio();
  const auto mine = chips->outputs({.chip = chip_, .lines = {"5"}, .consumer = "somebody else"});
  const GpioLineInfo taken = chips->info(chip_, "5");
  EXPECT_EQ(taken.consumer, "somebody else");
  EXPECT_TRUE(taken.is_output);
  EXPECT_FALSE(chips->info(chip_, "4").consumer);
  for (const std::string line : {"NO_SUCH_LINE", "4000"}) {
    try {
      (void)chips->info(chip_, line);
      FAIL() << line;
    } catch (const DeviceError& error) {
      EXPECT_THAT(error.what(), HasSubstr("has no line " + line));
    }
  }
  try {
    (void)chips->outputs({.chip = chip_, .lines = {"4", "5"}});
    FAIL();
  } catch (const DeviceError& error) {
    EXPECT_EQ(error.cause(), DeviceCause::kInUse);
    EXPECT_THAT(error.what(), HasSubstr("line 5: is taken by \"somebody else\""));
  }
  EXPECT_THROW((void)chips->input({.chip = chip_, .lines = {"5"}}), DeviceError);
}

TEST_F(RigGpio, StopsByALineThatIsPulled) {
  for (const bool active_low : {false, true}) {
    const std::string good = active_low ? "pull-up" : "pull-down";
    const std::string pressed = active_low ? "pull-down" : "pull-up";
    pull(kStopLine, good);
    EmergencyStop stop;
    std::atomic<bool> in_error{false};
    std::atomic<std::uint64_t> cycle{0};
    SafetySettings settings;
    settings.stop =
        GpioRequest{.chip = chip_, .lines = {std::to_string(kStopLine)}, .active_low = active_low};
    settings.power = GpioRequest{.chip = chip_, .lines = {std::to_string(kPowerLine)}};
    SafetyLines lines(settings, kernel_gpio(), stop, [&] {
      if (stop.sources() != 0) in_error = true;
      return CycleView{++cycle, in_error};
    });
    lines.start();
    EXPECT_EQ(stop.sources(), 0u);
    EXPECT_FALSE(is_high(kPowerLine));
    lines.allow_power();
    ASSERT_TRUE(wait_until([&] { return is_high(kPowerLine); }));
    const std::int64_t pulled_ns = now_ns();
    pull(kStopLine, pressed);
    ASSERT_TRUE(wait_until([&] { return stop.sources() != 0; }));
    std::cout << "seen after " << (now_ns() - pulled_ns) / 1000 << " us" << std::endl;
    EXPECT_TRUE(wait_until([&] { return !is_high(kPowerLine); }));
    pull(kStopLine, good);
    ASSERT_TRUE(wait_until([&] { return stop.sources() == 0; }));
    EXPECT_FALSE(is_high(kPowerLine)) << "not before it is cleared";
    in_error = false;
    EXPECT_TRUE(wait_until([&] { return is_high(kPowerLine); }));
    // Short, between two looks at the level: the edge shows it.
    pull(kStopLine, pressed);
    pull(kStopLine, good);
    EXPECT_TRUE(wait_until([&] { return in_error.load(); }));
    lines.stop();
    EXPECT_FALSE(is_high(kPowerLine));
  }
}

/// A GPIO adapter's plug: takes the chip's driver from its device and gives it back. The chip may then have
/// another number; `link()` is what udev would make of it.
class Plug {
 public:
  Plug(const std::string& chip, std::string link) : link_(std::move(link)) {
    device_ = fs::canonical("/sys/bus/gpio/devices" / fs::path(chip).filename()).parent_path();
    driver_ = fs::canonical(device_ / "driver");
    point_at(chip);
  }
  ~Plug() {
    if (is_out_) in();
    fs::remove(link_);
  }
  [[nodiscard]] const std::string& link() const { return link_; }
  void out() { command("unbind", true); }
  /// Returns the chip's directory in sysfs.
  fs::path in() {
    command("bind", false);
    for (const fs::directory_entry& entry : fs::directory_iterator(device_)) {
      const std::string name = entry.path().filename().string();
      if (!name.starts_with("gpiochip")) continue;
      point_at("/dev/" + name);
      return entry.path();
    }
    return {};
  }

 private:
  void command(const std::string& what, bool is_out) {
    std::ofstream(driver_ / what) << device_.filename().string() << std::endl;
    is_out_ = is_out;
  }
  void point_at(const std::string& chip) {
    fs::remove(link_);
    fs::create_symlink(chip, link_);
  }

  std::string link_;
  fs::path device_;
  fs::path driver_;
  bool is_out_{false};
};

TEST_F(RigGpio, ComesBackWithItsChip) {
  Plug plug(chip_, "/run/corbot-test-gpio");
  GpiodSettings settings;
  settings.chip = plug.link();
  settings.lines = {"0", "1", "2"};
  ArmModel arm;
  arm.dof = 2;
  for (std::size_t i = 0; i < 2; ++i)
    arm.servos[i] = {static_cast<std::uint32_t>(i), 1500.0, 600.0, 1.0, 500.0, 2500.0};
  arm.gripper = {2, 1900.0, 1100.0, 0.5};
  ServoFrame frame;
  frame.servo_count = 3;
  frame.channel = {0, 1, 2};
  frame.pulse_us = {1500.0, 1500.0, 1500.0};
  EmergencyStop stop;
  BusBackend backend(arm, std::make_unique<Gpiod>(settings, kernel_gpio()),
                     BusSettings{"gpiod", false, true, 0.02}, stop);
  backend.open(frame);
  const auto becomes = [&](BackendHealth health) {
    return wait_until([&] {
      frame.time_ns = now_ns();
      ++frame.cycle;
      frame.needs_clear = backend.health() == BackendHealth::kLost;  // and is cleared at once
      backend.write(frame);
      return backend.health() == health;
    });
  };
  fs::path chip = rig("CORBOT_RIG_GPIO_SIM");
  const auto has_pulses = [&] {
    return wait_until([&] {
      backend.write(frame);
      return line_of((chip / "sim_gpio0" / "value").string()) == "1";
    });
  };
  EXPECT_TRUE(has_pulses());
  for (int i = 0; i < 10; ++i) {
    plug.out();
    ASSERT_TRUE(becomes(BackendHealth::kLost));
    EXPECT_EQ(backend.cause(), DeviceCause::kHungUp);
    chip = plug.in();
    ASSERT_TRUE(becomes(BackendHealth::kOpen)) << to_string(backend.drain_log());
    EXPECT_TRUE(has_pulses()) << chip;
  }
  std::cout << "at the end " << chip << ": " << to_string(backend.drain_log()) << std::endl;
}

}  // namespace
}  // namespace corbot::test
