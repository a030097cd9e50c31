// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/can/socketcan.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "corbot/arm/joint_units.h"
#include "rt/backends/can/cia402_setup.h"

namespace corbot::rt {
namespace {

using namespace std::chrono_literals;

/// The age at which missing process data of a drive are reported.
constexpr auto kStale = 50ms;
constexpr int kStalePeriods = 5;
/// After this multiple of that age a drive is lost, even if its heartbeat goes on: its statusword is old as
/// well.
constexpr int kLostAfterStale = 20;

}  // namespace

Cia402Drives::Cia402Drives(Cia402Settings settings)
    : settings_(std::move(settings)),
      bus_(settings_.interface, nodes_of(settings_), settings_.heartbeat_ms, settings_.loop_ns),
      enabling_(bus_, settings_),
      preparation_(settings_, bus_, enabling_),
      frame_age_(std::chrono::nanoseconds(settings_.stale_ns)) {
  for (std::size_t i = 0; i < settings_.joints.size(); ++i) {
    if (!settings_.joints[i].reports_following) bus_.watch().expect_no_follow_bit(i);
  }
  if (!settings_.gripper) return;
  const std::size_t gripper = settings_.joints.size();
  if (!settings_.gripper->reports_following) bus_.watch().expect_no_follow_bit(gripper);
  bus_.watch().expect_limit(gripper);
  grip_limit_.emplace(settings_.gripper->open_count - settings_.gripper->closed_count,
                      settings_.gripper_model.travel_s);
}

DriveBus::Clock::duration Cia402Drives::heartbeat_limit() const {
  return kHeartbeatsMissed * std::chrono::milliseconds(settings_.heartbeat_ms);
}

DriveBus::Clock::duration Cia402Drives::stale_limit() const {
  return std::max<Clock::duration>(kStale, kStalePeriods * bus_.period());
}

void Cia402Drives::examine() {
  try {
    for (const DriveReport& drive : bus_.drives()) {
      if (!is_energised_ || drive.emergency != 0 || state_of(drive.process.statusword) != DriveState::kFault)
        continue;
      CanFrame emergency{};  // as the drive would have sent it
      const std::uint16_t code = read_error_code(bus_.port(), bus_.watch(), drive.node);
      emergency.can_id = kEmergency + drive.node;
      emergency.can_dlc = CAN_MAX_DLEN;
      emergency.data[0] = static_cast<std::uint8_t>(code);
      emergency.data[1] = static_cast<std::uint8_t>(code >> 8);
      bus_.watch().take(emergency, Clock::now());
    }
    bus_.watch().check(Clock::now(), heartbeat_limit(), kLostAfterStale * stale_limit(), is_energised_);
  } catch (const DeviceError& error) {
    throw DeviceError(error.cause(), settings_.interface + ": " + error.what());
  }
  if (is_energised_) enabling_.note_positions();
}

std::string Cia402Drives::open() {
  bus_.open();
  enabling_.note_restarts();
  bus_.watch().clear(Clock::now());
  last_targets_.clear();
  exchange_succeeded_ = is_energised_ = false;
  const std::string rate = preparation_.choose_period();
  const std::string nodes = preparation_.set_up(true);
  if (grip_limit_) grip_limit_->set_following_window(preparation_.gripper_window());
  preparation_.start();
  exchange_succeeded_ = true;
  return "CiA 402 drives on " + settings_.interface + ": nodes " + nodes + "; " + rate;
}

bool Cia402Drives::energise(const std::function<bool()>& is_stopped) {
  exchange_succeeded_ = false;
  if (frame_age_.is_stale()) fail_stale();
  const auto targets = enabling_.enable([&] {
    beat();  // enabling one after another takes longer than drives wait for the master
    return is_stopped();
  });
  exchange_succeeded_ = true;
  if (!targets) return false;
  last_targets_ = *targets;
  is_energised_ = true;
  return true;
}

bool Cia402Drives::de_energise() {
  exchange_succeeded_ = false;
  enabling_.disable_all();
  is_energised_ = false;
  exchange_succeeded_ = true;
  return true;
}

void Cia402Drives::beat() {
  const auto now = Clock::now();
  if (settings_.watch_ms == 0 || frame_age_.is_stale()) return;
  if (now - last_beat_ + bus_.period() / 2 < preparation_.beat_period()) return;
  bus_.port().write(master_heartbeat_frame(), now + DriveBus::kSendWithin);
  last_beat_ = now;
}

void Cia402Drives::close() noexcept {
  if (!exchange_succeeded_ || !bus_.is_open()) return close_after_fault();
  exchange_succeeded_ = false;
  try {
    preparation_.watch_masters(0);
  } catch (const DeviceError&) {
    // The drives react to the missing heartbeat then.
  }
  is_energised_ = false;
  bus_.close();
}

/// Drives that watch corbot's heartbeat react to its absence, unless it is back soon.
void Cia402Drives::close_after_fault() noexcept {
  exchange_succeeded_ = false;
  if (is_energised_ && bus_.is_open()) enabling_.quick_stop();
  is_energised_ = false;
  bus_.close();
}

std::vector<std::int32_t> Cia402Drives::targets(const ServoFrame& frame) const {
  const auto last = [&](std::size_t i) { return i < last_targets_.size() ? last_targets_[i] : 0; };
  std::vector<std::int32_t> counts;
  for (const JointDrive& joint : settings_.joints) {
    const std::size_t i = counts.size();
    counts.push_back(
        to_counts(joint.zero_count + joint.direction * joint.counts_per_q * frame.position_q[i], last(i)));
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
    reading.value[i] = (positions[i] - joint.zero_count) / (joint.direction * joint.counts_per_q);
  }
  if (settings_.gripper && positions.size() > settings_.joints.size()) {
    const GripperModel& model = settings_.gripper_model;
    const double travel = settings_.gripper->open_count - settings_.gripper->closed_count;
    const double opening = (positions[settings_.joints.size()] - settings_.gripper->closed_count) / travel;
    reading.gripper_us = model.closed_us + (model.open_us - model.closed_us) * opening;
  }
  return reading;
}

void Cia402Drives::fail_stale() const {
  const auto limit = std::chrono::duration_cast<std::chrono::milliseconds>(frame_age_.limit());
  throw DeviceError(DeviceCause::kNoSetpoint, settings_.interface + ": no set-point for " +
                                                  std::to_string(limit.count()) +
                                                  " ms: the drives are stopped (quick stop)");
}

void Cia402Drives::check_age(const ServoFrame& frame) {
  frame_age_.see(frame, Clock::now());
  if (is_energised_ && frame_age_.is_stale()) fail_stale();
}

void Cia402Drives::limit_grip(std::vector<std::int32_t>& targets) const {
  const DriveReport& drive = bus_.drives().back();
  if (!grip_limit_ || !drive.has_process || last_targets_.size() != targets.size()) return;
  targets.back() = grip_limit_->target(targets.back(), drive.process.position, last_targets_.back(),
                                       static_cast<double>(bus_.period_ns()) * 1e-9);
}

bool Cia402Drives::send(const ServoFrame& frame, bool) {
  exchange_succeeded_ = false;
  check_age(frame);
  bus_.listen(Clock::now(), [] { return false; });
  examine();
  std::vector<std::int32_t> next = targets(frame);
  limit_grip(next);
  last_targets_ = std::move(next);
  beat();
  bus_.synchronise(std::vector<std::uint16_t>(last_targets_.size(), kEnableOperation), last_targets_);
  exchange_succeeded_ = true;
  return true;
}

BusReading Cia402Drives::measure(const ServoFrame& frame) {
  exchange_succeeded_ = false;
  check_age(frame);
  beat();
  // Drives that get a SYNC between two cycles answer as well.
  if (!bus_.is_synchronised()) bus_.request_answers(Clock::now() + DriveBus::kSendWithin);
  bus_.await_answers(Clock::now() + bus_.period() / 2);
  bus_.settle_synchronisation();
  examine();
  exchange_succeeded_ = true;
  const auto now = Clock::now();
  std::vector<std::int32_t> positions;
  for (const DriveReport& drive : bus_.drives()) {
    if (!drive.has_process || now - drive.process_time > stale_limit()) return {};
    positions.push_back(drive.process.position);
  }
  return reading_of(positions);
}

std::optional<BusReading> Cia402Drives::held() const {
  if (!is_energised_ || last_targets_.empty()) return std::nullopt;
  return reading_of(last_targets_);
}

std::optional<DeviceError> Cia402Drives::warning() {
  auto warning = bus_.watch().warning(Clock::now(), stale_limit());
  if (!warning) return warning;
  return DeviceError(warning->cause(), settings_.interface + ": " + warning->what());
}

void Cia402Drives::relax() {
  enabling_.disable_all();
  is_energised_ = false;
  bus_.command(NmtCommand::kPreOperational);
}

}  // namespace corbot::rt
