// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/pwm/pwm_sysfs.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>
#include <thread>
#include <utility>

namespace corbot::rt {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr int kRelaxAttempts = 3;

[[noreturn]] void fail(const std::string& path, int error) {
  const bool is_gone = error == ENODEV || error == ENOENT || error == ENXIO;
  const std::string hint = error == EACCES  ? " (install the udev rule, and join the group gpio)"
                           : is_gone        ? " (is the PWM controller there, and its driver loaded?)"
                           : error == EBUSY ? " (another driver uses this output, or needs another period)"
                                            : "";
  throw DeviceError(is_gone          ? DeviceCause::kHungUp
                    : error == EBUSY ? DeviceCause::kInUse
                                     : DeviceCause::kNotThere,
                    path + ": " + std::strerror(error) + hint);
}

/// A file descriptor that is closed at the end of its scope.
class File {
 public:
  File(const std::string& path, int flags) : fd_(::open(path.c_str(), flags | O_CLOEXEC)) {
    if (fd_ < 0) fail(path, errno);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  ~File() {
    if (fd_ >= 0) ::close(fd_);
  }
  [[nodiscard]] int fd() const { return fd_; }
  [[nodiscard]] int release() { return std::exchange(fd_, -1); }

 private:
  int fd_;
};

void write_at_start(int fd, const std::string& path, const std::string& text) {
  // The new line ends the number also in a plain file that was longer before.
  const std::string line = text + "\n";
  if (::pwrite(fd, line.data(), line.size(), 0) != static_cast<ssize_t>(line.size())) fail(path, errno);
}

std::int64_t nanoseconds(double pulse_us) {
  return std::isfinite(pulse_us) ? std::llround(std::max(pulse_us, 0.0) * 1000.0) : 0;
}

}  // namespace

std::string PwmSysfs::read_text(const std::string& path) const {
  const File file(path, O_RDONLY);
  std::array<char, 64> text{};
  const ssize_t n = ::pread(file.fd(), text.data(), text.size(), 0);
  if (n < 0) fail(path, errno);
  const std::string all(text.data(), static_cast<std::size_t>(n));
  return all.substr(0, all.find('\n'));
}

std::int64_t PwmSysfs::read_number(const std::string& path) const {
  const std::string text = read_text(path);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc{} && end == text.data() + text.size()) return value;
  throw DeviceError(DeviceCause::kBadAnswer, path + ": holds no number");
}

void PwmSysfs::write_text(const std::string& path, const std::string& text) const {
  const File file(path, O_WRONLY);
  write_at_start(file.fd(), path, text);
}

std::string PwmSysfs::open() {
  close();
  period_ns_ = std::llround(1e9 / settings_.frame_hz);
  const std::int64_t count = read_number(settings_.chip + "/npwm");
  outputs_.resize(settings_.channels.size());
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    Output& output = outputs_[i];
    output.channel = settings_.channels[i];
    output.directory = settings_.chip + "/pwm" + std::to_string(output.channel);
    if (output.channel >= count) {
      throw DeviceError(DeviceCause::kNotThere, settings_.chip + ": has " + std::to_string(count) +
                                                    " outputs, but a servo of the profile has channel " +
                                                    std::to_string(output.channel));
    }
    open(output);
  }
  const std::int64_t tenths_hz = 10'000'000'000 / period_ns_;
  return "PWM on " + settings_.chip + ": " + std::to_string(outputs_.size()) + " of its " +
         std::to_string(count) + " outputs, " + std::to_string(tenths_hz / 10) + "." +
         std::to_string(tenths_hz % 10) + " frames a second";
}

void PwmSysfs::open(Output& output) {
  if (::access(output.directory.c_str(), F_OK) != 0) export_and_wait(output);
  prepare(output);
  File duty(output.directory + "/duty_cycle", O_WRONLY);
  output.duty_fd = duty.release();
}

void PwmSysfs::export_and_wait(Output& output) {
  write_text(settings_.chip + "/export", std::to_string(output.channel));
  output.is_ours = true;
  // udev gives the new files to the group some time later.
  const auto deadline = Clock::now() + settings_.permission_within;
  for (;;) {
    const auto may_use = [&](const char* name) {
      return ::access((output.directory + name).c_str(), R_OK | W_OK) == 0;
    };
    if (may_use("/period") && may_use("/duty_cycle") && may_use("/enable")) return;
    if (Clock::now() > deadline) fail(output.directory, errno);
    std::this_thread::sleep_for(2ms);
  }
}

void PwmSysfs::prepare(Output& output) {
  const std::string enable = output.directory + "/enable";
  const std::string duty = output.directory + "/duty_cycle";
  const std::string period = output.directory + "/period";
  const std::string polarity = output.directory + "/polarity";
  output.is_on = read_number(enable) != 0;
  if (::access(polarity.c_str(), F_OK) == 0 && read_text(polarity) != "normal") {
    if (output.is_on) switch_off(output);
    write_text(polarity, "normal");
  }
  output.duty_ns = read_number(duty);
  if (output.duty_ns > period_ns_) {
    write_text(duty, "0");
    output.duty_ns = 0;
  }
  if (read_number(period) != period_ns_) write_text(period, std::to_string(period_ns_));
}

void PwmSysfs::set_duty(Output& output, std::int64_t duty_ns) {
  if (duty_ns == output.duty_ns) return;
  write_at_start(output.duty_fd, output.directory + "/duty_cycle", std::to_string(duty_ns));
  output.duty_ns = duty_ns;
}

void PwmSysfs::switch_on(Output& output) {
  if (output.is_on) return;
  write_text(output.directory + "/enable", "1");
  output.is_on = true;
}

/// Switches an output off. Some drivers leave the line at its level when the output is disabled, in the
/// middle of a pulse, or high. With a duty cycle of 0 the line is low before.
void PwmSysfs::switch_off(Output& output) {
  write_text(output.directory + "/duty_cycle", "0");
  output.duty_ns = 0;
  write_text(output.directory + "/enable", "0");
  output.is_on = false;
}

PwmSysfs::Output* PwmSysfs::find(std::uint32_t channel) {
  const auto found = std::find_if(outputs_.begin(), outputs_.end(),
                                  [&](const Output& output) { return output.channel == channel; });
  return found == outputs_.end() ? nullptr : &*found;
}

void PwmSysfs::look_after_one() {
  if (outputs_.empty()) return;
  const Output& output = outputs_[looked_after_++ % outputs_.size()];
  const bool is_on = read_number(output.directory + "/enable") != 0;
  if (is_on || !output.is_on) return;
  throw DeviceError(DeviceCause::kDeviceFault, output.directory + ": another program has switched it off");
}

bool PwmSysfs::send(const ServoFrame& frame, bool) {
  // A controller that was unbound shows on the next write, but there may be none while the arm holds.
  look_after_one();
  for (std::size_t i = 0; i < std::min<std::size_t>(frame.servo_count, kMaxServos); ++i) {
    Output* output = find(frame.channel[i]);
    if (output == nullptr) continue;
    set_duty(*output, std::min(nanoseconds(frame.pulse_us[i]), period_ns_));
    switch_on(*output);
  }
  return true;
}

BusReading PwmSysfs::measure(const ServoFrame& frame) {
  look_after_one();
  BusReading reading;
  for (std::size_t i = 0; i < std::min<std::size_t>(frame.servo_count, kMaxServos); ++i) {
    const Output* output = find(frame.channel[i]);
    if (output == nullptr || !output->is_on || output->duty_ns == 0) continue;  // 0: it sends no pulse
    reading.unit = BusReading::Unit::kPulses;
    reading.value[i] = static_cast<double>(output->duty_ns) / 1000.0;
  }
  return reading;
}

/// Tries every output: one that cannot be switched off must not keep the others on.
void PwmSysfs::relax() {
  std::optional<DeviceError> failure;
  for (Output& output : outputs_) {
    for (int attempt = 1; attempt <= kRelaxAttempts; ++attempt) {
      try {
        switch_off(output);
        if (output.is_ours) write_text(settings_.chip + "/unexport", std::to_string(output.channel));
        break;
      } catch (const DeviceError& error) {
        if (attempt == kRelaxAttempts) failure = error;
      }
    }
  }
  if (failure) throw DeviceError(*failure);
}

void PwmSysfs::close() noexcept {
  for (const Output& output : outputs_) {
    if (output.duty_fd >= 0) ::close(output.duty_fd);
  }
  outputs_.clear();
}

}  // namespace corbot::rt
