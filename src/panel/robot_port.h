// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include "client/request.h"

namespace corbot::panel {

/// The panel's interface to one robot. Each function may block. Each reports an error by a std::exception,
/// whose text is for people.
class RobotPort {
 public:
  RobotPort() = default;
  RobotPort(const RobotPort&) = delete;
  RobotPort& operator=(const RobotPort&) = delete;
  virtual ~RobotPort() = default;

  /// Connects, also for stop(). Returns an object with the data that do not change until the next connect().
  [[nodiscard]] virtual nlohmann::json connect() = 0;
  /// Returns the robot's present state as an object. The thread of connect() calls it.
  [[nodiscard]] virtual nlohmann::json state() = 0;
  /// Stops the arm and returns when the arm is at rest. Another thread calls it, even while the other
  /// functions hang or have failed.
  virtual void stop() = 0;
  /// Starts a motion, or executes another request, without a wait for a motion. Returns an object for the
  /// reply. A third thread calls it.
  [[nodiscard]] virtual nlohmann::json call(const client::Request& request) = 0;
};

}  // namespace corbot::panel
