// SPDX-License-Identifier: Apache-2.0
// What the kernel says of a CAN interface (rtnetlink).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace corbot::rt {

/// As in linux/can/netlink.h.
enum class CanBusState : std::uint32_t {
  kErrorActive,
  kErrorWarning,
  kErrorPassive,
  kBusOff,
  kStopped,
  kSleeping,
};
[[nodiscard]] const char* to_string(CanBusState state) noexcept;

/// Of a virtual interface (vcan) nothing has a bit rate, a state, or restart-ms.
struct CanLink {
  bool is_can{false};
  bool is_up{false};
  std::uint32_t queue{};                    ///< txqueuelen, frames
  std::optional<std::uint32_t> bit_rate;    ///< bits a second
  std::optional<CanBusState> state;         ///< of the controller
  std::optional<std::uint32_t> restart_ms;  ///< 0: a controller that is off the bus stays off
};

/// Nothing where there is no such interface.
[[nodiscard]] std::optional<CanLink> read_can_link(const std::string& interface) noexcept;

/// One message of the kernel. Trusts no length in it; nothing when it is not RTM_NEWLINK.
[[nodiscard]] std::optional<CanLink> parse_can_link(std::span<const std::byte> message) noexcept;

}  // namespace corbot::rt
