// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "contract/device_fixture.h"
#include "corbot/channel/records.h"

namespace corbot::test {

/// Every set-point of a robot while this lives, out of the flight recorder of its task.
class PathLog {
 public:
  explicit PathLog(const std::string& robot);
  ~PathLog();
  PathLog(const PathLog&) = delete;
  PathLog& operator=(const PathLog&) = delete;

  /// Ends the log. Throws std::runtime_error where a cycle was missed.
  const std::vector<Snapshot>& finish();

 private:
  void follow();

  const std::string robot_;
  std::vector<Snapshot> path_;
  std::uint64_t lost_{0};
  std::atomic<bool> end_{false};
  std::thread thread_;
};

/// How a device followed a path.
struct Following {
  std::size_t outputs{};    ///< instants at which something changed
  double deviation_m{};     ///< of the TCP from the planned path, at worst
  double quantisation_m{};  ///< what half a unit at every joint, a corner cut, and servos that start one by
                            ///< one can do
  double beyond_m{
      -1.0};  ///< the largest excess of the former over the latter, and what a late output cuts off
};

/// Compares the TCP of a device's outputs with the set-points before each output: those of as many cycles as
/// fit into `window_s`. The nearest set-point counts, for a device is behind the cycle, never ahead of it.
Following following(const ArmModel& arm, const std::vector<Snapshot>& path,
                    const std::vector<Output>& outputs, const DeviceFacts& facts, double window_s);

}  // namespace corbot::test
