// SPDX-License-Identifier: Apache-2.0
#include "cli/supervise/console.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <utility>

#include "cli/supervise/report.h"
#include "client/explain.h"
#include "client/failure.h"

namespace corbot::cli {

namespace {

constexpr std::size_t kMostStops = 8;
constexpr std::size_t kLongestLine = 256;

}  // namespace

Console::Console(std::string robot, bool reads_input)
    : robot_(std::move(robot)), open_(reads_input && ::isatty(STDIN_FILENO) == 1) {}

int Console::fd() const {
  if (!open_) return -1;
  const pid_t foreground = ::tcgetpgrp(STDIN_FILENO);  // fails if the terminal does not control this process
  return foreground < 0 || foreground == ::getpgrp() ? STDIN_FILENO : -1;
}

std::string Console::hint() const { return open_ ? "Enter stops the arm; " : ""; }

std::string Console::end_hint() const {
  return open_ ? "; a second Ctrl-C would kill its programs, and a moving arm would not slow down" : "";
}

void Console::step() {
  for (auto stop = stops_.begin(); stop != stops_.end();) {
    if (!stop->has_ended()) {
      ++stop;
      continue;
    }
    std::string why;
    for (std::string& line : stop->read_lines()) why = std::move(line);
    const int status = stop->reap().value_or(0);
    const bool stopped = WIFEXITED(status) && WEXITSTATUS(status) == 0;
    report(stopped ? "the arm is stopped"
                   : fmt::format("THE STOP FAILED: {}",
                                 why.empty() ? describe_end(status) : client::printable(why)));
    stop = stops_.erase(stop);
  }
  pollfd input{fd(), POLLIN, 0};
  if (input.fd < 0 || ::poll(&input, 1, 0) <= 0) return;
  std::array<char, kLongestLine> bytes{};
  const ssize_t n = ::read(STDIN_FILENO, bytes.data(), bytes.size());
  if (n <= 0) {
    open_ = false;  // Ctrl-D, or the terminal is gone
    return;
  }
  typed_.append(bytes.data(), static_cast<std::size_t>(n));
  for (std::size_t end = typed_.find('\n'); end != std::string::npos; end = typed_.find('\n')) {
    handle(typed_.substr(0, end));
    typed_.erase(0, end + 1);
  }
  if (typed_.size() > kLongestLine) typed_.clear();
}

void Console::handle(const std::string& line) {
  std::string word;
  for (const char c : line) {
    if (c != ' ' && c != '\t' && c != '\r') word += c;
  }
  if (word.empty() || word == "s" || word == "stop") return stop();
  report("Enter, or s and Enter, stops the arm; Ctrl-C ends the robot");
}

void Console::stop() {
  if (stops_.size() >= kMostStops) return;  // enough stops are under way
  try {
    Child child("corbot stop", {"/proc/self/exe", "stop", "--robot", robot_});
    child.start({.errors_too = true});
    stops_.push_back(std::move(child));
    report("stopping the arm");
  } catch (const client::Failure& failure) {
    report(fmt::format("THE STOP FAILED: {}", failure.what()));
  }
}

}  // namespace corbot::cli
