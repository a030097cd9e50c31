// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace corbot::sim {

enum class Ssc32Model { kSsc32, kSsc32U };

inline constexpr int kSsc32Channels = 32;
inline constexpr int kSsc32PulseMin_us = 500;
inline constexpr int kSsc32PulseMax_us = 2500;

/// The commands of an SSC-32 in parsed form.
namespace ssc32 {

struct ServoMove {
  int channel;
  int pulse_us;
  int speed_us_per_s;  ///< at most this; 0: no limit given
};
struct GroupMove {
  std::vector<ServoMove> moves;
  int time_ms;  ///< at least this; 0: no time given
};
struct Offset {
  int channel;
  int offset_us;
};
using Offsets = std::vector<Offset>;
struct Level {
  int channel;
  bool is_high;
};
using Levels = std::vector<Level>;
struct QueryMoving {};
struct QueryPulses {
  std::vector<int> channels;
};
struct QueryVersion {};
struct Stop {
  int channel;
};
struct DigitalRead {
  int pin;  ///< 0 = A
  bool is_latching;
};
using DigitalReads = std::vector<DigitalRead>;
struct AnalogReads {
  std::vector<int> pins;
};

using Command = std::variant<GroupMove, Offsets, Levels, QueryMoving, QueryPulses, QueryVersion, Stop,
                             DigitalReads, AnalogReads>;

[[nodiscard]] constexpr int digital_inputs(Ssc32Model model) { return model == Ssc32Model::kSsc32 ? 4 : 6; }
[[nodiscard]] constexpr int analog_inputs(Ssc32Model model) { return model == Ssc32Model::kSsc32 ? 4 : 8; }

/// Parses one command without its CR, in capitals and without white space. Returns nothing if the model would
/// not understand all of it: a command is taken as a whole or not at all.
[[nodiscard]] std::optional<Command> parse(std::string_view text, Ssc32Model model);

}  // namespace ssc32
}  // namespace corbot::sim
