// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sim/devices/answer_faults.h"

namespace corbot::sim {

/// A servo controller at the other end of a serial line, without the line: a state machine that is given the
/// time. Times may be from any clock that does not run backwards; an earlier time counts as the latest so
/// far.
class SerialDevice {
 public:
  virtual ~SerialDevice() = default;

  /// Takes bytes that have arrived by now. The caller paces them to the line's speed (ByteLine).
  virtual void receive(std::span<const std::uint8_t> bytes, std::int64_t now_ns) = 0;
  /// Returns the bytes that have left the device since the last call. Answers leave at the speed of the line.
  virtual std::vector<std::uint8_t> answers(std::int64_t now_ns) = 0;
  /// Returns the time at which the next byte of an answer will have left.
  [[nodiscard]] virtual std::optional<std::int64_t> next_answer_ns() const = 0;

  [[nodiscard]] virtual std::size_t channel_count() const = 0;
  /// Returns the width of the pulses that leave in the servo frame of this instant; 0: none.
  [[nodiscard]] virtual double pulse_us(std::size_t channel, std::int64_t now_ns) = 0;
  /// Returns the shaft position of the servo at this channel, as a pulse width.
  [[nodiscard]] virtual double shaft_us(std::size_t channel, std::int64_t now_ns) = 0;

  /// Switches the power off and on. Settings, and half received or half answered data, are lost; the shafts
  /// stay.
  virtual void power_cycle(std::int64_t now_ns) = 0;
  /// Sets a digital input to 5 V or 0 V; false if there is none of this name.
  virtual bool set_input(char name, bool is_high) = 0;

  /// Returns the faults of its answers, query by query.
  [[nodiscard]] AnswerFaults& faults() { return faults_; }

 protected:
  SerialDevice(std::initializer_list<const char*> queries) : faults_(queries) {}
  SerialDevice(const SerialDevice&) = default;
  SerialDevice& operator=(const SerialDevice&) = default;

 private:
  AnswerFaults faults_;
};

}  // namespace corbot::sim
