// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "contract/device_fixture.h"

namespace corbot::test {

/// The pulses at the first lines of a GPIO chip, out of the kernel's trace event gpio:gpio_value, which has
/// the time of each edge. Needs root, tracefs, and no other tracer.
class TracePipe {
 public:
  TracePipe() = default;
  TracePipe(const TracePipe&) = delete;
  TracePipe& operator=(const TracePipe&) = delete;
  ~TracePipe();

  /// Throws std::runtime_error.
  void open(const std::string& chip, std::size_t lines);
  /// The pulses of every frame that is over, at its end.
  std::vector<Output> pulses();
  /// The last pulse of each line; NaN where none began within the last tenth of a second.
  std::vector<double> latest();

 private:
  void read(const std::stop_token& end);
  void take(const std::string& text);
  void add(const Output& pulse);

  int fd_{-1};
  long base_{0};
  std::mutex mutex_;
  std::vector<Output> pulses_;
  std::vector<Output> frame_;          ///< under way
  std::vector<std::int64_t> rose_ns_;  ///< by line; 0: is low
  std::vector<Output> last_;
  std::string rest_;
  std::jthread thread_;
};

}  // namespace corbot::test
