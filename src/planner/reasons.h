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

// Why a planned motion is not quicker.

namespace corbot::rate {

enum class Mover { kJoint, kToolTravel, kToolTurn };
enum class LimitKind { kSpeed, kAcceleration, kJerk };

/// One limit.
struct Reason {
  Mover mover{Mover::kJoint};
  std::size_t joint{};  ///< 0 for the tool
  LimitKind limit{LimitKind::kSpeed};

  [[nodiscard]] bool operator==(const Reason&) const noexcept = default;
};

/// The limit that a part of a path is nearest to.
struct ReasonStretch {
  Reason reason;
  double begin_s{}, end_s{};        ///< time
  double begin_path{}, end_path{};  ///< path parameter, 0 to 1
  double share{};                   ///< the greatest here, of what a plan may use: without the reserves
};

/// Stretches from the beginning to the end, none shorter than 1 % of the duration. `command`: a line or an arc with this rate, which has
/// travel. Shares are sampled, not proved.
[[nodiscard]] std::vector<ReasonStretch> reasons_of(const ArmModel& model, const PlanSettings& settings,
                                                    const Command& command, const PlannedRate& rate);

/// The joint that needs all of a joint motion's time, and the greatest derivative whose limit its law reaches. Nothing: no joint does,
/// since the caller asked for a longer time or a lower speed.
[[nodiscard]] std::optional<Reason> reason_of(const ArmModel& model, const PlanSettings& settings,
                                              const Command& command);

/// A place of a path.
struct NearestSingularity {
  double pivot{};  ///< least_pivot() there
  double path{};   ///< path parameter
  std::array<double, 3> point_m{};
};

/// The knot with the least pivot. Nothing: the task's matrix is not square. At least one knot.
[[nodiscard]] std::optional<NearestSingularity> nearest_singularity(const ArmModel& model,
                                                                    const Command& command,
                                                                    std::span<const Knot> knots);

/// One command of a plan.
struct PlanPart {
  double duration_s{};
  bool moves_arm{};                           ///< no dwell, no gripper
  std::vector<ReasonStretch> stretches;       ///< of a joint motion one over all of it, or none
  std::optional<NearestSingularity> nearest;  ///< of a path
};

/// The commands of a plan that these settings made, none for a refusal. `model`: without the frames in force.
[[nodiscard]] std::vector<PlanPart> parts_of(const ArmModel& model, const PlanSettings& settings,
                                             const PlanResult& plan);

}  // namespace corbot::rate
