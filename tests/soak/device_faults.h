// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <random>
#include <string>
#include <vector>

#include "soak/device_checks.h"
#include "soak/device_rig.h"
#include "soak/stage.h"

namespace corbot::soak {

/// One thing to break, and to mend after a while.
struct Trouble {
  DeviceFault fault;
  std::function<void()> begin{};
  std::function<void()> undo{};
  double lasts_s{};
  bool is_emulator{};  ///< commands to the emulator have no effect meanwhile
};

/// Draws at random what can befall a device of this kind, its wires and the robot's processes.
class Troubles {
 public:
  Troubles(Stage& stage, DeviceRig& rig, std::mt19937_64& random)
      : stage_(stage), rig_(rig), random_(random) {}

  [[nodiscard]] Trouble of_device();
  [[nodiscard]] Trouble of_process();

 private:
  int between(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }
  double real(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  double duration() { return between(0, 2) == 0 ? real(0.01, 0.2) : real(0.3, 1.4); }
  /// Commands of the emulator; `line` may name a node.
  Trouble told(DeviceFault fault, const std::string& on, const std::string& off, double lasts_s);
  Trouble of_query(const std::vector<const char*>& queries, std::vector<std::string> alarms);
  Trouble of_ssc32();
  Trouble of_maestro();
  Trouble of_serial(std::vector<std::string> alarms);
  Trouble of_drives();
  Trouble of_emulator(std::vector<std::string> alarms);
  Trouble kill(const char* what, pid_t pid, std::vector<std::string> alarms);
  Trouble freeze(const char* what, pid_t pid, std::vector<std::string> alarms);

  Stage& stage_;
  DeviceRig& rig_;
  std::mt19937_64& random_;
};

}  // namespace corbot::soak
