// SPDX-License-Identifier: Apache-2.0
#include "contract/trace_pipe.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/mount.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace corbot::test {
namespace {

namespace fs = std::filesystem;

const std::string kTracing = "/sys/kernel/tracing";

void write_file(const std::string& file, const std::string& text) {
  std::ofstream stream(file);
  stream << text << std::flush;
  if (!stream) throw std::runtime_error(file + ": cannot be written");
}

/// The kernel's number of a chip's first line.
long base_of(const std::string& chip) {
  const fs::path device =
      fs::canonical("/sys/bus/gpio/devices/" + fs::path(chip).filename().string()).parent_path();
  for (const auto& entry : fs::directory_iterator("/sys/class/gpio")) {
    if (!entry.path().filename().string().starts_with("gpiochip")) continue;
    if (fs::canonical(entry.path()).string().starts_with(device.string() + "/")) {
      long base = -1;
      std::ifstream(entry.path() / "base") >> base;
      return base;
    }
  }
  throw std::runtime_error(chip + ": is not in /sys/class/gpio");
}

std::int64_t monotonic_ns() {
  timespec time{};
  ::clock_gettime(CLOCK_MONOTONIC, &time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

}  // namespace

TracePipe::~TracePipe() {
  if (fd_ < 0) return;
  thread_.request_stop();
  thread_.join();
  ::close(fd_);
  std::ofstream(kTracing + "/events/gpio/gpio_value/enable") << "0";
}

void TracePipe::open(const std::string& chip, std::size_t lines) {
  if (!fs::exists(kTracing + "/trace_clock") &&
      ::mount("tracefs", kTracing.c_str(), "tracefs", 0, nullptr) != 0) {
    throw std::runtime_error(kTracing + ": cannot be mounted");
  }
  base_ = base_of(chip);
  rose_ns_.assign(lines, 0);
  last_.assign(lines, Output{0, 0, NAN});
  write_file(kTracing + "/trace", "");
  write_file(kTracing + "/trace_clock", "mono");
  write_file(kTracing + "/events/gpio/gpio_value/enable", "1");
  write_file(kTracing + "/tracing_on", "1");
  fd_ = ::open((kTracing + "/trace_pipe").c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (fd_ < 0) throw std::runtime_error("trace_pipe cannot be opened");
  thread_ = std::jthread([this](const std::stop_token& end) { read(end); });
}

std::vector<Output> TracePipe::pulses() {
  const std::lock_guard lock(mutex_);
  return pulses_;
}

std::vector<double> TracePipe::latest() {
  const std::lock_guard lock(mutex_);
  std::vector<double> values;
  for (const Output& output : last_) {
    values.push_back(monotonic_ns() - output.time_ns < 100'000'000 ? output.value : NAN);
  }
  return values;
}

void TracePipe::read(const std::stop_token& end) {
  std::array<char, 16384> text{};
  while (!end.stop_requested()) {
    const ssize_t n = ::read(fd_, text.data(), text.size());
    if (n > 0) {
      take({text.data(), static_cast<std::size_t>(n)});
    } else {
      const timespec pause{0, 5'000'000};
      ::nanosleep(&pause, nullptr);
    }
  }
}

/// The pulses of one frame come one after the other, and count together when the last of them is over.
void TracePipe::add(const Output& pulse) {
  for (const Output& other : frame_) {
    if (other.servo == pulse.servo) frame_.clear();  // the rest of a frame that was begun before
    if (frame_.empty()) break;
  }
  frame_.push_back(pulse);
  if (frame_.size() < last_.size()) return;
  for (Output& output : frame_) output.time_ns = pulse.time_ns;
  pulses_.insert(pulses_.end(), frame_.begin(), frame_.end());
  frame_.clear();
}

void TracePipe::take(const std::string& text) {
  rest_ += text;
  std::size_t begin = 0;
  for (std::size_t end = 0; (end = rest_.find('\n', begin)) != std::string::npos; begin = end + 1) {
    // ... [000] d..2.  12.345678: gpio_value: 995 set 1
    const std::string line = rest_.substr(begin, end - begin);
    const std::size_t event = line.find(": gpio_value: ");
    if (event == std::string::npos) continue;
    const std::size_t time = line.rfind(' ', event - 1) + 1;
    long long seconds = 0;
    long long microseconds = 0;
    long number = 0;
    int value = 0;
    if (std::sscanf(line.c_str() + time, "%lld.%lld: gpio_value: %ld set %d", &seconds, &microseconds,
                    &number, &value) != 4) {
      continue;
    }
    const auto servo = static_cast<std::size_t>(number - base_);
    if (number < base_ || servo >= rose_ns_.size()) continue;
    const std::int64_t time_ns = (seconds * 1'000'000 + microseconds) * 1000;
    const std::lock_guard lock(mutex_);
    if (value != 0 && rose_ns_[servo] == 0) rose_ns_[servo] = time_ns;
    if (value == 0 && rose_ns_[servo] != 0) {
      last_[servo] = {time_ns, servo, static_cast<double>(time_ns - rose_ns_[servo]) * 1e-3};
      add(last_[servo]);
      rose_ns_[servo] = 0;
    }
  }
  rest_.erase(0, begin);
}

}  // namespace corbot::test
