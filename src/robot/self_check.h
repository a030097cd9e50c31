// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>

#include "corbot/running_time.h"

namespace corbot {

/// Checks repeatedly, in a thread of its own, whether calls from outside get through to this process.
class SelfCheck {
 public:
  static constexpr std::chrono::milliseconds kInterval{200};
  /// Validity of an answer: as many as five checks may be slow. The time counts in looks, so a time in which
  /// this process did not run does not count.
  static constexpr std::chrono::milliseconds kHolds{1000};
  static constexpr std::chrono::milliseconds kLongestLook{40};

  SelfCheck() = default;
  SelfCheck(const SelfCheck&) = delete;
  SelfCheck& operator=(const SelfCheck&) = delete;
  ~SelfCheck() { close(); }

  /// `answers` may take long, but must return.
  void start(std::function<bool()> answers);
  void close();
  /// Returns true if the check is not started, or has passed recently. To be called every few milliseconds.
  [[nodiscard]] bool passes();
  [[nodiscard]] bool is_started() const noexcept { return started_.load(std::memory_order_acquire); }

 private:
  void run();

  std::function<bool()> answers_;
  std::atomic<bool> started_{false};
  std::atomic<std::uint64_t> answers_count_{0};
  std::mutex look_mutex_;  // guards the two members below
  std::uint64_t seen_{0};  // number of answers at the last look
  RunningTime since_answer_{kLongestLook, RunningTime::Clock::now()};
  std::mutex mutex_;  // guards end_
  std::condition_variable end_requested_;
  bool end_{false};
  std::thread thread_;
};

}  // namespace corbot
