// SPDX-License-Identifier: Apache-2.0
#include "sim/devices/cia402_node.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace corbot::sim {
namespace {

constexpr canid_t kSyncId = 0x080;
constexpr canid_t kEmergencyId = 0x080;
constexpr canid_t kHeartbeatId = 0x700;
constexpr std::uint16_t kNoHeartbeat = 0x8130;

constexpr std::int64_t kHighest32 = std::numeric_limits<std::int32_t>::max();
constexpr std::int64_t kLowest32 = std::numeric_limits<std::int32_t>::min();

CanObject constant(unsigned bytes, std::int64_t value) { return {.bytes = bytes, .value = value}; }
CanObject text(std::string value) { return {.bytes = 0, .text = std::move(value)}; }
CanObject writable(unsigned bytes, std::int64_t value, std::int64_t lowest, std::int64_t highest) {
  return {.bytes = bytes,
          .is_signed = lowest < 0,
          .access = Access::kReadWrite,
          .value = value,
          .lowest = lowest,
          .highest = highest};
}
CanObject input(CanObject object) {
  object.goes_into_rpdo = true;
  return object;
}
CanObject output(unsigned bytes, bool is_signed) {
  return {.bytes = bytes, .is_signed = is_signed, .goes_into_tpdo = true};
}

bool is_warning(std::uint16_t code) {
  const auto group = static_cast<unsigned>(code >> 8);
  return group == 0x81 || group == 0x82 || group == 0xFF;
}

}  // namespace

Cia402Node::Cia402Node(std::uint8_t node, const Cia402DriveOptions& options)
    : node_(node), drive_(options), sdo_server_(node) {
  add_objects();
}

void Cia402Node::add_communication_objects() {
  objects_.add(0x100000, constant(4, 0x0002'0192));  // a servo drive, profile 402
  objects_.add(0x100100, output(1, false));
  objects_.add(0x100500, writable(4, kSyncId, 0, 0x7FF));
  objects_.add(0x100600, writable(4, 0, 0, 0xFFFF'FFFF));
  objects_.add(0x100800, text("corbot emulated drive"));
  objects_.add(0x100900, text("1"));
  objects_.add(0x100A00, text("1.0"));
  objects_.add(0x101400, constant(4, kEmergencyId + node_));
  objects_.add(0x101600, constant(1, 1));
  objects_.add(0x101601, writable(4, 0, 0, 0xFFFF'FFFF));
  objects_.add(0x101700, writable(2, 0, 0, 0xFFFF));
  objects_.add(0x101800, constant(1, 4));
  for (ObjectKey sub = 1; sub <= 4; ++sub) objects_.add(0x101800 + sub, constant(4, sub == 4 ? node_ : 0));
  for (std::size_t number = 0; number < ProcessData::kPdos; ++number) add_pdo(number);
}

void Cia402Node::add_objects() {
  add_communication_objects();
  objects_.add(0x600700, writable(2, 1, 0, 3));
  objects_.add(0x603F00, output(2, false));
  objects_.add(0x604000, input(writable(2, 0, 0, 0xFFFF)));
  objects_.add(0x604100, output(2, false));
  objects_.add(0x605A00, writable(2, 2, -1, 6));
  objects_.add(0x606000, input(writable(1, 0, -1, 10)));
  objects_.add(0x606100, output(1, true));
  objects_.add(0x606200, output(4, true));
  objects_.add(0x606400, output(4, true));
  objects_.add(0x606500, writable(4, 20'000, 0, 0xFFFF'FFFF));
  objects_.add(0x606600, writable(2, 50, 0, 0xFFFF));
  objects_.add(0x607A00, input(writable(4, 0, kLowest32, kHighest32)));
  objects_.add(0x607D00, constant(1, 2));
  objects_.add(0x607D01, writable(4, kLowest32, kLowest32, kHighest32));
  objects_.add(0x607D02, writable(4, kHighest32, kLowest32, kHighest32));
  objects_.add(0x608500, writable(4, 5'000'000, 1, 0xFFFF'FFFF));
  objects_.add(0x60C200, constant(1, 2));
  objects_.add(0x60C201, writable(1, 1, 1, 255));
  objects_.add(0x60C202, writable(1, -3, -6, 0));
  objects_.add(0x60F400, output(4, true));
  objects_.add(0x650200, constant(4, 1 << 7));
}

void Cia402Node::add_pdo(std::size_t number) {
  const auto n = static_cast<ObjectKey>(number);
  const std::int64_t off = number == 0 ? 0 : std::int64_t{1} << 31;
  // From the factory the first carries the word alone, as CiA 402 has it; the others are off.
  for (const bool is_received : {true, false}) {
    const ObjectKey parameters = (is_received ? 0x1400u : 0x1800u) + n;
    const ObjectKey mapping = (is_received ? 0x1600u : 0x1A00u) + n;
    const std::int64_t id = (is_received ? 0x200 : 0x180) + 0x100 * static_cast<std::int64_t>(n) + node_;
    objects_.add(parameters << 8, constant(1, 2));
    objects_.add(parameters << 8 | 1, writable(4, off | id, 0, 0xFFFF'FFFF));
    objects_.add(parameters << 8 | 2, writable(1, 255, 0, 255));
    objects_.add(mapping << 8, writable(1, number == 0 ? 1 : 0, 0, ProcessData::kMostEntries));
    for (ObjectKey sub = 1; sub <= ProcessData::kMostEntries; ++sub) {
      const bool is_first = number == 0 && sub == 1;
      objects_.add(mapping << 8 | sub, writable(4,
                                                !is_first     ? 0
                                                : is_received ? 0x6040'0010
                                                              : 0x6041'0010,
                                                0, 0xFFFF'FFFF));
    }
  }
}

void Cia402Node::boot(bool counts_from_0) {
  objects_ = CanObjects();
  add_objects();
  drive_.power_cycle(counts_from_0);
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
      add_communication_objects();
      begin_communication();
      break;
    default:
      break;
  }
  process_data_.drop_received();
}

void Cia402Node::apply(ObjectKey key, std::int64_t value) {
  objects_.set(key, value);
  switch (key >> 8) {
    case 0x1016:
      master_ns_.reset();
      break;
    case 0x1017:
      heartbeat_ns_ = now_ns_ + value * 1'000'000;
      break;
    case 0x6040:
      drive_.control(static_cast<std::uint16_t>(value));
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
    case 0x607D:
      drive_.set_limits(static_cast<std::int32_t>(objects_.value(0x607D01)),
                        static_cast<std::int32_t>(objects_.value(0x607D02)));
      break;
    case 0x6085:
      drive_.set_quick_stop_ramp(static_cast<double>(value));
      break;
    case 0x60C2:
      drive_.set_interpolation_s(static_cast<double>(objects_.value(0x60C201)) *
                                 std::pow(10.0, static_cast<double>(objects_.value(0x60C202))));
      break;
    default:
      break;
  }
  report_new_fault();
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
