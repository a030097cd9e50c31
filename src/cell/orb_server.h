// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <omniORB4/CORBA.h>

#include <string>
#include <vector>

namespace corbot::cell {

/// The ORB of a cell's program: its objects have fixed keys at each of its ports, so `corbaloc::HOST:PORT/KEY` finds them. One a
/// process.
class OrbServer {
 public:
  /// Listens at one port or more. Throws client::Failure, kInternal, where one is in use. No message has more
  /// than `most_bytes`.
  OrbServer(const std::string& host, const std::vector<int>& ports, std::size_t most_bytes = 262'144);
  OrbServer(const OrbServer&) = delete;
  OrbServer& operator=(const OrbServer&) = delete;
  /// Ends the ORB; calls under way are waited for.
  ~OrbServer();

  [[nodiscard]] CORBA::ORB_ptr orb() const { return orb_.in(); }
  /// `servant` must outlive the ORB. Requests come once serve() is called.
  void activate(const std::string& key, PortableServer::Servant servant);
  /// From now on calls are carried out. Prints "ready CORBALOC" of `key` at the first port, and reports READY=1 and WATCHDOG=1 until SIGINT, SIGTERM
  /// or SIGHUP, which are blocked in all threads (run_program), asks for the end.
  void serve(const std::string& key);

 private:
  std::string endpoint_;
  CORBA::ORB_var orb_;
  PortableServer::POA_var poa_;
};

/// Throws client::Failure, kInternal, where no server can listen there now.
void check_listen(const std::string& host, int port);

/// A reference that is checked by its first call, not now: the order of starts does not matter.
template <class Interface>
typename Interface::_ptr_type reference_to(CORBA::ORB_ptr orb, const std::string& uri) {
  const CORBA::Object_var object = orb->string_to_object(uri.c_str());
  return Interface::_unchecked_narrow(object);
}

}  // namespace corbot::cell
