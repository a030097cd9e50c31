// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string_view>

#include "notify/notify_address.h"

namespace corbot {

/// Reports to the supervisor of this process, systemd or `corbot up`, that it is ready and well:
/// sd_notify(3), whose protocol is stable and a datagram. Not by libsystemd, which would bring five
/// libraries for compression and cryptography into the locked memory of the real-time process. Where the
/// environment names no supervisor nothing happens. Not thread-safe, not real-time safe; never blocks.
class ServiceNotifier {
 public:
  /// Reads NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID.
  ServiceNotifier();
  ServiceNotifier(const ServiceNotifier&) = delete;
  ServiceNotifier& operator=(const ServiceNotifier&) = delete;
  ~ServiceNotifier();

  /// The service does its work from now on. Sent once.
  void ready();
  /// This process has just been seen to advance. To be called as often as that is seen; sent a few times an
  /// interval.
  void alive();

 private:
  using Clock = std::chrono::steady_clock;

  bool send(std::string_view text) const noexcept;

  int fd_{-1};
  NotifyAddress address_;
  Clock::duration interval_{};  ///< between two reports; 0: no watchdog
  Clock::time_point sent_at_{};
  bool is_ready_sent_{false};
};

}  // namespace corbot
