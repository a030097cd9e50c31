// SPDX-License-Identifier: Apache-2.0
#include "sim/devices/sdo_server.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "sim/devices/cia402_drive.h"
#include "sim/devices/process_data.h"

namespace corbot::sim {
namespace {

constexpr std::size_t kSegmentBytes = 7;

std::uint32_t raw_of(const can_frame& frame, unsigned bytes) {
  std::uint32_t value = 0;
  for (unsigned i = 0; i < bytes; ++i) value |= static_cast<std::uint32_t>(frame.data[4 + i]) << (8 * i);
  return value;
}

}  // namespace

void SdoServer::answer(unsigned command, ObjectKey key, std::uint32_t value, NodeServices& services) const {
  std::vector<std::uint8_t> data{static_cast<std::uint8_t>(command), static_cast<std::uint8_t>(key >> 8),
                                 static_cast<std::uint8_t>(key >> 16), static_cast<std::uint8_t>(key)};
  for (unsigned i = 0; i < 4; ++i) data.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  services.send(0x580u + node_, std::move(data));
}

void SdoServer::abort(ObjectKey key, std::uint32_t code, NodeServices& services) {
  is_uploading_ = false;
  answer(0x80, key, code, services);
}

void SdoServer::handle(const can_frame& frame, const CanObjects& objects, NodeServices& services) {
  if (frame.can_dlc != CAN_MAX_DLEN) return;
  const unsigned command = frame.data[0];
  const auto key = static_cast<ObjectKey>(frame.data[2] << 16 | frame.data[1] << 8 | frame.data[3]);
  if (abort_next_ && (!abort_next_->where || abort_next_->where->fits(key))) {
    abort(key, abort_next_->code, services);
    abort_next_.reset();
    return;
  }
  if (services.is_unanswered(key)) return;
  switch (command >> 5) {
    case 1:
      is_uploading_ = false;
      return download(frame, key, objects, services);
    case 2:
      is_uploading_ = false;
      return upload(key, objects, services);
    case 3:
      if (is_uploading_) return upload_segment(command, services);
      return abort(0, kAbortCommand, services);
    case 4:
      is_uploading_ = false;
      return;
    default:
      return abort(key, kAbortCommand, services);
  }
}

void SdoServer::upload(ObjectKey key, const CanObjects& objects, NodeServices& services) {
  if (const std::uint32_t why = objects.check_read(key); why != 0) return abort(key, why, services);
  services.refresh();
  const CanObject& object = *objects.find(key);
  if (object.bytes != 0) {
    const auto value = static_cast<std::uint32_t>(object.value);
    const std::uint32_t kept = object.bytes == 4 ? value : value & ((1u << (8 * object.bytes)) - 1);
    return answer(0x43 | (4 - object.bytes) << 2, key, kept, services);
  }
  upload_ = object.text;
  uploaded_ = 0;
  toggle_ = false;
  is_uploading_ = true;
  answer(0x41, key, static_cast<std::uint32_t>(upload_.size()), services);
}

void SdoServer::upload_segment(unsigned command, NodeServices& services) {
  if (((command & 0x10) != 0) != toggle_) return abort(0, kAbortToggle, services);
  const std::size_t bytes = std::min(kSegmentBytes, upload_.size() - uploaded_);
  const bool is_last = uploaded_ + bytes == upload_.size();
  std::vector<std::uint8_t> data(CAN_MAX_DLEN, 0);
  data[0] =
      static_cast<std::uint8_t>((toggle_ ? 0x10u : 0u) | (kSegmentBytes - bytes) << 1 | (is_last ? 1u : 0u));
  for (std::size_t i = 0; i < bytes; ++i) data[1 + i] = static_cast<std::uint8_t>(upload_[uploaded_ + i]);
  uploaded_ += bytes;
  toggle_ = !toggle_;
  is_uploading_ = !is_last;
  services.send(0x580u + node_, std::move(data));
}

void SdoServer::download(const can_frame& frame, ObjectKey key, const CanObjects& objects,
                         NodeServices& services) {
  const unsigned command = frame.data[0];
  if (objects.find(key) == nullptr) return abort(key, objects.check_write(key, 0, 0), services);
  if ((command & 2) == 0)
    return abort(key, kAbortTooLong, services);  // nothing here takes more than four bytes
  const unsigned bytes = (command & 1) != 0 ? 4 - (command >> 2 & 3u) : 0;
  const std::uint32_t raw = raw_of(frame, bytes == 0 ? 4 : bytes);
  if (const std::uint32_t why = objects.check_write(key, raw, bytes); why != 0)
    return abort(key, why, services);
  const std::int64_t value = objects.number(key, raw);
  if (const std::uint32_t why = ProcessData::check_write(objects, key, value); why != 0)
    return abort(key, why, services);
  if (const std::uint32_t why = services.check_state(key); why != 0) return abort(key, why, services);
  if (key == 0x606000 && value != 0 && value != Cia402Drive::kModeHoming &&
      value != Cia402Drive::kModeCyclicPosition) {
    return abort(key, kAbortRange, services);
  }
  if (key == 0x609800 && value != 0 && !HomingSequence::has_method(static_cast<int>(value))) {
    return abort(key, kAbortRange, services);
  }
  services.apply(key, value);
  answer(0x60, key, 0, services);
}

}  // namespace corbot::sim
