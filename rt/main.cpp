// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <grp.h>
#include <pthread.h>
#include <pwd.h>
#include <signal.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <cstdio>
#include <stdexcept>
#include <thread>

#include "config/load_profile.h"
#include "config/segment_fingerprint.h"
#include "corbot/standard_streams.h"
#include "log/program_log.h"
#include "rt/backends/registry.h"
#include "rt/cycle/cycle.h"
#include "rt/cycle_settings.h"
#include "rt/housekeeping.h"
#include "rt/inputs/safety_lines.h"
#include "rt/loop.h"
#include "rt/options.h"
#include "rt/realtime_setup.h"
#include "rt/safety_settings.h"
#include "rt/start_position.h"
#include "rt/task_channel.h"

namespace {

std::atomic<bool> stop_requested{false};

/// The backend that is bringing the arm to its place, which may take a while.
std::atomic<corbot::Backend*> opening{nullptr};

void request_stop(int) {
  stop_requested.store(true);
  if (corbot::Backend* backend = opening.load()) backend->cancel();
}

void catch_signals() {
  struct sigaction action {};
  action.sa_handler = request_stop;
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGINT, &action, nullptr);
  struct sigaction of_parent {};
  sigaction(SIGHUP, nullptr, &of_parent);
  if (of_parent.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);  // started by nohup
  signal(SIGPIPE, SIG_IGN);                                                  // the reader of the log may end
  signal(SIGXFSZ, SIG_IGN);  // a limit of the file size then is an error of ftruncate
  signal(SIGUSR1, SIG_IGN);  // unless the backend uses them
  signal(SIGUSR2, SIG_IGN);
}

void log_missing_privileges(const corbot::rt::RealtimeResult& result, bool enforce) {
  for (const std::string& failure : result.failures) spdlog::warn("{}", failure);
  if (result.realtime()) return;
  if (enforce) throw std::runtime_error("--realtime enforce: real-time privileges are missing, see above");
  spdlog::warn("*** NOT REAL-TIME: running best effort. Good for a simulator, not for a machine. ***");
}

/// Leaves a stop that was seen before the cycle ran to the next task, however run() ends.
class StopLegacy {
 public:
  StopLegacy(corbot::TaskSegment& task, const corbot::EmergencyStop& stop) : task_(task), stop_(stop) {}
  StopLegacy(const StopLegacy&) = delete;
  StopLegacy& operator=(const StopLegacy&) = delete;
  void cycle_runs() noexcept { cycle_runs_ = true; }
  ~StopLegacy() {
    if (!cycle_runs_ && stop_.presses() > 0) task_.stop_seen.store(1, std::memory_order_release);
  }

 private:
  corbot::TaskSegment& task_;
  const corbot::EmergencyStop& stop_;
  bool cycle_runs_{false};
};

/// Returns the ids of a user and a group that the command line names or numbers.
corbot::ChannelPolicy policy_of(const corbot::rt::Options& options) {
  corbot::ChannelPolicy policy;
  if (!options.servant_user.empty()) {
    const passwd* const user = ::getpwnam(options.servant_user.c_str());
    if (user == nullptr)
      throw std::runtime_error(fmt::format("--servant-user {}: no such user", options.servant_user));
    policy.servant_user = user->pw_uid;
  }
  if (!options.stop_group.empty()) {
    const ::group* const group = ::getgrnam(options.stop_group.c_str());
    if (group == nullptr)
      throw std::runtime_error(fmt::format("--stop-group {}: no such group", options.stop_group));
    policy.stop_group = group->gr_gid;
  }
  return policy;
}

/// Returns false if the end was requested meanwhile.
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

/// Returns the cycle's state for the safety lines.
corbot::rt::CycleView view_of(const corbot::TaskSegment& segment, const corbot::Backend& device,
                              bool after_gap, std::uint64_t incarnation) {
  corbot::Snapshot snapshot{};
  corbot::rt::CycleView seen{.in_error = true, .is_known = false, .bus_beats = device.beats()};
  if (!segment.snapshot.load(snapshot)) return seen;
  const bool stop_seen = segment.stop_seen.load(std::memory_order_acquire) != 0;
  const bool begins_in_error = after_gap && snapshot.incarnation != incarnation;
  seen.cycle = snapshot.cycle;
  seen.in_error = stop_seen || begins_in_error || snapshot.state == corbot::RtState::kError;
  seen.power_off = (snapshot.flags & corbot::kSnapshotPowerOff) != 0;
  seen.fault_stop = (snapshot.flags & corbot::kSnapshotFaultStop) != 0;
  seen.is_known = true;
  return seen;
}

void run(const corbot::rt::Options& options) {
  using namespace corbot;
  rt::limit_thread_stacks();
  const Profile profile = load_profile(options.profile);
  const std::string name = options.name.empty() ? profile.name : options.name;
  EmergencyStop stop;
  rt::TaskChannel channel(name, segment_fingerprint(profile), policy_of(options), options.fresh,
                          stop_requested);
  TaskSegment& segment = channel.task();
  // If corbot switches the servos' power, it went off with the previous task: only a person's Clear restores
  // it.
  if (Snapshot last{}; switches_power(profile) && segment.snapshot.load(last)) segment.stop_seen.store(1);
  StopLegacy legacy(segment, stop);
  const std::unique_ptr<Backend> backend = rt::make_backend(profile, stop);
  const std::uint64_t incarnation = segment.incarnation;
  const auto view = [&segment, &options, incarnation, &device = *backend] {
    return view_of(segment, device, options.after_gap, incarnation);
  };
  // The lines are watched before anything moves: an input pressed at the start stops the first cycle.
  rt::SafetyLines safety(rt::safety_settings(profile), rt::kernel_gpio(), stop, view);
  safety.start();
  rt::StartPosition position(profile, name, options.state_directory);
  rt::CycleStart start = position.find(segment, backend->connect(), options.fresh);
  start.after_gap = options.after_gap;
  const auto cycle = std::make_unique<rt::Cycle>(profile.arm, channel.cycle_channel(), *backend, stop, start,
                                                 rt::cycle_settings(profile));
  if (!open_backend(*backend, cycle->frame())) return;
  safety.allow_power();
  backend->install_fault_controls();

  // These threads start before this one becomes real-time, so they do not inherit its priority.
  std::atomic<bool> ended{false};
  std::thread housekeeping([&] {
    rt::run_housekeeping(channel.server(), *cycle, *backend, safety, kinds_of(profile.arm.kinematics.chain()),
                         ended);
  });
  std::thread reporting([&] { rt::report_progress(*cycle, ended); });
  const auto join = [&] {
    ended.store(true, std::memory_order_release);
    reporting.join();
    housekeeping.join();
  };
  try {
    int latency_fd = -1;  // open, and so in force, until the process ends
    const rt::RealtimeResult result = rt::make_realtime({profile.priority, profile.cpu}, latency_fd);
    log_missing_privileges(result, options.enforce);
    rt::Loop loop(*cycle, segment, {profile.arm.period_ns, result.realtime(), profile.priority});
    fmt::print("position {}\n", position.text());
    fmt::print("ready {} period {} us {}\n", name, profile.arm.period_ns / 1000,
               result.realtime() ? "realtime" : "best-effort");
    std::fflush(stdout);
    legacy.cycle_runs();
    loop.run(stop_requested);
  } catch (...) {
    join();
    throw;
  }
  safety.stop();  // before any output to a terminal
  backend->close();
  position.save(segment);
  join();
  rt::print_log(*backend);
  rt::print_log(safety);
  spdlog::info("{} at rest, ended", name);
}

}  // namespace

int main(int argc, char** argv) {
  const corbot::rt::Options options = corbot::rt::parse_options(argc, argv);
  corbot::log_without_waiting("corbot-rt");
  catch_signals();
  try {
    run(options);
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    return 1;
  }
  return 0;
}
