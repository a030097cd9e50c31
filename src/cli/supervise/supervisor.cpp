// SPDX-License-Identifier: Apache-2.0
#include "cli/supervise/supervisor.h"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <utility>

#include "client/failure.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;

namespace {

constexpr double kPollInterval_s = 0.1;
constexpr double kFirstBackOff_s = 0.1;  // a robot should not be without its servant for long
constexpr double kLongestBackOff_s = 5.0;
constexpr double kHealthyAfter_s = 10.0;  // of running: then the next back-off is the first one again
constexpr double kKillAfter_s = 5.0;

double seconds_since(Child::Clock::time_point instant) {
  return std::chrono::duration<double>(Child::Clock::now() - instant).count();
}

Child::Clock::time_point in_seconds(double seconds) {
  return Child::Clock::now() +
         std::chrono::duration_cast<Child::Clock::duration>(std::chrono::duration<double>(seconds));
}

void log(const std::string& text) {
  fmt::print(stderr, "corbot up: {}\n", text);
  std::fflush(stderr);
}

}  // namespace

Supervisor::Supervisor(std::function<void()> on_change) : on_change_(std::move(on_change)) {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGCHLD}) sigaddset(&set, signal);
  sigprocmask(SIG_BLOCK, &set, nullptr);
  signal_fd_ = ::signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
  if (signal_fd_ < 0) throw Failure(ExitCode::kInternal, "signalfd: no file descriptor left");
}

Supervisor::~Supervisor() {
  stop_all();
  ::close(signal_fd_);
}

bool Supervisor::start(Spec spec) {
  if (end_requests_ > 0) return false;
  Child child(spec.title, spec.command);
  entries_.push_back({std::move(spec), std::move(child), false, 0, {}});
  Entry& entry = entries_.back();
  entry.child.start();
  while (!entry.ready) {
    poll(kPollInterval_s);
    if (end_requests_ > 0) return false;
    read_output(entry);
    if (const auto status = entry.child.reap(); status && !entry.ready) {
      throw Failure(ExitCode::kInternal, fmt::format("{} ended at its start ({}); see its own message above",
                                                     entry.spec.title, describe_end(*status)));
    }
    if (!entry.ready && seconds_since(entry.child.started()) > entry.spec.ready_within_s) {
      throw Failure(ExitCode::kInternal, fmt::format("{} was not ready within {:g} s", entry.spec.title,
                                                     entry.spec.ready_within_s));
    }
    for (Entry& other : entries_) {
      if (&other != &entry) supervise(other);
    }
  }
  on_change_();
  return true;
}

void Supervisor::run() {
  while (end_requests_ == 0) {
    poll(kPollInterval_s);
    for (Entry& entry : entries_) supervise(entry);
  }
}

void Supervisor::supervise(Entry& entry) {
  read_output(entry);
  if (const auto status = entry.child.reap()) schedule_restart(entry, *status);
  if (entry.child.pid() != 0 || end_requests_ > 0 || Clock::now() < entry.restart_at) return;
  try {
    entry.child.start();
    on_change_();
  } catch (const Failure& failure) {
    log(failure.what());
    entry.restart_at = in_seconds(kLongestBackOff_s);
  }
}

void Supervisor::schedule_restart(Entry& entry, int status) {
  const bool healthy = seconds_since(entry.child.started()) > kHealthyAfter_s;
  entry.back_off_s =
      healthy || entry.back_off_s == 0 ? kFirstBackOff_s : std::min(2 * entry.back_off_s, kLongestBackOff_s);
  entry.restart_at = in_seconds(entry.back_off_s);
  entry.ready = false;
  log(fmt::format("{} died ({}), starting it again in {:g} s", entry.spec.title, describe_end(status),
                  entry.back_off_s));
}

void Supervisor::read_output(Entry& entry) {
  const bool was_ready = entry.ready;
  for (const auto& line : entry.child.read_lines()) {
    if (entry.spec.is_ready(line)) entry.ready = true;
  }
  if (!entry.ready && entry.child.pid() != 0 && entry.spec.is_ready("")) entry.ready = true;
  if (entry.ready && !was_ready && entry.back_off_s > 0) {
    log(fmt::format("{} restarted (pid {})", entry.spec.title, entry.child.pid()));
    on_change_();
  }
}

void Supervisor::poll(double seconds) {
  std::vector<pollfd> fds{{signal_fd_, POLLIN, 0}};
  for (const Entry& entry : entries_) {
    if (entry.child.output_fd() >= 0) fds.push_back({entry.child.output_fd(), POLLIN, 0});
  }
  (void)::poll(fds.data(), fds.size(), static_cast<int>(seconds * 1000));
  read_signals();
}

void Supervisor::read_signals() {
  signalfd_siginfo info{};
  while (::read(signal_fd_, &info, sizeof(info)) == sizeof(info)) {
    if (info.ssi_signo != static_cast<std::uint32_t>(SIGCHLD)) ++end_requests_;
  }
}

void Supervisor::stop_all() {
  const int requests_before = end_requests_;
  while (!entries_.empty()) {
    Entry& entry = entries_.back();
    entry.child.send(SIGTERM);
    const auto begin = Clock::now();
    bool killed = false;
    while (entry.child.pid() != 0 && !entry.child.reap()) {
      poll(kPollInterval_s);
      (void)entry.child.read_lines();
      if (!killed && (end_requests_ > std::max(requests_before, 1) || seconds_since(begin) > kKillAfter_s)) {
        log(fmt::format("{} does not end; killing it", entry.spec.title));
        entry.child.send(SIGKILL);
        killed = true;
      }
    }
    entries_.pop_back();
  }
}

pid_t Supervisor::pid_of(const std::string& title) const {
  for (const Entry& entry : entries_) {
    if (entry.spec.title == title) return entry.child.pid();
  }
  return 0;
}

}  // namespace corbot::cli
