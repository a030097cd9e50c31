// SPDX-License-Identifier: Apache-2.0
#include "robot/release_signal.h"

#include <fmt/format.h>
#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <utility>

namespace corbot {
namespace {

sigset_t release_signals() noexcept {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGUSR1);
  return signals;
}

/// Describes the sender. The kernel has verified the sender only with SI_USER. With other codes the sender
/// itself fills in the fields, or they are empty for lack of memory.
std::string sender_of(const siginfo_t& info) {
  if (info.si_code != SI_USER || info.si_pid == 0) return "local";
  return fmt::format("local uid {}, process {}", info.si_uid, info.si_pid);
}

}  // namespace

void ReleaseSignal::block() noexcept {
  const sigset_t signals = release_signals();
  (void)::pthread_sigmask(SIG_BLOCK, &signals, nullptr);
}

ReleaseSignal::ReleaseSignal(OnSignal on_signal)
    : on_signal_(std::move(on_signal)), thread_([this] { run(); }) {}

ReleaseSignal::~ReleaseSignal() {
  ending_ = true;
  (void)::pthread_kill(thread_.native_handle(), SIGUSR1);
  thread_.join();
}

void ReleaseSignal::run() {
  const sigset_t signals = release_signals();
  for (;;) {
    siginfo_t info{};
    if (::sigwaitinfo(&signals, &info) != SIGUSR1) continue;
    if (ending_) return;
    on_signal_(sender_of(info));
  }
}

}  // namespace corbot
