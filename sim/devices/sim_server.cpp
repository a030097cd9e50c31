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

/// On their way from the host; more stay in the terminal, whose buffer fills up as a serial driver's does.
constexpr std::size_t kMostUnderWay = 256;
/// Bytes that come close upon each other are taken together; each still counts as of its own time.
constexpr std::int64_t kBatch_ns = 1'000'000;

}  // namespace

SimServer::SimServer(std::unique_ptr<SerialDevice> device, const ServerOptions& options)
    : device_(std::move(device)),
      port_(options.link),
      line_in_(options.baud, kMostUnderWay),
      record_(open_record(options.record, "time_ns,channel,pulse_us,shaft_us")),
      recorded_(device_->channel_count()) {}

void SimServer::run() {
  plug();
  const std::int64_t begin_ns = clock_ns();
  next_frame_ns_ = begin_ns - begin_ns % kServoFrame_ns + kServoFrame_ns;
  for (;;) {
    (void)std::fflush(stdout);
    const std::int64_t now_ns = clock_ns();
    advance(now_ns);
    // What the line cannot take yet stays in the terminal.
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
    // May close the port, so it comes last.
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
  return next;
}

void SimServer::advance(std::int64_t now_ns) {
  if (record_ != nullptr) latest_ns_ = std::max(latest_ns_, now_ns - next_frame_ns_);
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
    } else {
      device_->receive({&byte->value, 1}, byte->time_ns);
    }
  }
  if (record_ != nullptr) (void)std::fflush(record_.get());
  std::vector<std::uint8_t> answers = device_->answers(now_ns);
  if (is_silent_) return;
  for (std::uint8_t& byte : answers) {
    if (to_garble_ == 0) break;
    --to_garble_;
    byte = static_cast<std::uint8_t>(~byte);
  }
  port_.write(answers);
}

void SimServer::record_frame(std::int64_t time_ns) {
  constexpr double kResolution_us = 0.005;  // half of what is written
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
  for (std::size_t i = 0; i < count; ++i) (void)line_in_.push(bytes[i], now_ns);
}

std::string SimServer::handle(std::string_view command) {
  const std::vector<std::string_view> words = words_of(command);
  if (words.size() == 1 && words[0] == "pulses") return pulses();
  if (words.size() == 1 && words[0] == "late") return fmt::format("late {}", std::exchange(latest_ns_, 0));
  const std::string error = execute(words);
  return error.empty() ? fmt::format("ok {}", fmt::join(words, " ")) : "error: " + error;
}

std::string SimServer::execute(const std::vector<std::string_view>& words) {
  const std::string_view what = words[0];
  const std::string_view how = words.size() > 1 ? words[1] : std::string_view();
  const auto counted = words.size() == 2 ? count_of(how) : std::nullopt;
  const std::uint64_t count = counted.value_or(0);
  const bool is_switch = words.size() == 2 && (how == "on" || how == "off");
  const bool is_level = words.size() == 3 && how.size() == 1 && (words[2] == "0" || words[2] == "1");
  if (what == "drop" && counted) {
    to_drop_ = count;
  } else if (what == "garble" && counted) {
    to_garble_ = count;
  } else if (what == "silent" && is_switch) {
    is_silent_ = how == "on";
  } else if (what == "input" && is_level) {
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
    return fmt::format(
        "'{}' is none of: drop N, garble N, silent on|off, reset, unplug, plug, input X 0|1, pulses, late",
        fmt::join(words, " "));
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
