// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

namespace corbot::panel {

/// One robot as the panel needs it. Each function may block. An error leaves as a std::exception whose text is for people.
class RobotPort {
 public:
  RobotPort() = default;
  RobotPort(const RobotPort&) = delete;
  RobotPort& operator=(const RobotPort&) = delete;
  virtual ~RobotPort() = default;

  /// Connects, for stop() as well. Returns what does not change until the next connect(): an object.
  [[nodiscard]] virtual nlohmann::json connect() = 0;
  /// The state of the robot now: an object. The thread of connect() calls it.
  [[nodiscard]] virtual nlohmann::json state() = 0;
  /// Stops the arm and returns when it is at rest. Another thread calls it, also while the others hang or have failed.
  virtual void stop() = 0;
};

}  // namespace corbot::panel
