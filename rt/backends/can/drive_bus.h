// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "rt/backends/can/can_port.h"
#include "rt/backends/can/drive_watch.h"

namespace corbot::rt {

/// A CAN bus with drives. It sends them commands and process data, and passes everything received to the
/// watch. Failures throw DeviceError.
class DriveBus {
 public:
  using Clock = CanPort::Clock;

  static constexpr auto kSendWithin = std::chrono::milliseconds(100);

  DriveBus(std::string interface, const std::vector<std::uint8_t>& nodes, int heartbeat_ms,
           std::int64_t period_ns);

  /// Opens the bus. Earlier reports in the watch stay until it is cleared.
  void open();
  void close() noexcept { port_.close(); }
  [[nodiscard]] bool is_open() const noexcept { return port_.is_open(); }

  [[nodiscard]] const std::string& interface() const noexcept { return interface_; }
  [[nodiscard]] CanPort& port() noexcept { return port_; }
  [[nodiscard]] DriveWatch& watch() noexcept { return watch_; }
  [[nodiscard]] const std::vector<DriveReport>& drives() const { return watch_.drives(); }
  /// Returns the period of SYNC.
  [[nodiscard]] Clock::duration period() const { return std::chrono::nanoseconds(period_ns_); }
  [[nodiscard]] std::int64_t period_ns() const noexcept { return period_ns_; }
  void set_period_ns(std::int64_t period_ns) noexcept { period_ns_ = period_ns; }

  void command(NmtCommand command);
  /// Sends RPDOs to all drives, then SYNC.
  void synchronise(const std::vector<std::uint16_t>& controlwords, std::vector<std::int32_t> targets);
  /// Returns the targets of the last synchronise(); empty: none since open().
  [[nodiscard]] const std::vector<std::int32_t>& targets() const noexcept { return targets_; }
  /// Sends SYNC alone, to which the drives also answer.
  void request_answers(Clock::time_point deadline);
  /// Takes the frames that have come in, and those until the deadline; ends early when `is_enough`.
  void listen(Clock::time_point deadline, const std::function<bool()>& is_enough);
  /// Does the same until all drives have answered.
  void await_answers(Clock::time_point deadline);
  /// Tells whether answers to the last synchronise() may still come.
  [[nodiscard]] bool is_synchronised() const noexcept { return is_synchronised_; }
  void settle_synchronisation() noexcept { is_synchronised_ = false; }

 private:
  const std::string interface_;
  const Clock::duration heartbeat_;
  CanPort port_;
  DriveWatch watch_;
  std::int64_t period_ns_;
  Clock::time_point last_listened_{};
  bool is_synchronised_{false};
  std::vector<std::int32_t> targets_;
};

}  // namespace corbot::rt
