// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sched.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "support/emulated_device.h"

namespace corbot::test {

/// corbot-sim cia402 on a bus of its own; on the interface that CORBOT_RIG_CAN names where that is set, and
/// then no other test may run on it.
class EmulatedDrives : public EmulatedDevice {
 public:
  /// `directory` exists; the bus's socket and the record are made in it.
  EmulatedDrives(const std::string& program, const std::string& directory, int nodes,
                 const std::vector<std::string>& more = {})
      : EmulatedDevice(words(program, directory, nodes, more), directory + "/counts.csv"),
        bus_(bus(directory)) {}

  /// Starts the drives. Real drives have processors of their own. So the emulator computes before ordinary
  /// programs, at the lowest real-time priority, if this user may set it, as the real-time task does.
  void start() {
    EmulatedDevice::start();
    if (testing::Test::HasFatalFailure()) return;
    const sched_param lowest{.sched_priority = 1};
    (void)::sched_setscheduler(pid(), SCHED_RR, &lowest);
  }
  /// The name of the bus, as a profile has it.
  [[nodiscard]] const std::string& bus() const { return bus_; }
  /// By node: "positions", "targets", or "states".
  std::map<int, std::int32_t> counts(const std::string& what = "positions") {
    std::map<int, std::int32_t> found;
    for (const auto& [node, count] : values(what)) found[node] = static_cast<std::int32_t>(count);
    return found;
  }
  /// The largest step between two targets that any node was ever given one after the other, and of any
  /// shaft. The first row of a node counts from `begin`.
  std::pair<std::int64_t, std::int64_t> largest_steps(double begin = 0.0) const {
    std::map<std::uint32_t, std::pair<double, double>> last;
    std::pair<double, double> largest{0.0, 0.0};
    for (const DeviceRow& row : rows()) {
      const auto [at, is_new] = last.try_emplace(row.channel, begin, begin);
      largest.first = std::max(largest.first, std::abs(row.given - at->second.first));
      largest.second = std::max(largest.second, std::abs(row.shaft - at->second.second));
      at->second = {row.given, row.shaft};
    }
    return {std::lround(largest.first), std::lround(largest.second)};
  }

 private:
  static std::string bus(const std::string& directory) {
    const char* interface = std::getenv("CORBOT_RIG_CAN");
    return interface != nullptr ? interface : "unix:" + directory + "/can";
  }
  static std::vector<std::string> words(const std::string& program, const std::string& directory, int nodes,
                                        const std::vector<std::string>& more) {
    std::vector<std::string> command{program,        "cia402",  "--can",
                                     bus(directory), "--nodes", std::to_string(nodes)};
    command.insert(command.end(), more.begin(), more.end());
    return command;
  }

  std::string bus_;
};

}  // namespace corbot::test
