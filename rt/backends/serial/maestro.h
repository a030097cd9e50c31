// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "rt/backends/bus/bus_device.h"
#include "rt/backends/serial/serial_dialog.h"

namespace corbot::rt {

struct MaestroSettings {
  std::string port;
  int baud{115200};  ///< of no consequence on the USB port
  /// 0 .. 127: Pololu protocol, for several boards on one line; -1: compact protocol.
  int device_number{-1};
  bool crc{false};  ///< every command ends with a CRC-7, as the board must be set to
  bool readback{false};
  std::size_t servos{kMaxServos};
  /// Sends channels that follow each other in one command. Mini Maestros support it, the Micro Maestro does
  /// not.
  bool multi_target{false};
  /// The board is set to "UART, detect baud rate", and accepts nothing before the byte that shows it. For any
  /// other board this byte is an error, after which its servos go home.
  bool detect_baud{false};
  double approach_us_per_s2{2500.0};  ///< greatest acceleration of an approach
};

/// Pololu Maestro: binary over USB or a serial line, a quarter of a microsecond, 50 Hz. Facts: the maker's
/// manual.
class Maestro final : public BusDevice {
 public:
  explicit Maestro(MaestroSettings settings,
                   std::unique_ptr<SerialLine> line = std::make_unique<SerialPort>())
      : settings_(std::move(settings)), dialog_(std::move(line)) {}

  std::string open() override;
  void close() noexcept override { dialog_.close(); }
  [[nodiscard]] std::int64_t period_ns() const noexcept override { return period_ns_; }
  bool send(const ServoFrame& frame, bool approach) override;
  [[nodiscard]] std::int64_t approach_ns() const noexcept override { return approach_ns_; }
  [[nodiscard]] std::optional<bool> has_arrived(BusReading& on_the_way) override;
  void halt() override;
  BusReading measure(const ServoFrame& frame) override;
  [[nodiscard]] bool has_answered() noexcept override { return dialog_.take_replied(); }
  void relax() override;
  [[nodiscard]] std::string drain_log() override { return std::exchange(log_, {}); }

  /// Opens the line. Returns the errors that the device reports, which clears them.
  [[nodiscard]] unsigned identify();

  using Bytes = std::vector<std::uint8_t>;
  /// Returns one command: its number (without the high bit in the Pololu protocol), its data, and address and
  /// CRC as set.
  [[nodiscard]] Bytes command(std::uint8_t number, const Bytes& data) const;
  /// Returns the targets of a frame, in as few commands as the board and the channels allow.
  [[nodiscard]] Bytes targets(const ServoFrame& frame) const;
  /// Returns the maker's CRC-7: polynomial 0x91, least significant bit first.
  [[nodiscard]] static std::uint8_t crc7(const Bytes& message) noexcept;
  /// Returns the names of the bits of the error register.
  [[nodiscard]] static std::string describe_errors(unsigned errors);

 private:
  void approach_to(const ServoFrame& frame);
  void go_elsewhere(const ServoFrame& frame);
  [[nodiscard]] std::optional<SerialDialog::Pulses> look();
  /// Called before an approach: the board's own time-out is no fault then.
  void clear_timeout();
  /// Returns the limits of the board's own motion; 0: no limit.
  [[nodiscard]] Bytes limits(const ServoFrame& frame, unsigned speed, unsigned acceleration) const;
  void send_query(const Bytes& bytes);
  [[nodiscard]] unsigned query_errors();
  [[nodiscard]] unsigned read_word();
  [[nodiscard]] unsigned read_position();
  [[nodiscard]] SerialDialog::Pulses query(const ServoFrame& frame);
  /// Reads until stable: a garbled byte must not decide an approach's duration, or the place of a halt.
  [[nodiscard]] SerialDialog::Pulses stable_pulses(const ServoFrame& frame);
  /// Tells whether it replies, by the position of the frame's first servo. Throws if it has restarted, or if
  /// there was no reply for long.
  [[nodiscard]] bool is_still_there(const ServoFrame& frame);
  /// Throws if the error register is not empty, or was not reported for several checks.
  void check_errors();
  /// Throws if a servo that was given a target has no pulses: noise, if a second query has another reply.
  void check_restart(std::uint32_t channel, unsigned position);
  [[noreturn]] void refuse(unsigned errors) const;

  MaestroSettings settings_;
  SerialDialog dialog_;
  std::int64_t period_ns_{20'000'000};
  std::int64_t approach_ns_{2'500'000'000};
  ServoFrame last_{};  ///< the last targets; before any, those of the approach that begins
  std::string log_;
  ServoFrame given_{};         ///< the last frame that was no approach
  bool is_served_{false};      ///< since the last approach
  bool is_slow_{false};        ///< the limits of an approach are set
  bool is_on_the_way_{false};  ///< an approach has its limits and targets, and nothing has ended it
  std::size_t approached_{0};  ///< servos that the approach under way has given pulses
  int frames_since_check_{0};
  int unanswered_checks_{0};          ///< in a row
  SerialDialog::Pulses polled_us_{};  ///< by has_arrived()
  int looks_unchanged_{0};
  unsigned found_errors_{0};
};

}  // namespace corbot::rt
