// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <stop_token>

namespace corbot::cell {

/// The gate at which robots wait between two commands while the work is paused.
class WorkGate {
 public:
  /// `file` contains "pause", "stop", both or nothing, so that the next process keeps the work held. The file
  /// has its full size from the beginning, so a disk that fills up later loses no Stop. Empty: no file.
  explicit WorkGate(std::filesystem::path file = {});
  void set_paused(bool is_paused) {
    set(is_paused_, is_paused);
    keep();
  }
  void set_stopped(bool is_stopped) {
    set(is_stopped_, is_stopped);
    keep();
  }
  /// Holds the work at once, before keep() writes the file.
  void stop() { set(is_stopped_, true); }
  /// Writes the file. The disk may be slow, so no robot waits for the write.
  void keep() const;
  [[nodiscard]] bool is_paused() const {
    const std::lock_guard lock(mutex_);
    return is_paused_;
  }
  [[nodiscard]] bool is_stopped() const {
    const std::lock_guard lock(mutex_);
    return is_stopped_;
  }
  [[nodiscard]] bool is_open() const {
    const std::lock_guard lock(mutex_);
    return !is_paused_ && !is_stopped_;
  }
  /// Waits until the gate is open or stopped, or a stop is requested.
  void pass(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, stop, [&] { return !is_paused_ || is_stopped_; });
  }

 private:
  void set(bool& flag, bool value);

  const std::filesystem::path file_;
  mutable std::mutex file_mutex_;  ///< locked before mutex_
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  bool is_paused_{false};
  bool is_stopped_{false};
};

}  // namespace corbot::cell
