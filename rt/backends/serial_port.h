// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>

namespace corbot::rt {

/// What is wrong with a device, in words and as a number that goes into the alarm.
enum class DeviceCause : std::uint32_t {
  kNone,
  kNotThere,      ///< cannot be opened
  kInUse,         ///< another program has it
  kHungUp,        ///< the plug was pulled
  kWriteTimeout,  ///< takes no more bytes
  kNoAnswer,
  kBadAnswer,
  kDeviceFault,    ///< the device itself reports a fault
  kBusDown,        ///< the network interface went down, or the controller off the bus
  kHeartbeatLost,  ///< a drive on a bus went silent
};

class DeviceError : public std::runtime_error {
 public:
  DeviceError(DeviceCause cause, const std::string& text) : std::runtime_error(text), cause_(cause) {}
  [[nodiscard]] DeviceCause cause() const noexcept { return cause_; }

 private:
  DeviceCause cause_;
};

/// A serial line, raw, 8N1, for this process alone. Never blocks longer than the deadline that it is given.
/// Not real-time safe; every failure throws DeviceError and leaves the port to be closed.
class SerialPort {
 public:
  using Clock = std::chrono::steady_clock;

  SerialPort() = default;
  SerialPort(const SerialPort&) = delete;
  SerialPort& operator=(const SerialPort&) = delete;
  ~SerialPort() { close(); }

  /// `baud`: one of those that termios knows.
  void open(const std::string& path, int baud);
  void close() noexcept;
  [[nodiscard]] bool is_open() const noexcept { return fd_ >= 0; }

  void write(std::span<const std::uint8_t> bytes, Clock::time_point deadline);
  /// Reads at least one byte; fewer than asked for is no failure.
  std::size_t read(std::span<std::uint8_t> into, Clock::time_point deadline);
  /// Reads all of it.
  void read_exactly(std::span<std::uint8_t> into, Clock::time_point deadline);
  /// Forgets what has come in and nobody asked for.
  void discard_input();

  /// Whether termios knows this speed.
  [[nodiscard]] static bool is_baud(int baud) noexcept;

 private:
  void await(short events, Clock::time_point deadline, DeviceCause late);
  [[noreturn]] void fail(DeviceCause cause, const std::string& what) const;

  std::string path_;
  int fd_{-1};
};

}  // namespace corbot::rt
