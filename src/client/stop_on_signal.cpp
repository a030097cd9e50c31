// SPDX-License-Identifier: Apache-2.0
#include "client/stop_on_signal.h"

#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "client/failure.h"

namespace corbot::client {

namespace {

sigset_t ending_signals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : {SIGINT, SIGTERM}) sigaddset(&set, signal);
  struct sigaction hang_up {};
  ::sigaction(SIGHUP, nullptr, &hang_up);
  if (hang_up.sa_handler != SIG_IGN) sigaddset(&set, SIGHUP);  // ignored: under nohup
  return set;
}

void raise_event(int fd) {
  const std::uint64_t one = 1;
  (void)!::write(fd, &one, sizeof(one));
}

}  // namespace

OnSignal::OnSignal(std::function<void()> action) : action_(std::move(action)) {
  const sigset_t set = ending_signals();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  end_fd_ = ::eventfd(0, EFD_CLOEXEC);
  seen_fd_ = ::eventfd(0, EFD_CLOEXEC);
  if (end_fd_ < 0 || seen_fd_ < 0) throw Failure(ExitCode::kInternal, "eventfd: no file descriptor left");
  thread_ = std::thread([this] { run(); });
}

OnSignal::~OnSignal() {
  raise_event(end_fd_);
  thread_.join();
  ::close(end_fd_);
  ::close(seen_fd_);
}

void OnSignal::run() {
  const sigset_t set = ending_signals();
  const int signals = ::signalfd(-1, &set, SFD_CLOEXEC);
  std::thread worker;  // the action may take long; a second signal must still get through
  for (;;) {
    pollfd fds[2] = {{signals, POLLIN, 0}, {end_fd_, POLLIN, 0}};
    if (::poll(fds, 2, -1) < 0 && errno != EINTR) break;
    if ((fds[1].revents & POLLIN) != 0) break;
    signalfd_siginfo info{};
    if ((fds[0].revents & POLLIN) == 0 || ::read(signals, &info, sizeof(info)) != sizeof(info)) continue;
    int none = 0;
    signal_.compare_exchange_strong(none, static_cast<int>(info.ssi_signo));
    if (seen_.exchange(true)) ::_exit(static_cast<int>(ExitCode::kStopped));
    raise_event(seen_fd_);
    worker = std::thread([this] {
      if (action_) action_();
      acted_ = true;
      acted_.notify_all();
    });
  }
  if (worker.joinable()) worker.join();
  ::close(signals);
}

std::string OnSignal::describe() const {
  switch (signal_.load()) {
    case SIGINT:
      return "Ctrl-C";
    case SIGHUP:
      return "the end of the terminal (SIGHUP)";
    default:
      return "SIGTERM";
  }
}

void OnSignal::join() const { acted_.wait(false); }

bool OnSignal::wait(double seconds) const {
  pollfd fd{seen_fd_, POLLIN, 0};
  (void)::poll(&fd, 1, static_cast<int>(std::clamp(seconds, 0.0, 1e6) * 1000));
  return seen();
}

}  // namespace corbot::client
