// SPDX-License-Identifier: Apache-2.0
#include "cli/calibrate/calibrate.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <fstream>
#include <optional>
#include <sstream>

#include "cli/calibrate/calibrate_session.h"
#include "cli/calibrate/input_lines.h"
#include "cli/calibrate/servo_claim.h"
#include "client/failure.h"
#include "client/stop_on_signal.h"
#include "config/load_profile.h"

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

/// Closes the servos before the signal handler goes away.
class Closing {
 public:
  explicit Closing(ServoPositioner& servos) : servos_(servos) {}
  ~Closing() { servos_.close(); }
  Closing(const Closing&) = delete;
  Closing& operator=(const Closing&) = delete;

 private:
  ServoPositioner& servos_;
};

void drive(const CalibrateSession::Setting& setting, const CalibrateOptions& options) {
  std::atomic<bool> end{false};
  ServoPositioner servos(setting.profile, end);
  OnSignal on_signal([&] {  // before the device's thread
    end = true;
    servos.cancel();
  });
  const Closing closing(servos);
  const auto kept = position_unless_held(setting.profile, setting.name, options.state_directory);
  servos.connect(kept ? &kept->position_q : nullptr, kept ? kept->opening : 0.0);
  CalibrateSession session(setting, servos);
  const auto fail_ended = [&] {
    throw Failure(ExitCode::kStopped, "ended by " + on_signal.describe() + session.unwritten_note());
  };
  InputLines lines(end);
  session.print_introduction();
  while (!session.done()) {
    if (setting.terminal) fmt::print("> ");
    std::fflush(stdout);
    const auto line = lines.next();
    if (!line) break;
    try {
      session.run(*line);
    } catch (const Failure&) {
      throw;
    } catch (const std::runtime_error& error) {
      if (end) fail_ended();
      if (servos.is_stopped()) throw Failure(ExitCode::kStopped, error.what());
      throw;
    }
  }
  if (end) fail_ended();
  session.report_unwritten();
}

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
                  fmt::format("{}: the drives of this profile take angles, not pulses: set zero_count, "
                              "counts and direction in the profile, see docs/wiring/socketcan.md",
                              options.profile));
  }
  const auto& has_servo = setting.profile.has_servo;
  if (!setting.profile.gripper_has_servo ||
      std::find(has_servo.begin(), has_servo.end(), false) != has_servo.end()) {
    throw Failure(ExitCode::kUsage, fmt::format("{}: the profile has no servo for some joint or the gripper: "
                                                "add channel, zero_us and pulse_range_us first",
                                                options.profile));
  }
  const std::string name = options.name.empty() ? setting.profile.name : options.name;
  setting.name = name;
  setting.text = read_text(options.profile);
  setting.terminal = ::isatty(STDIN_FILENO) == 1;
  setting.dry_run = options.dry_run;
  const StateLock lock = claim_servos(name);

  try {
    drive(setting, options);
  } catch (const Failure&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw Failure(ExitCode::kInternal, error.what());
  }
}

}  // namespace corbot::cli
