// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/bus/frame_rate.h"

#include <algorithm>
#include <utility>

namespace corbot::rt {
namespace {

constexpr std::int64_t kWindow_ns = 1'000'000'000;
constexpr std::int64_t kFewestFrames = 6;
/// Below this share of the announced rate a device is too slow; from the other on it is fast enough.
constexpr double kTooSlow = 0.9;
constexpr double kFastEnough = 0.95;
/// A rate must be better by this much before the arm gains speed. It gains at most this much in one window.
constexpr double kBetter = 0.05;
constexpr double kGain = 0.1;

}  // namespace

void FrameRate::begin(std::int64_t period_ns) noexcept {
  *this = FrameRate{};
  period_ns_ = std::max<std::int64_t>(period_ns, 1);
  reached_hz_ = announced_hz();
}

bool FrameRate::count(std::int64_t busy_ns) noexcept {
  std::int64_t took_ns = std::max(busy_ns, period_ns_);
  sum_ns_ += took_ns;
  ++frames_;
  for (std::int64_t& longest_ns : longest_ns_) {
    if (took_ns > longest_ns) std::swap(took_ns, longest_ns);
  }
  if (sum_ns_ < kWindow_ns || frames_ < kFewestFrames) return false;
  const auto usual = static_cast<std::int64_t>(longest_ns_.size());
  const double each_ns =
      static_cast<double>(sum_ns_ - longest_ns_[0] - longest_ns_[1]) / static_cast<double>(frames_ - usual);
  reached_hz_ = 1e9 / each_ns;
  sum_ns_ = frames_ = 0;
  longest_ns_ = {};
  judge(static_cast<double>(period_ns_) / each_ns);
  return true;
}

void FrameRate::judge(double share) noexcept {
  if (share < std::min(speed_ratio_, kTooSlow)) {
    speed_ratio_ = std::max(share, kLeastRatio);
  } else if (share >= kFastEnough) {
    speed_ratio_ = std::min(speed_ratio_ + kGain, 1.0);
  } else if (share > speed_ratio_ + kBetter) {
    speed_ratio_ = std::min(speed_ratio_ + kGain, share);
  }
}

}  // namespace corbot::rt
