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

/// Returns the address of the robot in `robot`, or if empty in $CORBOT_ROBOT, or of the one that is up
/// here. Accepts a corbaloc, corbaname or IOR, HOST:PORT/NAME, or the name of a robot that is up here. Throws
/// Failure. `naming`: by which the user of this program names a robot.
[[nodiscard]] Address find_robot(const std::string& robot, const std::string& naming = "--robot");

/// Returns the rotation of three angles in degrees (as in CartCoord) or of a quaternion w x y z. No numbers
/// give no rotation.
[[nodiscard]] Corbot::Quaternion orientation_of(std::span<const double> numbers);

/// Replaces the joint's name, one of `names`, by its number. Throws Failure, kUsage, if no joint has that
/// name.
[[nodiscard]] Request with_joint_number(const Request& request, std::span<const std::string> names);

/// Returns true if the arm moves and Client::plan() can plan the motion.
[[nodiscard]] bool is_planned(Verb verb) noexcept;

/// Returns a line for the user if a robot has planned more time than --time; else "".
[[nodiscard]] std::string lengthening(double wanted_s, double planned_s);

/// Reports the progress of the motion, 0 … 1; the waiting thread calls it several times a second.
using ProgressReport = std::function<void(double)>;

/// Starts the ORB of a client. `timeout_s` bounds each call through a reference without its own time-out.
/// Throws Failure.
[[nodiscard]] CORBA::ORB_var start_orb(double timeout_s);
/// Returns a new reference to the object at the address without a call. Throws Failure.
[[nodiscard]] CORBA::Object_var find_object(CORBA::ORB_ptr orb, const Address& address);
/// The arm there, which a call has confirmed. Throws Failure.
[[nodiscard]] Corbot::Arm_var find_arm(CORBA::ORB_ptr orb, const Address& address);

/// One robot behind the ORB. Thread-safe, like the stubs. Turns every CORBA exception into a Failure.
class Client {
 public:
  /// Connects. `timeout_s` bounds each call, not the motion that it starts.
  Client(const Address& address, double timeout_s);
  /// Uses an ORB that outlives the client, and a reference with the caller's time-out. Calls nothing.
  Client(const Address& address, CORBA::ORB_ptr orb, Corbot::Arm_ptr arm);
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  ~Client();

  [[nodiscard]] const Address& address() const noexcept { return address_; }
  [[nodiscard]] Corbot::Arm_ptr arm() const noexcept { return arm_.in(); }

  /// Executes a request and returns when it is done. Throws Failure: kStopped if a Stop or a Cancel ended the
  /// motion, kUnreachable if its outcome is unknown. Returns a line for the user if the robot has taken more
  /// time than --time; else "".
  [[nodiscard]] std::string perform(const Request& request, const ProgressReport& report = {});

  /// Starts a motion and returns its ticket without a wait. Executes any other request that perform() does,
  /// and returns nothing. Throws Failure.
  std::optional<Corbot::Ticket> send(const Request& request);

  /// Plans the motion that perform() would start now; nothing moves. The request must be a motion of the arm,
  /// see is_planned(). Throws Failure.
  [[nodiscard]] Corbot::PlanInfo_var plan(const Request& request);

  /// Pre-empts all motion; returns at rest.
  void stop();

  /// Takes exclusive control. Returns the holder's reference as text.
  [[nodiscard]] std::string acquire(const std::string& who, double lease_s);

  /// Prevents perform() from starting any motion from now on. A motion that it is just starting is stopped.
  /// To be called before the arm is stopped, from a thread other than perform()'s.
  void begin_cancel() noexcept { cancelled_ = true; }
  /// Does the same, and stops the arm.
  void cancel();

  template <class F>
  auto call(F&& f) {
    return client::call(address_, [&] { return f(*arm_.in()); });
  }

 private:
  /// Starts a motion. If it is unknown whether the motion was accepted, the Failure says so.
  [[nodiscard]] Corbot::Ticket start(const Request& request);
  [[nodiscard]] Corbot::Ticket begin(const Request& request);
  void set(const Request& request);
  /// Calls `f`. Turns an exceeded limit into a Failure with the unit of its joint. That message, and the one
  /// of an unreachable point, names the settings that decide where `verb` leads the joints.
  template <class F>
  auto with_units(Verb verb, F&& f) -> decltype(f()) {
    try {
      return f();
    } catch (const Corbot::LimitExceeded& e) {
      throw explain(e, info_of(e.articulation), pitch_clause(verb, e));
    } catch (const Corbot::Unreachable& e) {
      throw explain(e, pitch_clause(verb) + frames_clause());
    }
  }
  /// Replaces the joint's name by its number. Throws Failure, kUsage, if the arm has no joint of that name.
  [[nodiscard]] Request with_joint_number(const Request& request);
  /// Returns nothing if the robot does not report it.
  [[nodiscard]] std::optional<Corbot::JointInfo> info_of(CORBA::Long joint) const;
  [[nodiscard]] std::string pitch_clause(Verb verb) const;
  [[nodiscard]] std::string pitch_clause(Verb verb, const Corbot::LimitExceeded& e) const;
  /// Names the tool and base frame in force if they change positions.
  [[nodiscard]] std::string frames_clause() const;
  /// Waits until the motion has ended. After a refused slot for a waiting call or a lost connection it
  /// retries; if the end stays unknown, it reports that. Returns the planned duration, seconds.
  double wait(Corbot::Ticket ticket, const ProgressReport& report);
  /// Returns the motion's state now, or slightly later.
  [[nodiscard]] Corbot::MotionInfo_var follow(Corbot::Ticket ticket);

  Address address_;
  CORBA::ORB_var orb_;
  bool has_own_orb_;
  Corbot::Arm_var arm_;
  std::atomic<bool> cancelled_{false};
};

}  // namespace corbot::client
