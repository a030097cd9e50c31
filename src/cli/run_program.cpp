// SPDX-License-Identifier: Apache-2.0
#include "cli/run_program.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "cli/arm/dry_run.h"
#include "cli/pause_note.h"
#include "cli/plot/plan_plot.h"
#include "client/notice.h"

namespace corbot::cli {

using client::Client;
using client::ExitCode;
using client::Failure;
using client::Program;
using client::Statement;
using client::to_string;

namespace {

using Clock = std::chrono::steady_clock;

/// Shows the statements: on a terminal one line that is redrawn, elsewhere a line for each statement.
class Display {
 public:
  Display(std::size_t count, bool terminal) : count_(count), terminal_(terminal) {}

  void begin(std::size_t index, const Statement& statement) {
    index_ = index;
    text_ = statement.text.substr(0, 60);
    if (!terminal_) fmt::print("{}/{}  line {}: {}\n", index + 1, count_, statement.line, statement.text);
    draw(0);
  }
  void draw(double progress) const {
    if (terminal_) {
      const double done = (static_cast<double>(index_) + progress) / static_cast<double>(count_);
      client::notice(stdout, fmt::format("\r\x1b[K{} {:3.0f} %  {}/{}  {}", bar(done, 30),
                                         std::floor(100 * done), index_ + 1, count_, text_));
    }
    std::fflush(stdout);
  }
  /// Writes a line about the statement under way, unless the text is empty.
  void remark(const std::string& text) const {
    if (text.empty()) return;
    end();
    client::notice(stdout, fmt::format("  {}\n", text));
  }
  void end() const { client::notice(stdout, terminal_ ? "\r\x1b[K" : ""); }

 private:
  std::size_t count_;
  bool terminal_;
  std::size_t index_{0};
  std::string text_;
};

std::string counted(const Program& program) {
  const std::size_t count = program.statements.size();
  return fmt::format("{} command{}", count, count == 1 ? "" : "s");
}

}  // namespace

std::string bar(double ratio, std::size_t width) {
  const double bounded = std::isfinite(ratio) ? std::clamp(ratio, 0.0, 1.0) : 0.0;
  const auto full = static_cast<std::size_t>(bounded * static_cast<double>(width) + 1e-9);
  return "[" + std::string(full, '#') + std::string(width - full, ' ') + "]";
}

Program load_program(const std::string& file) {
  Program program = client::parse_program(client::read_program(file));
  program.name = file == "-" ? "<standard input>" : file;
  client::check_program(program);
  return program;
}

void print_program(const Program& program) {
  for (const auto& statement : program.statements) {
    fmt::print("line {}: {}\n", statement.line, to_string(statement.request));
  }
  fmt::print(
      "{}: the syntax is right; joint names, reach and limits were NOT checked, the robot does "
      "that; nothing "
      "moved\n",
      counted(program));
}

void check_reach(const Program& program, const std::string& profile, const std::string& picture) {
  DryRun robot(profile);
  for (const auto& statement : program.statements) {
    if (const auto why = robot.refusal_of(statement.request))
      throw Failure(ExitCode::kRefused, fmt::format("{}:{}: {}: the robot would refuse this line: {}; the "
                                                    "lines after it were not checked; nothing moved",
                                                    program.name, statement.line, statement.text, *why));
    const bool is_override = statement.request.verb == client::Verb::kOverride;
    fmt::print("line {}: {}{}\n", statement.line, to_string(statement.request),
               is_override ? ": skipped, since it changes no path" : "");
    fmt::print("{}", robot.plan());
  }
  if (!picture.empty()) charts::plot_plan(robot, program.name, picture);
  fmt::print(
      "{}: {} can carry {}, from all joints at 0 and with the profile's settings. Nothing moved. The robot's "
      "position, its present settings, the planes and boxes that clients have set, and other obstacles were "
      "NOT checked\n",
      counted(program), robot.robot(), program.statements.size() == 1 ? "it out" : "out all of them");
}

void run_program(Client& client, const Program& program) {
  Display display(program.statements.size(), ::isatty(STDOUT_FILENO) == 1);
  const auto begin = Clock::now();
  PauseNote note(client);
  try {
    client::carry_out(program, [&](std::size_t index, const Statement& statement) {
      display.begin(index, statement);
      display.remark(client.perform(statement.request, [&](double progress) {
        display.remark(note(progress));
        display.draw(progress);
      }));
    });
  } catch (const Failure&) {
    display.end();
    throw;
  }
  display.end();
  const std::chrono::duration<double> took = Clock::now() - begin;
  fmt::print("done: {} in {:.1f} s\n", counted(program), took.count());
}

}  // namespace corbot::cli
