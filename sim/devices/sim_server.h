// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/devices/byte_line.h"
#include "sim/devices/control_input.h"
#include "sim/devices/pty_port.h"
#include "sim/devices/serial_device.h"

namespace corbot::sim {

struct ServerOptions {
  std::string link;
  int baud{115200};
  std::string record;  ///< file, empty: none
  /// If set, a line whose other end has another speed carries garbage. A device's own USB has no such check.
  bool checks_baud{true};
};

/// Runs a device on a pseudo-terminal in real time. Commands on standard input cause faults. Replies to them
/// go to standard output, one line each.
class SimServer {
 public:
  /// Throws std::runtime_error on failures. From here on SIGTERM, SIGINT and SIGHUP only end run().
  SimServer(std::unique_ptr<SerialDevice> device, const ServerOptions& options);

  void run();

 private:
  struct Recorded {
    double pulse_us{0.0};
    double shaft_us{0.0};
  };

  void advance(std::int64_t now_ns);
  void record_frame(std::int64_t time_ns);
  void read_line(std::int64_t now_ns);
  /// Sends the bytes that have left the device, except those that the faults of the line take.
  void send_answers(std::int64_t now_ns);
  void set_power(bool is_on, std::int64_t now_ns);
  [[nodiscard]] std::optional<std::int64_t> next_event_ns(std::int64_t now_ns) const;

  /// Returns the reply to a command.
  [[nodiscard]] std::string handle(std::string_view command);
  /// Executes the faults of the line and of the power. Returns nothing if the words are no such command.
  [[nodiscard]] std::optional<std::string> execute_fault(const std::vector<std::string_view>& words);
  /// Carries out a command. Returns the error, which is empty if there is none.
  [[nodiscard]] std::string execute(const std::vector<std::string_view>& words);
  [[nodiscard]] std::string pulses();
  void plug();

  EndingSignals ending_;
  std::unique_ptr<SerialDevice> device_;
  PtyPort port_;
  ByteLine line_in_;
  Record record_;
  std::vector<Recorded> recorded_;
  std::int64_t next_frame_ns_{0};
  ControlInput control_;
  std::uint64_t to_drop_{0};
  std::uint64_t to_garble_{0};
  bool is_silent_{false};
  bool checks_baud_;
  bool is_powered_{true};
  std::int64_t power_on_ns_{0};      ///< end of a brown-out; 0: a command switches on
  std::int64_t batch_ns_{0};         ///< interval at which an adapter delivers answers; 0: at once
  std::vector<std::uint8_t> batch_;  ///< in the adapter
  std::int64_t batched_ns_{0};       ///< time of the last look at the batch
  std::int64_t latest_ns_{0};        ///< greatest delay of a servo frame in the record since the last query
};

}  // namespace corbot::sim
