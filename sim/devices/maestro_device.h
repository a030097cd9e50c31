// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "sim/devices/byte_line.h"
#include "sim/devices/serial_device.h"
#include "sim/devices/servo_frames.h"

namespace corbot::sim {

/// A board as its maker ships it, but with channels that accept every pulse width that it can make.
struct MaestroOptions {
  int baud{115200};
  std::size_t channels{24};
  int device_number{12};
  bool crc{false};          ///< every command except the Mini SSC's ends with a CRC-7
  bool multi_target{true};  ///< supports Set Multiple Targets, as all except the Micro Maestro do
  int mini_ssc_offset{0};
  double mini_ssc_neutral_us{1500.0};
  double mini_ssc_range_us{476.25};  ///< to both sides of neutral
  double min_us{64.0};               ///< targets are clipped to min .. max
  double max_us{4080.0};
  double home_us{0.0};        ///< 0: the pulses stop
  bool errors_go_home{true};  ///< as a board does at every error
  bool detects_baud{false};   ///< set to detect the baud: accepts nothing before the byte AA
  int timeout_ms{0};          ///< an error after this time without a valid command; 0: never
  ServoModelOptions servo{};
  double shaft_us{1500.0};  ///< initial positions of the shafts
};

/// Pololu Maestro: compact, Pololu and Mini SSC protocol. It has no scripts, PWM and inputs.
class MaestroDevice final : public SerialDevice {
 public:
  static constexpr unsigned kSerialCrcError = 1u << 3;
  static constexpr unsigned kSerialProtocolError = 1u << 4;
  static constexpr unsigned kSerialTimeout = 1u << 5;

  explicit MaestroDevice(const MaestroOptions& options);

  void receive(std::span<const std::uint8_t> bytes, std::int64_t now_ns) override;
  std::vector<std::uint8_t> answers(std::int64_t now_ns) override;
  [[nodiscard]] std::optional<std::int64_t> next_answer_ns() const override;

  [[nodiscard]] std::size_t channel_count() const override { return channels_.size(); }
  [[nodiscard]] double pulse_us(std::size_t channel, std::int64_t now_ns) override;
  [[nodiscard]] double shaft_us(std::size_t channel, std::int64_t now_ns) override;

  void power_cycle(std::int64_t now_ns) override;
  bool set_input(char, bool) override { return false; }

  /// Returns the error register, without clearing it.
  [[nodiscard]] unsigned errors() const { return errors_; }

 private:
  /// A channel. Positions are in eighths of a quarter microsecond, and speeds in these per 10 ms. An
  /// acceleration of 1 then adds 1 in 10 ms.
  struct Channel {
    int position{0};  ///< 0: no pulses
    int target{0};
    int velocity{0};
    int speed{0};         ///< limit, 0: none
    int acceleration{0};  ///< limit, 0: none

    void step(int lowest, int highest);
    [[nodiscard]] bool is_at_target() const { return position == target; }
  };

  void advance(std::int64_t now_ns);
  void advance_to(std::int64_t now_ns);
  void let_move(std::int64_t time_ns);
  void take_byte(std::uint8_t byte);
  void take_command_byte(std::uint8_t byte);
  void take_data_byte(std::uint8_t byte);
  void take_mini_ssc_byte(std::uint8_t byte);
  void finish_packet(std::size_t data_begin);
  void execute(std::uint8_t command, std::span<const std::uint8_t> data);
  void for_channel(std::uint8_t command, std::span<const std::uint8_t> data);
  void set_target(std::size_t channel, int quarters);
  void go_home();
  void fail(unsigned error);
  /// Answers a query of this kind.
  void answer(std::string_view query, unsigned value, int bytes);

  MaestroOptions options_;
  ServoFrames frames_;
  ByteLine line_out_;
  std::int64_t now_ns_{0};
  std::int64_t step_ns_{0};  ///< the 10 ms steps up to here are done
  std::vector<Channel> channels_;
  std::vector<std::uint8_t> packet_;  ///< the command being received
  bool is_skipping_{false};           ///< data until the next command are ignored
  unsigned errors_{0};
  bool knows_baud_;
  std::int64_t command_ns_{0};  ///< time of the last valid command, or of the last time-out
};

}  // namespace corbot::sim
