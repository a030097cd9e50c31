// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <thread>

namespace corbot {

/// SIGUSR1 to this process, by which its own user and root, and nobody else, end whoever's exclusive control: the kernel
/// checks who sends it. Not real-time safe.
class ReleaseSignal {
 public:
  /// `from`: the sender, for a person, where the kernel has said it. Called from a thread of this class; throws nothing.
  using OnSignal = std::function<void(const std::string& from)>;

  /// In every thread that this one starts from now on, as it has to be in all of the process.
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
