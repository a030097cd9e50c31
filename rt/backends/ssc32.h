// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "rt/backends/bus_device.h"

namespace corbot::rt {

struct Ssc32Settings {
  std::string port;
  int baud{115200};
  bool readback{false};
  std::size_t servos{kMaxServos};  ///< that a frame will have, for the rate
  char stop_input{0};              ///< 'A' .. 'F': of an emergency stop; 0: none
  bool stop_at_high{true};         ///< pressed is 5 V: a contact to ground that opens, or a wire that breaks
};

/// Lynxmotion SSC-32 and SSC-32U: ASCII over a serial line, 1 us, 50 Hz. Facts: the makers' manuals.
class Ssc32 final : public BusDevice {
 public:
  explicit Ssc32(Ssc32Settings settings, std::unique_ptr<SerialLine> line = std::make_unique<SerialPort>())
      : settings_(std::move(settings)), line_(std::move(line)), port_(*line_) {}

  std::string open() override;
  void close() noexcept override { port_.close(); }
  [[nodiscard]] std::int64_t period_ns() const noexcept override { return period_ns_; }
  void send(const ServoFrame& frame, bool approach) override;
  [[nodiscard]] std::int64_t approach_ns() const noexcept override;
  void halt() override;
  BusReading measure(const ServoFrame& frame) override;
  bool emergency_stop() override;
  void relax() override;

  /// The bytes of one group move; `time_ms` 0: none. Pulses are rounded to 1 us and bounded to 500 .. 2500.
  [[nodiscard]] static std::string group(const ServoFrame& frame, int time_ms);
  /// What VER answers: the model in words; empty when it is no SSC-32. Trusts nothing.
  [[nodiscard]] static std::string model_of(std::string_view version);
  /// Time between frames that a line of this speed can carry, at least a servo frame (20 ms).
  [[nodiscard]] static std::int64_t shortest_period_ns(std::size_t servos, int baud, bool readback,
                                                       bool stop_input = false) noexcept;

 private:
  void write(std::string_view text);
  [[nodiscard]] std::string read_line();
  /// One query for each channel of the frame; each answers a byte, in 10 us.
  void query(const ServoFrame& frame, std::array<double, kMaxServos>& pulse_us);
  /// Whether the stop input is active now, or (active at low only) has been since it was last asked.
  [[nodiscard]] bool ask_stop_input();

  Ssc32Settings settings_;
  const std::unique_ptr<SerialLine> line_;
  SerialLine& port_;
  std::int64_t period_ns_{20'000'000};
  ServoFrame last_{};
  bool is_u_{false};       ///< an SSC-32U
  int frames_pressed_{0};  ///< for which a short press is still told
};

}  // namespace corbot::rt
