// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "panel/order.h"
#include "panel/performer.h"

namespace corbot::panel {

/// The panel's interface to one robot or cell. Each function may block. Each reports an error by a
/// std::exception, whose text is for people.
class Port {
 public:
  Port() = default;
  Port(const Port&) = delete;
  Port& operator=(const Port&) = delete;
  virtual ~Port() = default;

  /// Connects, also for stop(). Returns an object with the data that do not change until the next connect().
  [[nodiscard]] virtual nlohmann::json connect() = 0;
  /// Returns the present state as an object. The thread of connect() calls it.
  [[nodiscard]] virtual nlohmann::json state() = 0;
  /// Stops the arms and returns when they are at rest. Another thread calls it, even while the other
  /// functions hang or have failed.
  virtual void stop() = 0;
  /// Starts a motion, or executes another order, without a wait for a motion. Returns an object for the
  /// reply. A third thread calls it.
  [[nodiscard]] virtual nlohmann::json call(const Order& order) = 0;
  /// Connects anew, for one program. The program's thread calls it.
  [[nodiscard]] virtual std::unique_ptr<Performer> performer() = 0;
  /// Returns the newest picture of a camera, a JPEG file; null if there is none. Any thread may call it.
  [[nodiscard]] virtual std::shared_ptr<const std::string> picture() const { return nullptr; }
};

}  // namespace corbot::panel
