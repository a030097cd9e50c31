// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/can/drive_preparation.h"

#include <algorithm>

#include "corbot/running_time.h"
#include "rt/backends/can/can_link.h"
#include "rt/backends/can/can_load.h"
#include "rt/backends/can/cia402_setup.h"

namespace corbot::rt {
namespace {

using namespace std::chrono_literals;

constexpr int kSetUps = 3;
constexpr DriveBus::Clock::duration kStartWithin = 2s;
constexpr DriveBus::Clock::duration kLook = 50ms;

std::string describe_rate(std::int64_t bits_per_s) {
  return std::to_string((bits_per_s + 999) / 1000) + " kbit/s";
}

}  // namespace

std::string DrivePreparation::choose_period() {
  const std::size_t drives = bus_.drives().size();
  std::uint32_t bit_rate = settings_.bit_rate;
  if (bit_rate == 0) bit_rate = read_can_link(settings_.interface).value_or(CanLink{}).bit_rate.value_or(0);
  const auto period_ns = sync_period_ns(drives, settings_.loop_ns, bit_rate);
  if (!period_ns) {
    throw DeviceError(DeviceCause::kNotThere,
                      settings_.interface + ": " + describe_rate(bit_rate) + " cannot carry " +
                          std::to_string(drives) + " drives even at 10 frames a second, which need " +
                          describe_rate(needed_bit_rate(drives, kLongestSyncPeriod_ns)));
  }
  bus_.set_period_ns(*period_ns);
  if (settings_.watch_ms > 0 && beat_period() < bus_.period()) {
    throw DeviceError(DeviceCause::kNotThere, settings_.interface +
                                                  ": watch_ms = " + std::to_string(settings_.watch_ms) +
                                                  " is too short for a bus that carries a frame every " +
                                                  std::to_string(bus_.period_ns() / 1'000'000) + " ms");
  }
  const std::int64_t tenths_hz = 10'000'000'000 / bus_.period_ns();
  std::string text = std::to_string(tenths_hz / 10) + "." + std::to_string(tenths_hz % 10) +
                     " frames a second, which need " +
                     describe_rate(needed_bit_rate(drives, bus_.period_ns())) +
                     (bit_rate == 0 ? "; the bit rate is not known" : " of " + describe_rate(bit_rate));
  if (bus_.period_ns() > settings_.loop_ns) {
    text += "; the loop's " + std::to_string(1'000'000'000 / settings_.loop_ns) + " would need " +
            describe_rate(needed_bit_rate(drives, settings_.loop_ns));
  }
  return text;
}

std::string DrivePreparation::set_up(bool must_be_homed) {
  std::string nodes = set_up_once(must_be_homed);
  // A drive that restarts meanwhile, as after all have just been switched on, has forgotten its set-up.
  for (int left = kSetUps - 1; const DriveReport* drive = restarted(); --left) {
    if (left == 0) {
      throw DeviceError(DeviceCause::kDeviceFault,
                        settings_.interface + ": " + name_of(*drive) + " has restarted while it was set up");
    }
    nodes = set_up_once(must_be_homed);
  }
  return nodes;
}

const DriveReport* DrivePreparation::restarted() const {
  const auto& drives = bus_.drives();
  const auto found = std::find_if(drives.begin(), drives.end(),
                                  [](const DriveReport& drive) { return drive.has_restarted; });
  return found == drives.end() ? nullptr : &*found;
}

DriveSetup DrivePreparation::setup_of(std::size_t drive, bool must_be_homed) const {
  DriveSetup setup{bus_.drives()[drive].node, bus_.period_ns(), settings_.heartbeat_ms};
  if (drive < settings_.joints.size()) {
    const JointDrive& joint = settings_.joints[drive];
    setup.identity = joint.identity;
    if (joint.homing && must_be_homed) setup.home_command = settings_.home_command;
  } else if (settings_.gripper) {
    setup.identity = settings_.gripper->identity;
    setup.is_gripper = true;
  }
  return setup;
}

std::string DrivePreparation::set_up_once(bool must_be_homed) {
  bus_.command(NmtCommand::kPreOperational);  // the drives' PDOs are quiet during the set-up
  watch_masters(0);                           // and no heartbeat is sent
  std::string nodes;
  std::string last_name;
  for (std::size_t i = 0; i < bus_.drives().size(); ++i) {
    const DriveReport& drive = bus_.drives()[i];
    enabling_.note_restarts();
    bus_.watch().settle_restart(i);
    const DriveSetup setup = setup_of(i, must_be_homed);
    const auto [name, was_set_up, following_window] = set_up_drive(bus_.port(), bus_.watch(), setup);
    if (!was_set_up) enabling_.note_restart(i);
    if (setup.is_gripper) gripper_window_ = following_window;
    // A row of the same drives is named once, at its end.
    if (!nodes.empty()) nodes += (name == last_name || last_name.empty() ? ", " : " (" + last_name + "), ");
    nodes += std::to_string(drive.node);
    last_name = name;
  }
  if (!last_name.empty()) nodes += " (" + last_name + ")";
  watch_masters(settings_.watch_ms);  // the watch begins with the first heartbeat
  return nodes;
}

void DrivePreparation::watch_masters(int watch_ms) {
  if (settings_.watch_ms == 0) return;
  for (const DriveReport& drive : bus_.drives())
    watch_master(bus_.port(), bus_.watch(), drive.node, watch_ms);
}

void DrivePreparation::start() {
  bus_.command(NmtCommand::kStart);
  const auto is_operational = [](const DriveReport& drive) { return drive.nmt == NmtState::kOperational; };
  const auto& drives = bus_.drives();
  // A drive's heartbeat shows that it has become operational.
  const Clock::duration two_heartbeats = 2 * std::chrono::milliseconds(settings_.heartbeat_ms);
  const auto are_all = [&] { return std::all_of(drives.begin(), drives.end(), is_operational); };
  Patience patience{std::max(kStartWithin, two_heartbeats)};
  while (!are_all() && !patience.is_over()) bus_.listen(Clock::now() + kLook, are_all);
  bus_.watch().check_bus();
  const auto late = std::find_if_not(drives.begin(), drives.end(), is_operational);
  if (late == drives.end()) return;
  throw DeviceError(DeviceCause::kNoAnswer, settings_.interface + ": " + name_of(*late) +
                                                " does not become operational, it is " +
                                                to_string(late->nmt));
}

}  // namespace corbot::rt
