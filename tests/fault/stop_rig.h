// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <signal.h>
#include <time.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <sstream>
#include <string>

#include <fmt/core.h>

#include "shm/channel_client.h"
#include "support/emulated_controller.h"
#include "support/paths.h"
#include "support/robot_rig.h"
#include "support/scratch.h"

namespace corbot::test {

/// A robot of whole processes with a stop input. If the machine has a simulated GPIO chip, its lines are the
/// stop input, the power switch and the watchdog output. If not, an emulated SSC-32 has the stop input.
class StopRig : public RobotRig {
 protected:
  static constexpr int kStopLine = 20;
  static constexpr int kPowerLine = 21;
  static constexpr int kWatchdogLine = 22;
  static constexpr double kRamp_s = 1.0;

  static std::string environment(const char* name) {
    const char* value = std::getenv(name);
    return value != nullptr ? value : "";
  }
  [[nodiscard]] static std::string why_no_gpio() {
    return environment("CORBOT_RIG_GPIO_SIM").empty()
               ? "needs a simulated GPIO chip (gpio-sim): tests/rig/run"
               : "";
  }
  static std::int64_t now_ns() {
    timespec time{};
    ::clock_gettime(CLOCK_MONOTONIC, &time);
    return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
  }

  void SetUp() override {}  // begin() does
  void TearDown() override {
    if (rt_) rt_->signal(SIGCONT);
    if (servant_) servant_->signal(SIGCONT);
    if (is_gpio_) press(false);
    if (!name_.empty()) RobotRig::TearDown();
    if (controller_) {
      EXPECT_EQ(controller_->stop(), 0);
    }
    if (!directory_.empty()) std::filesystem::remove_all(directory_);
  }
  /// `lines`: tables of the profile. `is_gpio`: the simulator drives the servos.
  void begin(bool is_gpio, const std::string& lines) {
    is_gpio_ = is_gpio;
    take_name("stop");
    directory_ = fmt::format("{}/{}", scratch_directory(CORBOT_SCRATCH_DIR), name_);
    std::filesystem::create_directory(directory_);
    if (!is_gpio) {
      controller_.emplace(std::string(CORBOT_BIN_DIR) + "/corbot-sim", std::vector<std::string>{"ssc32"},
                          directory_);
      controller_->start();
    }
    if (HasFatalFailure()) return;
    press(false);
    write_profile(lines);
    start();
    if (!HasFatalFailure()) settle();
  }
  /// At rest and ready, whatever has happened.
  void settle() {
    const bool is_ready = wait_until(within(180), [&] {
      try {
        if (arm_->Status() == Corbot::Standby) return true;
        arm_->Clear();
      } catch (const CORBA::Exception&) {
        const timespec pause{0, 20'000'000};  // a device that starves is back in its own time
        ::nanosleep(&pause, nullptr);
      }
      return false;
    });
    ASSERT_TRUE(is_ready) << rt_->errors() << servant_->errors() << "state " << arm_->Status();
  }
  void press(bool pressed) {
    if (is_gpio_) {
      std::ofstream(line_file(kStopLine, "pull")) << (pressed ? "pull-up" : "pull-down") << std::endl;
      return;
    }
    controller_->command(fmt::format("input B {}", pressed ? 1 : 0));
  }
  static std::string line_file(int line, const std::string& what) {
    return fmt::format("{}/sim_gpio{}/{}", environment("CORBOT_RIG_GPIO_SIM"), line, what);
  }
  [[nodiscard]] static bool is_high(int line) {
    std::ifstream file(line_file(line, "value"));
    return file.get() == '1';
  }
  [[nodiscard]] static std::string stop_table() {
    return table("emergency_stop", kStopLine) + "bias = \"as-is\"\n";
  }
  [[nodiscard]] static std::string table(const std::string& name, int line) {
    return fmt::format("[{}]\nchip = \"{}\"\nline = \"{}\"\n", name, environment("CORBOT_RIG_GPIOCHIP"),
                       line);
  }
  void freeze_servant() { servant_->signal(SIGSTOP); }

  std::optional<EmulatedController> controller_;

 private:
  void write_profile(const std::string& lines) {
    std::ifstream from(CORBOT_TIMED_PROFILE);
    std::stringstream text;
    text << from.rdbuf();
    std::string all = text.str();
    // A busy or an emulated machine makes gaps that are no fault.
    for (const std::string key : {"gap_fault_ms", "frozen_ms"}) {
      const std::size_t at = all.find(key + " = ") + key.size() + 3;
      all.replace(at, all.find_first_not_of("0123456789", at) - at, "10000");
    }
    profile_ = directory_ + "/arm.toml";
    std::ofstream to(profile_);
    if (is_gpio_) {
      const std::size_t backend = all.find("[backend]");
      to << all.substr(0, backend) << lines << all.substr(backend);
    } else {
      to << all.substr(0, all.find("[backend]")) << lines
         << fmt::format(
                "[backend]\nkind = \"ssc32\"\nposition_known_at_start = true\n[backend.ssc32]\nport = "
                "\"{}\"\n"
                "stop_input = \"B\"\nstop_active = \"high\"\n",
                controller_->line());
    }
  }

  bool is_gpio_{false};
  std::string directory_;
};

}  // namespace corbot::test
