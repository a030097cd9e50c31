// SPDX-License-Identifier: Apache-2.0
#include "cli/supervise/supervisor.h"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/signalfd.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include "cli/supervise/report.h"
#include "client/explain.h"
#include "client/failure.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;

namespace {

constexpr double kPollInterval_s = 0.1;
constexpr double kHealthyAfter_s = 10.0;  // of running: the next back-off then begins anew
constexpr double kOwnGap_s = 0.5;         // between two steps: this process was stopped, or had no processor

double seconds_since(Child::Clock::time_point instant) {
  return std::chrono::duration<double>(Child::Clock::now() - instant).count();
}

Child::Clock::time_point in_seconds(double seconds) {
  return Child::Clock::now() +
         std::chrono::duration_cast<Child::Clock::duration>(std::chrono::duration<double>(seconds));
}

}  // namespace

Supervisor::Supervisor(Options options) : options_(std::move(options)), notify_(options_.notify_path) {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : {SIGINT, SIGTERM, SIGCHLD}) sigaddset(&set, signal);
  struct sigaction hang_up {};
  ::sigaction(SIGHUP, nullptr, &hang_up);
  if (hang_up.sa_handler != SIG_IGN) sigaddset(&set, SIGHUP);  // ignored: under nohup
  ::signal(SIGCHLD, SIG_DFL);  // if its parent ignored it, the kernel would report no child's end
  sigprocmask(SIG_BLOCK, &set, nullptr);
  signal_fd_ = ::signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
  if (signal_fd_ < 0)
    throw Failure(
        ExitCode::kInternal,
        "no file descriptor is left (signalfd): end other programs, or raise the limit 'ulimit -n'");
  last_step_ = Clock::now();
}

Supervisor::~Supervisor() {
  stop_all();
  ::close(signal_fd_);
}

bool Supervisor::start(Spec spec) {
  if (end_signal_ != 0) return false;
  Child child(spec.title, spec.command);
  entries_.push_back({std::move(spec), std::move(child)});
  Entry& entry = entries_.back();
  if (options_.manager != nullptr) {
    for (DescriptorStore::Item& item : options_.manager->take(entry.spec.title))
      entry.stored.add(item.name, std::move(item.fd));
  }
  start_child(entry);
  while (!entry.ready) {
    poll(kPollInterval_s);
    if (end_signal_ != 0) return false;
    read_output(entry);
    if (entry.ready) break;
    if (const auto status = entry.child.reap()) {
      const bool is_usage = WIFEXITED(*status) && WEXITSTATUS(*status) == static_cast<int>(ExitCode::kUsage);
      give_up(entry, is_usage ? ExitCode::kUsage : ExitCode::kInternal,
              fmt::format("{} ended at its start ({}){}{}", entry.spec.title, describe_end(*status),
                          WIFSIGNALED(*status) ? "" : ": its own message above has the reason",
                          entry.spec.examine_with.empty()
                              ? ""
                              : fmt::format("; '{}' says what to do", entry.spec.examine_with)));
    }
    if (seconds_since(entry.child.started()) > entry.spec.ready_within_s) {
      give_up(entry, ExitCode::kInternal,
              fmt::format("{} was not ready within {:g} s", entry.spec.title, entry.spec.ready_within_s));
    }
    for (Entry& other : entries_) {
      if (&other != &entry) supervise(other);
    }
  }
  options_.on_change();
  return true;
}

bool Supervisor::step() {
  if (end_signal_ != 0) return false;
  poll(kPollInterval_s);
  for (Entry& entry : entries_) supervise(entry);
  return end_signal_ == 0;
}

void Supervisor::supervise(Entry& entry) {
  read_output(entry);
  const bool restarts = options_.restarts || !entry.spec.is_needed;
  if (entry.child.has_ended()) {
    read_notifications();  // messages from before its end; no other process has its pid before it is reaped
    read_output(entry);
    const int status = entry.child.reap().value_or(0);
    const std::string how = describe_end(status);
    // RLIMIT_RTTIME: it computed without end, and completed no cycle meanwhile.
    if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) entry.was_frozen = true;
    if (!restarts) {
      entry.ready = false;
      log(fmt::format("{} died ({})", entry.spec.title, how));
      options_.on_change();
      return;
    }
    schedule_restart(entry, entry.was_killed ? fmt::format("{} killed", entry.spec.title)
                                             : fmt::format("{} died ({})", entry.spec.title, how));
  } else if (entry.child.pid() != 0) {
    kill_unresponsive(entry);
  }
  if (!restarts || entry.child.pid() != 0 || end_signal_ != 0 || Clock::now() < entry.restart_at) return;
  try {
    start_child(entry);
    options_.on_change();
  } catch (const Failure& failure) {
    schedule_restart(entry, failure.what());
  }
}

void Supervisor::start_child(Entry& entry) {
  const Service service{notify_.path(), entry.spec.respond_s, &entry.stored};
  entry.was_killed = false;
  const bool was_frozen = std::exchange(entry.was_frozen, false);
  if (entry.restarted && !entry.spec.restart_command.empty())
    entry.child.set_command(entry.spec.restart_command);
  entry.child.start(service, was_frozen ? entry.spec.after_unresponsive : std::vector<std::string>{});
}

/// Uses SIGKILL instead of SIGTERM, because the behaviour of a frozen process that resumes is unpredictable.
/// A restarted task takes the arm over from the data that the killed one wrote.
void Supervisor::kill_unresponsive(Entry& entry) {
  if (entry.was_killed) return;
  const std::string status =
      entry.status.empty() ? "" : fmt::format(" (its last status: {})", client::printable(entry.status));
  if (entry.ready) {
    if (entry.spec.respond_s <= 0 || seconds_since(entry.responded) <= entry.spec.respond_s) return;
    log(fmt::format("{} (pid {}) has not responded for {:g} s{}; killing it", entry.spec.title,
                    entry.child.pid(), entry.spec.respond_s, status));
  } else {
    if (seconds_since(entry.child.started()) <= entry.spec.ready_within_s) return;
    log(fmt::format("{} (pid {}) was not ready within {:g} s{}; killing it", entry.spec.title,
                    entry.child.pid(), entry.spec.ready_within_s, status));
  }
  entry.was_killed = true;
  entry.was_frozen = entry.ready;
  entry.child.send(SIGKILL);
}

void Supervisor::schedule_restart(Entry& entry, const std::string& why) {
  const bool healthy = entry.ready && seconds_since(entry.child.started()) > kHealthyAfter_s;
  entry.failed_attempts = entry.ready ? 0 : entry.failed_attempts + 1;
  const double back_off_s = entry.back_off.next_s(healthy);
  entry.restart_at = in_seconds(back_off_s);
  entry.ready = false;
  entry.restarted = true;
  entry.status.clear();
  if (entry.spec.is_needed && options_.attempts > 0 && entry.failed_attempts >= options_.attempts) {
    give_up(entry, ExitCode::kInternal,
            fmt::format("{}; {} starts in a row failed, the limit of [supervisor] attempts: giving up", why,
                        entry.failed_attempts));
  }
  log(fmt::format("{}, starting it again in {:g} s", why, back_off_s));
}

void Supervisor::give_up(const Entry& entry, ExitCode code, const std::string& why) {
  throw Failure(code, why + (entry.spec.last_lines ? entry.spec.last_lines() : ""));
}

void Supervisor::read_output(Entry& entry) {
  for (const auto& line : entry.child.read_lines()) {
    if (entry.spec.is_ready && entry.spec.is_ready(line)) set_ready(entry);
  }
  if (!entry.ready && entry.child.pid() != 0 && entry.spec.is_ready && entry.spec.is_ready(""))
    set_ready(entry);
}

void Supervisor::set_ready(Entry& entry) {
  if (entry.ready) return;
  entry.ready = true;
  entry.responded = Clock::now();
  if (!entry.restarted) return;
  log(fmt::format("{} restarted (pid {})", entry.spec.title, entry.child.pid()));
  options_.on_change();
}

void Supervisor::read_notifications() {
  while (auto notification = notify_.receive()) {
    for (Entry& entry : entries_) {
      if (entry.child.pid() == notification->sender) apply(entry, *notification);
    }
  }
}

void Supervisor::store(Entry& entry, const std::string& name, Descriptor fd) {
  using Added = DescriptorStore::Added;
  const Added added = entry.stored.add(name, std::move(fd));
  if (added == Added::kFull || added == Added::kFailed) {
    const std::string why = added == Added::kFull
                                ? fmt::format("there are {} already", DescriptorStore::kCapacity)
                                : "no file descriptor left";
    log(fmt::format("{}: the supervisor cannot store descriptor '{}', so a restart begins without it: {}",
                    entry.spec.title, client::printable(name), why));
  }
  if (added == Added::kNew && options_.manager != nullptr) {
    const DescriptorStore::Item& item = entry.stored.items().back();
    options_.manager->store(entry.spec.title, item.name, item.fd.get());
  }
}

void Supervisor::apply(Entry& entry, Notification& notification) {
  if (notification.status) entry.status = *notification.status;
  if (notification.watchdog) entry.responded = Clock::now();
  if (notification.remove) {
    entry.stored.remove(notification.fd_name);
    if (options_.manager != nullptr) options_.manager->remove(entry.spec.title, notification.fd_name);
  }
  if (notification.store) {
    for (Descriptor& fd : notification.descriptors) store(entry, notification.fd_name, std::move(fd));
  }
  if (notification.ready && !entry.spec.is_ready) set_ready(entry);
}

/// Excludes the time in which this process did not run. Messages then wait in the queue, or are late if the
/// queue is full; the children are not at fault.
void Supervisor::allow_for_own_gap() {
  const auto now = Clock::now();
  const auto gap = now - std::exchange(last_step_, now);
  if (std::chrono::duration<double>(gap).count() < kOwnGap_s && !socket_lost_) return;
  for (Entry& entry : entries_) entry.responded += gap;
}

void Supervisor::restore_socket() {
  try {
    notify_.restore();
    if (std::exchange(socket_lost_, false))
      log("the supervisor receives the messages of its processes again");
  } catch (const Failure& failure) {
    if (!std::exchange(socket_lost_, true))
      log(fmt::format("the supervisor cannot receive the messages of its processes: {}", failure.what()));
  }
}

void Supervisor::poll(double seconds) {
  if (options_.on_step) options_.on_step();
  restore_socket();
  std::vector<pollfd> fds{{signal_fd_, POLLIN, 0}, {notify_.fd(), POLLIN, 0}};
  for (const Entry& entry : entries_) {
    if (entry.child.output_fd() >= 0) fds.push_back({entry.child.output_fd(), POLLIN, 0});
  }
  if (const int input = options_.input_fd ? options_.input_fd() : -1; input >= 0)
    fds.push_back({input, POLLIN, 0});
  if (options_.until_eof) fds.push_back({STDIN_FILENO, POLLIN, 0});
  (void)::poll(fds.data(), fds.size(), static_cast<int>(seconds * 1000));
  read_signals();
  if (options_.until_eof && fds.back().revents != 0) read_standard_input();
  allow_for_own_gap();
  read_notifications();
}

void Supervisor::read_signals() {
  signalfd_siginfo info{};
  while (::read(signal_fd_, &info, sizeof(info)) == sizeof(info)) {
    if (info.ssi_signo == static_cast<std::uint32_t>(SIGCHLD)) continue;
    request_end(static_cast<int>(info.ssi_signo));
  }
}

void Supervisor::read_standard_input() {
  std::array<char, 256> ignored{};
  const ssize_t n = ::read(STDIN_FILENO, ignored.data(), ignored.size());
  if (n > 0 || (n < 0 && (errno == EAGAIN || errno == EINTR))) return;
  options_.until_eof = false;
  log("standard input has ended, so all programs end (--until-eof)");
  request_end(SIGHUP);
}

void Supervisor::request_end(int signal) {
  if (signal == SIGINT) ++interrupts_;
  if (end_signal_ == 0) end_signal_ = signal;
}

void Supervisor::stop_last() {
  if (!entries_.empty()) stop_last(interrupts_);
}

void Supervisor::stop_all() {
  const int interrupts_before = interrupts_;
  while (!entries_.empty()) stop_last(interrupts_before);
}

void Supervisor::stop_last(int interrupts_before) {
  const auto note = [&] {
    if (options_.on_ending) options_.on_ending();
  };
  Entry& entry = entries_.back();
  note();
  entry.child.send(SIGTERM);
  const auto begin = Clock::now();
  bool killed = false;
  while (entry.child.pid() != 0 && !entry.child.reap()) {
    poll(kPollInterval_s);
    note();
    for (const auto& line : entry.child.read_lines()) {
      if (entry.spec.is_ready) (void)entry.spec.is_ready(line);
    }
    if (!killed &&
        (interrupts_ > std::max(interrupts_before, 1) || seconds_since(begin) > entry.spec.end_within_s)) {
      log(fmt::format("{} has not ended yet; killing it", entry.spec.title));
      entry.child.send(SIGKILL);
      killed = true;
    }
  }
  entries_.pop_back();
}

pid_t Supervisor::pid_of(const std::string& title) const {
  for (const Entry& entry : entries_) {
    if (entry.spec.title == title) return entry.child.pid();
  }
  return 0;
}

bool Supervisor::all_ready() const {
  return std::all_of(entries_.begin(), entries_.end(), [](const Entry& entry) {
    return !entry.spec.is_needed || (entry.ready && !entry.was_killed);
  });
}

}  // namespace corbot::cli
