// SPDX-License-Identifier: Apache-2.0
#include "cli/supervise/report.h"

#include <unistd.h>

#include <string>

#include "log/line_output.h"

namespace corbot::cli {
namespace {

LineOutput& standard_output() noexcept {
  static LineOutput output(STDOUT_FILENO);
  return output;
}

}  // namespace

void report(std::string_view line) noexcept { standard_output().write(line); }
bool can_redraw() noexcept { return standard_output().can_redraw(); }
void draw(std::string_view line) noexcept { standard_output().draw(line); }

void log(std::string_view line) noexcept {
  static LineOutput output(STDERR_FILENO);
  draw("");
  try {
    output.write("corbot: " + std::string(line));
  } catch (...) {
    output.write(line);
  }
}

}  // namespace corbot::cli
