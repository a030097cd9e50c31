// SPDX-License-Identifier: Apache-2.0
#include "cli/calibrate/home.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>

#include "cli/calibrate/input_lines.h"
#include "cli/calibrate/servo_claim.h"
#include "client/explain.h"
#include "client/failure.h"
#include "client/stop_on_signal.h"
#include "config/load_profile.h"
#include "corbot/arm/joint_units.h"
#include "corbot/backend/emergency_stop.h"
#include "rt/backends/can/drive_homing.h"
#include "rt/backends/can_settings.h"
#include "rt/inputs/safety_lines.h"
#include "rt/safety_settings.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;
using client::OnSignal;
using client::printable;

namespace {

Profile profile_of_drives(const std::string& file) {
  try {
    Profile profile = load_profile(file);
    if (profile.backend.kind == "socketcan") return profile;
    throw Failure(
        ExitCode::kUsage,
        fmt::format(
            "{}: the backend of this profile is {}, and corbot homes only drives on a CAN bus (socketcan)",
            file, profile.backend.kind));
  } catch (const ConfigError& error) {
    throw Failure(ExitCode::kUsage, error.what());
  }
}

bool has_homing(const Profile& profile, std::size_t joint) {
  return profile.backend.socketcan.drives[joint].homing.method != 0;
}

std::size_t joint_of(const Profile& profile, const std::string& word) {
  const auto& names = profile.joint_names;
  if (word == "gripper") {
    throw Failure(ExitCode::kUsage,
                  "corbot does not home the gripper, which would take a held piece for the end of its "
                  "travel: use an absolute encoder, or home it with its maker's tool");
  }
  for (std::size_t i = 0; i < profile.arm.dof; ++i) {
    if (word == names[i] || word == std::to_string(i)) return i;
  }
  throw Failure(ExitCode::kUsage, fmt::format("JOINT '{}': the arm has no such joint; its joints are {}",
                                              printable(word), fmt::join(names, ", ")));
}

std::vector<std::size_t> chosen_joints(const Profile& profile, const std::vector<std::string>& words) {
  std::vector<std::size_t> joints;
  for (const std::string& word : words) {
    const std::size_t joint = joint_of(profile, word);
    if (!has_homing(profile, joint)) {
      throw Failure(
          ExitCode::kUsage,
          fmt::format("joint {} has no homing_method in {}, so its drive keeps its count and needs no homing",
                      profile.joint_names[joint], profile.file));
    }
    if (std::find(joints.begin(), joints.end(), joint) == joints.end()) joints.push_back(joint);
  }
  for (std::size_t i = 0; words.empty() && i < profile.arm.dof; ++i) {
    if (has_homing(profile, i)) joints.push_back(i);
  }
  if (joints.empty()) {
    throw Failure(
        ExitCode::kUsage,
        fmt::format("{}: no drive has a homing_method, so all drives keep their counts and need no homing",
                    profile.file));
  }
  return joints;
}

void print_introduction(const Profile& profile, const std::vector<std::size_t>& joints,
                        const std::string& nodes) {
  fmt::print("{}: nodes {}. These joints are homed, in this order:\n", profile.file, nodes);
  for (const std::size_t joint : joints) {
    const CanDrive& drive = profile.backend.socketcan.drives[joint];
    const JointKind kind = profile.arm.kinematics.joint_kind(joint);
    fmt::print("  {} (node {}): method {}, {:g} {} a second, then {:g}\n", profile.joint_names[joint],
               drive.node, drive.homing.method, to_shown(kind, drive.homing.speed_q_s), unit_name(kind),
               to_shown(kind, drive.homing.creep_q_s));
  }
  fmt::print(
      "Each joint moves by itself to its switch, WITHOUT THE LIMITS OF THE PROFILE; all other joints hold.\n"
      "KEEP CLEAR. 'on' begins; Ctrl-C halts and de-energises the drives; 'quit' ends without a motion.\n");
}

/// Returns false if nothing may move.
bool is_begun(const std::atomic<bool>& end) {
  const bool terminal = ::isatty(STDIN_FILENO) == 1;
  InputLines lines(end);
  for (;;) {
    if (terminal) fmt::print("> ");
    std::fflush(stdout);
    const auto line = lines.next();
    if (!line || *line == "quit") return false;
    if (*line == "on") return true;
    if (!line->empty())
      fmt::print("refused: '{}' is neither 'on' nor 'quit': type one of them\n", printable(*line));
  }
}

/// The drives, and the lines that may stop them.
class Homing {
 public:
  Homing(const Profile& profile, const std::atomic<bool>& end)
      : profile_(profile),
        end_(end),
        drives_(rt::cia402_settings(profile)),
        safety_(rt::safety_settings(profile), rt::kernel_gpio(), stop_, [this] {
          // A drive during homing expects no set-points. A watchdog output can therefore only show that this
          // process runs.
          rt::CycleView view;
          view.cycle = ++looks_;
          view.in_error = view.power_off = stop_.presses() != 0;
          return view;
        }) {}
  ~Homing() {
    drives_.stop();  // except the drives that have been left
    safety_.stop();
  }
  Homing(const Homing&) = delete;
  Homing& operator=(const Homing&) = delete;

  std::string open() { return drives_.open(); }

  void run(const std::vector<std::size_t>& joints) {
    safety_.start();
    if (stop_.sources() != 0)
      throw Failure(ExitCode::kRefused, "the emergency stop is pressed: release it first");
    if (!goes_on()) end_early("nothing has been energised, and nothing has moved");
    safety_.allow_power();
    if (!drives_.energise([this] { return !goes_on(); }))
      end_early("the drives are disabled again, and nothing has moved");
    for (const std::size_t joint : joints) {
      const std::string& name = profile_.joint_names[joint];
      if (!goes_on()) end_early(name + " is not homed");
      fmt::print("{} is being homed\n", name);
      std::fflush(stdout);
      if (!drives_.home(joint, [this] { return goes_on(); }))
        end_early(name + " was halted, and is not homed");
      const JointKind kind = profile_.arm.kinematics.joint_kind(joint);
      fmt::print("{} is homed: count {}, {:.{}f} {}\n", name, drives_.count(joint),
                 to_shown(kind, drives_.position_q(joint)), decimals(kind, 2), unit_name(kind));
      std::fflush(stdout);
    }
    leave();
  }

 private:
  [[nodiscard]] bool goes_on() const { return !end_ && stop_.presses() == 0; }
  void leave() {
    if (profile_.backend.common.relax_at_end) {
      drives_.relax();
    } else {
      drives_.leave();
    }
  }
  /// Ends the command and removes the voltage from all drives whose homing has not ended properly.
  [[noreturn]] void end_early(const std::string& result) {
    drives_.relax();
    const bool is_pressed = stop_.presses() != 0;
    throw Failure(ExitCode::kStopped,
                  fmt::format("{}{}; the drives are de-energised",
                              is_pressed ? "the emergency stop was pressed: " : "ended: ", result));
  }

  const Profile& profile_;
  const std::atomic<bool>& end_;
  EmergencyStop stop_;
  rt::DriveHoming drives_;
  std::atomic<std::uint64_t> looks_{0};
  rt::SafetyLines safety_;
};

}  // namespace

void home(const HomeOptions& options) {
  const Profile profile = profile_of_drives(options.profile);
  const std::vector<std::size_t> joints = chosen_joints(profile, options.joints);
  const std::string& name = options.name.empty() ? profile.name : options.name;
  const StateLock lock = claim_servos(name);
  (void)position_unless_held(profile, name, "");
  std::atomic<bool> end{false};
  OnSignal on_signal([&] { end = true; });
  try {
    Homing homing(profile, end);
    print_introduction(profile, joints, homing.open());
    if (!is_begun(end)) throw Failure(ExitCode::kStopped, "ended before 'on' was typed: nothing has moved");
    homing.run(joints);
  } catch (const Failure&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw Failure(ExitCode::kInternal, error.what());
  }
}

}  // namespace corbot::cli
