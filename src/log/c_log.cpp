// SPDX-License-Identifier: Apache-2.0
#include "log/c_log.h"

#include <unistd.h>

#include <mutex>

#include "log/line_output.h"

void corbot_log_line(const char* line) {
  static std::mutex mutex;
  static auto* const output = new corbot::LineOutput(STDERR_FILENO);  // threads log while the program ends
  const std::lock_guard lock(mutex);
  output->write(line);
}
