// SPDX-License-Identifier: Apache-2.0
// The SDO server of an emulated drive: CiA 301, 7.2.4.
#include <algorithm>

#include "sim/devices/cia402_node.h"

namespace corbot::sim {
namespace {

constexpr std::size_t kSegmentBytes = 7;
constexpr std::int64_t kPdoOff = std::int64_t{1} << 31;
constexpr std::int64_t kExtended = std::int64_t{1} << 29;

std::uint32_t raw_of(const can_frame& frame, unsigned bytes) {
  std::uint32_t value = 0;
  for (unsigned i = 0; i < bytes; ++i) value |= static_cast<std::uint32_t>(frame.data[4 + i]) << (8 * i);
  return value;
}

}  // namespace

void Cia402Node::answer_sdo(unsigned command, ObjectKey key, std::uint32_t value) {
  std::vector<std::uint8_t> data{static_cast<std::uint8_t>(command), static_cast<std::uint8_t>(key >> 8),
                                 static_cast<std::uint8_t>(key >> 16), static_cast<std::uint8_t>(key)};
  for (unsigned i = 0; i < 4; ++i) data.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  send(0x580u + node_, std::move(data));
}

void Cia402Node::abort_sdo(ObjectKey key, std::uint32_t code) {
  is_uploading_ = false;
  answer_sdo(0x80, key, code);
}

void Cia402Node::serve_sdo(const can_frame& frame) {
  if (frame.can_dlc != CAN_MAX_DLEN) return;
  const unsigned command = frame.data[0];
  const auto key = static_cast<ObjectKey>(frame.data[2] << 16 | frame.data[1] << 8 | frame.data[3]);
  if (abort_next_) {
    abort_sdo(key, *abort_next_);
    abort_next_.reset();
    return;
  }
  switch (command >> 5) {
    case 1:
      is_uploading_ = false;
      return serve_download(frame, key);
    case 2:
      is_uploading_ = false;
      return serve_upload(key);
    case 3:
      if (is_uploading_) return serve_segment(command);
      return abort_sdo(0, kAbortCommand);
    case 4:
      is_uploading_ = false;
      return;
    default:
      return abort_sdo(key, kAbortCommand);
  }
}

void Cia402Node::serve_upload(ObjectKey key) {
  if (const std::uint32_t why = objects_.check_read(key); why != 0) return abort_sdo(key, why);
  refresh();
  const CanObject& object = *objects_.find(key);
  if (object.bytes != 0) {
    const auto value = static_cast<std::uint32_t>(object.value);
    const std::uint32_t kept = object.bytes == 4 ? value : value & ((1u << (8 * object.bytes)) - 1);
    return answer_sdo(0x43 | (4 - object.bytes) << 2, key, kept);
  }
  upload_ = object.text;
  uploaded_ = 0;
  toggle_ = false;
  is_uploading_ = true;
  answer_sdo(0x41, key, static_cast<std::uint32_t>(upload_.size()));
}

void Cia402Node::serve_segment(unsigned command) {
  if (((command & 0x10) != 0) != toggle_) return abort_sdo(0, kAbortToggle);
  const std::size_t bytes = std::min(kSegmentBytes, upload_.size() - uploaded_);
  const bool is_last = uploaded_ + bytes == upload_.size();
  std::vector<std::uint8_t> data(CAN_MAX_DLEN, 0);
  data[0] =
      static_cast<std::uint8_t>((toggle_ ? 0x10u : 0u) | (kSegmentBytes - bytes) << 1 | (is_last ? 1u : 0u));
  for (std::size_t i = 0; i < bytes; ++i) data[1 + i] = static_cast<std::uint8_t>(upload_[uploaded_ + i]);
  uploaded_ += bytes;
  toggle_ = !toggle_;
  is_uploading_ = !is_last;
  send(0x580u + node_, std::move(data));
}

void Cia402Node::serve_download(const can_frame& frame, ObjectKey key) {
  const unsigned command = frame.data[0];
  if (objects_.find(key) == nullptr) return abort_sdo(key, objects_.check_write(key, 0, 0));
  if ((command & 2) == 0) return abort_sdo(key, kAbortTooLong);  // nothing here takes more than four bytes
  const unsigned bytes = (command & 1) != 0 ? 4 - (command >> 2 & 3u) : 0;
  const std::uint32_t raw = raw_of(frame, bytes == 0 ? 4 : bytes);
  if (const std::uint32_t why = objects_.check_write(key, raw, bytes); why != 0) return abort_sdo(key, why);
  const std::int64_t value = objects_.number(key, raw);
  if (const std::uint32_t why = check_pdo_write(key, value); why != 0) return abort_sdo(key, why);
  if (key == 0x606000 && value != 0 && value != Cia402Drive::kModeCyclicPosition) {
    return abort_sdo(key, kAbortRange);
  }
  apply(key, value);
  answer_sdo(0x60, key, 0);
}

std::uint32_t Cia402Node::check_pdo_write(ObjectKey key, std::int64_t value) const {
  const ObjectKey index = key >> 8;
  const ObjectKey sub = key & 0xFF;
  const ObjectKey block = index & ~ObjectKey{kPdos - 1};
  const bool is_parameters = block == 0x1400 || block == 0x1800;
  const bool is_mapping = block == 0x1600 || block == 0x1A00;
  if (!is_parameters && !is_mapping) return 0;
  const bool is_received = block < 0x1800;
  const ObjectKey parameters = is_mapping ? index - 0x200 : index;
  const std::int64_t id = objects_.value(parameters << 8 | 1);
  const bool is_on = (id & kPdoOff) == 0;
  if (is_parameters && sub == 1) {
    const bool changes_id = (id & CAN_SFF_MASK) != (value & CAN_SFF_MASK);
    if ((value & kExtended) != 0) return kAbortRange;
    return is_on && (value & kPdoOff) == 0 && changes_id ? kAbortRange : 0;
  }
  if (is_parameters) return value > 240 && value < 254 ? kAbortRange : 0;
  if (is_on) return kAbortState;
  if (sub == 0) return check_mapping_count(index << 8, is_received, value);
  if (objects_.value(index << 8) != 0) return kAbortState;
  if (value == 0) return 0;
  const CanObject* object = objects_.find(static_cast<ObjectKey>(value >> 8));
  if (object == nullptr) return kAbortNoObject;
  const bool is_mappable = is_received ? object->goes_into_rpdo : object->goes_into_tpdo;
  return is_mappable && (value & 0xFF) == 8 * std::int64_t{object->bytes} ? 0 : kAbortNotMappable;
}

std::uint32_t Cia402Node::check_mapping_count(ObjectKey mapping, bool is_received, std::int64_t count) const {
  std::int64_t bits = 0;
  for (std::int64_t i = 1; i <= count; ++i) {
    const std::int64_t entry = objects_.value(mapping | static_cast<ObjectKey>(i));
    const CanObject* object = objects_.find(static_cast<ObjectKey>(entry >> 8));
    if (object == nullptr || !(is_received ? object->goes_into_rpdo : object->goes_into_tpdo)) {
      return kAbortNotMappable;
    }
    bits += entry & 0xFF;
  }
  return bits > 64 ? kAbortPdoLength : 0;
}

}  // namespace corbot::sim
