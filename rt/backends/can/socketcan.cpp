// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/can/socketcan.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rt/backends/can/can_load.h"
#include "rt/backends/can/cia402_setup.h"

namespace corbot::rt {
namespace {

using namespace std::chrono_literals;

constexpr int kHeartbeatsMissed = 3;
constexpr int kSetUps = 3;
constexpr DriveBus::Clock::duration kStartWithin = 2s;
/// A drive that sends no process data so long has them reported as missing.
constexpr auto kStale = 50ms;
constexpr int kStalePeriods = 5;
/// So many times as long, and it is lost, though its heartbeat goes on: its statusword is old as well.
constexpr int kLostAfterStale = 20;
/// So far the shaft of a drive that restarts may sag; more, and its count has begun anew.
constexpr double kSag_rad = 0.05;
constexpr double kSagOfGripper = 0.05;

std::vector<std::uint8_t> nodes_of(const Cia402Settings& settings) {
  std::vector<std::uint8_t> nodes;
  for (const JointDrive& joint : settings.joints) nodes.push_back(joint.node);
  if (settings.gripper) nodes.push_back(settings.gripper->node);
  return nodes;
}

std::vector<double> most_sag(const Cia402Settings& settings) {
  std::vector<double> counts;
  for (const JointDrive& joint : settings.joints) counts.push_back(kSag_rad * joint.counts_per_rad);
  if (settings.gripper) {
    counts.push_back(kSagOfGripper * std::abs(settings.gripper->open_count - settings.gripper->closed_count));
  }
  return counts;
}

std::string describe_rate(std::int64_t bits_per_s) {
  return std::to_string((bits_per_s + 999) / 1000) + " kbit/s";
}

}  // namespace

Cia402Drives::Cia402Drives(Cia402Settings settings)
    : settings_(std::move(settings)),
      bus_(settings_.interface, nodes_of(settings_), settings_.heartbeat_ms, settings_.loop_ns),
      enabling_(bus_, most_sag(settings_)) {}

DriveBus::Clock::duration Cia402Drives::heartbeat_limit() const {
  return kHeartbeatsMissed * std::chrono::milliseconds(settings_.heartbeat_ms);
}

DriveBus::Clock::duration Cia402Drives::stale_limit() const {
  return std::max<Clock::duration>(kStale, kStalePeriods * bus_.period());
}

void Cia402Drives::examine() {
  try {
    for (const DriveReport& drive : bus_.drives()) {
      if (drive.emergency != 0 || state_of(drive.process.statusword) != DriveState::kFault) continue;
      CanFrame emergency{};  // as the drive would have sent it
      const std::uint16_t code = read_error_code(bus_.port(), bus_.watch(), drive.node);
      emergency.can_id = kEmergency + drive.node;
      emergency.can_dlc = CAN_MAX_DLEN;
      emergency.data[0] = static_cast<std::uint8_t>(code);
      emergency.data[1] = static_cast<std::uint8_t>(code >> 8);
      bus_.watch().take(emergency, Clock::now());
    }
    bus_.watch().check(Clock::now(), heartbeat_limit(), kLostAfterStale * stale_limit());
  } catch (const DeviceError& error) {
    throw DeviceError(error.cause(), settings_.interface + ": " + error.what());
  }
  enabling_.note_positions();
}

std::string Cia402Drives::choose_period() {
  const std::size_t drives = bus_.drives().size();
  const std::uint32_t bit_rate =
      settings_.bit_rate != 0 ? settings_.bit_rate : bit_rate_of(settings_.interface).value_or(0);
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

std::string Cia402Drives::open() {
  bus_.open();
  enabling_.note_restarts();
  bus_.watch().clear(Clock::now());
  last_targets_.clear();
  exchange_succeeded_ = false;
  const std::string rate = choose_period();
  std::string nodes = set_up();
  // A drive that restarts meanwhile, as after all have just been switched on, has forgotten its set-up.
  for (int left = kSetUps - 1; const DriveReport* drive = restarted(); --left) {
    if (left == 0) {
      throw DeviceError(DeviceCause::kDeviceFault,
                        settings_.interface + ": " + name_of(*drive) + " has restarted while it was set up");
    }
    nodes = set_up();
  }
  start();
  last_targets_ = enabling_.enable();
  exchange_succeeded_ = true;
  return "CiA 402 drives on " + settings_.interface + ": nodes " + nodes + "; " + rate;
}

const DriveReport* Cia402Drives::restarted() const {
  const auto& drives = bus_.drives();
  const auto found = std::find_if(drives.begin(), drives.end(),
                                  [](const DriveReport& drive) { return drive.has_restarted; });
  return found == drives.end() ? nullptr : &*found;
}

std::string Cia402Drives::set_up() {
  bus_.command(NmtCommand::kPreOperational);  // their PDOs are quiet while they are set up
  watch_masters(0);                           // and no heartbeat is sent
  std::string nodes;
  std::string last_name;
  for (std::size_t i = 0; i < bus_.drives().size(); ++i) {
    const DriveReport& drive = bus_.drives()[i];
    enabling_.note_restarts();
    bus_.watch().settle_restart(i);
    const auto [name, was_set_up] =
        set_up_drive(bus_.port(), bus_.watch(), {drive.node, bus_.period_ns(), settings_.heartbeat_ms});
    if (!was_set_up) enabling_.note_restart(i);
    // A row of the same drives is named once, at its end.
    if (!nodes.empty()) nodes += (name == last_name || last_name.empty() ? ", " : " (" + last_name + "), ");
    nodes += std::to_string(drive.node);
    last_name = name;
  }
  if (!last_name.empty()) nodes += " (" + last_name + ")";
  watch_masters(settings_.watch_ms);  // which begins with the first heartbeat
  return nodes;
}

void Cia402Drives::watch_masters(int watch_ms) {
  if (settings_.watch_ms == 0) return;
  for (const DriveReport& drive : bus_.drives())
    watch_master(bus_.port(), bus_.watch(), drive.node, watch_ms);
}

void Cia402Drives::beat() {
  const auto now = Clock::now();
  if (settings_.watch_ms == 0 || now - last_beat_ + bus_.period() / 2 < beat_period()) return;
  bus_.port().write(master_heartbeat_frame(), now + DriveBus::kSendWithin);
  last_beat_ = now;
}

void Cia402Drives::close() noexcept {
  // At a proper end they go on as they are; after a fault they react, unless it is fixed soon.
  if (exchange_succeeded_ && bus_.is_open()) {
    exchange_succeeded_ = false;
    try {
      watch_masters(0);
    } catch (const DeviceError&) {
      // Then they react.
    }
  }
  bus_.close();
}

void Cia402Drives::start() {
  bus_.command(NmtCommand::kStart);
  const auto is_operational = [](const DriveReport& drive) { return drive.nmt == NmtState::kOperational; };
  const auto& drives = bus_.drives();
  // Its heartbeat shows that it has become operational.
  const Clock::duration two_heartbeats = 2 * std::chrono::milliseconds(settings_.heartbeat_ms);
  bus_.listen(Clock::now() + std::max(kStartWithin, two_heartbeats),
              [&] { return std::all_of(drives.begin(), drives.end(), is_operational); });
  bus_.watch().check_bus();
  const auto late = std::find_if_not(drives.begin(), drives.end(), is_operational);
  if (late == drives.end()) return;
  throw DeviceError(DeviceCause::kNoAnswer, settings_.interface + ": " + name_of(*late) +
                                                " does not become operational, it is " +
                                                to_string(late->nmt));
}

std::vector<std::int32_t> Cia402Drives::targets(const ServoFrame& frame) const {
  const auto last = [&](std::size_t i) { return i < last_targets_.size() ? last_targets_[i] : 0; };
  std::vector<std::int32_t> counts;
  for (const JointDrive& joint : settings_.joints) {
    const std::size_t i = counts.size();
    counts.push_back(to_counts(
        joint.zero_count + joint.direction * joint.counts_per_rad * frame.position_rad[i], last(i)));
  }
  if (settings_.gripper) {
    const GripperModel& model = settings_.gripper_model;
    const std::size_t i = counts.size();
    const double opening = (frame.pulse_us[i] - model.closed_us) / (model.open_us - model.closed_us);
    const double travel = settings_.gripper->open_count - settings_.gripper->closed_count;
    counts.push_back(to_counts(settings_.gripper->closed_count + travel * opening, last(i)));
  }
  return counts;
}

BusReading Cia402Drives::reading_of(const std::vector<std::int32_t>& positions) const {
  BusReading reading{BusReading::Unit::kJoints, {}, {}};
  for (std::size_t i = 0; i < std::min(settings_.joints.size(), positions.size()); ++i) {
    const JointDrive& joint = settings_.joints[i];
    reading.value[i] = (positions[i] - joint.zero_count) / (joint.direction * joint.counts_per_rad);
  }
  if (settings_.gripper && positions.size() > settings_.joints.size()) {
    const GripperModel& model = settings_.gripper_model;
    const double travel = settings_.gripper->open_count - settings_.gripper->closed_count;
    const double opening = (positions[settings_.joints.size()] - settings_.gripper->closed_count) / travel;
    reading.gripper_us = model.closed_us + (model.open_us - model.closed_us) * opening;
  }
  return reading;
}

void Cia402Drives::send(const ServoFrame& frame, bool) {
  exchange_succeeded_ = false;
  bus_.listen(Clock::now(), [] { return false; });
  examine();
  last_targets_ = targets(frame);
  beat();
  bus_.synchronise(std::vector<std::uint16_t>(last_targets_.size(), kEnableOperation), last_targets_);
  exchange_succeeded_ = true;
}

BusReading Cia402Drives::measure(const ServoFrame&) {
  exchange_succeeded_ = false;
  // Drives that get a SYNC between two cycles answer as well.
  if (!bus_.is_synchronised()) bus_.request_answers(Clock::now() + DriveBus::kSendWithin);
  bus_.await_answers(Clock::now() + bus_.period() / 2);
  bus_.settle_synchronisation();
  examine();
  exchange_succeeded_ = true;
  const auto now = Clock::now();
  std::vector<std::int32_t> positions;
  for (const DriveReport& drive : bus_.drives()) {
    if (now - drive.process_time > stale_limit()) return {};
    positions.push_back(drive.process.position);
  }
  return reading_of(positions);
}

std::optional<DeviceError> Cia402Drives::warning() {
  auto warning = bus_.watch().warning(Clock::now(), stale_limit());
  if (!warning) return warning;
  return DeviceError(warning->cause(), settings_.interface + ": " + warning->what());
}

void Cia402Drives::relax() {
  const std::size_t count = bus_.drives().size();
  if (last_targets_.size() != count) return;
  bus_.synchronise(std::vector<std::uint16_t>(count, kDisableVoltage), last_targets_);
  bus_.await_answers(Clock::now() + std::max<Clock::duration>(DriveBus::kSendWithin, bus_.period()));
  bus_.command(NmtCommand::kPreOperational);
}

}  // namespace corbot::rt
