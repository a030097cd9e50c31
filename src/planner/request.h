// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <variant>

#include "corbot/kinematics/joints.h"
#include "corbot/kinematics/pose.h"

namespace corbot {

// Requests of clients, one record for each kind of motion, in SI units. Planner defines their meaning.

struct MoveRequest {
  std::array<double, 3> target_m{};
  double t_s{};
};
struct MoveSRequest {
  std::array<double, 3> target_m{};
  double t_s{};
};
struct MoveCRequest {
  std::array<double, 3> p1_m{};
  std::array<double, 3> p2_m{};
  std::array<double, 3> p3_m{};
};
struct MoveJointsRequest {
  Joints target_q{};
  double t_s{};
};
struct DriveRequest {
  int joint{};
  double increment_q{};
  double speed_q_s{};
};
struct ReadyRequest {};
struct DwellRequest {
  double t_s{};
};
struct GripperRequest {
  double opening{};  ///< 0 closed … 1 open
};

/// A motion to a position and an orientation, base frame; any orientation setting is ignored.
struct MovePoseRequest {
  Pose target{};
  double t_s{};
  /// True: a line of the TCP, with the tool turning about one axis in step. False: a free motion.
  bool straight{};
};
/// The axes of an offset and of its turn.
enum class OffsetFrame : std::uint32_t {
  kBase,  ///< axes of the base frame; the turn is still about the tool centre point
  kTool   ///< axes of the tool frame
};
/// A motion by an offset from the tool's pose at its beginning. An offset without a turn keeps the
/// orientation; an arm of fewer than six joints keeps the angles that it follows. For such an arm, an offset
/// with a turn is a MovePoseRequest to the resulting pose.
struct MoveRelativeRequest {
  Pose offset{};
  OffsetFrame frame{};
  double t_s{};
  bool straight{};  ///< like MovePoseRequest::straight
};

using MotionRequest =
    std::variant<MoveRequest, MoveSRequest, MoveCRequest, MoveJointsRequest, DriveRequest, ReadyRequest,
                 DwellRequest, GripperRequest, MovePoseRequest, MoveRelativeRequest>;

}  // namespace corbot
