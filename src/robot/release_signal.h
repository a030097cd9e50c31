// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <thread>

namespace corbot {

/// Receives SIGUSR1, with which this process's user and root end any holder's exclusive control. The kernel
/// checks the sender. Not real-time safe.
class ReleaseSignal {
 public:
  /// `from` describes the sender for a person, as far as the kernel has identified it. A thread of this class
  /// calls it; it throws nothing.
  using OnSignal = std::function<void(const std::string& from)>;

  /// Blocks the signal in every thread that this one starts from now on. All threads of the process must have
  /// it blocked.
  static void block() noexcept;
  explicit ReleaseSignal(OnSignal on_signal);
  ReleaseSignal(const ReleaseSignal&) = delete;
  ReleaseSignal& operator=(const ReleaseSignal&) = delete;
  ~ReleaseSignal();

 private:
  void run();

  const OnSignal on_signal_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace corbot
