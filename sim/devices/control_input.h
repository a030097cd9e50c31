// SPDX-License-Identifier: Apache-2.0
// The common parts of the programs around emulated devices: commands on standard input, an orderly end, a
// record.
#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/devices/words.h"

namespace corbot::sim {

/// Returns the time of the monotonic clock.
[[nodiscard]] std::int64_t clock_ns();
/// Prints a line on standard output, which may be closed at the other end.
void print_line(const std::string& line);
[[nodiscard]] std::vector<std::string_view> words_of(std::string_view text);

/// Standard input, line by line.
class ControlInput {
 public:
  /// Returns the descriptor to be polled; −1 if it has been closed.
  [[nodiscard]] int fd() const;
  /// Reads the available input; every line that is not empty gets the reply that `handle` returns. A line of
  /// more than 256 characters is refused as a whole.
  void read(const std::function<std::string(std::string_view)>& handle);

 private:
  bool is_open_{true};
  bool is_too_long_{false};  ///< the line that has begun
  std::string text_;
};

/// While it exists, SIGTERM, SIGINT and SIGHUP only make its descriptor readable.
class EndingSignals {
 public:
  EndingSignals();
  EndingSignals(const EndingSignals&) = delete;
  EndingSignals& operator=(const EndingSignals&) = delete;
  ~EndingSignals();
  [[nodiscard]] int fd() const { return fd_; }

 private:
  int fd_;
};

struct CloseFile {
  void operator()(std::FILE* file) const { (void)std::fclose(file); }
};
using Record = std::unique_ptr<std::FILE, CloseFile>;
/// Opens a file for rows; null for an empty path. Throws std::runtime_error.
[[nodiscard]] Record open_record(const std::string& path, const char* heading);

}  // namespace corbot::sim
