// SPDX-License-Identifier: Apache-2.0
// Reads the state of a CAN interface from the kernel (rtnetlink).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace corbot::rt {

/// The values of linux/can/netlink.h.
enum class CanBusState : std::uint32_t {
  kErrorActive,
  kErrorWarning,
  kErrorPassive,
  kBusOff,
  kStopped,
  kSleeping,
};
[[nodiscard]] const char* to_string(CanBusState state) noexcept;

/// The state of an interface. A virtual one (vcan) has no bit rate, no state and no restart-ms.
struct CanLink {
  bool is_can{false};
  bool is_up{false};
  std::uint32_t queue{};                    ///< txqueuelen, frames
  std::optional<std::uint32_t> bit_rate;    ///< bits a second
  std::optional<CanBusState> state;         ///< of the controller
  std::optional<std::uint32_t> restart_ms;  ///< 0: a controller that is off the bus stays off
};

/// Returns the interface's state; empty if there is no such interface.
[[nodiscard]] std::optional<CanLink> read_can_link(const std::string& interface) noexcept;

/// Parses one message of the kernel. It trusts no length in the message; empty if it is not RTM_NEWLINK.
[[nodiscard]] std::optional<CanLink> parse_can_link(std::span<const std::byte> message) noexcept;

}  // namespace corbot::rt
