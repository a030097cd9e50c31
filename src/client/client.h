// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "client/explain.h"
#include "client/request.h"

namespace corbot::client {

/// The address of the robot of `--robot`. Empty: $CORBOT_ROBOT, or the one that is up here. Takes a
/// corbaloc, corbaname or IOR, HOST:PORT/NAME, or the name of a robot that is up here. Throws Failure.
[[nodiscard]] Address find_robot(const std::string& robot);

/// The rotation of three angles as CartCoord has them, degrees, or of a quaternion w x y z; of nothing: none.
[[nodiscard]] Corbot::Quaternion orientation_of(std::span<const double> numbers);

/// With the joint's number in place of its name, one of `names`. Throws Failure, kUsage, where no joint has that name.
[[nodiscard]] Request with_joint_number(const Request& request, std::span<const std::string> names);

/// The arm moves, and Client::plan() says how.
[[nodiscard]] bool is_planned(Verb verb) noexcept;

/// A line for the user where a robot has planned more time than --time says; else nothing.
[[nodiscard]] std::string lengthening(double wanted_s, double planned_s);

/// Progress of the motion under way, 0 … 1; called several times a second from the thread that waits.
using ProgressReport = std::function<void(double)>;

/// The ORB of a client. `timeout_s` bounds each call through a reference without a time-out of its own. Throws Failure.
[[nodiscard]] CORBA::ORB_var start_orb(double timeout_s);
/// A new reference to the object at the address; nothing is called. Throws Failure.
[[nodiscard]] CORBA::Object_var find_object(CORBA::ORB_ptr orb, const Address& address);

/// One robot behind the ORB. Thread-safe, as the stubs are; every CORBA exception leaves as a Failure.
class Client {
 public:
  /// Connects. `timeout_s` bounds each call, not the motion that it starts.
  Client(const Address& address, double timeout_s);
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  ~Client();

  [[nodiscard]] const Address& address() const noexcept { return address_; }
  [[nodiscard]] Corbot::Arm_ptr arm() const noexcept { return arm_.in(); }

  /// Executes a request and returns when it is done. Throws Failure: kStopped when a Stop or a Cancel ended the
  /// motion, kUnreachable when what became of it is unknown. Returns a line for the user where the robot has taken more time
  /// than --time says; else nothing.
  [[nodiscard]] std::string perform(const Request& request, const ProgressReport& report = {});

  /// What perform() would start now; nothing moves. A motion of the arm, see is_planned(). Throws Failure.
  [[nodiscard]] Corbot::PlanInfo_var plan(const Request& request);

  /// Pre-empts whatever moves; returns at rest.
  void stop();

  /// Takes exclusive control; the reference through which its holder works, as text.
  [[nodiscard]] std::string acquire(const std::string& who, double lease_s);

  /// Makes perform() start nothing from now on, not even what it is about to start, unless that is stopped. To be
  /// called before the arm is stopped, from another thread than perform().
  void begin_cancel() noexcept { cancelled_ = true; }
  /// The same, and stops.
  void cancel();

  template <class F>
  auto call(F&& f) {
    return client::call(address_, [&] { return f(*arm_.in()); });
  }

 private:
  /// A Failure says when it is unknown whether the motion was accepted.
  [[nodiscard]] Corbot::Ticket start(const Request& request);
  [[nodiscard]] Corbot::Ticket begin(const Request& request);
  void set(const Request& request);
  /// Calls `f`; a limit that is exceeded leaves as a Failure with the unit of its joint.
  template <class F>
  auto with_units(F&& f) -> decltype(f()) {
    try {
      return f();
    } catch (const Corbot::LimitExceeded& e) {
      throw explain(e, info_of(e.articulation));
    }
  }
  /// With the joint's number in place of its name. Throws Failure, kUsage, where the arm has no joint of that name.
  [[nodiscard]] Request with_joint_number(const Request& request);
  /// Nothing where the robot does not say.
  [[nodiscard]] std::optional<Corbot::JointInfo> info_of(CORBA::Long joint) const;
  /// Until the motion has ended. A refused place among the waiting calls, or a lost connection, is no end: it
  /// asks again, and reports an unknown end as one. Returns the planned duration, seconds.
  double wait(Corbot::Ticket ticket, const ProgressReport& report);
  /// Its state now, or a moment later.
  [[nodiscard]] Corbot::MotionInfo_var follow(Corbot::Ticket ticket);

  Address address_;
  CORBA::ORB_var orb_;
  Corbot::Arm_var arm_;
  std::atomic<bool> cancelled_{false};
};

}  // namespace corbot::client
