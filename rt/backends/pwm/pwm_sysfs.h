// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "rt/backends/bus/bus_device.h"

namespace corbot::rt {

struct PwmSysfsSettings {
  std::string chip;                     ///< directory, /sys/class/pwm/pwmchipN
  std::vector<std::uint32_t> channels;  ///< channels of the servos
  double frame_hz{50.0};
  std::chrono::milliseconds permission_within{3000};  ///< udev's time after an export
};

/// PWM outputs of the kernel, by sysfs: nanoseconds, in the steps of the hardware. The files stay open, and a
/// frame writes the duty cycles that have changed. Pulses go on without the program.
class PwmSysfs final : public BusDevice {
 public:
  explicit PwmSysfs(PwmSysfsSettings settings) : settings_(std::move(settings)) {}
  ~PwmSysfs() override { close(); }

  std::string open() override;
  void close() noexcept override;
  [[nodiscard]] std::int64_t period_ns() const noexcept override { return period_ns_; }
  bool send(const ServoFrame& frame, bool approach) override;
  /// Returns the pulses that the outputs had when they were opened or have got since; no pulse for an output
  /// that is off.
  BusReading measure(const ServoFrame& frame) override;
  /// Switches the outputs off and unexports those that this program has exported.
  void relax() override;

 private:
  struct Output {
    std::uint32_t channel{};
    std::string directory;
    int duty_fd{-1};
    std::int64_t duty_ns{0};
    bool is_on{false};
    bool is_ours{false};  ///< exported by this program
  };

  void open(Output& output);
  void export_and_wait(Output& output);
  /// Sets period, duty cycle and polarity in an order that the kernel accepts. The duty cycle never exceeds
  /// the period, and the polarity changes only while the output is off.
  void prepare(Output& output);
  void set_duty(Output& output, std::int64_t duty_ns);
  void switch_on(Output& output);
  void switch_off(Output& output);
  /// Checks that one output, another one each time, is still there and on.
  void look_after_one();
  [[nodiscard]] Output* find(std::uint32_t channel);

  [[nodiscard]] std::string read_text(const std::string& path) const;
  [[nodiscard]] std::int64_t read_number(const std::string& path) const;
  void write_text(const std::string& path, const std::string& text) const;

  PwmSysfsSettings settings_;
  std::vector<Output> outputs_;
  std::int64_t period_ns_{20'000'000};
  std::size_t looked_after_{0};
};

}  // namespace corbot::rt
