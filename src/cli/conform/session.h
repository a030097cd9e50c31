// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <chrono>
#include <optional>
#include <stdexcept>
#include <string>

#include "client/explain.h"

namespace corbot::cli {

/// A check does not hold; the text is the actual result.
class Differs : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

constexpr double kLow_percent = 20;      ///< speed of all checks
constexpr double kSame_m = 0.005;        ///< tolerance of arrival, the same as the cell's
constexpr double kRest_m = 0.002;        ///< tolerance of a repeated measurement at rest
constexpr double kBreaks_s = 0.5;        ///< time after which `cut` breaks its connection
constexpr double kLongestMotion_s = 60;  ///< time-out of a motion

/// Two points near the arm, and a third beside their middle, in the base frame, to which the robot moves.
struct Place {
  Eigen::Vector3d begin;
  Eigen::Vector3d middle;
  Eigen::Vector3d end;
};

/// A robot under examination.
class Session {
 public:
  /// Throws Failure if there is no reply or no robot, or the robot is not at rest. Nothing moves.
  Session(const client::Address& address, double timeout_s);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  ~Session();

  [[nodiscard]] const client::Address& address() const { return address_; }
  /// Returns the reference for calls without motion.
  [[nodiscard]] Corbot::Robot_ptr robot() const { return robot_.in(); }
  /// Returns the reference for motions. Throws Differs before slow_down() and after end().
  [[nodiscard]] Corbot::Robot_ptr motions() const;
  /// Returns a reference that breaks its connection during a call.
  [[nodiscard]] Corbot::Robot_ptr cut() const { return cut_.in(); }

  [[nodiscard]] Eigen::Vector3d position() const;
  void move(const Eigen::Vector3d& target, double above_m = 0) const;
  void move_s(const Eigen::Vector3d& target, double duration_s) const;
  /// Returns text such as "1.2 mm off, at rest". Throws Differs.
  [[nodiscard]] std::string rest_at(const Eigen::Vector3d& target) const;
  /// Returns the place; the first call moves the arm to find it. Throws Differs if there is none.
  const Place& place();

  void slow_down();
  /// Restores the speed from before slow_down(), as far as it is known.
  void restore_speed() const;
  /// Prevents further motions, and stops an Arm. Any thread may call it.
  void end();

 private:
  [[nodiscard]] bool is_standby() const;
  [[nodiscard]] bool reaches(const Place& place);
  void find_place();

  const client::Address address_;
  CORBA::ORB_var orb_;
  Corbot::Robot_var robot_;
  Corbot::Robot_var motions_;
  Corbot::Robot_var cut_;
  Corbot::Arm_var arm_;        ///< nil: the robot serves only robot.idl
  double speed_percent_{100};  ///< robot.idl cannot read it
  std::optional<Place> place_;
  std::string refusal_;  ///< of the first place that was tried
  bool is_slow_{false};
  std::atomic<bool> is_ended_{false};
};

/// Returns the run time of `f` in seconds.
template <class F>
double seconds_of(F&& f) {
  const auto begin = std::chrono::steady_clock::now();
  f();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace corbot::cli
