// SPDX-License-Identifier: Apache-2.0
#include "orb/log/orb_log.h"

#include <omniORB4/CORBA.h>
#include <poll.h>
#include <unistd.h>

#include <atomic>
#include <cinttypes>
#include <cstdio>
#include <mutex>

namespace corbot::orb {
namespace {

std::mutex log_mutex;  // from the look for room to the end of the message
std::atomic<std::uint64_t> left_out_beside{0};
LogLimit log_limit;

bool would_block() noexcept {
  pollfd log{STDERR_FILENO, POLLOUT, 0};
  return ::poll(&log, 1, 0) != 1 || (log.revents & POLLOUT) == 0;
}

/// The ORB calls this function from its destructors, too.
void write(const char* message) noexcept {
  // Another process may fill the pipe after the look. Then one thread is held, and no other waits for it.
  const std::unique_lock lock(log_mutex, std::try_to_lock);
  if (!lock.owns_lock()) {
    ++left_out_beside;
    return;
  }
  if (would_block()) return log_limit.leave_out();
  const auto admitted = log_limit.admit(LogLimit::Clock::now());
  if (!admitted) return;
  if (const std::uint64_t left_out = *admitted + left_out_beside.exchange(0); left_out > 0)
    (void)std::fprintf(stderr, "omniORB: %" PRIu64 " messages were left out here\n", left_out);
  (void)std::fputs(message, stderr);
}

}  // namespace

void limit_orb_log() {
  const char* const file = omniORB::getLogFilename();
  if (omniORB::traceLevel > 1 || (file != nullptr && *file != '\0')) return;
  omniORB::setLogFunction(&write);
}

}  // namespace corbot::orb
