// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "rt/backends/bus/device_error.h"
#include "rt/backends/pwm/i2c_bus.h"
#include "sim/devices/pca9685_chip.h"

namespace corbot::test {

/// A bus with one chip on it, which the test keeps.
class ChipBus final : public rt::I2cBus {
 public:
  struct State {
    std::mutex mutex;  // of all below, where several threads look
    sim::Pca9685Chip chip;
    bool is_there{true};
    int absent_next{0};                               ///< so many transfers find no chip
    std::vector<std::pair<int, std::size_t>> writes;  ///< first register, bytes
  };
  explicit ChipBus(State& state) : state_(state) {}
  void open() override {
    const std::lock_guard lock(state_.mutex);
    check_there();
  }
  void close() noexcept override {}
  [[nodiscard]] const std::string& name() const noexcept override { return name_; }
  void write(std::uint8_t first, std::span<const std::uint8_t> bytes) override {
    const std::lock_guard lock(state_.mutex);
    check_there();
    check(state_.chip.write(first, bytes));
    state_.writes.emplace_back(first, bytes.size());
  }
  void read(std::uint8_t first, std::span<std::uint8_t> into) override {
    const std::lock_guard lock(state_.mutex);
    check_there();
    check(state_.chip.read(first, into));
  }

 private:
  void check_there() {
    if (!state_.is_there || state_.absent_next > 0) {
      state_.absent_next = std::max(state_.absent_next - 1, 0);
      throw rt::DeviceError(DeviceCause::kNotThere, name_ + ": no device");
    }
  }
  void check(bool is_acknowledged) const {
    if (!is_acknowledged) throw rt::DeviceError(DeviceCause::kNoAnswer, name_ + ": not acknowledged");
  }
  State& state_;
  const std::string name_{"fake 0x40"};
};

}  // namespace corbot::test
