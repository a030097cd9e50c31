// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <pthread.h>
#include <signal.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdio>
#include <stdexcept>
#include <thread>

#include "config/load_profile.h"
#include "corbot/channel/fingerprint.h"
#include "rt/backends/registry.h"
#include "rt/cycle/cycle.h"
#include "rt/housekeeping.h"
#include "rt/inputs/safety_lines.h"
#include "rt/loop.h"
#include "rt/realtime_setup.h"
#include "rt/safety_settings.h"
#include "rt/start_position.h"
#include "shm/segment.h"

namespace {

std::atomic<bool> stop_requested{false};

/// The backend that is bringing the arm to its place, which may take a while.
std::atomic<corbot::Backend*> opening{nullptr};

void request_stop(int) {
  stop_requested.store(true);
  if (corbot::Backend* backend = opening.load()) backend->cancel();
}

struct Options {
  std::string profile;
  std::string name;
  std::string state_directory;
  bool enforce{false};
  bool fresh{false};
  bool after_gap{false};
};

void catch_signals() {
  struct sigaction action {};
  action.sa_handler = request_stop;
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGINT, &action, nullptr);
  struct sigaction of_parent {};
  sigaction(SIGHUP, nullptr, &of_parent);
  if (of_parent.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);  // started by nohup
  signal(SIGPIPE, SIG_IGN);                                                  // the reader of the log may end
  signal(SIGUSR1, SIG_IGN);  // unless the backend has a use for them
  signal(SIGUSR2, SIG_IGN);
}

/// Adopts the segment, or with --fresh begins with an empty one: the arm is then taken to be at angle 0.
corbot::Segment open_segment(const Options& options, const std::string& name, const corbot::ArmModel& arm) {
  const std::uint64_t print = corbot::fingerprint(arm);
  corbot::Segment segment = corbot::Segment::create_or_adopt(name, print);
  if (options.fresh && segment.adopted()) {
    if (segment.peer_alive())
      throw std::runtime_error("--fresh: a servant is using the segment; end it first");
    segment.leave();
    segment = corbot::Segment::create_or_adopt(name, print);
  }
  spdlog::info("segment {} {}", name,
               segment.adopted() ? "adopted from an earlier real-time task" : "created");
  return segment;
}

void log_missing_privileges(const corbot::rt::RealtimeResult& result, bool enforce) {
  for (const std::string& failure : result.failures) spdlog::warn("{}", failure);
  if (result.realtime()) return;
  if (enforce) throw std::runtime_error("--realtime enforce: real-time privileges are missing, see above");
  spdlog::warn("*** NOT REAL-TIME: running best effort. Good for a simulator, not for a machine. ***");
}

/// Leaves the segment however run() ends, so that a device that is not there leaves no segment behind. A stop
/// that was seen before the cycle ran is left to the next task.
class SegmentLease {
 public:
  SegmentLease(corbot::Segment& segment, const corbot::EmergencyStop& stop)
      : segment_(segment), stop_(stop) {}
  SegmentLease(const SegmentLease&) = delete;
  SegmentLease& operator=(const SegmentLease&) = delete;
  void cycle_runs() noexcept { cycle_runs_ = true; }
  ~SegmentLease() {
    if (!cycle_runs_ && stop_.presses() > 0) segment_.layout().header.stop_seen.store(1);
    try {
      segment_.leave();
    } catch (const std::exception& error) {
      spdlog::error("{}", error.what());
    }
  }

 private:
  corbot::Segment& segment_;
  const corbot::EmergencyStop& stop_;
  bool cycle_runs_{false};
};

/// False when the end was asked for meanwhile.
bool open_backend(corbot::Backend& backend, const corbot::ServoFrame& first) {
  opening.store(&backend);
  if (stop_requested.load()) backend.cancel();
  try {
    backend.open(first);
  } catch (const std::exception& error) {
    opening.store(nullptr);
    if (!stop_requested.load()) throw;
    spdlog::info("{}", error.what());
    return false;
  }
  opening.store(nullptr);
  return true;
}

void run(const Options& options) {
  using namespace corbot;
  const Profile profile = load_profile(options.profile);
  const std::string name = options.name.empty() ? profile.name : options.name;
  Segment segment = open_segment(options, name, profile.arm);
  EmergencyStop stop;
  SegmentLease lease(segment, stop);
  const std::unique_ptr<Backend> backend = rt::make_backend(profile, stop);
  const std::uint64_t incarnation = segment.layout().header.incarnation.load(std::memory_order_acquire);
  const auto view = [&segment, &options, incarnation] {
    Snapshot snapshot{};
    if (!segment.layout().snapshot.load(snapshot)) return rt::CycleView{0, true};
    const bool stop_seen = segment.layout().header.stop_seen.load(std::memory_order_acquire) != 0;
    const bool begins_in_error = options.after_gap && snapshot.incarnation != incarnation;
    return rt::CycleView{snapshot.cycle, stop_seen || begins_in_error || snapshot.state == RtState::kError};
  };
  // Watched before anything moves: what is pressed at the start stops the first cycle.
  rt::SafetyLines safety(rt::safety_settings(profile), rt::kernel_gpio(), stop, view);
  safety.start();
  rt::StartPosition position(profile, name, options.state_directory);
  rt::CycleStart start = position.find(segment.layout(), backend->connect(), options.fresh);
  start.after_gap = options.after_gap;
  const rt::LivenessLimits limits{profile.gap_fault_ns, profile.orphan_ns};
  const auto cycle =
      std::make_unique<rt::Cycle>(profile.arm, segment.layout(), *backend, stop, start, limits);
  if (!open_backend(*backend, cycle->frame())) return;
  safety.allow_power();
  backend->install_fault_controls();

  // The housekeeping thread starts before this one becomes real-time, so it inherits none of it.
  std::atomic<bool> ended{false};
  std::thread housekeeping([&] { rt::run_housekeeping(segment, *cycle, *backend, safety, ended); });
  const auto join = [&] {
    ended.store(true, std::memory_order_release);
    housekeeping.join();
  };
  try {
    int latency_fd = -1;  // open, and so in force, until the process ends
    const rt::RealtimeResult result = rt::make_realtime({profile.priority, profile.cpu}, latency_fd);
    log_missing_privileges(result, options.enforce);
    rt::Loop loop(*cycle, segment.layout(), {profile.arm.period_ns, result.realtime(), profile.priority});
    fmt::print("position {}\n", position.text());
    fmt::print("ready {} period {} us {}\n", name, profile.arm.period_ns / 1000,
               result.realtime() ? "realtime" : "best-effort");
    std::fflush(stdout);
    lease.cycle_runs();
    loop.run(stop_requested);
  } catch (...) {
    join();
    throw;
  }
  safety.stop();  // before what writes to a terminal
  backend->close();
  position.save(segment.layout());
  join();
  rt::print_log(*backend);
  rt::print_log(safety);
  spdlog::info("{} at rest, ended", name);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"corbot's real-time task: follows accepted motions and drives the servos", "corbot-rt"};
  Options options;
  std::string realtime{"best-effort"};
  app.add_option("PROFILE", options.profile, "profile of the robot, a TOML file")->required();
  app.add_option("--name", options.name, "name of the robot, instead of the profile's");
  app.add_option("--realtime", realtime, "what to do where real-time privileges are missing")
      ->check(CLI::IsMember({"enforce", "best-effort"}))
      ->capture_default_str();
  app.add_option("--state-dir", options.state_directory,
                 "where the last position is saved, instead of $CORBOT_STATE_DIR or ~/.local/state/corbot");
  app.add_flag("--fresh", options.fresh, "forget where the arm was: it must be at angle 0");
  app.add_flag("--after-gap", options.after_gap,
               "begin in Error: the task before did not respond, and was replaced");
  app.footer(corbot::rt::fault_controls_help());
  CLI11_PARSE(app, argc, argv);
  options.enforce = realtime == "enforce";

  spdlog::set_default_logger(spdlog::stderr_color_mt("corbot-rt"));
  catch_signals();
  try {
    run(options);
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    return 1;
  }
  return 0;
}
