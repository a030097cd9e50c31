// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <optional>

#include "corbot/channel/layout.h"
#include "corbot/motion/rate_curve.h"
#include "corbot/motion/rate_proof.h"
#include "corbot/motion/rate_stop.h"
#include "rt/cycle/governor.h"
#include "rt/cycle/rate_check.h"

namespace corbot::rt {

/// Virtual time of the running motion: by its laws and Governor, or, along a path, by RateGovernor. It also
/// holds the path's knots and pieces. Real-time safe.
class MotionRate {
 public:
  MotionRate() = default;
  MotionRate(const MotionRate&) = delete;
  MotionRate& operator=(const MotionRate&) = delete;

  /// These functions do what those of Governor do.
  void rest() noexcept {
    governor_.rest();
    curve_.reset();
  }
  void begin(const GovernedMotion& motion) noexcept {
    curve_.reset();
    governor_.begin(motion);
  }
  /// Begins a path that has passed the check. It copies the path and the results of the check.
  void begin(const rate::RatePath& path, const RateCheck& check) noexcept {
    std::copy(path.knots.begin(), path.knots.end(), slot_.knots.begin());
    std::copy(path.law.pieces.begin(), path.law.pieces.end(), slot_.pieces.begin());
    path_ = path;
    path_.knots = {slot_.knots.data(), path.knots.size()};
    path_.law.pieces = {slot_.pieces.data(), path.law.pieces.size()};
    curve_ = check.curve();
    std::copy_n(check.shares().begin(), path.law.pieces.size(), shares_.begin());
    limits_ = rate::RateLimits(check.limits());
    is_seeking_ = false;
    path_governor_.begin(*curve_, governor_.target());
  }
  void restart() noexcept {
    governor_.restart();
    if (has_path()) path_governor_.halt();
    is_seeking_ = false;
  }
  void set_target(double rate) noexcept {
    governor_.set_target(rate);
    if (has_path()) path_governor_.seek(rate);
  }
  void advance(double dt_s) noexcept {
    if (!has_path()) return governor_.advance(dt_s);
    seek_quick_stop(dt_s);
    path_governor_.advance(dt_s);
  }

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

  /// A path runs.
  [[nodiscard]] bool has_path() const noexcept { return curve_.has_value(); }
  /// Returns the path's present state.
  [[nodiscard]] rate::State state() const noexcept {
    return rate::state_at(path_.knots, path_.law.at(virtual_time_s()).lambda_s);
  }

 private:
  /// Seeks a quicker stop. A stop begins by the known curve of the whole motion. Meanwhile a quicker curve is
  /// sought, for the stop's place at the end of the search. Ever fewer pieces lie ahead, so the search is
  /// repeated until the arm rests.
  void seek_quick_stop(double dt_s) noexcept {
    if (governor_.target() != 0.0 || path_governor_.is_at_rest()) {
      is_seeking_ = false;
    } else if (!is_seeking_) {
      later_.begin(path_governor_, rate::StopSearch::kCalls, dt_s);
      calls_ = 0;
      is_seeking_ = true;
      look_ahead();
    } else {
      if (later_.is_there()) {
        (void)search_.step();
      } else {
        look_ahead();
      }
      if (++calls_ < rate::StopSearch::kCalls) return;
      is_seeking_ = false;
      if (later_.is_there() && search_.found() != nullptr && path_governor_.is_as(later_.governor()))
        path_governor_.stop(quick_.emplace(*search_.found()));
    }
  }
  void look_ahead() noexcept {
    if (later_.step())
      search_.begin(later_.governor(), path_.law, {shares_.data(), path_.law.pieces.size()}, limits_.view());
  }

  Governor governor_;
  RateSlot slot_{};
  rate::RatePath path_{};  ///< in the slot
  std::optional<rate::RateCurve> curve_;
  rate::RateGovernor path_governor_;
  std::array<rate::Shares, rate::kMostPieces> shares_{};  ///< shares of its limits
  rate::RateLimits limits_;
  rate::StopSearch search_;
  bool is_seeking_{false};
  int calls_{0};                          ///< of the search
  rate::StopAhead later_;                 ///< the beginning of the search
  std::optional<rate::RateCurve> quick_;  ///< the present stop's curve
};

}  // namespace corbot::rt
