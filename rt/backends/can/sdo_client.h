// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "rt/backends/can/can_port.h"
#include "rt/backends/can/canopen_sdo.h"
#include "rt/backends/can/drive_watch.h"

namespace corbot::rt {

/// Reads and writes the object dictionary of one node. What else comes in meanwhile goes to the watch. Every
/// failure throws DeviceError, naming interface, node, object and abort code.
class SdoClient {
 public:
  SdoClient(CanPort& port, DriveWatch& watch, std::uint8_t node) : port_(port), watch_(watch), node_(node) {}

  [[nodiscard]] std::uint32_t read(ObjectAddress object);
  /// The same, or nothing where the node has no such object.
  [[nodiscard]] std::optional<std::uint32_t> read_if_there(ObjectAddress object);
  /// A text of printable ASCII; "" where the node has no such object.
  [[nodiscard]] std::string read_text(ObjectAddress object);

  void write(ObjectAddress object, std::uint32_t value, std::size_t bytes);
  /// The code with which the node aborts it, nothing: it is written.
  [[nodiscard]] std::optional<std::uint32_t> try_to_write(ObjectAddress object, std::uint32_t value,
                                                          std::size_t bytes);
  /// Reads it again and throws when it is not that; only the bits in `mask` are compared.
  void check(ObjectAddress object, std::uint32_t value, std::size_t bytes, std::uint32_t mask = 0xFFFF'FFFF);

  [[noreturn]] void fail(DeviceCause cause, const std::string& what) const;

 private:
  /// Carries a transfer out; true unless the node has aborted it.
  bool run(SdoTransfer& transfer);
  [[noreturn]] void fail_aborted(const SdoTransfer& transfer, const char* doing) const;
  [[nodiscard]] std::uint32_t number_of(const SdoTransfer& transfer) const;

  CanPort& port_;
  DriveWatch& watch_;
  std::uint8_t node_;
};

}  // namespace corbot::rt
