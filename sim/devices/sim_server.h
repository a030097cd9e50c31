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
  /// A line whose other end is set to another speed carries garbage. Not so over a device's own USB.
  bool checks_baud{true};
};

/// Runs a device on a pseudo-terminal in real time, with the faults that commands on standard input ask
/// for. Replies to them go to standard output, one line each.
class SimServer {
 public:
  /// Failures throw std::runtime_error. From here on SIGTERM, SIGINT and SIGHUP only end run().
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
  /// What has left the device, but for what the faults of the line take.
  void send_answers(std::int64_t now_ns);
  void set_power(bool is_on, std::int64_t now_ns);
  [[nodiscard]] std::optional<std::int64_t> next_event_ns(std::int64_t now_ns) const;

  /// The reply to a command.
  [[nodiscard]] std::string handle(std::string_view command);
  /// The faults of the line and of the power; nothing where the words are no such command.
  [[nodiscard]] std::optional<std::string> execute_fault(const std::vector<std::string_view>& words);
  /// Carries a command out; what is wrong with it, empty: nothing.
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
  std::int64_t power_on_ns_{0};      ///< after a brown-out; 0: by a command
  std::int64_t batch_ns_{0};         ///< an adapter hands answers over so often; 0: at once
  std::vector<std::uint8_t> batch_;  ///< in the adapter
  std::int64_t batched_ns_{0};       ///< the last look at it
  std::int64_t latest_ns_{0};  ///< by which a servo frame was late in the record; since it was last asked for
};

}  // namespace corbot::sim
