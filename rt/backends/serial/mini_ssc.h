// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "rt/backends/bus/bus_device.h"
#include "rt/backends/serial/serial_port.h"

namespace corbot::rt {

struct MiniSscSettings {
  std::string port;
  int baud{9600};  ///< 2400 or 9600
  /// The pulse widths of positions 0 and 254: 500 and 2500 with the controller's jumper for the whole range.
  double first_us{500.0};
  double last_us{2500.0};
  std::size_t servos{kMaxServos};
};

/// Mini SSC II, and compatible controllers: three bytes for each servo, 255 positions, no replies. So nothing
/// shows whether it is there.
class MiniSsc final : public BusDevice {
 public:
  explicit MiniSsc(MiniSscSettings settings) : settings_(std::move(settings)) {}

  std::string open() override;
  void close() noexcept override { port_.close(); }
  [[nodiscard]] std::int64_t period_ns() const noexcept override { return period_ns_; }
  bool send(const ServoFrame& frame, bool approach) override;
  BusReading measure(const ServoFrame&) override {
    port_.check();
    return {};
  }
  void relax() override {}  // it has no such command

  /// Returns the position nearest to a pulse, 0 .. 254.
  [[nodiscard]] std::uint8_t position_of(double pulse_us) const noexcept;

 private:
  MiniSscSettings settings_;
  SerialPort port_;
  std::int64_t period_ns_{20'000'000};
};

}  // namespace corbot::rt
