// SPDX-License-Identifier: Apache-2.0
#include "rt/inputs/watchdog_output.h"

#include <algorithm>
#include <cstring>
#include <string>

namespace corbot::rt {

void WatchdogOutput::step(std::int64_t now_ns, bool may_run, const CycleView& view) noexcept {
  if (is_lost_ && line_.request_again(now_ns)) {
    is_lost_ = level_ = false;
    log_("watchdog: its line can be switched again");
  }
  const bool was_tripped = logic_.is_tripped();
  const bool level = logic_.step(now_ns, may_run && !is_lost_, view);
  if (level != level_ && !is_lost_) {
    const int error = line_.set(level);
    if (error == 0) {
      level_ = level;
    } else {
      is_lost_ = true;
      logic_.trip();
      log_(std::string("watchdog: its line cannot be switched: ") + std::strerror(error) + "; trying again");
    }
  }
  if (logic_.is_tripped() && !was_tripped) log_(std::string("watchdog tripped: ") + logic_.cause());
  if (logic_.is_running() != was_running_) log_(was_running_ ? "watchdog stopped" : "watchdog runs");
  was_running_ = logic_.is_running();
}

std::int64_t WatchdogOutput::wait_ns(std::int64_t now_ns, std::int64_t longest_ns) const noexcept {
  if (!logic_.is_running()) return longest_ns;
  return std::clamp(logic_.due_ns() - now_ns, std::int64_t{0}, longest_ns);
}

void WatchdogOutput::end() noexcept {
  (void)line_.set(false);
  line_.close();
}

}  // namespace corbot::rt
