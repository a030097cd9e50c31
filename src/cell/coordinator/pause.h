// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stop_token>

namespace corbot::cell {

/// Waits for `duration_s`, or until a stop is requested.
inline void pause(double duration_s, const std::stop_token& stop) {
  std::mutex mutex;
  std::unique_lock lock(mutex);
  std::condition_variable_any never;
  never.wait_for(lock, stop, std::chrono::duration<double>(duration_s), [] { return false; });
}

}  // namespace corbot::cell
