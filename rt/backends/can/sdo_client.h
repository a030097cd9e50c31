// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "rt/backends/can/can_port.h"
#include "rt/backends/can/canopen_sdo.h"
#include "rt/backends/can/drive_watch.h"

namespace corbot::rt {

/// Reads and writes the object dictionary of one node. Other frames that come in meanwhile go to the watch.
/// Every failure throws DeviceError, naming interface, node, object and abort code.
class SdoClient {
 public:
  SdoClient(CanPort& port, DriveWatch& watch, std::uint8_t node) : port_(port), watch_(watch), node_(node) {}

  [[nodiscard]] std::uint32_t read(ObjectAddress object);
  /// Does the same, or returns nothing if the node has no such object.
  [[nodiscard]] std::optional<std::uint32_t> read_if_there(ObjectAddress object);
  /// Returns a text of printable ASCII; "" if the node has no such object.
  [[nodiscard]] std::string read_text(ObjectAddress object);

  void write(ObjectAddress object, std::uint32_t value, std::size_t bytes);
  /// Returns the abort code of the node, or nothing if it is written.
  [[nodiscard]] std::optional<std::uint32_t> try_to_write(ObjectAddress object, std::uint32_t value,
                                                          std::size_t bytes);
  /// Reads the object again and throws if the value differs; only the bits in `mask` are compared.
  void check(ObjectAddress object, std::uint32_t value, std::size_t bytes, std::uint32_t mask = 0xFFFF'FFFF);

  [[noreturn]] void fail(DeviceCause cause, const std::string& what) const;

 private:
  /// Carries out a transfer; true unless the node has aborted it.
  bool run(SdoTransfer& transfer);
  [[noreturn]] void fail_aborted(const SdoTransfer& transfer, const char* doing) const;
  [[nodiscard]] std::uint32_t number_of(const SdoTransfer& transfer) const;

  CanPort& port_;
  DriveWatch& watch_;
  std::uint8_t node_;
};

}  // namespace corbot::rt
