// SPDX-License-Identifier: Apache-2.0
#include "cli/calibrate/calibrate.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <fstream>
#include <optional>
#include <sstream>
#include <utility>

#include "cli/calibrate/calibrate_session.h"
#include "cli/supervise/robot_processes.h"
#include "cli/supervise/state_lock.h"
#include "client/failure.h"
#include "client/stop_on_signal.h"
#include "config/load_profile.h"
#include "shm/channel_client.h"
#include "state/position_store.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;
using client::OnSignal;

namespace {

std::string read_text(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  if (!stream) throw Failure(ExitCode::kInternal, file + ": cannot be read");
  return text.str();
}

/// Two programs must not drive the same servos.
void refuse_if_running(const std::string& name) {
  // It may listen in another run directory: then it is found by what it has open.
  if (!task_runs(name) && find_robot_processes(name).empty()) return;
  throw Failure(ExitCode::kInternal,
                fmt::format("the real-time task of {} is running and holds the servos: end it first, with "
                            "'corbot down --name {}'",
                            name, name));
}

std::optional<LastPosition> kept_position(const CalibrateOptions& options, const Profile& profile,
                                          const std::string& name) {
  const std::filesystem::path directory = options.state_directory.empty()
                                              ? default_state_directory()
                                              : std::filesystem::path(options.state_directory);
  if (directory.empty()) return std::nullopt;
  try {
    return PositionStore(directory, name, "calibrate").load(profile.arm);
  } catch (const PositionError&) {
    return std::nullopt;
  }
}

/// Standard input, a line at a time; nothing at its end, or once `end` is set.
class Lines {
 public:
  explicit Lines(const std::atomic<bool>& end) : end_(end) {}

  std::optional<std::string> next() {
    for (;;) {
      if (const auto at = text_.find('\n'); at != std::string::npos) {
        std::string line = text_.substr(0, at);
        text_.erase(0, at + 1);
        return line;
      }
      if (ended_) return text_.empty() ? std::nullopt : std::optional(std::exchange(text_, {}));
      pollfd input{STDIN_FILENO, POLLIN, 0};
      constexpr int kPoll_ms = 100;
      const int ready = ::poll(&input, 1, kPoll_ms);
      if (end_) return std::nullopt;
      if (ready <= 0) continue;
      char bytes[1024];
      const ssize_t n = ::read(STDIN_FILENO, bytes, sizeof(bytes));
      if (n > 0) text_.append(bytes, static_cast<std::size_t>(n));
      if (n <= 0 || text_.size() > kLongest) ended_ = true;
    }
  }

 private:
  static constexpr std::size_t kLongest = 1u << 16;
  const std::atomic<bool>& end_;
  std::string text_;
  bool ended_{false};
};

}  // namespace

void calibrate(const CalibrateOptions& options) {
  CalibrateSession::Setting setting;
  try {
    setting.profile = load_profile(options.profile);
  } catch (const ConfigError& error) {
    throw Failure(ExitCode::kUsage, error.what());
  }
  if (setting.profile.backend.kind == "socketcan") {
    throw Failure(ExitCode::kUsage,
                  fmt::format("{}: its drives take angles, not pulses: they are calibrated by "
                              "their own keys, see docs/wiring",
                              options.profile));
  }
  const std::string name = options.name.empty() ? setting.profile.name : options.name;
  setting.name = name;
  setting.text = read_text(options.profile);
  setting.terminal = ::isatty(STDIN_FILENO) == 1;
  setting.dry_run = options.dry_run;
  const auto lock = StateLock::acquire(name);  // keeps 'corbot up' out
  if (!lock) {
    throw Failure(ExitCode::kInternal,
                  fmt::format("'{}' is up: end it first, with 'corbot down --name {}'", name, name));
  }
  refuse_if_running(name);

  std::atomic<bool> end{false};
  OnSignal on_signal([&] { end = true; });  // before the device's thread
  try {
    ServoPositioner servos(setting.profile, end);
    const auto kept = kept_position(options, setting.profile, name);
    servos.connect(kept ? &kept->position_rad : nullptr, kept ? kept->opening : 0.0);
    CalibrateSession session(setting, servos);
    Lines lines(end);
    session.print_introduction();
    while (!session.done()) {
      if (setting.terminal) fmt::print("> ");
      std::fflush(stdout);
      const auto line = lines.next();
      if (!line) break;
      session.run(*line);
    }
    if (end) throw Failure(ExitCode::kStopped, "ended by " + on_signal.describe() + session.unwritten_note());
    session.report_unwritten();
  } catch (const Failure&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw Failure(ExitCode::kInternal, error.what());
  }
}

}  // namespace corbot::cli
