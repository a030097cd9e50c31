// SPDX-License-Identifier: Apache-2.0
#include "orb/log/orb_log.h"

#include <fmt/format.h>
#include <omniORB4/CORBA.h>
#include <unistd.h>

#include <mutex>
#include <string_view>

#include "log/line_output.h"

namespace corbot::orb {
namespace {

std::mutex log_mutex;
LogLimit log_limit;
LineOutput* output = nullptr;  // never deleted: the ORB logs in its destructors, too

void write(const char* message) noexcept {
  const std::lock_guard lock(log_mutex);
  const auto left_out = log_limit.admit(LogLimit::Clock::now());
  if (!left_out) return;
  std::string_view text(message);
  text.remove_suffix(text.ends_with('\n') ? 1 : 0);
  if (*left_out > 0) {
    char line[64];
    const auto end =
        fmt::format_to_n(line, sizeof(line), "omniORB: {} messages were left out here", *left_out);
    output->write({line, static_cast<std::size_t>(end.out - line)});  // this needs no memory
  }
  output->write(text);
}

}  // namespace

void limit_orb_log() {
  const char* const file = omniORB::getLogFilename();
  if (omniORB::traceLevel > 1 || (file != nullptr && *file != '\0')) return;
  if (output == nullptr) output = new LineOutput(STDERR_FILENO);
  omniORB::setLogFunction(&write);
}

}  // namespace corbot::orb
