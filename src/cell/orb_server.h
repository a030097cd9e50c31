// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <omniORB4/CORBA.h>

#include <string>
#include <vector>

namespace corbot::cell {

/// The ORB of a cell's program. Its objects have fixed keys at each port, so `corbaloc::HOST:PORT/KEY` finds
/// them. A process has at most one.
class OrbServer {
 public:
  /// Listens at one or more ports. Throws client::Failure, kInternal, if a port is in use. `most_bytes` is
  /// the largest message.
  OrbServer(const std::string& host, const std::vector<int>& ports, std::size_t most_bytes = 262'144);
  OrbServer(const OrbServer&) = delete;
  OrbServer& operator=(const OrbServer&) = delete;
  /// Shuts the ORB down, and waits for calls in progress.
  ~OrbServer();

  [[nodiscard]] CORBA::ORB_ptr orb() const { return orb_.in(); }
  /// Registers an object. `servant` must outlive the ORB. Its calls start with serve().
  void activate(const std::string& key, PortableServer::Servant servant);
  /// Carries out calls until a signal of end_signals.h; all threads block these signals (run_program). Prints
  /// "ready CORBALOC" of `key` at the first port, and reports READY=1 and WATCHDOG=1.
  void serve(const std::string& key);

 private:
  std::string endpoint_;
  CORBA::ORB_var orb_;
  PortableServer::POA_var poa_;
};

/// Throws client::Failure, kInternal, if a server cannot listen at the address now. `instead` is the advice
/// for a port in use.
void check_listen(const std::string& host, int port,
                  const std::string& instead = "choose other ports with --ports");

/// Returns a reference unchecked: its first call connects. Programs may therefore start in any order.
template <class Interface>
typename Interface::_ptr_type reference_to(CORBA::ORB_ptr orb, const std::string& uri) {
  const CORBA::Object_var object = orb->string_to_object(uri.c_str());
  return Interface::_unchecked_narrow(object);
}

}  // namespace corbot::cell
