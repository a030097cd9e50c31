// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/loopback/plug_signals.h"

#include <signal.h>

#include <atomic>

namespace corbot::rt {
namespace {

std::atomic<Pluggable*> simulated{nullptr};

void pull_plug(int signal_number) {
  if (Pluggable* device = simulated.load()) device->set_plugged(signal_number == SIGUSR2);
}

}  // namespace

PlugSignals::PlugSignals(Pluggable& device) noexcept {
  simulated.store(&device);
  struct sigaction action {};
  action.sa_handler = pull_plug;
  action.sa_flags = SA_RESTART;
  sigaction(SIGUSR1, &action, nullptr);
  sigaction(SIGUSR2, &action, nullptr);
}

PlugSignals::~PlugSignals() {
  signal(SIGUSR1, SIG_IGN);
  signal(SIGUSR2, SIG_IGN);
  simulated.store(nullptr);
}

}  // namespace corbot::rt
