// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <mutex>
#include <stop_token>
#include <string>
#include <utility>

#include "cell/coordinator/pause.h"
#include "cell/coordinator/ports.h"
#include "cell/orb_server.h"
#include "client/explain.h"

// Common parts of the calls to robots, camera and store.

namespace corbot::cell {

/// Tells if the same call may succeed later: there was no connection, or no reply in time.
[[nodiscard]] bool may_recover(const CORBA::SystemException& e);
/// Returns a Failure with "no reply from URI (TRANSIENT)", or with the text of client::explain.
[[nodiscard]] client::Failure explain_call(const CORBA::SystemException& e, const std::string& uri);

/// A reference with its own time-out. The first use resolves it, because resolving a corbaname throws while
/// the naming service starts.
template <class Interface>
class LazyReference {
 public:
  LazyReference(CORBA::ORB_ptr orb, std::string uri, double timeout_s)
      : orb_(CORBA::ORB::_duplicate(orb)), uri_(std::move(uri)), timeout_s_(timeout_s) {}

  [[nodiscard]] typename Interface::_var_type get() {
    const std::lock_guard lock(mutex_);
    if (CORBA::is_nil(reference_.in())) {
      typename Interface::_var_type made = reference_to<Interface>(orb_.in(), uri_);
      omniORB::setClientCallTimeout(made.in(), static_cast<CORBA::ULong>(1e3 * timeout_s_));
      reference_ = made;
    }
    return reference_;
  }
  [[nodiscard]] const std::string& uri() const { return uri_; }

 private:
  const CORBA::ORB_var orb_;
  const std::string uri_;
  const double timeout_s_;
  std::mutex mutex_;
  typename Interface::_var_type reference_;
};

/// Calls `f`, and repeats it after 0.1 to 2 s while it throws NotReady or gets no reply. Throws Failure after
/// `patience_s` without success, or once a stop is requested.
template <class F>
auto call_patiently(const std::string& uri, double patience_s, const std::stop_token& stop, F&& f)
    -> decltype(f()) {
  const auto begin = std::chrono::steady_clock::now();
  for (double pause_s = 0.1;; pause_s = std::min(2 * pause_s, 2.0)) {
    std::string why;
    try {
      return f();
    } catch (const Corbot::NotReady& e) {
      why = uri + ": " + client::printable(e.reason.in());
    } catch (const CORBA::SystemException& e) {
      if (!may_recover(e)) throw explain_call(e, uri);
      why = explain_call(e, uri).what();
    }
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin;
    if (stop.stop_requested() || elapsed.count() >= patience_s)
      throw client::Failure(client::ExitCode::kUnreachable, why);
    pause(pause_s, stop);
  }
}

}  // namespace corbot::cell
