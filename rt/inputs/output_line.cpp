// SPDX-License-Identifier: Apache-2.0
#include "rt/inputs/output_line.h"

#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>

#include "rt/backends/bus/device_error.h"

namespace corbot::rt {
namespace {

constexpr int kTriesAtEnd = 10;
constexpr auto kPauseAtEnd = std::chrono::milliseconds(2);

}  // namespace

int OutputLine::set(bool on) noexcept {
  const int error = line_ ? line_->set(on ? 1 : 0) : ENODEV;
  if (error == 0) failed_at_ns_ = 0;
  return error;
}

bool OutputLine::request_again(std::int64_t now_ns) noexcept {
  if (failed_at_ns_ == 0) failed_at_ns_ = now_ns;
  if (now_ns - failed_at_ns_ < kRetryAfter_ns) return false;
  failed_at_ns_ = now_ns;
  return reopen();
}

bool OutputLine::reopen() noexcept {
  line_.reset();  // a line that is held cannot be requested
  try {
    open();
    failed_at_ns_ = 0;
    return true;
  } catch (const std::exception&) {
    return false;
  }
}

void PowerSwitch::set(bool on, std::int64_t now_ns) noexcept {
  if (on == is_on_ && failures_ == 0 && now_ns - set_at_ns_ < kRefresh_ns) return;
  set_at_ns_ = now_ns;
  const int error = line_.set(on);
  if (error != 0) return failed(error, on, now_ns);
  failures_ = 0;
  if (on == is_on_) return;
  is_on_ = on;
  log_(on ? "servo power on" : "servo power off");
}

void PowerSwitch::failed(int error, bool on, std::int64_t now_ns) noexcept {
  if (++failures_ == 1 || on != is_failing_on_) {
    log_(std::string("servo power cannot be switched ") + (on ? "on: " : "OFF: ") + std::strerror(error) +
         "; trying again");
  }
  is_failing_on_ = on;
  if (!line_.request_again(now_ns)) return;
  if (is_on_) log_("servo power off: its line can be switched again");
  is_on_ = false;
  failures_ = 0;
}

void PowerSwitch::end() noexcept {
  int error = line_.set(false);
  if (!is_on_ && error == ENODEV) error = 0;
  for (int i = 1; error != 0 && i < kTriesAtEnd; ++i) {
    std::this_thread::sleep_for(kPauseAtEnd);
    if (i == kTriesAtEnd / 2) (void)line_.reopen();
    error = line_.set(false);
  }
  if (error != 0) log_(std::string("SERVO POWER COULD NOT BE SWITCHED OFF: ") + std::strerror(error));
  is_on_ = false;
  line_.close();
}

}  // namespace corbot::rt
