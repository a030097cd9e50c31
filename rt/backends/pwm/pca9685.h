// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "rt/backends/bus/bus_device.h"
#include "rt/backends/pwm/i2c_bus.h"

namespace corbot::rt {

struct Pca9685Settings {
  /// The internal oscillator is true to some percent; measure a pulse, and correct this.
  double oscillator_hz{25e6};
  double frame_hz{50.0};  ///< wanted rate; the prescaler determines the real one
};

/// PCA9685: sixteen 12-bit PWM outputs on I2C. Facts: the maker's data sheet. Pulses go on without the
/// program. So a chip that comes back is read first, and ramps from its present pulses.
class Pca9685 final : public BusDevice {
 public:
  static constexpr std::uint32_t kChannels = 16;
  static constexpr int kCounts = 4096;

  Pca9685(std::unique_ptr<I2cBus> bus, Pca9685Settings settings)
      : bus_(std::move(bus)), settings_(settings) {}

  std::string open() override;
  void close() noexcept override;
  [[nodiscard]] std::int64_t period_ns() const noexcept override { return period_ns_; }
  bool send(const ServoFrame& frame, bool approach) override;
  /// Returns the pulses that the chip sends; 0 for an output that is off.
  BusReading measure(const ServoFrame& frame) override;
  void relax() override;

  /// Returns the value of PRE_SCALE: round(oscillator / (4096 · rate)) − 1, bounded to 3 .. 255.
  [[nodiscard]] static int prescale_for(double oscillator_hz, double frame_hz) noexcept;
  /// Returns the length of one count at a prescale, microseconds.
  [[nodiscard]] static double count_us(double oscillator_hz, int prescale) noexcept;
  /// Returns the counts of a pulse, 1 .. 4095; 0 for a pulse of 0.
  [[nodiscard]] static int counts_of(double pulse_us, double count_us) noexcept;

 private:
  /// An address without acknowledge means at the start that there is no chip, later that one answer was
  /// missed.
  void read_block(std::uint8_t first, std::span<std::uint8_t> into);
  void write_block(std::uint8_t first, std::span<const std::uint8_t> bytes);
  [[nodiscard]] DeviceError missed(const DeviceError& error) const;
  [[nodiscard]] std::uint8_t read(std::uint8_t number);
  void write(std::uint8_t number, std::uint8_t value);
  /// Changes the prescaler, for which the chip must sleep; the pulses keep their length in microseconds.
  void set_prescale(std::uint8_t mode, int from, int to);
  void wake(std::uint8_t mode);
  /// Returns the counts that an output sends; empty: it is off, or on for good.
  [[nodiscard]] std::optional<int> counts_at(std::uint32_t channel);
  void write_counts(std::uint32_t channel, int counts);

  std::unique_ptr<I2cBus> bus_;
  Pca9685Settings settings_;
  double count_us_{4.88};
  std::int64_t period_ns_{20'000'000};
  ServoFrame last_{};
  bool is_open_{false};  ///< open() has found it
};

}  // namespace corbot::rt
