// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

namespace corbot::sim {

struct TimedByte {
  std::uint8_t value;
  std::int64_t time_ns;  ///< the time when its last bit has come through
};

/// One direction of a serial line, 8N1: a byte takes ten bits, and begins when the previous one has ended.
class ByteLine {
 public:
  ByteLine(int baud, std::size_t capacity) : byte_ns_(10'000'000'000 / baud), capacity_(capacity) {}

  /// Sends a byte. False, and the byte is lost, if the line already carries as many bytes as its capacity.
  bool push(std::uint8_t value, std::int64_t now_ns) {
    if (room() == 0) return false;
    last_ns_ = std::max(last_ns_, now_ns) + byte_ns_;
    bytes_.push_back({value, last_ns_});
    return true;
  }
  /// Returns the next byte that has come through by now.
  std::optional<TimedByte> pop(std::int64_t now_ns) {
    if (bytes_.empty() || bytes_.front().time_ns > now_ns) return std::nullopt;
    const TimedByte byte = bytes_.front();
    bytes_.pop_front();
    return byte;
  }
  void clear() { bytes_.clear(); }

  [[nodiscard]] bool is_empty() const { return bytes_.empty(); }
  [[nodiscard]] std::size_t room() const { return capacity_ - bytes_.size(); }
  [[nodiscard]] std::int64_t byte_ns() const { return byte_ns_; }
  /// Returns the times at which the next byte and the last byte come through; only while not empty.
  [[nodiscard]] std::int64_t next_ns() const { return bytes_.front().time_ns; }
  [[nodiscard]] std::int64_t last_ns() const { return last_ns_; }

 private:
  std::int64_t byte_ns_;
  std::size_t capacity_;
  std::int64_t last_ns_{0};
  std::deque<TimedByte> bytes_;
};

}  // namespace corbot::sim
