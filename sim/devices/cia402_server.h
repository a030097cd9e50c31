// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/devices/can_bus.h"
#include "sim/devices/control_input.h"
#include "sim/devices/node_commands.h"

namespace corbot::sim {

struct Cia402ServerOptions {
  std::string bus;
  int nodes{5};  ///< numbered from 1
  Cia402DriveOptions drive{};
  std::string record;  ///< file, empty: none
};

/// Runs emulated drives on a bus in real time. Commands on standard input cause faults. Replies to them go to
/// standard output, one line each.
class Cia402Server {
 public:
  /// Throws std::runtime_error on failures. From here on SIGTERM, SIGINT and SIGHUP only end run().
  explicit Cia402Server(const Cia402ServerOptions& options);

  void run();

 private:
  void advance();
  void read_bus();
  void flush(ServedNode& slot);
  void record_changes();
  [[nodiscard]] std::optional<std::int64_t> next_event_ns() const;

  [[nodiscard]] std::string handle(std::string_view command);
  /// Returns the values for "positions", "targets" or "states"; empty: no such query.
  [[nodiscard]] std::string values_of(std::string_view question);
  /// Carries out a command. Returns the error, which is empty if there is none.
  [[nodiscard]] std::string execute(const std::vector<std::string_view>& words);
  void plug();

  EndingSignals ending_;
  std::string name_;
  std::unique_ptr<CanBus> bus_;
  Record record_;
  std::vector<ServedNode> slots_;
  ControlInput control_;
  std::uint64_t to_drop_{0};
  std::uint64_t to_garble_{0};
};

}  // namespace corbot::sim
