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

/// A CAN bus with raw frames. It is an interface of the kernel ("can0"), or a virtual bus of another program.
/// A virtual bus is a Unix socket ("unix:/path", SOCK_SEQPACKET, one can_frame in each packet) and needs no
/// privilege and no driver. No call blocks longer than its deadline. Not real-time safe. Every failure throws
/// DeviceError and leaves the port to be closed.
class CanPort {
 public:
  using Clock = std::chrono::steady_clock;

  CanPort() = default;
  CanPort(const CanPort&) = delete;
  CanPort& operator=(const CanPort&) = delete;
  ~CanPort() { close(); }

  /// Opens the bus. It reads only data frames with one of these 11-bit identifiers, and error frames of the
  /// interface.
  void open(const std::string& interface, const std::vector<canid_t>& identifiers);
  /// Limits the frames of this port that wait for the bus to about this number. A queue that only grows would
  /// hold outdated frames when it can be sent at last.
  void limit_queue(std::size_t frames);
  void close() noexcept;
  [[nodiscard]] bool is_open() const noexcept { return fd_ >= 0; }
  [[nodiscard]] const std::string& interface() const noexcept { return interface_; }

  /// Writes a frame. It tries again until the deadline while the transmit queue is full.
  void write(const CanFrame& frame, Clock::time_point deadline);
  /// Returns the next frame, of at most 8 bytes; empty if the deadline passes first. A deadline in the past
  /// means no waiting.
  std::optional<CanFrame> read(Clock::time_point deadline);

 private:
  void open_socket(const std::vector<canid_t>& identifiers);
  void open_unix(const std::string& path);
  [[nodiscard]] bool is_wanted(const CanFrame& frame) const;
  /// Throws for the errno of a read or a write.
  [[noreturn]] void fail(int error) const;
  [[noreturn]] void fail(DeviceCause cause, const std::string& what) const;

  std::string interface_;
  std::vector<canid_t> wanted_;  ///< for a virtual bus, which filters nothing
  bool is_virtual_{false};
  int fd_{-1};
};

}  // namespace corbot::rt
