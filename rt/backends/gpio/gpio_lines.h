// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace corbot::rt {

/// GPIO lines that this program has asked the kernel for; given back when the object ends, also by a crash.
/// A failed request throws DeviceError, which names chip, line and, where a line is taken, its consumer.

/// One output or several, set together.
class GpioOutputs {
 public:
  GpioOutputs() = default;
  GpioOutputs(const GpioOutputs&) = delete;
  GpioOutputs& operator=(const GpioOutputs&) = delete;
  virtual ~GpioOutputs() = default;

  /// Bit i is line i in the order of the request; 1 is active. One system call, which does not sleep on a
  /// controller in the processor's own address space, but does behind I2C or USB. 0, or an errno.
  [[nodiscard]] virtual int set(std::uint32_t values) noexcept = 0;
};

class GpioInput {
 public:
  GpioInput() = default;
  GpioInput(const GpioInput&) = delete;
  GpioInput& operator=(const GpioInput&) = delete;
  virtual ~GpioInput() = default;

  /// Waits for an edge, at most this long (below a second), and takes a bounded number. True when there was
  /// one. Throws DeviceError when the chip has gone. A line without interrupts has no edges: then a pause.
  virtual bool wait_edge(std::chrono::nanoseconds longest) = 0;
  /// Whether it is active now. Throws DeviceError.
  [[nodiscard]] virtual bool is_active() = 0;
};

enum class GpioBias { kAsIs, kDisabled, kPullUp, kPullDown };

/// One line or several of a chip.
struct GpioRequest {
  std::string chip;                ///< /dev/gpiochipN
  std::vector<std::string> lines;  ///< names, or offsets in digits
  bool active_low{false};
  GpioBias bias{GpioBias::kAsIs};  ///< of inputs
  std::string consumer{"corbot"};  ///< what other programs see
};

struct GpioLineInfo {
  std::optional<std::string>
      consumer;  ///< of a line that is in use, as its user named it; nothing: it is free
  bool is_output{false};
};

/// Where lines come from; tests bring their own.
class GpioChips {
 public:
  GpioChips() = default;
  GpioChips(const GpioChips&) = delete;
  GpioChips& operator=(const GpioChips&) = delete;
  virtual ~GpioChips() = default;
  /// All lines inactive at first.
  [[nodiscard]] virtual std::unique_ptr<GpioOutputs> outputs(const GpioRequest& request) = 0;
  [[nodiscard]] virtual std::unique_ptr<GpioInput> input(const GpioRequest& request) = 0;
  /// Requests nothing and changes nothing. Throws DeviceError where there is no such line.
  [[nodiscard]] virtual GpioLineInfo info(const std::string& chip, const std::string& line) = 0;
};

/// Those of the kernel, by libgpiod.
[[nodiscard]] std::unique_ptr<GpioChips> kernel_gpio();

}  // namespace corbot::rt
