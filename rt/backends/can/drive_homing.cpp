// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/can/drive_homing.h"

#include <algorithm>
#include <utility>

#include "corbot/running_time.h"
#include "rt/backends/can/cia402_setup.h"
#include "rt/backends/can/drive_objects.h"

namespace corbot::rt {
namespace {

using namespace std::chrono_literals;

constexpr ObjectAddress kHomeOffset{0x607C};
constexpr ObjectAddress kHomingMethod{0x6098};
constexpr ObjectAddress kSearchSpeed{0x6099, 1};
constexpr ObjectAddress kCreepSpeed{0x6099, 2};
constexpr ObjectAddress kHomingAcceleration{0x609A};

constexpr DriveBus::Clock::duration kProcessWithin = 1s;
/// A controlword stands this long before its statusword counts.
constexpr auto kHomingStep = 20ms;
constexpr auto kHaltWithin = 2s;
/// The longest way at the slowest speed; a person stands by and may end it sooner.
constexpr auto kHomeWithin = std::chrono::minutes(10);

Cia402Settings without_watch(Cia402Settings settings) {
  settings.watch_ms = 0;  // no set-points, for which a heartbeat would stand, are sent here
  return settings;
}

}  // namespace

DriveHoming::DriveHoming(const Cia402Settings& settings)
    : settings_(without_watch(settings)),
      bus_(settings_.interface, nodes_of(settings_), settings_.heartbeat_ms, settings_.loop_ns),
      enabling_(bus_, settings_),
      preparation_(settings_, bus_, enabling_) {
  for (std::size_t i = 0; i < bus_.drives().size(); ++i) bus_.watch().expect_no_follow_bit(i);
}

void DriveHoming::fail(std::size_t joint, const std::string& what) const {
  throw DeviceError(DeviceCause::kDeviceFault,
                    settings_.interface + ": " + name_of(bus_.drives().at(joint)) + " " + what);
}

std::string DriveHoming::open() {
  bus_.open();
  bus_.watch().clear(Clock::now());
  (void)preparation_.choose_period();
  std::string nodes = preparation_.set_up(false);
  for (std::size_t i = 0; i < settings_.joints.size(); ++i) {
    const auto& homing = settings_.joints[i].homing;
    if (!homing) continue;
    DriveObjects objects(bus_.port(), bus_.watch(), settings_.joints[i].node);
    objects.ensure(kHomingMethod, static_cast<std::uint8_t>(homing->method), 1);
    objects.ensure(kSearchSpeed, homing->search_counts_per_s, 4);
    objects.ensure(kCreepSpeed, homing->creep_counts_per_s, 4);
    if (homing->counts_per_s2) objects.ensure(kHomingAcceleration, *homing->counts_per_s2, 4);
    objects.ensure(kHomeOffset, static_cast<std::uint32_t>(homing->offset), 4);
  }
  preparation_.start();
  return nodes;
}

bool DriveHoming::energise(const std::function<bool()>& is_stopped) {
  const auto targets = enabling_.enable(is_stopped);
  if (!targets) return false;
  targets_ = *targets;
  is_energised_ = true;
  due_ = Clock::now();
  return true;
}

double DriveHoming::position_q(std::size_t joint) const {
  const JointDrive& drive = settings_.joints.at(joint);
  return (count(joint) - drive.zero_count) / (drive.direction * drive.counts_per_q);
}

void DriveHoming::exchange(std::size_t joint, std::uint16_t word) {
  std::vector<std::uint16_t> words(targets_.size(), kEnableOperation);
  words.at(joint) = word;
  bus_.synchronise(words, targets_);
  due_ = std::max(due_ + bus_.period(), Clock::now());
  bus_.listen(due_, [] { return false; });
  bus_.settle_synchronisation();
  bus_.watch().check(Clock::now(), kHeartbeatsMissed * std::chrono::milliseconds(settings_.heartbeat_ms),
                     kProcessWithin);
  targets_[joint] = count(joint);  // so that nothing jumps when it follows targets again
}

void DriveHoming::exchange_for(std::size_t joint, std::uint16_t word, Clock::duration time) {
  RunningTime waited(2 * bus_.period(), Clock::now());
  do {
    exchange(joint, word);
  } while (waited.look(Clock::now()) < time);
}

void DriveHoming::set_mode(std::size_t joint, std::uint8_t mode) {
  DriveObjects(bus_.port(), bus_.watch(), bus_.drives().at(joint).node).set_mode(mode);
  due_ = Clock::now();
}

void DriveHoming::halt(std::size_t joint) {
  RunningTime waited(2 * bus_.period(), Clock::now());
  exchange_for(joint, kStartHoming | kHalt, kHomingStep);
  while ((bus_.drives()[joint].process.statusword & kStatusReached) == 0) {
    if (waited.look(Clock::now()) > kHaltWithin) fail(joint, "is not halted (statusword bit 10)");
    exchange(joint, kStartHoming | kHalt);
  }
}

bool DriveHoming::home(std::size_t joint, const std::function<bool()>& goes_on) {
  if (!goes_on()) return false;
  set_mode(joint, kHoming);
  exchange_for(joint, kEnableOperation, kHomingStep);
  RunningTime waited(2 * bus_.period(), Clock::now());
  bool has_begun = false;
  bool has_failed = false;
  bool is_homed = false;
  while (!is_homed && !has_failed && goes_on()) {
    exchange(joint, kStartHoming);
    has_begun = true;
    const auto passed = waited.look(Clock::now());
    if (passed < kHomingStep) continue;
    const std::uint16_t word = bus_.drives()[joint].process.statusword;
    has_failed = (word & kStatusHomingError) != 0 || passed > kHomeWithin;
    is_homed = !has_failed && (word & kStatusAttained) != 0 && (word & kStatusReached) != 0;
  }
  if (has_begun && !is_homed) halt(joint);
  exchange_for(joint, kEnableOperation, kHomingStep);
  set_mode(joint, kCyclicSynchronousPosition);
  exchange_for(joint, kEnableOperation, kHomingStep);
  if (has_failed) {
    fail(joint,
         "has not found its home position (statusword bit 13): look at its switches, and at homing_method");
  }
  return is_homed;
}

void DriveHoming::relax() {
  enabling_.disable_all();
  bus_.close();
}

void DriveHoming::stop() noexcept {
  if (is_energised_ && bus_.is_open()) enabling_.quick_stop();
  bus_.close();
}

}  // namespace corbot::rt
