// SPDX-License-Identifier: Apache-2.0
// Calls that move the arm, or wait.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <future>
#include <thread>

#include "cli/conform/checks.h"

namespace corbot::cli {

using Eigen::Vector3d;

namespace {

// allowance for clocks that differ: a call may last this much less than it should
constexpr double kEarly_s = 0.1;

void pause(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

Corbot::Point point(const Vector3d& at) { return {at.x(), at.y(), at.z()}; }

/// Returns the duration as text. Throws Differs if it is not within the bounds, in seconds.
std::string expect_seconds(double lasted_s, double least_s, double most_s) {
  std::string came = fmt::format("{:.2f} s", lasted_s);
  if (lasted_s < least_s - kEarly_s || lasted_s > most_s) throw Differs(came);
  return came;
}

std::string moves(Session& session) {
  const Place& place = session.place();
  session.move(place.end);
  std::string came = session.rest_at(place.end);
  session.move(place.begin, 0.02);
  (void)session.rest_at(place.begin);
  return came;
}

std::string moves_again(Session& session) {
  const Place& place = session.place();
  session.move(place.begin);
  const double lasted_s = seconds_of([&] { session.move(place.begin); });
  (void)session.rest_at(place.begin);
  return expect_seconds(lasted_s, 0, 1);
}

std::string moves_in_a_line(Session& session) {
  const Place& place = session.place();
  session.move(place.begin);
  const double lasted_s = seconds_of([&] { session.move_s(place.end, 2); });
  const std::string came = session.rest_at(place.end);
  return expect_seconds(lasted_s, 2, 4) + ", " + came;
}

std::string reads_meanwhile(Session& session) {
  const Place& place = session.place();
  session.move(place.begin);
  auto motion = std::async(std::launch::async, [&] { session.move_s(place.end, 2); });
  pause(0.5);
  Corbot::RobotState state{};
  const double lasted_s = seconds_of([&] {
    state = session.robot()->Status();
    (void)session.position();
  });
  motion.get();
  if (state != Corbot::Waiting) throw Differs("Status is not Waiting");
  return "Waiting, " + expect_seconds(lasted_s, 0, 1);
}

std::string speed_slows(Session& session) {
  session.slow_down();
  const Place& place = session.place();
  session.move(place.begin);
  const double quick_s = seconds_of([&] { session.move_s(place.end, 0); });
  session.robot()->Speed(kLow_percent / 4);
  const double slow_s = seconds_of([&] { session.move_s(place.begin, 0); });
  session.slow_down();
  std::string came = fmt::format("{:.2f} and {:.2f} s", quick_s, slow_s);
  if (slow_s < 1.5 * quick_s) throw Differs(came);
  return came;
}

std::string two_calls(Session& session) {
  const Place& place = session.place();
  session.move(place.begin);
  bool is_refused = false;
  const double lasted_s = seconds_of([&] {
    auto first = std::async(std::launch::async, [&] { session.move_s(place.end, 1.5); });
    pause(0.3);
    try {
      session.move_s(place.begin, 1.5);
    } catch (const Corbot::QueueFull&) {
      is_refused = true;
    }
    first.get();
  });
  (void)session.rest_at(is_refused ? place.end : place.begin);
  return is_refused ? "QueueFull" : "one after the other, " + expect_seconds(lasted_s, 3, 6);
}

std::string breaks_a_connection(Session& session) {
  const Place& place = session.place();
  session.move(place.begin);
  try {
    const Vector3d& to = place.end;
    session.cut()->MoveS(to.x(), to.y(), to.z(), 0, 2);
    throw Differs("MoveS in 2 s has returned within 0.5 s");
  } catch (const CORBA::SystemException& e) {
    if (!client::is_call_timeout(e)) throw;
  }
  const double lasted_s = seconds_of([&] {
    for (int i = 0; i < 100 && session.robot()->Status() == Corbot::Waiting; ++i) pause(0.1);
  });
  if (session.robot()->Status() != Corbot::Standby)
    throw Differs(fmt::format("no Standby after {:.0f} s", lasted_s));
  session.move(place.begin);
  return fmt::format("Standby after {:.1f} s, ", lasted_s) + session.rest_at(place.begin);
}

std::string moves_in_an_arc(Session& session) {
  const Place& place = session.place();
  session.motions()->MoveC(point(place.begin), point(place.middle), point(place.end));
  return session.rest_at(place.end);
}

/// Returns true for a sliding joint. The range of a rotary joint is at least 6 degrees, that of a sliding one
/// at most 6 m.
bool slides(const Corbot::JointRange& range) { return range.upper - range.lower < 6; }

std::string drives(Session& session) {
  Corbot::JointRanges_var ranges = session.robot()->MovRange();
  Corbot::JointCoord_var before = session.robot()->ArtiCoord();
  if (before->length() == 0 || ranges->length() == 0) throw Differs("not called: no joint is known");
  const bool is_slide = slides(ranges[0]);
  const double way = is_slide ? 0.02 : 3, speed = is_slide ? 0.02 : 3;
  const bool is_high = before[0] > (ranges[0].lower + ranges[0].upper) / 2;
  const double increment = is_high ? -way : way;
  const double lasted_s = seconds_of([&] { session.motions()->Drive(0, increment, speed); });
  Corbot::JointCoord_var after = session.robot()->ArtiCoord();
  session.motions()->Drive(0, -increment, speed);
  std::string came = fmt::format("{:+g}, ", after[0] - before[0]);
  if (!(std::abs(after[0] - before[0] - increment) <= way / 10)) throw Differs(came + "not all of it");
  return came + expect_seconds(lasted_s, way / speed, 4);
}

std::string delays(Session& session) {
  return expect_seconds(seconds_of([&] { session.motions()->Delay(1); }), 1, 2);
}

std::string grips(Session& session) {
  const bool was_open = session.robot()->GripperStatus() == Corbot::Open;
  session.motions()->Close();
  const bool is_closed = session.robot()->GripperStatus() == Corbot::Close;
  session.motions()->Open();
  const bool is_open = session.robot()->GripperStatus() == Corbot::Open;
  if (!was_open) session.motions()->Close();
  if (!is_closed || !is_open) throw Differs("GripperStatus is not what was called");
  return "Close, Open";
}

std::string gets_ready(Session& session) {
  session.motions()->Ready();
  Corbot::JointCoord_var joints = session.robot()->ArtiCoord();
  Corbot::JointRanges_var ranges = session.robot()->MovRange();
  for (CORBA::ULong i = 0; i < joints->length() && i < ranges->length(); ++i) {
    const double tolerance = slides(ranges[i]) ? 0.005 : 1;
    if (!(std::abs(joints[i]) <= tolerance)) throw Differs(fmt::format("joint {} at {:g}", i, joints[i]));
  }
  return session.rest_at(session.position());
}

constexpr std::array kMotionChecks{
    Check{"Move", true, "at rest within 5 mm, also by d = 0.02", moves},
    Check{"Move to where it is", true, "1 s or less", moves_again},
    Check{"MoveS in 2 s", true, "2 to 4 s, at rest within 5 mm", moves_in_a_line},
    Check{"reads in a motion", true, "Waiting, 1 s or less", reads_meanwhile},
    Check{"Speed", true, "a line is slower at a quarter", speed_slows},
    Check{"Delay", true, "1 to 2 s", delays},
    Check{"Open, Close", true, "GripperStatus follows", grips},
    Check{"broken connection", true, "Standby within 10 s, then a Move", breaks_a_connection},
    Check{"two calls at once", false, "one after the other, or QueueFull", two_calls},
    Check{"MoveC", false, "at rest within 5 mm of P3", moves_in_an_arc},
    Check{"Drive", false, "joint 0 by 3 degrees (0.02 m) in 1 s", drives},
    Check{"Ready", false, "at rest, all joints 0", gets_ready},
};

}  // namespace

std::span<const Check> motion_checks() { return kMotionChecks; }

}  // namespace corbot::cli
