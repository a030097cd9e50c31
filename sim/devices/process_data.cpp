// SPDX-License-Identifier: Apache-2.0
#include "sim/devices/process_data.h"

#include <algorithm>
#include <utility>

namespace corbot::sim {
namespace {

constexpr std::uint16_t kWrongLength = 0x8210;
constexpr std::int64_t kInvalidId = std::int64_t{1} << 31;
constexpr std::int64_t kExtended = std::int64_t{1} << 29;
constexpr std::int64_t kLastSynchronous = 240;
constexpr ObjectKey kControlword = 0x604000;

ObjectKey key_of(unsigned base, std::size_t number, unsigned sub) {
  return (base + static_cast<ObjectKey>(number)) << 8 | sub;
}

std::vector<std::uint8_t> tpdo_data(const CanObjects& objects, std::size_t number) {
  std::vector<std::uint8_t> data;
  const auto entries = static_cast<unsigned>(objects.value(key_of(0x1A00, number, 0)));
  for (unsigned i = 1; i <= entries; ++i) {
    const auto entry = static_cast<std::uint32_t>(objects.value(key_of(0x1A00, number, i)));
    const auto value = static_cast<std::uint64_t>(objects.value(entry >> 8));
    for (unsigned b = 0; b < (entry & 0xFF) / 8; ++b)
      data.push_back(static_cast<std::uint8_t>(value >> (8 * b)));
  }
  return data;
}

std::uint32_t check_mapping_count(const CanObjects& objects, ObjectKey mapping, bool is_received,
                                  std::int64_t count) {
  std::int64_t bits = 0;
  for (std::int64_t i = 1; i <= count; ++i) {
    const std::int64_t entry = objects.value(mapping | static_cast<ObjectKey>(i));
    const CanObject* object = objects.find(static_cast<ObjectKey>(entry >> 8));
    if (object == nullptr || !(is_received ? object->goes_into_rpdo : object->goes_into_tpdo)) {
      return kAbortNotMappable;
    }
    bits += entry & 0xFF;
  }
  return bits > 64 ? kAbortPdoLength : 0;
}

}  // namespace

std::uint32_t ProcessData::check_write(const CanObjects& objects, ObjectKey key, std::int64_t value) {
  const ObjectKey index = key >> 8;
  const ObjectKey sub = key & 0xFF;
  const ObjectKey block = index & ~ObjectKey{kPdos - 1};
  const bool is_parameters = block == 0x1400 || block == 0x1800;
  const bool is_mapping = block == 0x1600 || block == 0x1A00;
  if (!is_parameters && !is_mapping) return 0;
  const bool is_received = block < 0x1800;
  const ObjectKey parameters = is_mapping ? index - 0x200 : index;
  const std::int64_t id = objects.value(parameters << 8 | 1);
  const bool is_on = (id & kInvalidId) == 0;
  if (is_parameters && sub == 1) {
    const bool changes_id = (id & CAN_SFF_MASK) != (value & CAN_SFF_MASK);
    if ((value & kExtended) != 0) return kAbortRange;
    return is_on && (value & kInvalidId) == 0 && changes_id ? kAbortRange : 0;
  }
  if (is_parameters) return value > 240 && value < 254 ? kAbortRange : 0;
  if (is_on) return kAbortState;
  if (sub == 0) return check_mapping_count(objects, index << 8, is_received, value);
  if (objects.value(index << 8) != 0) return kAbortState;
  if (value == 0) return 0;
  const CanObject* object = objects.find(static_cast<ObjectKey>(value >> 8));
  if (object == nullptr) return kAbortNoObject;
  const bool is_mappable = is_received ? object->goes_into_rpdo : object->goes_into_tpdo;
  return is_mappable && (value & 0xFF) == 8 * std::int64_t{object->bytes} ? 0 : kAbortNotMappable;
}

void ProcessData::start() {
  last_sent_ = {};
  syncs_ = {};
}

void ProcessData::synchronise(const CanObjects& objects, NodeServices& services) {
  for (std::size_t number = 0; number < kPdos; ++number) {
    if (received_[number]) apply_rpdo(number, objects, services);
  }
  services.refresh();
  for (std::size_t number = 0; number < kPdos; ++number) {
    const std::int64_t type = objects.value(key_of(0x1800, number, 2));
    if ((objects.value(key_of(0x1800, number, 1)) & kInvalidId) != 0 || type > kLastSynchronous) continue;
    const bool is_due = type == 0 ? tpdo_data(objects, number) != last_sent_[number]
                                  : ++syncs_[number] >= static_cast<unsigned>(type);
    if (is_due) send_tpdo(number, objects, services);
  }
}

void ProcessData::receive(const can_frame& frame, const CanObjects& objects, NodeServices& services) {
  for (std::size_t number = 0; number < kPdos; ++number) {
    if (objects.value(key_of(0x1400, number, 1)) != static_cast<std::int64_t>(frame.can_id)) continue;
    received_[number] = frame;
    if (objects.value(key_of(0x1400, number, 2)) > kLastSynchronous) apply_rpdo(number, objects, services);
  }
}

void ProcessData::apply_rpdo(std::size_t number, const CanObjects& objects, NodeServices& services) {
  const can_frame frame = *received_[number];
  received_[number].reset();
  const auto entries = static_cast<unsigned>(objects.value(key_of(0x1600, number, 0)));
  std::size_t needed = 0;
  for (unsigned i = 1; i <= entries; ++i) {
    needed += static_cast<std::size_t>(objects.value(key_of(0x1600, number, i)) & 0xFF) / 8;
  }
  if (frame.can_dlc < needed) return services.send_emergency(kWrongLength);
  // Applies the target before the word that may let the drive go there, in whatever order they are mapped.
  std::size_t offset = 0;
  std::vector<std::pair<ObjectKey, std::uint32_t>> values;
  for (unsigned i = 1; i <= entries; ++i) {
    const auto entry = static_cast<std::uint32_t>(objects.value(key_of(0x1600, number, i)));
    const std::size_t bytes = (entry & 0xFF) / 8;
    std::uint32_t raw = 0;
    for (std::size_t b = 0; b < bytes; ++b)
      raw |= static_cast<std::uint32_t>(frame.data[offset + b]) << (8 * b);
    offset += bytes;
    values.emplace_back(entry >> 8, raw);
  }
  std::stable_sort(values.begin(), values.end(), [](const auto& a, const auto& b) {
    return a.first != kControlword && b.first == kControlword;
  });
  for (const auto& [key, raw] : values) {
    if (objects.check_write(key, raw, 0) == 0) services.apply(key, objects.number(key, raw));
  }
}

void ProcessData::send_tpdo(std::size_t number, const CanObjects& objects, NodeServices& services) {
  services.refresh();
  last_sent_[number] = tpdo_data(objects, number);
  syncs_[number] = 0;
  services.send(static_cast<canid_t>(objects.value(key_of(0x1800, number, 1)) & CAN_SFF_MASK),
                last_sent_[number]);
}

void ProcessData::send_changed(const CanObjects& objects, NodeServices& services) {
  services.refresh();
  for (std::size_t number = 0; number < kPdos; ++number) {
    if ((objects.value(key_of(0x1800, number, 1)) & kInvalidId) != 0) continue;
    if (objects.value(key_of(0x1800, number, 2)) <= kLastSynchronous) continue;
    if (tpdo_data(objects, number) != last_sent_[number]) send_tpdo(number, objects, services);
  }
}

}  // namespace corbot::sim
