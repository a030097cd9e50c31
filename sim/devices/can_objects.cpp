// SPDX-License-Identifier: Apache-2.0
#include "sim/devices/can_objects.h"

namespace corbot::sim {

const CanObject* CanObjects::find(ObjectKey key) const {
  const auto found = objects_.find(key);
  return found == objects_.end() || found->second.is_hidden ? nullptr : &found->second;
}

void CanObjects::hide(const std::function<bool(ObjectKey)>& is_hidden) {
  for (auto& [key, object] : objects_) object.is_hidden = is_hidden(key);
}

std::int64_t CanObjects::value(ObjectKey key) const {
  const auto found = objects_.find(key);
  return found == objects_.end() ? 0 : found->second.value;
}

void CanObjects::set(ObjectKey key, std::int64_t value) {
  const auto found = objects_.find(key);
  if (found != objects_.end()) found->second.value = value;
}

std::uint32_t CanObjects::missing(ObjectKey key) const {
  bool has_index = false;
  for (auto next = objects_.lower_bound(key & ~ObjectKey{0xFF});
       next != objects_.end() && next->first >> 8 == key >> 8; ++next) {
    has_index = has_index || !next->second.is_hidden;
  }
  return has_index ? kAbortNoSubIndex : kAbortNoObject;
}

std::uint32_t CanObjects::check_read(ObjectKey key) const {
  const CanObject* object = find(key);
  if (object == nullptr) return missing(key);
  return object->access == Access::kWriteOnly ? kAbortWriteOnly : 0;
}

std::int64_t CanObjects::number(ObjectKey key, std::uint32_t raw) const {
  const CanObject* object = find(key);
  if (object == nullptr) return raw;
  switch (object->bytes) {
    case 1:
      return object->is_signed ? std::int64_t{static_cast<std::int8_t>(raw)} : static_cast<std::uint8_t>(raw);
    case 2:
      return object->is_signed ? std::int64_t{static_cast<std::int16_t>(raw)}
                               : static_cast<std::uint16_t>(raw);
    default:
      return object->is_signed ? std::int64_t{static_cast<std::int32_t>(raw)} : std::int64_t{raw};
  }
}

std::uint32_t CanObjects::check_write(ObjectKey key, std::uint32_t raw, unsigned bytes) const {
  const CanObject* object = find(key);
  if (object == nullptr) return missing(key);
  if (object->access == Access::kReadOnly) return kAbortReadOnly;
  if (bytes > object->bytes) return kAbortTooLong;
  if (bytes != 0 && bytes < object->bytes) return kAbortTooShort;
  const std::int64_t wanted = number(key, raw);
  if (wanted > object->highest) return kAbortTooHigh;
  return wanted < object->lowest ? kAbortTooLow : 0;
}

}  // namespace corbot::sim
