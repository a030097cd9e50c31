// SPDX-License-Identifier: Apache-2.0
#include "sim/devices/cia402_node.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "sim/devices/cia402_objects.h"

namespace corbot::sim {
namespace {

constexpr canid_t kEmergencyId = 0x080;
constexpr canid_t kHeartbeatId = 0x700;
constexpr std::uint16_t kNoHeartbeat = 0x8130;

constexpr std::int64_t kHighest32 = std::numeric_limits<std::int32_t>::max();
constexpr std::int64_t kLowest32 = std::numeric_limits<std::int32_t>::min();
constexpr std::int64_t kPdoOff = std::int64_t{1} << 31;

bool is_warning(std::uint16_t code) {
  const auto group = static_cast<unsigned>(code >> 8);
  return group == 0x81 || group == 0x82 || group == 0xFF;
}

}  // namespace

Cia402Node::Cia402Node(std::uint8_t node, const Cia402DriveOptions& options)
    : node_(node), drive_(options), sdo_server_(node) {
  add_drive_objects(objects_, node_);
}

void Cia402Node::boot(bool counts_from_0) {
  objects_ = CanObjects();
  add_drive_objects(objects_, node_);
  rules_.apply_to(objects_);
  drive_.power_cycle(counts_from_0 || is_incremental_);
  for (const ObjectKey index : {0x605Au, 0x6060u, 0x6065u, 0x607Cu, 0x607Du, 0x6085u, 0x6098u, 0x60C2u}) {
    hand_over(index);
  }
  reported_ = 0;
  begin_communication();
}

void Cia402Node::begin_communication() {
  nmt_ = Nmt::kPreOperational;
  heartbeat_ns_ = 0;
  master_ns_.reset();
  has_missed_master_ = false;
  sdo_server_.reset();
  process_data_ = {};
  send(kHeartbeatId + node_, {0});
}

void Cia402Node::send(canid_t id, std::vector<std::uint8_t> data) {
  can_frame frame{};
  frame.can_id = id;
  frame.can_dlc = static_cast<std::uint8_t>(std::min<std::size_t>(data.size(), CAN_MAX_DLEN));
  std::copy_n(data.begin(), frame.can_dlc, frame.data);
  sent_.push_back(frame);
}

std::vector<can_frame> Cia402Node::take_sent() { return std::exchange(sent_, {}); }

void Cia402Node::send_emergency(std::uint16_t code) {
  refresh();
  if (nmt_ == Nmt::kStopped) return;
  send(kEmergencyId + node_, {static_cast<std::uint8_t>(code), static_cast<std::uint8_t>(code >> 8),
                              static_cast<std::uint8_t>(objects_.value(0x100100)), 0, 0, 0, 0, 0});
}

void Cia402Node::report_new_fault() {
  const std::uint16_t code = drive_.error_code();
  if (code == reported_) return;
  reported_ = code;
  send_emergency(code);  // 0 after a reset
}

void Cia402Node::emergency(std::uint16_t code, std::int64_t now_ns) {
  advance(now_ns);
  if (code == 0 || is_warning(code)) {
    drive_.set_warning(code != 0);
    send_emergency(code);
    return;
  }
  drive_.fail(code);
  report_new_fault();
  send_changed_tpdos();
}

void Cia402Node::power_cycle(std::int64_t now_ns, bool counts_from_0) {
  now_ns_ = std::max(now_ns_, now_ns);
  boot(counts_from_0);
}

void Cia402Node::set_sto(bool is_on, std::int64_t now_ns) {
  advance(now_ns);
  drive_.set_sto(is_on);
  send_changed_tpdos();
}

void Cia402Node::set_blocked(bool is_on, std::int64_t now_ns) {
  advance(now_ns);
  drive_.set_blocked(is_on);
}

void Cia402Node::set_piece(std::optional<std::int32_t> count, std::int64_t now_ns) {
  advance(now_ns);
  drive_.set_piece(count);
}

void Cia402Node::set_ignoring(bool is_on, std::int64_t now_ns) {
  advance(now_ns);
  drive_.set_ignoring(is_on);
  send_changed_tpdos();
}

void Cia402Node::advance(std::int64_t now_ns) {
  now_ns_ = std::max(now_ns_, now_ns);
  if (nmt_ == Nmt::kBoot) boot();
  drive_.advance(now_ns_);
  watch_master();
  report_new_fault();
  send_changed_tpdos();
  const std::int64_t period_ns = objects_.value(0x101700) * 1'000'000;
  if (period_ns == 0 || now_ns_ < heartbeat_ns_) return;
  heartbeat_ns_ = std::max(heartbeat_ns_ + period_ns, now_ns_ + period_ns / 2);
  send(kHeartbeatId + node_, {static_cast<std::uint8_t>(nmt_)});
}

std::optional<std::int64_t> Cia402Node::next_event_ns() const {
  if (nmt_ == Nmt::kBoot) return now_ns_;
  const auto master_ns = master_due_ns();
  if (objects_.value(0x101700) == 0) return master_ns;
  return std::min(heartbeat_ns_, master_ns.value_or(heartbeat_ns_));
}

std::optional<std::int64_t> Cia402Node::master_due_ns() const {
  if (!master_ns_) return std::nullopt;
  return *master_ns_ + (objects_.value(0x101601) & 0xFFFF) * 1'000'000;
}

void Cia402Node::receive_master_heartbeat(const can_frame& frame) {
  const std::int64_t wanted = objects_.value(0x101601);
  if ((wanted & 0xFFFF) == 0 || frame.can_id != kHeartbeatId + (wanted >> 16 & 0x7F)) return;
  master_ns_ = now_ns_;
  if (std::exchange(has_missed_master_, false) && drive_.error_code() == 0) send_emergency(0);
}

void Cia402Node::watch_master() {
  const auto due_ns = master_due_ns();
  if (!due_ns || now_ns_ < *due_ns) return;
  master_ns_.reset();
  has_missed_master_ = true;
  const std::int64_t reaction = objects_.value(0x600700);
  if (reaction == 1) return drive_.fail(kNoHeartbeat);
  send_emergency(kNoHeartbeat);
  if (reaction == 2) drive_.control(0x00);
  if (reaction == 3) drive_.control(0x02);
}

void Cia402Node::receive(const can_frame& frame, std::int64_t now_ns) {
  if (frame.can_dlc > CAN_MAX_DLEN || (frame.can_id & (CAN_EFF_FLAG | CAN_RTR_FLAG | CAN_ERR_FLAG)) != 0)
    return;
  advance(now_ns);
  receive_master_heartbeat(frame);
  if (frame.can_id == 0) return command(frame);
  if (frame.can_id == 0x600u + node_ && nmt_ != Nmt::kStopped) {
    return sdo_server_.handle(frame, objects_, *this);
  }
  if (nmt_ != Nmt::kOperational) return;
  if (frame.can_id == static_cast<canid_t>(objects_.value(0x100500))) {
    return process_data_.synchronise(objects_, *this);
  }
  process_data_.receive(frame, objects_, *this);
}

void Cia402Node::send_changed_tpdos() {
  if (nmt_ == Nmt::kOperational) process_data_.send_changed(objects_, *this);
}

void Cia402Node::command(const can_frame& frame) {
  if (frame.can_dlc != 2 || (frame.data[1] != 0 && frame.data[1] != node_)) return;
  switch (frame.data[0]) {
    case 0x01:
      nmt_ = Nmt::kOperational;
      process_data_.start();
      send_changed_tpdos();
      break;
    case 0x02:
      nmt_ = Nmt::kStopped;
      break;
    case 0x80:
      nmt_ = Nmt::kPreOperational;
      break;
    case 0x81:
      boot();
      break;
    case 0x82:
      add_communication_objects(objects_, node_);
      rules_.apply_to(objects_);
      begin_communication();
      break;
    default:
      break;
  }
  process_data_.drop_received();
}

void Cia402Node::leave_operation(std::int64_t now_ns) {
  advance(now_ns);
  drive_.leave_operation();
  send_changed_tpdos();
}

bool Cia402Node::turn(double counts, std::int64_t now_ns) {
  advance(now_ns);
  if (!drive_.turn(counts)) return false;
  send_changed_tpdos();
  return true;
}

bool Cia402Node::store(ObjectKey key, std::uint32_t raw, std::int64_t now_ns) {
  advance(now_ns);
  const CanObject* object = objects_.find(key);
  if (object == nullptr || object->bytes == 0) return false;
  if (object->bytes < 4 && raw >> (8 * object->bytes) != 0) return false;
  rules_.set_value(key, objects_.number(key, raw));
  rules_.apply_to(objects_);
  hand_over(key >> 8);
  return true;
}

std::uint32_t Cia402Node::check_state(ObjectKey key) const {
  switch (rules_.when(key)) {
    case WriteWhen::kNever:
      return kAbortReadOnly;
    case WriteWhen::kPreOperational:
      return nmt_ == Nmt::kPreOperational ? 0 : kAbortState;
    case WriteWhen::kPdosOff:
      for (ObjectKey number = 0; number < ProcessData::kPdos; ++number) {
        for (const ObjectKey parameters : {0x1400u + number, 0x1800u + number}) {
          if ((objects_.value(parameters << 8 | 1) & kPdoOff) == 0) return kAbortState;
        }
      }
      return 0;
    case WriteWhen::kModeInactive:
      return drive_.mode() == 0 ? 0 : kAbortState;
    case WriteWhen::kDisabled:
      return drive_.state() == Cia402Drive::State::kOperationEnabled ? kAbortState : 0;
    default:
      return 0;
  }
}

void Cia402Node::apply(ObjectKey key, std::int64_t value) {
  objects_.set(key, value);
  if (key == 0x604000) {
    drive_.control(static_cast<std::uint16_t>(value));
  } else {
    hand_over(key >> 8);
  }
  report_new_fault();
}

void Cia402Node::hand_over(ObjectKey index) {
  const std::int64_t value = objects_.value(index << 8);
  switch (index) {
    case 0x1016:
      master_ns_.reset();
      break;
    case 0x1017:
      heartbeat_ns_ = now_ns_ + value * 1'000'000;
      break;
    case 0x605A:
      drive_.set_quick_stop_option(static_cast<int>(value));
      break;
    case 0x6060:
      drive_.set_mode(static_cast<int>(value));
      break;
    case 0x6065:
    case 0x6066:
      drive_.set_following(static_cast<double>(objects_.value(0x606500)),
                           static_cast<double>(objects_.value(0x606600)) * 1e-3);
      break;
    case 0x607A:
      drive_.set_target(static_cast<std::int32_t>(value));
      break;
    case 0x607C:
      drive_.set_home_offset(static_cast<std::int32_t>(value));
      break;
    case 0x607D:
      drive_.set_limits(static_cast<std::int32_t>(objects_.value(0x607D01)),
                        static_cast<std::int32_t>(objects_.value(0x607D02)));
      break;
    case 0x6085:
      drive_.set_quick_stop_ramp(static_cast<double>(value));
      break;
    case 0x6098:
    case 0x6099:
    case 0x609A:
      drive_.set_homing(
          {static_cast<int>(objects_.value(0x609800)), static_cast<double>(objects_.value(0x609901)),
           static_cast<double>(objects_.value(0x609902)), static_cast<double>(objects_.value(0x609A00))});
      break;
    case 0x60C2:
      drive_.set_interpolation_s(static_cast<double>(objects_.value(0x60C201)) *
                                 std::pow(10.0, static_cast<double>(objects_.value(0x60C202))));
      break;
    default:
      break;
  }
}

void Cia402Node::refresh() {
  objects_.set(0x100100, drive_.error_code() != 0 ? 1 : 0);
  objects_.set(0x603F00, drive_.error_code());
  objects_.set(0x604100, drive_.statusword());
  objects_.set(0x606100, drive_.mode());
  objects_.set(0x606200, drive_.demand());
  objects_.set(0x606400, drive_.position());
  const std::int64_t error = std::int64_t{drive_.demand()} - drive_.position();
  objects_.set(0x60F400, std::clamp(error, kLowest32, kHighest32));
}

}  // namespace corbot::sim
