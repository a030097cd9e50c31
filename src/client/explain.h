// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "arm.hh"
#include "client/failure.h"

// Exceptions of the interface and of the ORB in words that a person can act on.

namespace corbot::client {

/// Where a robot was looked for, for messages.
struct Address {
  std::string uri;    ///< what string_to_object takes
  std::string name;   ///< of the robot, as far as known
  std::string where;  ///< "127.0.0.1:12810", or the whole URI when it is of another form
};

/// Whether a call ended because it took longer than this client waits.
[[nodiscard]] bool is_call_timeout(const CORBA::SystemException& e);

[[nodiscard]] Failure explain(const Corbot::BadParameter& e);
[[nodiscard]] Failure explain(const Corbot::Unreachable& e);
[[nodiscard]] Failure explain(const Corbot::LimitExceeded& e);
[[nodiscard]] Failure explain(const Corbot::NotReady& e);
[[nodiscard]] Failure explain(const Corbot::Stopped& e);
[[nodiscard]] Failure explain(const Corbot::QueueFull& e);
[[nodiscard]] Failure explain(const CORBA::SystemException& e, const Address& address);

/// What came over the wire, fit for a terminal: printable ASCII, others as '?', at most 400 characters.
[[nodiscard]] std::string printable(std::string_view text);

/// A number with its unit, without digits that mean nothing: "0.42", "-12.5".
[[nodiscard]] std::string plain(double value);

/// Calls `f` and turns every CORBA exception into a Failure.
template <class F>
auto ask(const Address& address, F&& f) -> decltype(f()) {
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
  } catch (const CORBA::SystemException& e) {
    throw explain(e, address);
  } catch (const CORBA::Exception& e) {
    throw Failure(ExitCode::kInternal,
                  std::string("the robot raised an exception that is not in the interface: ") + e._name());
  }
}

}  // namespace corbot::client
