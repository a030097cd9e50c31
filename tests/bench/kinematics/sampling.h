// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <ctime>
#include <vector>

namespace corbot::bench {

/// Nanoseconds a call, by quantile.
struct Quantiles {
  double median_ns, p95_ns, p99_ns;
};

/// Keeps a value from being optimised away.
template <class T>
inline void keep(const T& value) {
  asm volatile("" : : "r"(&value) : "memory");
}

/// Returns this thread's processor time, in nanoseconds: other programs on the machine do not count.
inline double thread_ns() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e9 * static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec);
}

/// One round: `calls` calls timed together, body(i) for i = 0 … calls − 1; nanoseconds a call.
template <class Body>
double time_round(std::size_t calls, Body&& body) {
  const auto begin = std::chrono::steady_clock::now();
  for (std::size_t i = 0; i < calls; ++i) body(i);
  const std::chrono::duration<double, std::nano> spent = std::chrono::steady_clock::now() - begin;
  return spent.count() / static_cast<double>(calls);
}

inline Quantiles quantiles(std::vector<double> rounds_ns) {
  std::sort(rounds_ns.begin(), rounds_ns.end());
  const auto at = [&rounds_ns](double q) {
    return rounds_ns[static_cast<std::size_t>(q * static_cast<double>(rounds_ns.size() - 1))];
  };
  return {at(0.5), at(0.95), at(0.99)};
}

inline void print(const char* name, const Quantiles& q) {
  std::printf("%-34s median %10.1f ns   p95 %10.1f ns   p99 %10.1f ns\n", name, q.median_ns, q.p95_ns,
              q.p99_ns);
}

/// Prints and returns whether the bound holds.
inline bool check(const char* what, double value, const char* relation, double bound) {
  const bool holds = relation[0] == '<' ? value <= bound : value >= bound;
  std::printf("%s  %s: %.3g, wanted %s= %.3g\n", holds ? "ok  " : "MISS", what, value, relation, bound);
  return holds;
}

}  // namespace corbot::bench
