// SPDX-License-Identifier: Apache-2.0
// Attributes, and calls that must be refused.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>

#include "cli/conform/checks.h"

namespace corbot::cli {

using Eigen::Vector3d;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kFar_m = 100;  // beyond the reach of any arm

std::string joints_agree(Session& session) {
  const CORBA::Long dof = session.robot()->DoF();
  Corbot::JointCoord_var joints = session.robot()->ArtiCoord();
  Corbot::JointRanges_var ranges = session.robot()->MovRange();
  std::string came = fmt::format("{}, {} joints, {} ranges", dof, joints->length(), ranges->length());
  const auto count = static_cast<CORBA::ULong>(dof);
  if (dof < 1 || joints->length() != count || ranges->length() != count) throw Differs(came);
  return came;
}

std::string joints_are_in_range(Session& session) {
  constexpr double kTolerance = 1;  // degrees or m: a measured joint may be slightly beyond
  Corbot::JointCoord_var joints = session.robot()->ArtiCoord();
  Corbot::JointRanges_var ranges = session.robot()->MovRange();
  for (CORBA::ULong i = 0; i < joints->length() && i < ranges->length(); ++i) {
    const Corbot::JointRange& range = ranges[i];
    if (range.lower < range.upper && joints[i] >= range.lower - kTolerance &&
        joints[i] <= range.upper + kTolerance)
      continue;
    throw Differs(fmt::format("joint {}: {:g} in {:g} to {:g}", i, joints[i], range.lower, range.upper));
  }
  return "all are";
}

std::string kind_and_reach(Session& session) {
  const auto kind = static_cast<int>(session.robot()->RobotType());
  const double reach_m = session.robot()->Reach();
  std::string came = fmt::format("kind {}, {:g} m", kind, reach_m);
  if (!std::isfinite(reach_m) || reach_m < 0) throw Differs(came);
  return came;
}

std::string pose_is_read(Session& session) {
  const Vector3d first = session.position(), later = session.position();
  std::string came = fmt::format("{:.3f} {:.3f} {:.3f} m", first.x(), first.y(), first.z());
  if (!first.allFinite() || !((later - first).norm() <= kRest_m)) throw Differs(came);
  return came;
}

std::string is_ready(Session& session) {
  if (session.robot()->Status() != Corbot::Standby) throw Differs("another Status");
  return "Standby";
}

/// Checks that `call` raises E and moves nothing. Any other exception leaves the function.
template <class E, class F>
void expect_refusal(Session& session, const std::string& name, F&& call) {
  const Vector3d before = session.position();
  bool is_refused = false;
  try {
    call();
  } catch (const E&) {
    is_refused = true;
  }
  if (!is_refused) throw Differs(name + " was accepted");
  if (!((session.position() - before).norm() <= kRest_m)) throw Differs(name + " has moved the arm");
}

/// Runs `call` and accepts the range of a sliding joint as the reason, too.
template <class F>
void as_unreachable(F&& call) {
  try {
    call();
  } catch (const Corbot::LimitExceeded&) {
    throw Corbot::Unreachable();
  }
}

std::string unreachable_is_refused(Session& session) {
  const Vector3d far(kFar_m, 0, 0);
  expect_refusal<Corbot::Unreachable>(session, "Move", [&] { as_unreachable([&] { session.move(far); }); });
  expect_refusal<Corbot::Unreachable>(session, "MoveS",
                                      [&] { as_unreachable([&] { session.move_s(far, 0); }); });
  return "so it is, and nothing moves";
}

std::string move_refuses_nonsense(Session& session) {
  const Vector3d here = session.position();
  expect_refusal<Corbot::BadParameter>(session, "x = NaN", [&] { session.move({kNan, here.y(), here.z()}); });
  expect_refusal<Corbot::BadParameter>(session, "t = -1", [&] { session.move_s(here, -1); });
  return "BadParameter";
}

std::string speed_refuses_nonsense(Session& session) {
  for (const double percent : {0.0, -1.0, 101.0, kNan}) {
    try {
      expect_refusal<Corbot::BadParameter>(session, fmt::format("{:g} %", percent),
                                           [&] { session.robot()->Speed(percent); });
    } catch (...) {
      session.slow_down();  // the value may be in force now
      throw;
    }
  }
  return "BadParameter";
}

std::string joint_speeds_refuse_nonsense(Session& session) {
  const CORBA::Long beyond = session.robot()->DoF();
  expect_refusal<Corbot::BadParameter>(session, fmt::format("joint {}", beyond),
                                       [&] { session.robot()->ArtSpeed(beyond, kLow_percent); });
  expect_refusal<Corbot::BadParameter>(session, "101 %", [&] { session.robot()->AllSpeed(101); });
  return "BadParameter";
}

std::string drive_refuses_nonsense(Session& session) {
  const CORBA::Long beyond = session.robot()->DoF();
  expect_refusal<Corbot::BadParameter>(session, fmt::format("joint {}", beyond),
                                       [&] { session.motions()->Drive(beyond, 1, 1); });
  expect_refusal<Corbot::BadParameter>(session, "NaN", [&] { session.motions()->Drive(0, kNan, 1); });
  return "BadParameter";
}

std::string arc_refuses_one_point(Session& session) {
  const Vector3d at = session.position();
  const Corbot::Point point{at.x(), at.y(), at.z()};
  expect_refusal<Corbot::BadParameter>(session, "one point",
                                       [&] { session.motions()->MoveC(point, point, point); });
  return "BadParameter";
}

std::string delay_refuses_nonsense(Session& session) {
  for (const double duration_s : {-1.0, kNan})
    expect_refusal<Corbot::BadParameter>(session, fmt::format("{:g} s", duration_s),
                                         [&] { session.robot()->Delay(duration_s); });
  return "BadParameter";
}

constexpr std::array kReadChecks{
    Check{"Status", true, "Standby at rest", is_ready},
    Check{"CartCoord", true, "numbers, and the same twice", pose_is_read},
    Check{"DoF", false, "as many in ArtiCoord and MovRange", joints_agree},
    Check{"ArtiCoord", false, "all within MovRange", joints_are_in_range},
    Check{"RobotType, Reach", false, "a kind, and 0 m or more", kind_and_reach},
    Check{"Speed refuses", false, "BadParameter at 0, -1, 101 % and NaN", speed_refuses_nonsense},
    Check{"ArtSpeed, AllSpeed", false, "BadParameter at no joint, 101 %", joint_speeds_refuse_nonsense},
    Check{"Move, MoveS too far", true, "Unreachable or LimitExceeded at 100 m", unreachable_is_refused},
    Check{"Move, MoveS refuse", false, "BadParameter at NaN, at t = -1", move_refuses_nonsense},
    Check{"Drive refuses", false, "BadParameter at no joint, at NaN", drive_refuses_nonsense},
    Check{"MoveC refuses", false, "BadParameter at one point", arc_refuses_one_point},
    Check{"Delay refuses", false, "BadParameter at -1 s and NaN", delay_refuses_nonsense},
};

}  // namespace

std::span<const Check> read_checks() { return kReadChecks; }

}  // namespace corbot::cli
