// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/serial/mini_ssc.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace corbot::rt {
namespace {

using namespace std::chrono_literals;

constexpr double kLastPosition = 254.0;
constexpr std::int64_t kBytesPerServo = 3;

}  // namespace

std::uint8_t MiniSsc::position_of(double pulse_us) const noexcept {
  const double share = (pulse_us - settings_.first_us) / (settings_.last_us - settings_.first_us);
  return static_cast<std::uint8_t>(std::lround(kLastPosition * std::clamp(share, 0.0, 1.0)));
}

std::string MiniSsc::open() {
  port_.open(settings_.port, settings_.baud);
  const std::int64_t bits = static_cast<std::int64_t>(settings_.servos) * kBytesPerServo * kBitsPerByte;
  period_ns_ = std::max(kServoFrame_ns, bits * 1'100'000'000 / settings_.baud);
  const std::int64_t tenths_hz = 10'000'000'000 / period_ns_;
  return "Mini SSC on " + settings_.port + " at " + std::to_string(settings_.baud) +
         " baud: " + std::to_string(tenths_hz / 10) + "." + std::to_string(tenths_hz % 10) +
         " frames a second; it never answers, so its presence is not checked";
}

bool MiniSsc::send(const ServoFrame& frame, bool) {
  constexpr std::uint8_t kSyncByte = 0xFF;
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < std::min<std::size_t>(frame.servo_count, kMaxServos); ++i) {
    bytes.insert(bytes.end(),
                 {kSyncByte, static_cast<std::uint8_t>(frame.channel[i]), position_of(frame.pulse_us[i])});
  }
  port_.write(bytes, SerialPort::Clock::now() + 300ms + std::chrono::nanoseconds(period_ns_));
  return true;
}

}  // namespace corbot::rt
