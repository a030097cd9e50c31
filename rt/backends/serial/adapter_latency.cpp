// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/serial/adapter_latency.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <system_error>

namespace corbot::rt {

namespace fs = std::filesystem;

std::optional<int> latency_timer_ms(const std::string& path, const std::string& ttys) {
  std::error_code error;
  const fs::path device = fs::canonical(path, error);
  if (error) return std::nullopt;
  const fs::path file = fs::path(ttys) / device.filename() / "device" / "latency_timer";
  const int fd = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return std::nullopt;
  std::array<char, 16> text{};
  const ssize_t length = ::read(fd, text.data(), text.size());
  ::close(fd);
  int latency_ms = 0;
  const auto [end, fault] =
      std::from_chars(text.data(), text.data() + std::max<ssize_t>(length, 0), latency_ms);
  if (fault != std::errc{} || latency_ms < 0) return std::nullopt;
  return latency_ms;
}

std::string latency_warning(std::optional<int> latency_ms) {
  if (!latency_ms || *latency_ms <= kGoodLatency_ms) return {};
  return "; warning: its USB adapter keeps answers for up to " + std::to_string(*latency_ms) +
         " ms: set its latency_timer to 1 (packaging/udev/70-corbot.rules does)";
}

}  // namespace corbot::rt
