// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "rt/backends/bus/bus_device.h"
#include "rt/backends/serial/serial_dialog.h"
#include "rt/backends/serial/stop_input_watch.h"

namespace corbot::rt {

struct Ssc32Settings {
  std::string port;
  int baud{115200};
  bool readback{false};
  std::size_t servos{kMaxServos};  ///< number in a frame, for the rate
  char stop_input{0};              ///< 'A' .. 'F': input of an emergency stop; 0: none
  bool stop_at_high{true};         ///< pressed is 5 V: a contact to ground that opens, or a wire that breaks
};

/// Lynxmotion SSC-32 and SSC-32U: ASCII over a serial line, 1 us, 50 Hz. Facts: the makers' manuals.
class Ssc32 final : public BusDevice {
 public:
  explicit Ssc32(Ssc32Settings settings, std::unique_ptr<SerialLine> line = std::make_unique<SerialPort>())
      : settings_(std::move(settings)), dialog_(std::move(line)) {}

  std::string open() override;
  void close() noexcept override { dialog_.close(); }
  [[nodiscard]] std::int64_t period_ns() const noexcept override { return period_ns_; }
  bool send(const ServoFrame& frame, bool approach) override;
  BusReading measure(const ServoFrame& frame) override;
  [[nodiscard]] bool has_answered() noexcept override { return dialog_.take_replied(); }
  [[nodiscard]] bool has_stop_input() const noexcept override { return settings_.stop_input != 0; }
  StopInputLevel emergency_stop() override;
  void relax() override;
  [[nodiscard]] std::string drain_log() override { return std::exchange(log_, {}); }

  /// Returns the bytes of one group move; `time_ms` 0: none. Pulses are rounded to 1 us and bounded to 500 ..
  /// 2500.
  [[nodiscard]] static std::string group(const ServoFrame& frame, int time_ms);
  /// Returns the model by the reply to VER; empty if it is no SSC-32. It trusts nothing.
  [[nodiscard]] static std::string model_of(std::string_view version);
  /// Returns the time between frames that a line of this speed can carry, at least a servo frame (20 ms).
  [[nodiscard]] static std::int64_t shortest_period_ns(std::size_t servos, int baud, bool readback,
                                                       bool stop_input = false,
                                                       std::optional<int> latency_ms = {}) noexcept;

 private:
  using Clock = SerialLine::Clock;

  [[nodiscard]] std::string query_version();
  void clear_latched_stop();
  [[nodiscard]] std::string read_line();
  void query(std::string_view text, std::span<std::uint8_t> reply);
  /// Sends one query for each channel of the frame; each has a reply of one byte, in 10 us.
  [[nodiscard]] SerialDialog::Pulses query(const ServoFrame& frame);
  /// Reads until stable: a garbled byte must not decide where a servo starts.
  [[nodiscard]] SerialDialog::Pulses stable_pulses(const ServoFrame& frame);
  /// Tells whether it replies, by the pulse of one commanded servo. Throws if it has restarted, or if there
  /// was no reply for long.
  [[nodiscard]] bool is_still_there();
  /// Throws if by the reply a commanded servo has had no pulse.
  void check_restart(std::size_t servo, std::uint8_t reply);
  /// Tells whether the stop input is active now, or (active at low only) has been since it was last queried.
  [[nodiscard]] bool query_stop_input();

  Ssc32Settings settings_;
  SerialDialog dialog_;
  std::int64_t period_ns_{20'000'000};
  ServoFrame last_{};
  std::string log_;
  std::size_t given_{0};          ///< number of servos of a frame that have got pulses since open()
  bool is_served_{false};         ///< a frame was sent since open()
  std::size_t queried_{0};        ///< the servo that is_still_there() queried
  bool is_reply_missing_{false};  ///< to that query
  StopInputWatch input_;
};

}  // namespace corbot::rt
