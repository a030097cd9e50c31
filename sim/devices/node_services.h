// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/can.h>

#include <cstdint>
#include <vector>

#include "sim/devices/can_objects.h"

namespace corbot::sim {

/// The services that the parts of an emulated CANopen node need from it.
class NodeServices {
 public:
  virtual ~NodeServices() = default;
  /// Updates the objects that the device itself writes.
  virtual void refresh() = 0;
  /// Returns why it is not written in the present state of the node; 0: it is.
  [[nodiscard]] virtual std::uint32_t check_state(ObjectKey key) const = 0;
  /// Tells whether requests for it get no answer.
  [[nodiscard]] virtual bool is_unanswered(ObjectKey key) const = 0;
  /// Writes an object, and carries out its effect.
  virtual void apply(ObjectKey key, std::int64_t value) = 0;
  virtual void send(canid_t id, std::vector<std::uint8_t> data) = 0;
  virtual void send_emergency(std::uint16_t code) = 0;
};

}  // namespace corbot::sim
