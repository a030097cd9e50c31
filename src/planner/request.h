// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <variant>

#include "corbot/kinematics/joints.h"

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

using MotionRequest = std::variant<MoveRequest, MoveSRequest, MoveCRequest, MoveJointsRequest, DriveRequest,
                                   ReadyRequest, DwellRequest, GripperRequest>;

}  // namespace corbot
