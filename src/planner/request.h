// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <variant>

#include "corbot/kinematics/joints.h"
#include "corbot/kinematics/pose.h"

namespace corbot {

// What a client asks for, one record a kind of motion; SI units. Planner says what each of them means.

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

/// To a position and an orientation, base frame, whatever orientation is set.
struct MovePoseRequest {
  Pose target{};
  double t_s{};
  bool
      straight{};  ///< a line of the TCP, the tool turning about one axis in step with it; else a free motion
};
/// The axes along which an offset counts, and about which it turns.
enum class OffsetFrame : std::uint32_t {
  kBase,  ///< of the base frame; the turn is about the tool centre point all the same
  kTool   ///< of the tool frame
};
/// By an offset from where the tool is when the motion begins. One without a turn keeps the orientation; an arm of fewer than six
/// joints then keeps what it follows of it, with a turn it is a MovePoseRequest to where the offset leads.
struct MoveRelativeRequest {
  Pose offset{};
  OffsetFrame frame{};
  double t_s{};
  bool straight{};  ///< as above
};

using MotionRequest =
    std::variant<MoveRequest, MoveSRequest, MoveCRequest, MoveJointsRequest, DriveRequest, ReadyRequest,
                 DwellRequest, GripperRequest, MovePoseRequest, MoveRelativeRequest>;

}  // namespace corbot
