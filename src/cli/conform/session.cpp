// SPDX-License-Identifier: Apache-2.0
#include "cli/conform/session.h"

#include <fmt/format.h>

#include <cmath>
#include <thread>

#include "client/client.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;
using Eigen::Vector3d;

namespace {

constexpr double kWay_m = 0.03;   // of a motion
constexpr double kBend_m = 0.01;  // distance of an arc from the line

Corbot::Robot_var reference(CORBA::ORB_ptr orb, const client::Address& address, double timeout_s) {
  const CORBA::Object_var object = client::find_object(orb, address);
  Corbot::Robot_var robot = Corbot::Robot::_unchecked_narrow(object);
  omniORB::setClientCallTimeout(robot.in(), static_cast<CORBA::ULong>(1e3 * timeout_s));
  return robot;
}

}  // namespace

Session::Session(const client::Address& address, double timeout_s)
    : address_(address), orb_(client::start_orb(timeout_s)) {
  robot_ = reference(orb_.in(), address, timeout_s);
  motions_ = reference(orb_.in(), address, kLongestMotion_s);
  cut_ = reference(orb_.in(), address, kBreaks_s);
  client::call(address, [&] {
    if (!robot_->_is_a(Corbot::Robot::_PD_repoId))
      throw Failure(
          ExitCode::kUnreachable,
          fmt::format("the object at {} does not have the interface Robot of robot.idl: check the reference",
                      address.where));
    if (robot_->_is_a(Corbot::Arm::_PD_repoId)) {
      arm_ = Corbot::Arm::_unchecked_narrow(robot_);
      const Corbot::SpeedSettings_var speeds = arm_->Speeds();
      speed_percent_ = speeds->tool;
    }
    if (!is_standby())
      throw Failure(ExitCode::kRefused,
                    "the robot is in Error or busy, but its Status must be Standby at the beginning: clear "
                    "it, or wait");
  });
}

/// Returns true also for a robot without Status.
bool Session::is_standby() const {
  try {
    return robot_->Status() == Corbot::Standby;
  } catch (const CORBA::BAD_OPERATION&) {  // NOLINT(bugprone-empty-catch): its check says so
  } catch (const CORBA::NO_IMPLEMENT&) {   // NOLINT(bugprone-empty-catch): the same
  }
  return true;
}

Session::~Session() {
  try {
    orb_->destroy();
  } catch (const CORBA::Exception&) {  // NOLINT(bugprone-empty-catch): the program ends
  }
}

Corbot::Robot_ptr Session::motions() const {
  if (is_ended_) throw Differs("not called: the examination was ended");
  if (!is_slow_) throw Differs("not called: Speed does not slow the arm down");
  return motions_.in();
}

Vector3d Session::position() const {
  const Corbot::CartesianCoord at = robot_->CartCoord();
  return {at.x, at.y, at.z};
}

void Session::move(const Vector3d& target, double above_m) const {
  motions()->Move(target.x(), target.y(), target.z() - above_m, above_m, 0);
}

void Session::move_s(const Vector3d& target, double duration_s) const {
  motions()->MoveS(target.x(), target.y(), target.z(), 0, duration_s);
}

std::string Session::rest_at(const Vector3d& target) const {
  const Vector3d first = position();
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  const Vector3d later = position();
  if (const double moved_m = (later - first).norm(); moved_m > kRest_m)
    throw Differs(fmt::format("the arm moves after the reply: {:.1f} mm in 0.3 s", 1e3 * moved_m));
  const double off_m = (later - target).norm();
  if (!(off_m <= kSame_m)) throw Differs(fmt::format("at rest {:.1f} mm off", 1e3 * off_m));
  if (robot_->Status() != Corbot::Standby) throw Differs("Status is not Standby after the motion");
  return fmt::format("{:.1f} mm off, at rest", 1e3 * off_m);
}

bool Session::reaches(const Place& place) {
  std::string refusal;
  try {
    for (const Vector3d& point : {place.begin, place.middle, place.end, place.begin}) move(point);
    return true;
  } catch (const Corbot::Unreachable& e) {
    refusal = client::explain(e).what();
  } catch (const Corbot::LimitExceeded& e) {
    refusal = client::explain(e).what();
  }
  if (refusal_.empty()) refusal_ = refusal;
  return false;
}

/// Searches from the present position inward, outward, upward and downward, as the arm may be at the edge of
/// its reach.
void Session::find_place() {
  const Vector3d here = position();
  const double radius_m = std::hypot(here.x(), here.y());
  Vector3d outward = Vector3d::UnitX();
  if (radius_m > 1e-3) outward = Vector3d(here.x(), here.y(), 0) / radius_m;
  const Vector3d sideways(-outward.y(), outward.x(), 0);
  for (const double inward_m : {0.0, 0.02, 0.04, 0.06, -0.03}) {
    for (const double up_m : {0.0, 0.03, -0.03}) {
      for (const double way_m : {kWay_m, -kWay_m}) {
        const Vector3d begin = here - inward_m * outward + up_m * Vector3d::UnitZ();
        const Vector3d end = begin + way_m * sideways;
        const Place tried{begin, (begin + end) / 2 - kBend_m * outward, end};
        if (!reaches(tried)) continue;
        place_ = tried;
        return;
      }
    }
  }
}

const Place& Session::place() {
  if (!place_ && refusal_.empty()) find_place();
  if (!place_) throw Differs("not called: no place near the arm is reached: " + refusal_);
  return *place_;
}

void Session::slow_down() {
  robot_->Speed(kLow_percent);
  is_slow_ = true;
}

void Session::restore_speed() const {
  if (!is_slow_) return;
  try {
    robot_->Speed(speed_percent_);
  } catch (const CORBA::Exception& e) {
    throw Failure(ExitCode::kUnreachable, fmt::format("Speed may still be {:g} % in place of {:g} %: {}",
                                                      kLow_percent, speed_percent_, e._name()));
  }
}

void Session::end() {
  constexpr int kTimes = 5;  // a motion may begin after a Stop that was sent before it
  is_ended_ = true;
  for (int i = 0; i < kTimes && !CORBA::is_nil(arm_.in()); ++i) {
    try {
      arm_->Stop();
    } catch (const CORBA::Exception&) {  // NOLINT(bugprone-empty-catch): sent again
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
}

}  // namespace corbot::cli
