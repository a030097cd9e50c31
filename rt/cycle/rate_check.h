// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "corbot/arm/arm_model.h"
#include "corbot/motion/rate_curve.h"
#include "corbot/motion/rate_proof.h"
#include "rt/cycle/command_check.h"

namespace corbot::rt {

/// Checks that knots and pieces of a line or an arc are those of its path, at a rate that keeps all limits.
/// It checks the tool at every knot and at two points between, with its velocity: this determines a
/// polynomial of the fifth degree. The pieces must have no jump and go from rest to rest. It repeats the
/// planner's proof with the arm's own limits and the reserves. Then it computes the curve by which the path
/// stops. Each call checks a few of them, so that a cycle's time is bounded. Nothing moves before all have
/// passed.
class RateCheck {
 public:
  /// The tolerance; planner and check differ by far less.
  static constexpr double kTracking = 2e-6;       ///< m and rad
  static constexpr std::size_t kPieces = 24;      ///< of one call
  static constexpr std::size_t kCells = 3;        ///< of one call
  static constexpr std::size_t kStretches = 6;    ///< of one call, in the proof
  static constexpr std::size_t kCurveSteps = 64;  ///< of one call

  /// Does one call's checks; empty: call again. `command` has passed check_command(). `arm` is in its frames.
  /// `path` is its own path, the same in all calls. Real-time safe.
  [[nodiscard]] std::optional<CommandVerdict> step(const ArmModel& arm, const Command& command,
                                                   const rate::RatePath& path) noexcept;
  /// Returns the limits of the last path that has passed.
  [[nodiscard]] const rate::Limits& limits() const noexcept { return limits_; }
  [[nodiscard]] std::span<const rate::Shares> shares() const noexcept { return shares_; }  ///< of its pieces
  [[nodiscard]] const rate::RateCurve& curve() const noexcept { return curve_.curve(); }

 private:
  template <class Motion>
  [[nodiscard]] std::optional<CommandVerdict> check_some(const ArmModel& arm, const Command& command,
                                                         const Motion& motion,
                                                         const rate::RatePath& path) noexcept;
  [[nodiscard]] CommandVerdict check_pieces(const rate::RatePieces& law) noexcept;
  [[nodiscard]] std::optional<CommandVerdict> prove_some(std::size_t pieces) noexcept;

  std::uint64_t id_{0};     ///< number of the command being checked
  std::size_t piece_{0};    ///< the next one
  rate::RateState last_{};  ///< the state at its beginning
  std::size_t cell_{0};     ///< the next one
  bool is_proved_{false};
  rate::Limits limits_{};
  std::array<rate::Shares, rate::kMostPieces> shares_{};
  rate::ProofWalk walk_;
  rate::CurveSteps curve_;
};

}  // namespace corbot::rt
