// SPDX-License-Identifier: Apache-2.0
#include "cell/orb_server.h"

#include <fmt/format.h>

#include <vector>

#include "cell/counted_calls.h"
#include "client/failure.h"
#include "net/connections.h"
#include "net/ports.h"
#include "notify/end_signals.h"
#include "orb/log/orb_log.h"

namespace corbot::cell {

using client::ExitCode;
using client::Failure;

void check_listen(const std::string& host, int port, const std::string& instead) {
  const std::string why = net::listen_error(host, port);
  if (why.empty()) return;
  const bool is_taken = why.find("in use") != std::string::npos;
  throw Failure(ExitCode::kInternal, why + ": " + (is_taken ? instead : "check cell.host in cell.toml"));
}

OrbServer::OrbServer(const std::string& host, const std::vector<int>& ports, std::size_t most_bytes)
    : endpoint_(net::endpoint_text(host, ports.front())) {
  for (const int port : ports) check_listen(host, port);
  corbot_connections_start();
  corbot_connections_close_elsewhere();
  std::vector<std::string> words{"corbot-cell"};
  const auto add = [&](const char* option, const std::string& value) {
    words.push_back(std::string("-ORB") + option);
    words.push_back(value);
  };
  for (const int port : ports) add("endPoint", "giop:tcp:" + net::endpoint_text(host, port));
  add("threadPerConnectionPolicy", "1");  // waiting calls would exhaust a thread pool
  add("maxServerThreadPerConnection", "32");
  add("maxGIOPConnectionPerServer", "20");  // a client's waiting calls do not block its other calls
  add("giopMaxMsgSize", std::to_string(most_bytes));
  add("scanGranularity", "5");
  add("inConScanPeriod", "180");  // closes half-open connections
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  int argc = static_cast<int>(argv.size());
  argv.push_back(nullptr);
  orb_ = CORBA::ORB_init(argc, argv.data());
  orb::limit_orb_log();
  count_calls();
  const CORBA::Object_var object = orb_->resolve_initial_references("omniINSPOA");
  poa_ = PortableServer::POA::_narrow(object);
}

OrbServer::~OrbServer() {
  try {
    orb_->shutdown(true);
    orb_->destroy();
  } catch (const CORBA::Exception&) {  // NOLINT(bugprone-empty-catch): the process ends
  }
}

void OrbServer::activate(const std::string& key, PortableServer::Servant servant) {
  const PortableServer::ObjectId_var id = PortableServer::string_to_ObjectId(key.c_str());
  poa_->activate_object_with_id(id, servant);
}

void OrbServer::serve(const std::string& key) {
  const PortableServer::POAManager_var manager = poa_->the_POAManager();
  manager->activate();
  corbot_connections_serve();
  run_until_signal(fmt::format("ready corbaloc::{}/{}", endpoint_, key));
}

}  // namespace corbot::cell
