// SPDX-License-Identifier: Apache-2.0
#include "orb/log/orb_log.h"

#include <omniORB4/CORBA.h>
#include <poll.h>
#include <unistd.h>

#include <cinttypes>
#include <cstdio>
#include <mutex>

namespace corbot::orb {
namespace {

std::mutex log_mutex;  // from the look for room to the end of the message
LogLimit log_limit;

bool would_block() noexcept {
  pollfd log{STDERR_FILENO, POLLOUT, 0};
  return ::poll(&log, 1, 0) != 1 || (log.revents & POLLOUT) == 0;
}

/// The ORB calls this function from its destructors, too.
void write(const char* message) noexcept {
  const std::lock_guard lock(log_mutex);
  if (would_block()) return log_limit.leave_out();
  const auto left_out = log_limit.admit(LogLimit::Clock::now());
  if (!left_out) return;
  if (*left_out > 0)
    (void)std::fprintf(stderr, "omniORB: %" PRIu64 " messages were left out here\n", *left_out);
  (void)std::fputs(message, stderr);
}

}  // namespace

void limit_orb_log() {
  const char* const file = omniORB::getLogFilename();
  if (omniORB::traceLevel > 1 || (file != nullptr && *file != '\0')) return;
  omniORB::setLogFunction(&write);
}

}  // namespace corbot::orb
