// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/can.h>

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "rt/backends/bus/bus_device.h"

namespace corbot::rt {

using CanFrame = ::can_frame;

/// A CAN bus, raw frames: an interface of the kernel ("can0"), or a virtual bus that another program offers
/// as a Unix socket ("unix:/path", SOCK_SEQPACKET, a can_frame a packet), which needs no privilege and no
/// driver. Never blocks longer than the deadline that it is given. Not real-time safe; every failure throws
/// DeviceError and leaves the port to be closed.
class CanPort {
 public:
  using Clock = std::chrono::steady_clock;

  CanPort() = default;
  CanPort(const CanPort&) = delete;
  CanPort& operator=(const CanPort&) = delete;
  ~CanPort() { close(); }

  /// Only data frames with one of these 11-bit identifiers are read, and error frames of the interface.
  void open(const std::string& interface, const std::vector<canid_t>& identifiers);
  /// At most about so many frames of this port wait for the bus, for a queue that can only grow holds what is
  /// old when it can be sent at last.
  void limit_queue(std::size_t frames);
  void close() noexcept;
  [[nodiscard]] bool is_open() const noexcept { return fd_ >= 0; }
  [[nodiscard]] const std::string& interface() const noexcept { return interface_; }

  /// A transmit queue that is full is tried again until the deadline.
  void write(const CanFrame& frame, Clock::time_point deadline);
  /// The next frame; nothing when the deadline passes first. A deadline in the past asks without waiting.
  /// Its length is at most 8.
  std::optional<CanFrame> read(Clock::time_point deadline);

 private:
  void open_socket(const std::vector<canid_t>& identifiers);
  void open_unix(const std::string& path);
  [[nodiscard]] bool is_wanted(const CanFrame& frame) const;
  /// Throws for the errno of a read or a write.
  [[noreturn]] void fail(int error) const;
  [[noreturn]] void fail(DeviceCause cause, const std::string& what) const;

  std::string interface_;
  std::vector<canid_t> wanted_;  ///< on a virtual bus, which filters nothing
  bool is_virtual_{false};
  int fd_{-1};
};

}  // namespace corbot::rt
