// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace corbot::sim {

/// The registers of a PCA9685, with the rules of its data sheet. The prescaler is writable only while the
/// chip sleeps, and a woken chip needs RESTART to go on. Addresses advance only with auto-increment, ALL_LED
/// goes to all, and off wins over on.
class Pca9685Chip {
 public:
  static constexpr std::size_t kOutputs = 16;

  Pca9685Chip() { power_cycle(); }

  /// Executes one transfer. False: not acknowledged.
  bool write(std::uint8_t first, std::span<const std::uint8_t> bytes);
  bool read(std::uint8_t first, std::span<std::uint8_t> into);

  void power_cycle();
  /// Lets the next `count` transfers go unacknowledged.
  void refuse_next(int count) { refused_ = count; }

  /// Returns the counts, of 4096, for which an output is high; 0 while it is off or the chip sleeps.
  [[nodiscard]] int high_counts(std::size_t output) const;
  [[nodiscard]] std::uint8_t reg(std::uint8_t number) const { return registers_[number]; }
  /// Returns the number of transfers that wrote to an output.
  [[nodiscard]] int led_writes() const { return led_writes_; }

 private:
  void store(std::uint8_t number, std::uint8_t value);
  void store_mode1(std::uint8_t value);

  std::array<std::uint8_t, 256> registers_{};
  bool is_halted_{false};  ///< woken, and waits for RESTART
  int refused_{0};
  int led_writes_{0};
};

}  // namespace corbot::sim
