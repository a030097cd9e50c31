// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <string>

#include "support/wait_until.h"

namespace corbot::test {

// Devices of the machine that runs the test, named by environment variables:
// CORBOT_RIG_GPIOCHIP: /dev/gpiochipN of a gpio-sim chip with at least eight free lines;
// CORBOT_RIG_GPIO_SIM: its directory in sysfs, which holds sim_gpioN/{value,pull};
// CORBOT_RIG_PWMCHIP: /sys/class/pwm/pwmchipN;
// CORBOT_RIG_I2C: /dev/i2c-N of an adapter with a PCA9685, or i2c-stub in its place;
// CORBOT_RIG_I2C_ADDRESS: its address there, such as 0x40.

/// The value of a variable; empty when it is not set.
inline std::string rig(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

inline std::string line_of(const std::string& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  return line;
}

}  // namespace corbot::test

/// In SetUp(): skips where the machine has not what is needed.
#define CORBOT_NEEDS(name) \
  if (::corbot::test::rig(name).empty()) GTEST_SKIP() << "needs " << (name) << " (see rig_device.h)"
