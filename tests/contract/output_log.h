// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <time.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "contract/device_fixture.h"

namespace corbot::test {

/// Records the outputs of a device without a record of its own, by polling.
class OutputLog {
 public:
  OutputLog(std::size_t servos, std::function<std::vector<double>()> look, long every_us = 2000)
      : look_(std::move(look)), every_us_(every_us), last_(servos, NAN) {}
  void start() {
    thread_ = std::jthread([this](const std::stop_token& end) {
      while (!end.stop_requested()) {
        note();
        const timespec pause{0, every_us_ * 1000};
        ::nanosleep(&pause, nullptr);
      }
    });
  }
  /// With what the device puts out by now: the record is not behind, however long its thread did not run.
  std::vector<Output> seen() {
    note();
    const std::lock_guard lock(mutex_);
    return seen_;
  }

 private:
  void note() {
    const std::lock_guard lock(mutex_);
    const std::vector<double> now = look_();
    const std::int64_t time_ns = std::chrono::steady_clock::now().time_since_epoch().count();
    for (std::size_t i = 0; i < now.size(); ++i) {
      const bool is_same = now[i] == last_[i] || (std::isnan(now[i]) && std::isnan(last_[i]));
      if (!is_same) seen_.push_back({time_ns, i, std::isnan(now[i]) ? 0.0 : now[i]});
      last_[i] = now[i];
    }
  }

  const std::function<std::vector<double>()> look_;
  const long every_us_;
  std::mutex mutex_;
  std::vector<double> last_;
  std::vector<Output> seen_;
  std::jthread thread_;  // last: it uses all the rest
};

}  // namespace corbot::test
