// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "rt/backends/bus_device.h"

namespace corbot::rt {

struct MaestroSettings {
  std::string port;
  int baud{115200};       ///< of no consequence on the USB port
  int device_number{-1};  ///< 0 .. 127: Pololu protocol, for several boards on one line; -1: compact protocol
  bool crc{false};        ///< every command ends with a CRC-7, as the board must be set to
  bool readback{false};
  std::size_t servos{kMaxServos};
};

/// Pololu Maestro: binary over USB or a serial line, a quarter of a microsecond, 50 Hz. Facts: the maker's
/// manual.
class Maestro final : public BusDevice {
 public:
  explicit Maestro(MaestroSettings settings,
                   std::unique_ptr<SerialLine> line = std::make_unique<SerialPort>())
      : settings_(std::move(settings)), line_(std::move(line)), port_(*line_) {}

  std::string open() override;
  void close() noexcept override { port_.close(); }
  [[nodiscard]] std::int64_t period_ns() const noexcept override { return period_ns_; }
  void send(const ServoFrame& frame, bool approach) override;
  [[nodiscard]] std::int64_t approach_ns() const noexcept override { return 2'500'000'000; }
  void halt() override;
  BusReading measure(const ServoFrame& frame) override;
  void relax() override;

  using Bytes = std::vector<std::uint8_t>;
  /// One command: its number without the high bit's meaning lost, its data, address and CRC as set.
  [[nodiscard]] Bytes command(std::uint8_t number, const Bytes& data) const;
  /// The targets of a frame, in as few commands as its channels allow: one where they follow each other.
  [[nodiscard]] Bytes targets(const ServoFrame& frame) const;
  /// The maker's CRC-7: polynomial 0x91, least significant bit first.
  [[nodiscard]] static std::uint8_t crc7(const Bytes& message) noexcept;
  /// The bits of the error register in words.
  [[nodiscard]] static std::string errors_in_words(unsigned errors);

 private:
  void write(const Bytes& bytes);
  [[nodiscard]] unsigned ask(std::uint8_t number, const Bytes& data);
  /// Throws when the error register is not empty.
  void check_errors();

  MaestroSettings settings_;
  const std::unique_ptr<SerialLine> line_;
  SerialLine& port_;
  std::int64_t period_ns_{20'000'000};
  ServoFrame last_{};
  bool is_slow_{false};  ///< the speed limits of an approach are set
  int frames_since_check_{0};
};

}  // namespace corbot::rt
