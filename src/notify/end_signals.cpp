// SPDX-License-Identifier: Apache-2.0
#include "notify/end_signals.h"

#include <signal.h>

#include <cstdio>

#include "notify/service_notifier.h"

namespace corbot {
namespace {

sigset_t end_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  struct sigaction of_parent {};
  sigaction(SIGHUP, nullptr, &of_parent);
  if (of_parent.sa_handler != SIG_IGN) sigaddset(&signals, SIGHUP);  // started by nohup
  return signals;
}

}  // namespace

void block_end_signals() noexcept {
  const sigset_t signals = end_signals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
}

void run_until_signal(const std::string& ready_line) {
  ServiceNotifier notifier;
  std::puts(ready_line.c_str());
  std::fflush(stdout);
  const sigset_t signals = end_signals();
  const timespec moment{0, 200'000'000};
  do {
    notifier.ready();  // again, if the supervisor's queue was full
    notifier.alive();
  } while (sigtimedwait(&signals, nullptr, &moment) < 0);
}

}  // namespace corbot
