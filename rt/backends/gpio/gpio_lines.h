// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace corbot::rt {

/// GPIO lines requested from the kernel; they are released when the object ends, also by a crash. A failed
/// request throws DeviceError, which names chip, line and, if a line is taken, its consumer.

/// One output or several, set together.
class GpioOutputs {
 public:
  GpioOutputs() = default;
  GpioOutputs(const GpioOutputs&) = delete;
  GpioOutputs& operator=(const GpioOutputs&) = delete;
  virtual ~GpioOutputs() = default;

  /// Sets the lines. Bit i is line i in the order of the request; 1 is active. It makes one system call. The
  /// call does not sleep on a controller in the processor's own address space, but does behind I2C or USB.
  /// Returns 0, or an errno.
  [[nodiscard]] virtual int set(std::uint32_t values) noexcept = 0;
};

class GpioInput {
 public:
  GpioInput() = default;
  GpioInput(const GpioInput&) = delete;
  GpioInput& operator=(const GpioInput&) = delete;
  virtual ~GpioInput() = default;

  /// Waits for an edge, at most this long (below a second), and takes a bounded number. True if there was
  /// one. Throws DeviceError if the chip has gone. A line without interrupts has no edges: the call then only
  /// pauses.
  virtual bool wait_edge(std::chrono::nanoseconds longest) = 0;
  /// Tells whether the line is active now. Throws DeviceError.
  [[nodiscard]] virtual bool is_active() = 0;
};

enum class GpioBias { kAsIs, kDisabled, kPullUp, kPullDown };

/// One line or several of a chip.
struct GpioRequest {
  std::string chip;                ///< /dev/gpiochipN
  std::vector<std::string> lines;  ///< names, or offsets in digits
  bool active_low{false};
  GpioBias bias{GpioBias::kAsIs};  ///< of inputs
  std::string consumer{"corbot"};  ///< name that other programs see
};

struct GpioLineInfo {
  /// The consumer of a line in use, as its user named it; empty: the line is free.
  std::optional<std::string> consumer;
  bool is_output{false};
};

/// The source of lines; tests bring their own.
class GpioChips {
 public:
  GpioChips() = default;
  GpioChips(const GpioChips&) = delete;
  GpioChips& operator=(const GpioChips&) = delete;
  virtual ~GpioChips() = default;
  /// Requests outputs, all inactive at first.
  [[nodiscard]] virtual std::unique_ptr<GpioOutputs> outputs(const GpioRequest& request) = 0;
  [[nodiscard]] virtual std::unique_ptr<GpioInput> input(const GpioRequest& request) = 0;
  /// Requests nothing and changes nothing. Throws DeviceError if there is no such line.
  [[nodiscard]] virtual GpioLineInfo info(const std::string& chip, const std::string& line) = 0;
};

/// Returns the lines of the kernel, by libgpiod.
[[nodiscard]] std::unique_ptr<GpioChips> kernel_gpio();

}  // namespace corbot::rt
