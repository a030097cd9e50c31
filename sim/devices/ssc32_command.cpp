// SPDX-License-Identifier: Apache-2.0
#include "sim/devices/ssc32_command.h"

namespace corbot::sim::ssc32 {
namespace {

constexpr int kLargest = 65535;
constexpr int kOffsetMost_us = 100;
constexpr int kBankSize = 8;
constexpr std::size_t kMostReads = 8;

class Cursor {
 public:
  explicit Cursor(std::string_view text) : text_(text) {}

  [[nodiscard]] bool at_end() const { return text_.empty(); }
  /// Returns the next character, 0 at the end.
  [[nodiscard]] char peek() const { return text_.empty() ? '\0' : text_.front(); }
  bool take(std::string_view word) {
    if (!text_.starts_with(word)) return false;
    text_.remove_prefix(word.size());
    return true;
  }
  /// Parses decimal digits, first .. last.
  std::optional<int> number(int first, int last) {
    int value = 0;
    std::size_t digits = 0;
    for (; digits < text_.size() && text_[digits] >= '0' && text_[digits] <= '9'; ++digits) {
      value = value * 10 + (text_[digits] - '0');
      if (value > kLargest) return std::nullopt;
    }
    text_.remove_prefix(digits);
    if (digits == 0 || value < first || value > last) return std::nullopt;
    return value;
  }
  /// Parses a letter from 'A' on, as a number from 0; one of the first `count`.
  std::optional<int> letter(int count) {
    if (peek() < 'A' || peek() >= 'A' + count) return std::nullopt;
    const int value = peek() - 'A';
    text_.remove_prefix(1);
    return value;
  }

 private:
  std::string_view text_;
};

std::optional<int> channel(Cursor& text) { return text.number(0, kSsc32Channels - 1); }

/// Parses #5P1500S500#6P1600T2000.
std::optional<Command> group_move(Cursor text) {
  GroupMove group{{}, 0};
  while (text.take("#")) {
    const auto to = channel(text);
    if (!to || !text.take("P")) return std::nullopt;
    const auto pulse_us = text.number(kSsc32PulseMin_us, kSsc32PulseMax_us);
    if (!pulse_us) return std::nullopt;
    std::optional<int> speed = 0;
    if (text.take("S")) speed = text.number(1, kLargest);
    if (!speed) return std::nullopt;
    group.moves.push_back({*to, *pulse_us, *speed});
  }
  if (text.take("T")) {
    const auto time_ms = text.number(0, kLargest);
    if (!time_ms) return std::nullopt;
    group.time_ms = *time_ms;
  }
  if (!text.at_end()) return std::nullopt;
  return group;
}

std::optional<Command> offsets(Cursor text) {
  Offsets all;
  while (text.take("#")) {
    const auto to = channel(text);
    if (!to || !text.take("PO")) return std::nullopt;
    const int sign = text.take("-") ? -1 : 1;
    const auto offset_us = text.number(0, kOffsetMost_us);
    if (!offset_us) return std::nullopt;
    all.push_back({*to, sign * *offset_us});
  }
  if (!text.at_end()) return std::nullopt;
  return all;
}

std::optional<Command> levels(Cursor text) {
  Levels all;
  while (text.take("#")) {
    const auto to = channel(text);
    const bool is_high = text.peek() == 'H';
    if (!to || !text.take(is_high ? "H" : "L")) return std::nullopt;
    all.push_back({*to, is_high});
  }
  if (!text.at_end()) return std::nullopt;
  return all;
}

std::optional<Command> banks(Cursor text) {
  Levels all;
  while (text.take("#")) {
    const auto bank = text.number(0, kSsc32Channels / kBankSize - 1);
    if (!bank || !text.take(":")) return std::nullopt;
    const auto value = text.number(0, 255);
    if (!value) return std::nullopt;
    for (int bit = 0; bit < kBankSize; ++bit) {
      all.push_back({*bank * kBankSize + bit, (*value >> bit & 1) != 0});
    }
  }
  if (!text.at_end()) return std::nullopt;
  return all;
}

/// The text after the first channel decides the kind; each kind then accepts nothing of another.
std::optional<Command> for_channels(Cursor text) {
  Cursor ahead = text;
  ahead.take("#");
  if (!channel(ahead)) return std::nullopt;
  if (ahead.take("PO")) return offsets(text);
  if (ahead.take("P")) return group_move(text);
  if (ahead.take(":")) return banks(text);
  return levels(text);
}

std::optional<Command> query(Cursor text) {
  text.take("Q");
  if (text.at_end()) return QueryMoving{};
  QueryPulses pulses;
  do {
    const bool is_pulse = text.take("P");
    const auto of = is_pulse ? channel(text) : std::nullopt;
    if (!of) return std::nullopt;
    pulses.channels.push_back(*of);
  } while (text.take("Q"));
  if (!text.at_end()) return std::nullopt;
  return pulses;
}

std::optional<Command> analog_reads(Cursor text, Ssc32Model model) {
  AnalogReads reads;
  while (text.take("V")) {
    const auto pin = text.letter(analog_inputs(model));
    if (!pin) return std::nullopt;
    reads.pins.push_back(*pin);
  }
  if (!text.at_end() || reads.pins.size() > kMostReads) return std::nullopt;
  return reads;
}

std::optional<Command> digital_reads(Cursor text, Ssc32Model model) {
  DigitalReads reads;
  while (const auto pin = text.letter(digital_inputs(model))) reads.push_back({*pin, text.take("L")});
  if (!text.at_end() || reads.empty() || reads.size() > kMostReads) return std::nullopt;
  return reads;
}

std::optional<Command> stop(Cursor text) {
  text.take("STOP");
  const auto which = channel(text);
  if (!which || !text.at_end()) return std::nullopt;
  return Stop{*which};
}

}  // namespace

std::optional<Command> parse(std::string_view text, Ssc32Model model) {
  const Cursor cursor(text);
  if (text == "VER") return QueryVersion{};
  if (text.starts_with('#')) return for_channels(cursor);
  if (text.starts_with('Q')) return query(cursor);
  if (text.starts_with('V')) return analog_reads(cursor, model);
  if (text.starts_with("STOP") && model == Ssc32Model::kSsc32U) return stop(cursor);
  return digital_reads(cursor, model);
}

}  // namespace corbot::sim::ssc32
