// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "corbot/arm/arm_model.h"
#include "corbot/motion/command.h"
#include "planner/plan/plan.h"

// The reasons why a planned motion is not quicker.

namespace corbot::rate {

enum class Mover { kJoint, kToolTravel, kToolTurn };
enum class LimitKind { kSpeed, kAcceleration, kJerk };

/// One limit: its owner and the derivative that it bounds.
struct Reason {
  Mover mover{Mover::kJoint};
  std::size_t joint{};  ///< 0 for the tool
  LimitKind limit{LimitKind::kSpeed};

  [[nodiscard]] bool operator==(const Reason&) const noexcept = default;
};

/// A part of a path and the limit that is nearest there.
struct ReasonStretch {
  Reason reason;
  double begin_s{}, end_s{};        ///< time
  double begin_path{}, end_path{};  ///< path parameter, 0 to 1
  double share{};                   ///< the greatest in this stretch, of the limit without the reserves
};

/// Returns the stretches from beginning to end, none shorter than 1 % of the duration. `command`: a line or
/// an arc with this rate and with travel. Shares are sampled, not proved.
[[nodiscard]] std::vector<ReasonStretch> reasons_of(const ArmModel& model, const PlanSettings& settings,
                                                    const Command& command, const PlannedRate& rate);

/// Returns the joint that needs all of a joint motion's time, and the highest derivative whose limit its law
/// reaches. Returns nothing if no joint does, because the caller requested a longer time or a lower speed.
[[nodiscard]] std::optional<Reason> reason_of(const ArmModel& model, const PlanSettings& settings,
                                              const Command& command);

/// The point of a path that is nearest to a singularity.
struct NearestSingularity {
  double pivot{};  ///< least_pivot() at this point
  double path{};   ///< path parameter
  std::array<double, 3> point_m{};
};

/// Returns the knot with the least pivot, or nothing if the task's matrix is not square. Needs at least one
/// knot.
[[nodiscard]] std::optional<NearestSingularity> nearest_singularity(const ArmModel& model,
                                                                    const Command& command,
                                                                    std::span<const Knot> knots);

/// One command of a plan.
struct PlanPart {
  double duration_s{};
  bool moves_arm{};                           ///< false for a dwell and for the gripper
  std::vector<ReasonStretch> stretches;       ///< a joint motion has one for its whole duration, or none
  std::optional<NearestSingularity> nearest;  ///< only for a path
};

/// Returns the commands of a plan that these settings made, none for a refusal. `model`: without the frames
/// in force.
[[nodiscard]] std::vector<PlanPart> parts_of(const ArmModel& model, const PlanSettings& settings,
                                             const PlanResult& plan);

}  // namespace corbot::rate
