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

/// Whether knots and pieces that came with a line or an arc are those of its path, at a rate that keeps all limits: the tool at every knot
/// and at two points between, with its velocity, which leaves a polynomial of the fifth degree no room for anything else; pieces without a
/// jump, from rest to rest; and the planner's proof, anew, with the arm's own limits and the reserves. Then the curve by which the path
/// stops. A few of each a call, so that a cycle's time is bounded: nothing moves before all of them have passed.
class RateCheck {
 public:
  /// What planner and this compute differently is far less.
  static constexpr double kTracking = 2e-6;       ///< m and rad
  static constexpr std::size_t kPieces = 24;      ///< of one call
  static constexpr std::size_t kCells = 3;        ///< likewise
  static constexpr std::size_t kStretches = 6;    ///< likewise, of the proof
  static constexpr std::size_t kCurveSteps = 64;  ///< likewise

  /// `command` has passed check_command(); `arm`: in its frames; `path`: its own, the same in all calls. Nothing: call again. Real-time safe.
  [[nodiscard]] std::optional<CommandVerdict> step(const ArmModel& arm, const Command& command,
                                                   const rate::RatePath& path) noexcept;
  /// Of the path that has passed last.
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

  std::uint64_t id_{0};     ///< of the command that is being looked at
  std::size_t piece_{0};    ///< the next one
  rate::RateState last_{};  ///< at its beginning
  std::size_t cell_{0};     ///< the next one
  bool is_proved_{false};
  rate::Limits limits_{};
  std::array<rate::Shares, rate::kMostPieces> shares_{};
  rate::ProofWalk walk_;
  rate::CurveSteps curve_;
};

}  // namespace corbot::rt
