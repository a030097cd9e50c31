// SPDX-License-Identifier: Apache-2.0
#include "support/traced_thread.h"

#include <elf.h>
#include <signal.h>
#include <sys/ptrace.h>
#include <sys/uio.h>
#include <sys/user.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <utility>

namespace corbot::test {

namespace {

namespace fs = std::filesystem;

constexpr int kSystemCallStop = SIGTRAP | 0x80;  // PTRACE_O_TRACESYSGOOD

/// Waits for its next stop. Its wait status; nothing when it has ended.
std::optional<int> await_stop(pid_t thread) {
  int status = 0;
  while (::waitpid(thread, &status, __WALL) != thread) {
    if (errno != EINTR) return std::nullopt;
  }
  if (!WIFSTOPPED(status)) return std::nullopt;
  return status;
}

__ptrace_syscall_info info_of(pid_t thread) {
  __ptrace_syscall_info info{};
  if (::ptrace(PTRACE_GET_SYSCALL_INFO, thread, sizeof(info), &info) <= 0)
    throw std::runtime_error(std::string("PTRACE_GET_SYSCALL_INFO: ") + std::strerror(errno));
  return info;
}

/// Returns the entry of the process's program: code that is not executed again.
std::uint64_t entry_of(pid_t process) {
  std::ifstream stream("/proc/" + std::to_string(process) + "/auxv", std::ios::binary);
  Elf64_auxv_t entry{};
  while (stream.read(reinterpret_cast<char*>(&entry), sizeof(entry))) {
    if (entry.a_type == AT_ENTRY) return entry.a_un.a_val;
  }
  throw std::runtime_error("no AT_ENTRY");
}

}  // namespace

TracedThread::TracedThread(pid_t process, pid_t thread) : process_(process), thread_(thread) {
  const long options = PTRACE_O_TRACESYSGOOD;
  if (::ptrace(PTRACE_SEIZE, thread, nullptr, options) != 0)
    throw std::runtime_error(std::string("PTRACE_SEIZE: ") + std::strerror(errno));
  if (::ptrace(PTRACE_INTERRUPT, thread, nullptr, nullptr) != 0 || !await_stop(thread))
    throw std::runtime_error(std::string("PTRACE_INTERRUPT: ") + std::strerror(errno));
}

TracedThread::TracedThread(TracedThread&& other) noexcept
    : process_(other.process_), thread_(std::exchange(other.thread_, 0)) {}

void TracedThread::release() noexcept {
  if (thread_ == 0) return;
  // One that was killed meanwhile is this tracer's to be waited for, unless it is the process itself.
  if (::ptrace(PTRACE_DETACH, thread_, nullptr, nullptr) != 0 && thread_ != process_)
    ::waitpid(thread_, nullptr, __WALL);
  thread_ = 0;
}

bool TracedThread::spin() {
#if defined(__x86_64__)
  const std::uint64_t entry = entry_of(process_);
  user_regs_struct registers{};
  iovec all{&registers, sizeof(registers)};
  if (::ptrace(PTRACE_GETREGSET, thread_, NT_PRSTATUS, &all) != 0) return false;
  constexpr long kJumpToItself = 0xfeeb;  // EB FE
  registers.rip = entry;
  registers.orig_rax = ~0ULL;  // the system call in which it slept is not begun anew
  if (::ptrace(PTRACE_POKETEXT, thread_, entry, kJumpToItself) != 0 ||
      ::ptrace(PTRACE_SETREGSET, thread_, NT_PRSTATUS, &all) != 0)
    return false;
  release();
  return true;
#else
  return false;
#endif
}

bool TracedThread::resume(int request) {
  int signal = 0;
  for (;;) {
    if (::ptrace(static_cast<__ptrace_request>(request), thread_, nullptr, signal) != 0) return false;
    const auto status = await_stop(thread_);
    if (!status) {
      thread_ = 0;
      return false;
    }
    const int stop = WSTOPSIG(*status);
    if (*status >> 16 == 0 && (stop == SIGTRAP || stop == kSystemCallStop)) return true;
    signal = *status >> 16 == 0 ? stop : 0;  // a signal of its own, which it gets
  }
}

std::optional<std::uint64_t> TracedThread::run_to_system_call() {
  std::optional<std::uint64_t> number;
  for (;;) {
    if (!resume(PTRACE_SYSCALL)) return std::nullopt;
    const __ptrace_syscall_info info = info_of(thread_);
    if (info.op == PTRACE_SYSCALL_INFO_ENTRY) number = info.entry.nr;
    if (info.op == PTRACE_SYSCALL_INFO_EXIT && number) return number;
  }
}

bool TracedThread::go_on() { return ::ptrace(PTRACE_SYSCALL, thread_, nullptr, 0) == 0; }

std::optional<SystemCall> TracedThread::look() {
  int status = 0;
  if (::waitpid(thread_, &status, __WALL | WNOHANG) != thread_ || !WIFSTOPPED(status)) return std::nullopt;
  const int stop = WSTOPSIG(status);
  if (status >> 16 == 0 && stop == kSystemCallStop) {
    const __ptrace_syscall_info info = info_of(thread_);
    if (info.op == PTRACE_SYSCALL_INFO_ENTRY) {
      SystemCall call{info.entry.nr, {}};
      std::copy(std::begin(info.entry.args), std::end(info.entry.args), call.arguments.begin());
      return call;
    }
  }
  const bool is_signal = status >> 16 == 0 && stop != kSystemCallStop && stop != SIGTRAP;
  (void)::ptrace(PTRACE_SYSCALL, thread_, nullptr, is_signal ? stop : 0);
  return std::nullopt;
}

void TracedThread::interrupt() noexcept {
  if (::ptrace(PTRACE_INTERRUPT, thread_, nullptr, nullptr) == 0) (void)await_stop(thread_);
}

std::uint64_t TracedThread::instruction_pointer() const { return info_of(thread_).instruction_pointer; }

bool TracedThread::step() { return resume(PTRACE_SINGLESTEP); }

std::string why_not_traceable() {
  const pid_t child = ::fork();
  if (child == 0) {
    for (;;) ::pause();
  }
  std::string why;
  try {
    TracedThread thread(child, child);
    (void)thread.instruction_pointer();
  } catch (const std::runtime_error& error) {
    why = std::string("skipped: ptrace is not allowed here: ") + error.what();
  }
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, __WALL);
  return why;
}

std::optional<TracedThread> hold_at_call(pid_t process, const std::vector<pid_t>& threads,
                                         const std::function<bool(const SystemCall&)>& is_wanted,
                                         std::chrono::steady_clock::time_point deadline) {
  std::vector<TracedThread> traced;
  for (const pid_t thread : threads) traced.emplace_back(process, thread);
  for (TracedThread& thread : traced) (void)thread.go_on();
  std::optional<std::size_t> found;
  while (!found && std::chrono::steady_clock::now() < deadline) {
    for (std::size_t i = 0; i < traced.size() && !found; ++i) {
      const auto call = traced[i].look();
      if (!call) continue;
      if (is_wanted(*call)) {
        found = i;
      } else {
        (void)traced[i].go_on();
      }
    }
    ::usleep(100);
  }
  for (std::size_t i = 0; i < traced.size(); ++i) {
    if (i != found) traced[i].interrupt();
  }
  if (!found) return std::nullopt;
  return std::move(traced[*found]);
}

std::vector<pid_t> threads_of(pid_t process) {
  std::vector<pid_t> threads;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/proc/" + std::to_string(process) + "/task", error)) {
    const std::string text = entry.path().filename().string();
    pid_t thread = 0;
    std::from_chars(text.data(), text.data() + text.size(), thread);
    threads.push_back(thread);
  }
  std::sort(threads.begin(), threads.end());
  return threads;
}

std::string thread_name(pid_t process, pid_t thread) {
  std::ifstream stream("/proc/" + std::to_string(process) + "/task/" + std::to_string(thread) + "/comm");
  std::string name;
  std::getline(stream, name);
  return name;
}

}  // namespace corbot::test
