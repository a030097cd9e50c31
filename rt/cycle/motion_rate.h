// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>

#include "corbot/channel/layout.h"
#include "corbot/motion/rate_curve.h"
#include "corbot/motion/rate_proof.h"
#include "rt/cycle/governor.h"

namespace corbot::rt {

/// Virtual time of the motion that runs: by its laws and Governor, or, along a path with a rate, by RateGovernor. The path's knots and pieces
/// are here, too. Real-time safe.
class MotionRate {
 public:
  MotionRate() = default;
  MotionRate(const MotionRate&) = delete;
  MotionRate& operator=(const MotionRate&) = delete;

  /// As those of Governor.
  void rest() noexcept {
    governor_.rest();
    curve_.reset();
  }
  void begin(const GovernedMotion& motion) noexcept {
    curve_.reset();
    governor_.begin(motion);
  }
  /// A path that RateCheck has passed, with its limits and the greatest shares of its pieces; it is copied.
  void begin(const rate::RatePath& path, const rate::Limits& limits, const rate::Shares& most) noexcept {
    std::copy(path.knots.begin(), path.knots.end(), slot_.knots.begin());
    std::copy(path.law.pieces.begin(), path.law.pieces.end(), slot_.pieces.begin());
    path_ = path;
    path_.knots = {slot_.knots.data(), path.knots.size()};
    path_.law.pieces = {slot_.pieces.data(), path.law.pieces.size()};
    curve_.emplace(rate::RateLimits(limits).view(), most);
    path_governor_.begin(*curve_, governor_.target());
  }
  void restart() noexcept {
    governor_.restart();
    if (has_path()) path_governor_.halt();
  }
  void set_target(double rate) noexcept {
    governor_.set_target(rate);
    if (has_path()) path_governor_.seek(rate);
  }
  void advance(double dt_s) noexcept { has_path() ? path_governor_.advance(dt_s) : governor_.advance(dt_s); }

  [[nodiscard]] double virtual_time_s() const noexcept {
    return has_path() ? std::min(path_governor_.time_s(), path_.law.duration_s) : governor_.virtual_time_s();
  }
  [[nodiscard]] double rate() const noexcept { return has_path() ? path_governor_.rate() : governor_.rate(); }
  [[nodiscard]] bool finished() const noexcept {
    return has_path() ? path_governor_.time_s() >= path_.law.duration_s : governor_.finished();
  }
  [[nodiscard]] bool holding() const noexcept {
    return has_path() ? path_governor_.is_at_rest() && governor_.target() == 0.0 : governor_.holding();
  }

  /// A path with a rate runs.
  [[nodiscard]] bool has_path() const noexcept { return curve_.has_value(); }
  /// Where it has come to.
  [[nodiscard]] Joints joints_q() const noexcept {
    const rate::State z = rate::state_at(path_.knots, path_.law.at(virtual_time_s()).lambda_s);
    Joints q{};
    std::copy_n(z.begin(), q.size(), q.begin());
    return q;
  }

 private:
  Governor governor_;
  RateSlot slot_{};
  rate::RatePath path_{};  ///< in the slot
  std::optional<rate::RateCurve> curve_;
  rate::RateGovernor path_governor_;
};

}  // namespace corbot::rt
