// SPDX-License-Identifier: Apache-2.0
#include "notify/service_notifier.h"

#include <unistd.h>

#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <optional>

namespace corbot {
namespace {

constexpr int kReportsPerInterval = 4;

std::string_view environment(const char* name) {
  const char* text = std::getenv(name);
  return text == nullptr ? std::string_view() : std::string_view(text);
}

std::optional<std::int64_t> number(std::string_view text) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

ServiceNotifier::ServiceNotifier() : address_(notify_address()) {
  if (address_.size == 0) return;
  fd_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);

  const std::string_view pid = environment("WATCHDOG_PID");
  const auto interval_us = number(environment("WATCHDOG_USEC"));
  if (interval_us && *interval_us > 0 && (pid.empty() || number(pid) == ::getpid()))
    interval_ = std::chrono::microseconds(*interval_us / kReportsPerInterval);
}

ServiceNotifier::~ServiceNotifier() {
  if (fd_ >= 0) ::close(fd_);
}

bool ServiceNotifier::send(std::string_view text) const noexcept {
  if (fd_ < 0) return false;
  return ::sendto(fd_, text.data(), text.size(), MSG_NOSIGNAL,
                  reinterpret_cast<const sockaddr*>(&address_.address),
                  address_.size) == static_cast<ssize_t>(text.size());
}

/// Reports readiness. If the supervisor's queue is full or its socket is absent, the next call sends it
/// again.
void ServiceNotifier::ready() {
  if (!is_ready_sent_) is_ready_sent_ = send("READY=1");
}

void ServiceNotifier::alive() {
  if (interval_ == Clock::duration::zero()) return;
  const Clock::time_point now = Clock::now();
  if (sent_at_ != Clock::time_point() && now - sent_at_ < interval_) return;
  if (send("WATCHDOG=1")) sent_at_ = now;
}

}  // namespace corbot
