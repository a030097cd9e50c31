// SPDX-License-Identifier: Apache-2.0
#include "robot/release_signal.h"

#include <fmt/format.h>
#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <utility>

namespace corbot {
namespace {

/// Of this process's own making: the end.
constexpr int kEnd = 1;

sigset_t release_signals() noexcept {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGUSR1);
  return signals;
}

bool is_end(const siginfo_t& info) {
  return info.si_code == SI_QUEUE && info.si_pid == ::getpid() && info.si_value.sival_int == kEnd;
}

}  // namespace

void ReleaseSignal::block() noexcept {
  const sigset_t signals = release_signals();
  (void)::pthread_sigmask(SIG_BLOCK, &signals, nullptr);
}

ReleaseSignal::ReleaseSignal(OnSignal on_signal)
    : on_signal_(std::move(on_signal)), thread_([this] { run(); }) {}

ReleaseSignal::~ReleaseSignal() {
  (void)::pthread_sigqueue(thread_.native_handle(), SIGUSR1, {kEnd});
  thread_.join();
}

void ReleaseSignal::run() {
  const sigset_t signals = release_signals();
  for (;;) {
    siginfo_t info{};
    if (::sigwaitinfo(&signals, &info) != SIGUSR1) continue;
    if (is_end(info)) return;
    on_signal_(fmt::format("local uid {}, process {}", info.si_uid, info.si_pid));
  }
}

}  // namespace corbot
