// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "sim/devices/byte_line.h"
#include "sim/devices/serial_device.h"
#include "sim/devices/servo_frames.h"
#include "sim/devices/ssc32_command.h"

namespace corbot::sim {

struct Ssc32Options {
  Ssc32Model model{Ssc32Model::kSsc32U};
  int baud{115200};
  std::string version{};  ///< the answer to VER; empty: that of the model
  /// The meaning of positions 0 and 254 of a Mini SSC command.
  double mini_ssc_first_us{500.0};
  double mini_ssc_last_us{2500.0};
  ServoModelOptions servo{};
  double shaft_us{1500.0};  ///< initial positions of the shafts
};

/// Lynxmotion SSC-32 and SSC-32U: ASCII commands that end with CR, and those of the Mini SSC II.
class Ssc32Device final : public SerialDevice {
 public:
  explicit Ssc32Device(Ssc32Options options);

  void receive(std::span<const std::uint8_t> bytes, std::int64_t now_ns) override;
  std::vector<std::uint8_t> answers(std::int64_t now_ns) override;
  [[nodiscard]] std::optional<std::int64_t> next_answer_ns() const override;

  [[nodiscard]] std::size_t channel_count() const override { return kSsc32Channels; }
  [[nodiscard]] double pulse_us(std::size_t channel, std::int64_t now_ns) override;
  [[nodiscard]] double shaft_us(std::size_t channel, std::int64_t now_ns) override;

  void power_cycle(std::int64_t now_ns) override;
  bool set_input(char name, bool is_high) override;
  /// Sets the pin of an analog input, 0 .. 5 V; digital inputs have the same pins.
  bool set_analog(char name, double volts);

  /// Returns the level of a channel that is a plain output; nothing while it is a servo's.
  [[nodiscard]] std::optional<bool> output(std::size_t channel) const;
  /// Returns the number of commands so far that were not understood, and hence ignored.
  [[nodiscard]] std::uint64_t bad_input_count() const { return bad_input_count_; }

 private:
  /// A position that goes linearly from one width to another, offset not included.
  struct Channel {
    bool has_position{false};
    int from_us{0};
    int to_us{0};
    std::int64_t start_ns{0};
    std::int64_t end_ns{0};
    std::int64_t busy_until_ns{0};  ///< STOP ends a motion, not this
    int offset_us{0};
    std::optional<bool> output{};

    [[nodiscard]] int position_us(std::int64_t time_ns) const;
  };
  struct Pin {
    double volts{5.0};  // a pull-up
    bool was_low{false};
    bool is_analog_valid{false};
  };

  void advance(std::int64_t now_ns);
  void take_byte(std::uint8_t byte);
  void take_mini_ssc(std::uint8_t byte);
  void run_line();
  /// Answers a query of this kind.
  void answer(std::string_view query, std::vector<std::uint8_t> bytes);

  void execute(const ssc32::GroupMove& group);
  void execute(const ssc32::Offsets& offsets);
  void execute(const ssc32::Levels& levels);
  void execute(const ssc32::QueryMoving&);
  void execute(const ssc32::QueryPulses& query);
  void execute(const ssc32::QueryVersion&);
  void execute(const ssc32::Stop& stop);
  void execute(const ssc32::DigitalReads& reads);
  void execute(const ssc32::AnalogReads& reads);
  void jump(Channel& channel, int pulse_us) const;

  Ssc32Options options_;
  ServoFrames frames_;
  ByteLine line_out_;
  std::int64_t now_ns_{0};
  std::array<Channel, kSsc32Channels> channels_{};
  std::array<Pin, 8> pins_{};
  std::string line_;
  bool is_line_too_long_{false};
  std::size_t mini_ssc_bytes_{0};  ///< received of a Mini SSC command
  std::uint8_t mini_ssc_channel_{0};
  std::uint64_t bad_input_count_{0};
};

}  // namespace corbot::sim
