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

/// A check does not hold; the text is what came instead.
class Differs : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

constexpr double kLow_percent = 20;      ///< the speed of all checks
constexpr double kSame_m = 0.005;        ///< for arrived: the cell's own tolerance
constexpr double kRest_m = 0.002;        ///< within which an arm at rest is measured again
constexpr double kBreaks_s = 0.5;        ///< after so long `cut` breaks its connection
constexpr double kLongestMotion_s = 60;  ///< time-out of a motion

/// Two points near the arm, and a third beside their middle, in the base frame, to which the robot moves.
struct Place {
  Eigen::Vector3d begin;
  Eigen::Vector3d middle;
  Eigen::Vector3d end;
};

/// A robot that is examined.
class Session {
 public:
  /// Throws Failure: no reply, no robot, or one that is not at rest. Nothing moves.
  Session(const client::Address& address, double timeout_s);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  ~Session();

  [[nodiscard]] const client::Address& address() const { return address_; }
  /// For what does not move.
  [[nodiscard]] Corbot::Robot_ptr robot() const { return robot_.in(); }
  /// For motions. Throws Differs before slow_down() and after end().
  [[nodiscard]] Corbot::Robot_ptr motions() const;
  /// Breaks its connection in mid-call.
  [[nodiscard]] Corbot::Robot_ptr cut() const { return cut_.in(); }

  [[nodiscard]] Eigen::Vector3d position() const;
  void move(const Eigen::Vector3d& target, double above_m = 0) const;
  void move_s(const Eigen::Vector3d& target, double duration_s) const;
  /// "1.2 mm off, at rest". Throws Differs.
  [[nodiscard]] std::string rest_at(const Eigen::Vector3d& target) const;
  /// The first call moves the arm to find it. Throws Differs where there is none.
  const Place& place();

  void slow_down();
  /// As it was before slow_down(), as far as that is known.
  void restore_speed() const;
  /// No motion begins from now on, and an Arm is stopped. From another thread.
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
  Corbot::Arm_var arm_;        ///< nil: it serves robot.idl alone
  double speed_percent_{100};  ///< robot.idl has no way to read it
  std::optional<Place> place_;
  std::string refusal_;  ///< of the first place that was tried
  bool is_slow_{false};
  std::atomic<bool> is_ended_{false};
};

/// Seconds that `f` takes.
template <class F>
double seconds_of(F&& f) {
  const auto begin = std::chrono::steady_clock::now();
  f();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace corbot::cli
