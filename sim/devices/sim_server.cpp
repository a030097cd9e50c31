// SPDX-License-Identifier: Apache-2.0
#include "sim/devices/sim_server.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <utility>

#include "sim/devices/servo_frames.h"

namespace corbot::sim {
namespace {

/// The greatest number of bytes on their way from the host. More stay in the terminal, whose buffer fills up
/// as a serial driver's does.
constexpr std::size_t kMostUnderWay = 256;
/// Bytes that come close after each other are taken together; each still counts at its own time.
constexpr std::int64_t kBatch_ns = 1'000'000;
/// Payload of one USB packet of an FTDI adapter: a full packet does not wait for the latency timer.
constexpr std::size_t kAdapterPacket = 62;
constexpr std::int64_t kMillisecond_ns = 1'000'000;
constexpr std::uint64_t kLongest_ms = 60'000;

constexpr const char* kServerCommands =
    "drop N, garble N, silent on|off, deaf|garble|half QUERY on|off, lose QUERY N, delay QUERY MS, batch MS, "
    "power on|off, brownout MS, reset, unplug, plug, input X 0|1, pulses, late";

/// Returns the byte that a receiver reads at another speed: never CR or ESC, which could occur by chance.
std::uint8_t misread(std::uint8_t byte) { return static_cast<std::uint8_t>(((byte ^ 0x5A) | 0x80) & 0xFE); }

}  // namespace

SimServer::SimServer(std::unique_ptr<SerialDevice> device, const ServerOptions& options)
    : device_(std::move(device)),
      port_(options.link, options.baud),
      line_in_(options.baud, kMostUnderWay),
      record_(open_record(options.record, "time_ns,channel,pulse_us,shaft_us")),
      recorded_(device_->channel_count()),
      checks_baud_(options.checks_baud) {}

void SimServer::run() {
  plug();
  const std::int64_t begin_ns = clock_ns();
  next_frame_ns_ = begin_ns - begin_ns % kServoFrame_ns + kServoFrame_ns;
  for (;;) {
    (void)std::fflush(stdout);
    const std::int64_t now_ns = clock_ns();
    advance(now_ns);
    // Bytes for which the line has no room stay in the terminal.
    std::array<pollfd, 4> fds{{{ending_.fd(), POLLIN, 0},
                               {control_.fd(), POLLIN, 0},
                               {line_in_.room() > 0 ? port_.fd() : -1, POLLIN, 0},
                               {port_.closed_fd(), POLLIN, 0}}};
    timespec left{};
    const auto event_ns = next_event_ns(now_ns);
    if (event_ns) {
      const std::int64_t left_ns = std::max<std::int64_t>(*event_ns - clock_ns(), 0);
      left = {left_ns / 1'000'000'000, left_ns % 1'000'000'000};
    }
    if (::ppoll(fds.data(), fds.size(), event_ns ? &left : nullptr, nullptr) <= 0) continue;
    if (fds[0].revents != 0) break;
    advance(clock_ns());
    if (fds[2].revents != 0) read_line(clock_ns());
    if (fds[3].revents != 0) port_.after_closed();
    // This may close the port, so it comes last.
    if (fds[1].revents != 0) control_.read([this](std::string_view command) { return handle(command); });
  }
}

std::optional<std::int64_t> SimServer::next_event_ns(std::int64_t now_ns) const {
  std::optional<std::int64_t> next = device_->next_answer_ns();
  const auto at = [&next](std::int64_t time_ns) { next = std::min(next.value_or(time_ns), time_ns); };
  if (!line_in_.is_empty()) {
    at(std::min(line_in_.last_ns(), std::max(line_in_.next_ns(), now_ns + kBatch_ns)));
  }
  if (record_ != nullptr) at(next_frame_ns_);
  if (!batch_.empty()) at(now_ns - now_ns % batch_ns_ + batch_ns_);
  if (power_on_ns_ > 0) at(power_on_ns_);
  return next;
}

void SimServer::advance(std::int64_t now_ns) {
  if (record_ != nullptr) latest_ns_ = std::max(latest_ns_, now_ns - next_frame_ns_);
  if (power_on_ns_ > 0 && now_ns >= power_on_ns_) set_power(true, power_on_ns_);
  for (;;) {
    const bool has_frame = record_ != nullptr && next_frame_ns_ <= now_ns;
    if (has_frame && (line_in_.is_empty() || next_frame_ns_ <= line_in_.next_ns())) {
      record_frame(next_frame_ns_);
      next_frame_ns_ += kServoFrame_ns;
      continue;
    }
    const auto byte = line_in_.pop(now_ns);
    if (!byte) break;
    if (to_drop_ > 0) {
      --to_drop_;
    } else if (is_powered_) {
      device_->receive({&byte->value, 1}, byte->time_ns);
    }
  }
  if (record_ != nullptr) (void)std::fflush(record_.get());
  send_answers(now_ns);
}

void SimServer::send_answers(std::int64_t now_ns) {
  std::vector<std::uint8_t> answers = device_->answers(now_ns);
  if (is_silent_ || !is_powered_) answers.clear();
  const bool is_wrong_baud = checks_baud_ && !answers.empty() && port_.is_open() && port_.is_wrong_baud();
  for (std::uint8_t& byte : answers) {
    if (to_garble_ == 0) break;
    --to_garble_;
    byte = static_cast<std::uint8_t>(~byte);
  }
  if (is_wrong_baud) std::transform(answers.begin(), answers.end(), answers.begin(), misread);
  // Bytes that came before the adapter's last instant go; later bytes wait for the next one.
  if (batch_ns_ == 0 || now_ns / batch_ns_ != batched_ns_ / batch_ns_) {
    port_.write(batch_);
    batch_.clear();
  }
  batched_ns_ = now_ns;
  if (batch_ns_ == 0) return port_.write(answers);
  batch_.insert(batch_.end(), answers.begin(), answers.end());
  if (batch_.size() < kAdapterPacket) return;
  port_.write(batch_);
  batch_.clear();
}

void SimServer::set_power(bool is_on, std::int64_t now_ns) {
  device_->power_cycle(now_ns);
  is_powered_ = is_on;
  power_on_ns_ = 0;
}

void SimServer::record_frame(std::int64_t time_ns) {
  constexpr double kResolution_us = 0.005;  // half of the written resolution
  for (std::size_t i = 0; i < recorded_.size(); ++i) {
    const Recorded now{device_->pulse_us(i, time_ns), device_->shaft_us(i, time_ns)};
    const bool is_off = now.pulse_us <= 0.0 && recorded_[i].pulse_us <= 0.0;
    const bool is_same = now.pulse_us == recorded_[i].pulse_us &&
                         std::abs(now.shaft_us - recorded_[i].shaft_us) < kResolution_us;
    if (is_off || is_same) continue;
    fmt::print(record_.get(), "{},{},{:.2f},{:.2f}\n", time_ns, i, now.pulse_us, now.shaft_us);
    recorded_[i] = now;
  }
}

void SimServer::read_line(std::int64_t now_ns) {
  std::array<std::uint8_t, kMostUnderWay> bytes{};
  const std::size_t count = port_.read(std::span(bytes).first(line_in_.room()));
  const bool is_wrong_baud = checks_baud_ && port_.is_wrong_baud();
  for (std::size_t i = 0; i < count; ++i) {
    (void)line_in_.push(is_wrong_baud ? misread(bytes[i]) : bytes[i], now_ns);
  }
}

std::string SimServer::handle(std::string_view command) {
  const std::vector<std::string_view> words = words_of(command);
  if (words.size() == 1 && words[0] == "pulses") return pulses();
  if (words.size() == 1 && words[0] == "late") return fmt::format("late {}", std::exchange(latest_ns_, 0));
  const std::string error = execute(words);
  return error.empty() ? fmt::format("ok {}", fmt::join(words, " ")) : "error: " + error;
}

std::optional<std::string> SimServer::execute_fault(const std::vector<std::string_view>& words) {
  if (words.size() != 2) return std::nullopt;
  const std::string_view what = words[0];
  const auto counted = count_of(words[1]);
  const std::uint64_t count = counted.value_or(0);
  const bool is_time = counted && count <= kLongest_ms;
  const bool is_switch = words[1] == "on" || words[1] == "off";
  const std::int64_t now_ns = clock_ns();
  if (what == "drop" && counted) {
    to_drop_ = count;
  } else if (what == "garble" && counted) {
    to_garble_ = count;
  } else if (what == "silent" && is_switch) {
    is_silent_ = words[1] == "on";
  } else if (what == "batch" && is_time) {
    batch_ns_ = static_cast<std::int64_t>(count) * kMillisecond_ns;
  } else if (what == "power" && is_switch) {
    set_power(words[1] == "on", now_ns);
  } else if (what == "brownout" && is_time) {
    set_power(false, now_ns);
    power_on_ns_ = now_ns + static_cast<std::int64_t>(count) * kMillisecond_ns;
  } else {
    return std::nullopt;
  }
  return std::string();
}

std::string SimServer::execute(const std::vector<std::string_view>& words) {
  if (const auto error = device_->faults().execute(words)) return *error;
  if (const auto error = execute_fault(words)) return *error;
  const std::string_view what = words[0];
  const std::string_view how = words.size() > 1 ? words[1] : std::string_view();
  const bool is_level = words.size() == 3 && how.size() == 1 && (words[2] == "0" || words[2] == "1");
  if (what == "input" && is_level) {
    if (!device_->set_input(how[0], words[2] == "1")) return fmt::format("the device has no input {}", how);
  } else if (what == "reset" && words.size() == 1) {
    device_->power_cycle(clock_ns());
  } else if (what == "unplug" && words.size() == 1) {
    port_.close();
    line_in_.clear();
  } else if (what == "plug" && words.size() == 1) {
    if (port_.is_open()) return "it is plugged in";
    try {
      plug();
    } catch (const std::runtime_error& e) {
      return e.what();
    }
  } else {
    return fmt::format("'{}' is none of: {}", fmt::join(words, " "), kServerCommands);
  }
  return {};
}

std::string SimServer::pulses() {
  std::string text = "pulses";
  const std::int64_t now_ns = clock_ns();
  for (std::size_t i = 0; i < device_->channel_count(); ++i) {
    const double pulse_us = device_->pulse_us(i, now_ns);
    if (pulse_us > 0.0) text += fmt::format(" {}={}", i, pulse_us);
  }
  return text;
}

void SimServer::plug() {
  port_.open();
  print_line("ready " + port_.link());
}

}  // namespace corbot::sim
