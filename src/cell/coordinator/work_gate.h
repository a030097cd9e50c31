// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <mutex>
#include <stop_token>

namespace corbot::cell {

/// The place where the robots wait between two commands while the work is paused.
class WorkGate {
 public:
  void set_open(bool is_open) {
    const std::lock_guard lock(mutex_);
    is_open_ = is_open;
    changed_.notify_all();
  }
  [[nodiscard]] bool is_open() const {
    const std::lock_guard lock(mutex_);
    return is_open_;
  }
  /// Returns while it is open, or when a stop is requested.
  void pass(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, stop, [&] { return is_open_; });
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  bool is_open_{true};
};

}  // namespace corbot::cell
