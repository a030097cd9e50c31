// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

namespace corbot::test {

struct Lasted {
  double running_s;      ///< without standstills of more than a tenth of a second
  double stood_still_s;  ///< the rest: the whole machine stood still
};

/// Measures how long `f` takes.
template <class F>
Lasted lasted(F&& f) {
  using Seconds = std::chrono::duration<double>;
  const auto since = [](std::chrono::steady_clock::time_point then) {
    return Seconds(std::chrono::steady_clock::now() - then).count();
  };
  std::atomic<double> stood_still_s{0};
  std::jthread watch([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      const auto before = std::chrono::steady_clock::now();
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      stood_still_s = stood_still_s + std::max(0.0, since(before) - 0.1);
    }
  });
  const auto begin = std::chrono::steady_clock::now();
  f();
  const double all_s = since(begin);
  watch.request_stop();
  watch.join();
  return {all_s - stood_still_s, stood_still_s};
}

template <class F>
double running_seconds_of(F&& f) {
  return lasted(f).running_s;
}

}  // namespace corbot::test
