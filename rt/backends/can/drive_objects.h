// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "rt/backends/can/sdo_client.h"

namespace corbot::rt {

/// A PDO as it is needed: its objects, identifier and mapping; sent or taken at every SYNC.
struct PdoPlan {
  std::uint16_t parameters;
  std::uint16_t mapping;
  canid_t identifier;
  std::span<const std::uint32_t> entries;
};

/// Sets the objects of a drive to the needed values. It reads first and writes only differences, so a right
/// value may be read-only. Some drives accept a value only while no mode is active, or no PDO is valid; it is
/// written then. Throws DeviceError, which names node, object, the present value and the needed one.
class DriveObjects {
 public:
  DriveObjects(CanPort& port, DriveWatch& watch, std::uint8_t node) : sdo_(port, watch, node) {}

  [[nodiscard]] SdoClient& sdo() { return sdo_; }
  /// `bytes` of `value`; only the bits in `mask` count.
  void ensure(ObjectAddress object, std::uint32_t value, std::size_t bytes, std::uint32_t mask = 0xFFFF'FFFF);
  void ensure_pdo(const PdoPlan& plan);
  /// Switches off the PDOs that the drive would send of its own accord.
  void switch_off_other_pdos();
  /// Sets 6060h, and waits until 6061h agrees.
  void set_mode(std::uint8_t mode);
  [[nodiscard]] std::uint8_t mode();
  [[nodiscard]] std::uint16_t statusword();

 private:
  /// Returns the abort code, or nothing if it is written. It tries again if the drive's state was the reason
  /// and could be changed.
  [[nodiscard]] std::optional<std::uint32_t> write(ObjectAddress object, std::uint32_t value,
                                                   std::size_t bytes);
  [[nodiscard]] bool make_mode_inactive();
  [[nodiscard]] bool switch_off_pdos();
  [[nodiscard]] bool is_mapped(const PdoPlan& plan);
  [[nodiscard]] std::string mapped(std::uint16_t mapping);
  void map(const PdoPlan& plan);
  [[noreturn]] void fail_refused(ObjectAddress object, std::uint32_t has, std::uint32_t needs,
                                 std::size_t bytes, std::uint32_t abort_code);

  SdoClient sdo_;
};

}  // namespace corbot::rt
