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
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals, number);
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
  notifier.ready();
  const sigset_t signals = end_signals();
  const timespec moment{0, 200'000'000};
  while (sigtimedwait(&signals, nullptr, &moment) < 0) notifier.alive();
}

}  // namespace corbot
