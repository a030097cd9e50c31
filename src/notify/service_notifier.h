// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string_view>

#include "notify/notify_address.h"

namespace corbot {

/// Reports to the supervisor of this process, systemd or `corbot up`, that the process is ready and alive. It
/// uses the protocol of sd_notify(3), which is stable and consists of datagrams. It does without libsystemd,
/// which would bring five libraries for compression and cryptography into the locked memory of the real-time
/// process. Without a supervisor in the environment it does nothing. Not thread-safe, not real-time safe;
/// never blocks.
class ServiceNotifier {
 public:
  /// Reads NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID.
  ServiceNotifier();
  ServiceNotifier(const ServiceNotifier&) = delete;
  ServiceNotifier& operator=(const ServiceNotifier&) = delete;
  ~ServiceNotifier();

  /// Reports that the service works from now on. Sent once.
  void ready();
  /// Reports that this process advances. To be called whenever that is observed; sends a few reports per
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
