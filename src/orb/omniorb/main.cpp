// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <pthread.h>
#include <signal.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "corbot/standard_streams.h"
#include "log/program_log.h"
#include "net/arrivals.h"
#include "net/endpoint.h"
#include "net/giop_probe.h"
#include "orb/log/orb_log.h"
#include "orb/omniorb/arm_servant.h"
#include "orb/omniorb/naming.h"
#include "orb/omniorb/options.h"
#include "orb/omniorb/place.h"

namespace {

using namespace corbot;
using namespace corbot::omni;

struct RobotCloser {
  void operator()(corbot_robot* robot) const noexcept { corbot_robot_close(robot); }
};
using RobotHandle = std::unique_ptr<corbot_robot, RobotCloser>;

RobotHandle open_robot(const Options& options) {
  corbot_error error{};
  RobotHandle robot(corbot_robot_open(options.profile.c_str(),
                                      options.name.empty() ? nullptr : options.name.c_str(), &error));
  if (!robot) throw std::runtime_error(error.text);
  corbot_robot_keep_state(robot.get(),
                          options.state_directory.empty() ? nullptr : options.state_directory.c_str(),
                          [](const char* text) { spdlog::warn("{}", text); });
  return robot;
}

std::string endpoint_text(const Options& options) {
  char text[CORBOT_HOST + 16];
  corbot_endpoint_text(options.host.c_str(), options.port, text, sizeof(text));
  return text;
}

/// Returns the ORB, listening.
CORBA::ORB_ptr start_orb(const Options& options) {
  check_port(options.host, options.port);
  std::vector<std::string> words{"corbot-servant"};
  const auto add = [&](const std::string& option, const std::string& value) {
    words.push_back("-ORB" + option);
    words.push_back(value);
  };
  words.insert(words.end(), options.orb.begin(), options.orb.end());
  add("endPoint", "giop:tcp:" + endpoint_text(options));
  // Not published. When a client loses the first address of a reference with two addresses, it sends its call
  // again to the second one.
  if (!options.unix_path.empty()) add("endPointNoPublish", "giop:unix:" + options.unix_path);
  add("unixTransportPermission", "0600");
  add("threadPerConnectionPolicy", "1");      // half-sent requests can starve a pool
  add("maxServerThreadPerConnection", "32");  // for clients that put all their calls on one connection
  // Time until such a client's next call is seen while one of its calls waits, in microseconds. The default
  // of 50 ms delayed a Stop by as much; connectionWatchImmediate costs every read 10 us.
  add("connectionWatchPeriod", "5000");
  add("giopMaxMsgSize", "65536");  // far above any message of this interface
  add("scanGranularity", "5");
  add("inConScanPeriod", "180");  // closes half-open connections
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  int argc = static_cast<int>(argv.size());
  argv.push_back(nullptr);
  return CORBA::ORB_init(argc, argv.data());
}

/// Waits until the interrupted calls are over, and briefly more. The ORB does not report when a reply has
/// been written; on an idle machine that follows within microseconds.
void flush_replies() {
  using namespace std::chrono_literals;
  constexpr auto kReplyWritten = 50ms;
  const auto deadline = std::chrono::steady_clock::now() + 1s;
  while (!corbot_places_idle() && std::chrono::steady_clock::now() < deadline)
    std::this_thread::sleep_for(1ms);
  std::this_thread::sleep_for(kReplyWritten);
}

/// Numbers requests by the stops that preceded them, during the lifetime of this object.
class Arrivals {
 public:
  explicit Arrivals(corbot_robot& robot) {
    corbot_arrivals_start(
        [](void* of, std::uint64_t* all, std::uint64_t* by_others) {
          corbot_robot_stops(static_cast<const corbot_robot*>(of), all, by_others);
        },
        &robot);
  }
  Arrivals(const Arrivals&) = delete;
  Arrivals& operator=(const Arrivals&) = delete;
  ~Arrivals() { corbot_arrivals_end(); }
};

/// The servant's own client, which checks that a request gets through to the ORB.
class Probe {
 public:
  Probe(corbot_robot& robot, const Options& options, const std::string& key) : robot_(robot) {
    corbot_giop_probe_init(&probe_, options.host.c_str(), options.port, nullptr, key.c_str());
  }
  Probe(const Probe&) = delete;
  Probe& operator=(const Probe&) = delete;
  ~Probe() {
    corbot_robot_interrupt(&robot_);  // ends the thread that uses the probe, on every path
    corbot_giop_probe_close(&probe_);
  }
  static int answers(void* self) {
    constexpr int kTimeout_ms = 1000;
    return corbot_giop_probe_answers(&static_cast<Probe*>(self)->probe_, kTimeout_ms);
  }

 private:
  corbot_robot& robot_;
  corbot_giop_probe probe_{};
};

/// Serves until a signal requests the end.
void serve(Options options, corbot_robot& robot, const sigset_t& end_signals) {
  corbot_description description{};
  corbot_robot_describe(&robot, &description);
  if (options.port < 0) {
    options.host = description.endpoint_host;
    options.port = description.endpoint_port;
  }
  const std::string name = description.name;
  if (!corbot_is_loopback(options.host.c_str())) {
    spdlog::warn("listening on {}: anyone who reaches it can move the robot", options.host);
  }
  corbot_connections_start();
  corbot_connections_close_elsewhere();
  const Arrivals arrivals(robot);
  CORBA::ORB_var orb = start_orb(options);
  orb::limit_orb_log();
  CORBA::Object_var object = orb->resolve_initial_references("omniINSPOA");
  PortableServer::POA_var poa = PortableServer::POA::_narrow(object);
  ControlReferences control(orb, name);
  note_requests(robot, name, control.key_prefix());
  ArmServant servant(robot, control, ArmServant::Object::kPublic);
  ArmServant control_servant(robot, control, ArmServant::Object::kControl);
  PortableServer::ObjectId_var id = PortableServer::string_to_ObjectId(name.c_str());
  poa->activate_object_with_id(id, &servant);
  PortableServer::POAManager_var manager = poa->the_POAManager();
  manager->activate();
  control.serve(&control_servant);
  corbot_connections_serve();

  std::optional<NameBinder> binder;
  if (!options.naming.empty()) {
    CORBA::Object_var reference = servant._this();
    binder.emplace(orb, options.naming, name, reference);
  }
  fmt::print("ready corbaloc::{}/{}\n", endpoint_text(options), name);
  std::fflush(stdout);
  Probe probe(robot, options, name);
  corbot_robot_serve(&robot, &Probe::answers, &probe);
  corbot_robot_heed_release_signal(&robot);
  int signal_number = 0;
  sigwait(&end_signals, &signal_number);
  spdlog::info("signal {}: ending", signal_number);
  binder.reset();
  corbot_robot_interrupt(&robot);  // calls that wait for motions return, or the ORB would wait for them
  flush_replies();                 // the ORB does not wait for a reply that is still being written
  corbot_connections_end();
  orb->shutdown(true);
  orb->destroy();
}

}  // namespace

int main(int argc, char** argv) {
  const Options options = parse_options(argc, argv);
  log_without_waiting("corbot-servant");
  sigset_t end_signals;
  sigemptyset(&end_signals);
  sigaddset(&end_signals, SIGINT);
  sigaddset(&end_signals, SIGTERM);
  struct sigaction of_parent {};
  sigaction(SIGHUP, nullptr, &of_parent);
  if (of_parent.sa_handler != SIG_IGN) sigaddset(&end_signals, SIGHUP);  // started by nohup
  signal(SIGPIPE, SIG_IGN);                                              // the reader of the log may end
  // before any thread starts: all of them inherit the mask
  pthread_sigmask(SIG_BLOCK, &end_signals, nullptr);
  corbot_block_release_signal();
  try {
    const RobotHandle robot = open_robot(options);
    serve(options, *robot, end_signals);
    return 0;
  } catch (const CORBA::Exception& error) {
    spdlog::error("CORBA {}: the ORB could not be started; is every -ORB option right, is the port free?",
                  error._name());
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
  }
  return 1;
}
