// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "arm.hh"
#include "client/failure.h"
#include "client/printable.h"

// Converts exceptions of the interface and of the ORB to messages that say what to do.

namespace corbot::client {

/// The address of a robot.
struct Address {
  std::string uri;                ///< argument of string_to_object
  std::string name;               ///< of the robot, as far as known
  std::string where;              ///< for messages: "127.0.0.1:12810", or the URI of another form
  std::string local{};            ///< name of the robot if it is up here; empty: it is elsewhere
  std::string naming{"--robot"};  ///< by which the user of this program names a robot
  /// Advice about a call without an answer in time.
  std::string if_late{"--timeout SECONDS waits longer"};
};

/// Returns true if a call ended because it took longer than this client waits.
[[nodiscard]] bool is_call_timeout(const CORBA::SystemException& e);

[[nodiscard]] Failure explain(const Corbot::BadParameter& e);
/// `settings`: a clause that names settings, "; …".
[[nodiscard]] Failure explain(const Corbot::Unreachable& e, const std::string& settings = {});
/// `joint`: the joint in the exception; none: not known, and the message has no unit. `reason`: a clause
/// after the values, "; …".
[[nodiscard]] Failure explain(const Corbot::LimitExceeded& e,
                              const std::optional<Corbot::JointInfo>& joint = {},
                              const std::string& reason = {});
[[nodiscard]] Failure explain(const Corbot::NotReady& e);
/// Does the same for Renew and Release, which need control, not a ready robot.
[[nodiscard]] Failure explain_control(const Corbot::NotReady& e);
[[nodiscard]] Failure explain(const Corbot::Stopped& e);
[[nodiscard]] Failure explain(const Corbot::QueueFull& e);
[[nodiscard]] Failure explain(const CORBA::SystemException& e, const Address& address);

/// Return true if the origin of the frame is elsewhere, and if its axes point elsewhere.
[[nodiscard]] bool has_offset(const Corbot::Pose& frame);
[[nodiscard]] bool is_turned(const Corbot::Pose& frame);

/// Returns "; numbers are metres: 20 cm is 0.20" for a point that no arm here reaches, else "".
[[nodiscard]] const char* metres_hint(double x_m, double y_m, double z_m);

[[nodiscard]] const char* to_string(Corbot::DeviceHealth health);
/// Returns true if the device is connected and waits for a Clear without energy for the servos. Otherwise a
/// closed device means that no task runs.
[[nodiscard]] bool stands_by(const Corbot::DeviceInfo& device);
/// Returns "ssc32, open", with the cause if there is one.
[[nodiscard]] std::string describe(const Corbot::DeviceInfo& device);

/// Returns the joint's number. Throws Failure, kUsage, with all names, if `name` is not among `names`.
[[nodiscard]] int number_of_joint(std::span<const std::string> names, const std::string& name);

/// Returns true if an arm whose tool pitch is not set plans with pitch 0. Other arms keep their tool's pitch.
[[nodiscard]] bool has_default_pitch(Corbot::RobotKind kind, std::size_t joints);

/// Returns the value with at most six significant digits: "0.42", "-12.5".
[[nodiscard]] std::string plain(double value);

/// Returns true if the call was not carried out, and will not be.
[[nodiscard]] bool is_certainly_not_executed(const CORBA::SystemException& e);

/// Returns the Failure for a call to start a motion that ended with `cause` although the robot may have
/// accepted it.
[[nodiscard]] Failure unknown_start(const Failure& cause);
/// Returns the Failure for an accepted motion whose end can no longer be queried. `is_known`: the robot may
/// have its ticket. If not, another motion may have the number, and the text does not offer to cancel it.
[[nodiscard]] Failure unknown_end(Corbot::Ticket ticket, const std::string& cause, bool is_known = true);

/// Calls `f` and turns every exception of the interface into a Failure; exceptions of the ORB leave the
/// function.
template <class F>
auto call_user(F&& f) -> decltype(f()) {
  try {
    return f();
  } catch (const Corbot::BadParameter& e) {
    throw explain(e);
  } catch (const Corbot::Unreachable& e) {
    throw explain(e);
  } catch (const Corbot::LimitExceeded& e) {
    throw explain(e);
  } catch (const Corbot::NotReady& e) {
    throw explain(e);
  } catch (const Corbot::Stopped& e) {
    throw explain(e);
  } catch (const Corbot::QueueFull& e) {
    throw explain(e);
  } catch (const CORBA::SystemException&) {
    throw;
  } catch (const CORBA::Exception& e) {
    throw Failure(ExitCode::kInternal,
                  std::string("the robot raised an exception that is not in the interface: ") + e._name());
  }
}

/// Does the same, including exceptions of the ORB.
template <class F>
auto call(const Address& address, F&& f) -> decltype(f()) {
  try {
    return call_user(f);
  } catch (const CORBA::SystemException& e) {
    throw explain(e, address);
  }
}

}  // namespace corbot::client
