// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace corbot {

/// Asks again and again, in a thread of its own, whether calls get through to this process from outside.
class SelfCheck {
 public:
  static constexpr std::chrono::milliseconds kInterval{200};
  /// An answer holds for so long: as many as five checks may be slow.
  static constexpr std::chrono::milliseconds kHolds{1000};

  SelfCheck() = default;
  SelfCheck(const SelfCheck&) = delete;
  SelfCheck& operator=(const SelfCheck&) = delete;
  ~SelfCheck() { close(); }

  /// `answers` may take its time, but must come back.
  void start(std::function<bool()> answers);
  void close();
  /// Not started, or passed lately.
  [[nodiscard]] bool passes() const noexcept;
  [[nodiscard]] bool is_started() const noexcept { return started_.load(std::memory_order_acquire); }

 private:
  using Clock = std::chrono::steady_clock;

  void run();

  std::function<bool()> answers_;
  std::atomic<bool> started_{false};
  std::atomic<Clock::rep> passed_at_{0};
  std::mutex mutex_;  // of end_
  std::condition_variable end_requested_;
  bool end_{false};
  std::thread thread_;
};

}  // namespace corbot
