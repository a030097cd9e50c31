// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "rt/backends/bus/device_error.h"

namespace corbot::rt {

inline constexpr std::int64_t kBitsPerByte = 10;  ///< 8N1
/// The time between two pulses of a servo.
inline constexpr std::int64_t kServoFrame_ns = 20'000'000;

/// The line of a serial controller. No call blocks longer than its deadline. Not real-time safe. Every
/// failure throws DeviceError and leaves the line to be closed.
class SerialLine {
 public:
  using Clock = std::chrono::steady_clock;

  SerialLine() = default;
  SerialLine(const SerialLine&) = delete;
  SerialLine& operator=(const SerialLine&) = delete;
  virtual ~SerialLine() = default;

  /// `path`: of a device, or "unix:" and that of a stream socket. `baud`: one that termios supports; without
  /// effect at a socket.
  virtual void open(const std::string& path, int baud) = 0;
  virtual void close() noexcept = 0;
  virtual void write(std::span<const std::uint8_t> bytes, Clock::time_point deadline) = 0;
  /// Reads all bytes.
  virtual void read_exactly(std::span<std::uint8_t> into, Clock::time_point deadline) = 0;
  /// Drops unsolicited input.
  virtual void discard_input() = 0;
  /// Returns the time that its adapter keeps received data; empty if it is not known.
  [[nodiscard]] virtual std::optional<int> latency_ms() const { return std::nullopt; }
};

/// A serial line of the kernel, raw, 8N1, for this process alone; or a Unix stream socket, as an emulated
/// controller has it.
class SerialPort final : public SerialLine {
 public:
  ~SerialPort() override { close(); }

  void open(const std::string& path, int baud) override;
  void close() noexcept override;
  [[nodiscard]] bool is_open() const noexcept { return fd_ >= 0; }

  void write(std::span<const std::uint8_t> bytes, Clock::time_point deadline) override;
  /// Reads at least one byte; fewer than requested is no failure.
  std::size_t read(std::span<std::uint8_t> into, Clock::time_point deadline);
  void read_exactly(std::span<std::uint8_t> into, Clock::time_point deadline) override;
  /// Throws if the line was cut, without sending anything.
  void check();
  void discard_input() override;
  [[nodiscard]] std::optional<int> latency_ms() const override;

  /// Tells whether termios supports this speed.
  [[nodiscard]] static bool is_baud(int baud) noexcept;
  /// Tells whether a path has the form of a socket, "unix:/path".
  [[nodiscard]] static bool is_socket(std::string_view path) noexcept;

 private:
  void open_socket(std::string_view path);
  void ask_for_low_latency() noexcept;
  void await(short events, Clock::time_point deadline, DeviceCause late);
  [[noreturn]] void fail(DeviceCause cause, const std::string& what) const;

  std::string path_;
  int fd_{-1};
  bool is_socket_{false};
  bool is_exclusive_{false};  ///< made so by this object
  bool is_stuck_{false};      ///< it did not take the written bytes
};

}  // namespace corbot::rt
