// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/can.h>
#include <poll.h>

#include <memory>
#include <string>
#include <vector>

namespace corbot::sim {

/// A CAN bus with emulated nodes. Failures of open() throw std::runtime_error.
class CanBus {
 public:
  CanBus() = default;
  CanBus(const CanBus&) = delete;
  CanBus& operator=(const CanBus&) = delete;
  virtual ~CanBus() = default;

  virtual void open() = 0;
  virtual void close() noexcept = 0;
  [[nodiscard]] virtual bool is_open() const = 0;
  /// Appends the descriptors to be polled.
  virtual void add_to(std::vector<pollfd>& fds) const = 0;
  /// Returns the frames that others have sent, without waiting.
  [[nodiscard]] virtual std::vector<can_frame> read() = 0;
  /// Sends to all others; a program that reads too slowly loses frames.
  virtual void send(const can_frame& frame) = 0;
};

/// Makes a bus: "unix:/path" is a bus of its own at a socket to which others connect, else an interface of
/// the kernel.
[[nodiscard]] std::unique_ptr<CanBus> make_can_bus(const std::string& name);

}  // namespace corbot::sim
