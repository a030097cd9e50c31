// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/serial/serial_dialog.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace corbot::rt {
namespace {

using namespace std::chrono_literals;

constexpr auto kReplyWithin = 300ms;  // outside service
constexpr auto kWriteWithin = 300ms;  // beyond the transmission in progress
/// An adapter delivers its data every 16 ms, and the controller takes its time.
constexpr auto kReplyInService = 30ms;
constexpr auto kSilence = 150ms;
constexpr int kMostTries = 5;
/// The motion at the speed of an approach, between two replies on a slow line.
constexpr double kAlike_us = 50.0;

}  // namespace

void SerialDialog::open(const std::string& path, int baud) {
  line_->open(path, baud);
  path_ = path;
  baud_ = baud;
  is_in_service_ = false;
  has_replied_ = false;
  free_at_ = Clock::now();
  silence_.restart(free_at_);
}

std::chrono::nanoseconds SerialDialog::duration(std::size_t bytes) const noexcept {
  return std::chrono::nanoseconds(static_cast<std::int64_t>(bytes) * kBitsPerByte * 1'000'000'000 / baud_);
}

void SerialDialog::write(std::span<const std::uint8_t> bytes) {
  const auto now = Clock::now();
  free_at_ = std::max(free_at_, now) + duration(bytes.size());
  line_->write(bytes, free_at_ + kWriteWithin);
}

void SerialDialog::write(std::string_view text) {
  write({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

void SerialDialog::read(std::span<std::uint8_t> into) {
  const auto queried_at = is_in_service_ ? std::max(free_at_, Clock::now()) : free_at_;
  const auto within = is_in_service_ ? kReplyInService : kReplyWithin;
  line_->read_exactly(into, queried_at + duration(into.size()) + within);
}

void SerialDialog::note_reply() noexcept {
  has_replied_ = true;
  silence_.restart(Clock::now());
}

void SerialDialog::note_miss(const DeviceError& error) {
  const auto now = Clock::now();
  if (is_noise(error.cause()) && silence_.look(now) < kSilence) return;
  silence_.restart(now);
  throw DeviceError(error);
}

SerialDialog::Pulses SerialDialog::read_until_stable(std::size_t count,
                                                     const std::function<Pulses()>& query) const {
  std::optional<Pulses> before;
  DeviceError why(DeviceCause::kBadAnswer,
                  path_ + ": reports no stable position: is the line disturbed, does an arm move?");
  for (int i = 0; i < kMostTries; ++i) {
    try {
      const Pulses now = query();
      const auto is_alike = [](double a, double b) { return std::abs(a - b) <= kAlike_us; };
      if (before && std::equal(now.begin(), now.begin() + static_cast<std::ptrdiff_t>(count), before->begin(),
                               is_alike)) {
        return now;
      }
      before = now;
    } catch (const DeviceError& error) {
      if (!is_noise(error.cause())) throw;
      why = error;
    }
  }
  throw DeviceError(why);
}

}  // namespace corbot::rt
