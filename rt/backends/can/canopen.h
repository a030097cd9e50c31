// SPDX-License-Identifier: Apache-2.0
// The parts that all of CANopen shares (CiA 301): identifiers and the order of bytes.
#pragma once

#include <linux/can.h>

#include <cstddef>
#include <cstdint>

#include "rt/backends/can/can_port.h"

namespace corbot::rt {

// The predefined connection set (7.3.5). The identifiers of a node have its number (1 to 127) added.
inline constexpr canid_t kNmt = 0x000;
inline constexpr canid_t kSync = 0x080;
inline constexpr canid_t kEmergency = 0x080;
inline constexpr canid_t kTpdo1 = 0x180;
inline constexpr canid_t kRpdo1 = 0x200;
inline constexpr canid_t kSdoAnswer = 0x580;
inline constexpr canid_t kSdoRequest = 0x600;
inline constexpr canid_t kHeartbeat = 0x700;

/// Returns `bytes` (1 to 4) of the frame's data from `offset`; 0 beyond the eighth byte.
[[nodiscard]] inline std::uint32_t little_endian(const CanFrame& frame, std::size_t offset,
                                                 std::size_t bytes) noexcept {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < bytes && offset + i < CAN_MAX_DLEN; ++i) {
    value |= static_cast<std::uint32_t>(frame.data[offset + i]) << (8 * i);
  }
  return value;
}

}  // namespace corbot::rt
