// SPDX-License-Identifier: Apache-2.0
// The process data of an emulated drive: CiA 301, 7.2.2.
#include <algorithm>

#include "sim/devices/cia402_node.h"

namespace corbot::sim {
namespace {

constexpr std::uint16_t kWrongLength = 0x8210;
constexpr std::int64_t kPdoOff = std::int64_t{1} << 31;
constexpr std::int64_t kLastSynchronous = 240;

ObjectKey key_of(unsigned base, std::size_t number, unsigned sub) {
  return (base + static_cast<ObjectKey>(number)) << 8 | sub;
}

}  // namespace

void Cia402Node::synchronise() {
  for (std::size_t number = 0; number < kPdos; ++number) {
    if (received_[number]) apply_rpdo(number);
  }
  refresh();
  for (std::size_t number = 0; number < kPdos; ++number) {
    const std::int64_t type = objects_.value(key_of(0x1800, number, 2));
    if ((objects_.value(key_of(0x1800, number, 1)) & kPdoOff) != 0 || type > kLastSynchronous) continue;
    const bool is_due =
        type == 0 ? tpdo_data(number) != last_sent_[number] : ++syncs_[number] >= static_cast<unsigned>(type);
    if (is_due) send_tpdo(number);
  }
}

void Cia402Node::take_rpdo(std::size_t number, const can_frame& frame) {
  received_[number] = frame;
  if (objects_.value(key_of(0x1400, number, 2)) > kLastSynchronous) apply_rpdo(number);
}

void Cia402Node::apply_rpdo(std::size_t number) {
  const can_frame frame = *received_[number];
  received_[number].reset();
  const auto entries = static_cast<unsigned>(objects_.value(key_of(0x1600, number, 0)));
  std::size_t needed = 0;
  for (unsigned i = 1; i <= entries; ++i) {
    needed += static_cast<std::size_t>(objects_.value(key_of(0x1600, number, i)) & 0xFF) / 8;
  }
  if (frame.can_dlc < needed) return send_emergency(kWrongLength);
  // The target before the word that may let the drive go there, whatever their order.
  std::size_t offset = 0;
  std::vector<std::pair<ObjectKey, std::uint32_t>> values;
  for (unsigned i = 1; i <= entries; ++i) {
    const auto entry = static_cast<std::uint32_t>(objects_.value(key_of(0x1600, number, i)));
    const std::size_t bytes = (entry & 0xFF) / 8;
    std::uint32_t raw = 0;
    for (std::size_t b = 0; b < bytes; ++b)
      raw |= static_cast<std::uint32_t>(frame.data[offset + b]) << (8 * b);
    offset += bytes;
    values.emplace_back(entry >> 8, raw);
  }
  std::stable_sort(values.begin(), values.end(),
                   [](const auto& a, const auto& b) { return a.first != 0x604000 && b.first == 0x604000; });
  for (const auto& [key, raw] : values) {
    if (objects_.check_write(key, raw, 0) == 0) apply(key, objects_.number(key, raw));
  }
}

std::vector<std::uint8_t> Cia402Node::tpdo_data(std::size_t number) const {
  std::vector<std::uint8_t> data;
  const auto entries = static_cast<unsigned>(objects_.value(key_of(0x1A00, number, 0)));
  for (unsigned i = 1; i <= entries; ++i) {
    const auto entry = static_cast<std::uint32_t>(objects_.value(key_of(0x1A00, number, i)));
    const auto value = static_cast<std::uint64_t>(objects_.value(entry >> 8));
    for (unsigned b = 0; b < (entry & 0xFF) / 8; ++b)
      data.push_back(static_cast<std::uint8_t>(value >> (8 * b)));
  }
  return data;
}

void Cia402Node::send_tpdo(std::size_t number) {
  refresh();
  last_sent_[number] = tpdo_data(number);
  syncs_[number] = 0;
  send(static_cast<canid_t>(objects_.value(key_of(0x1800, number, 1)) & CAN_SFF_MASK), last_sent_[number]);
}

void Cia402Node::send_changed_tpdos() {
  if (nmt_ != Nmt::kOperational) return;
  refresh();
  for (std::size_t number = 0; number < kPdos; ++number) {
    if ((objects_.value(key_of(0x1800, number, 1)) & kPdoOff) != 0) continue;
    if (objects_.value(key_of(0x1800, number, 2)) <= kLastSynchronous) continue;
    if (tpdo_data(number) != last_sent_[number]) send_tpdo(number);
  }
}

}  // namespace corbot::sim
