// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/loopback/plug_signals.h"

#include <signal.h>

#include <atomic>
#include <thread>

namespace corbot::rt {
namespace {

std::atomic<Pluggable*> pluggable{nullptr};
std::atomic<int> running_handlers{0};  // in all threads
static_assert(std::atomic<Pluggable*>::is_always_lock_free && std::atomic<int>::is_always_lock_free);

void pull_plug(int signal_number) {
  ++running_handlers;
  if (Pluggable* const device = pluggable.load()) device->set_plugged(signal_number == SIGUSR2);
  --running_handlers;
}

}  // namespace

PlugSignals::PlugSignals(Pluggable& device) noexcept {
  pluggable.store(&device);
  struct sigaction action {};
  action.sa_handler = pull_plug;
  action.sa_flags = SA_RESTART;
  sigaction(SIGUSR1, &action, nullptr);
  sigaction(SIGUSR2, &action, nullptr);
}

PlugSignals::~PlugSignals() {
  signal(SIGUSR1, SIG_IGN);
  signal(SIGUSR2, SIG_IGN);
  pluggable.store(nullptr);
  // A handler in another thread may have loaded the pointer before; one that begins from here on gets null.
  while (running_handlers.load() != 0) std::this_thread::yield();
}

}  // namespace corbot::rt
