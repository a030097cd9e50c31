// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <poll.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sim/devices/ssc32_device.h"
#include "sim/devices/unix_listener.h"

namespace corbot::sim {

/// An emulated SSC-32 at a Unix stream socket, mode 0600, for one client at a time. Another client meanwhile
/// is closed at once. The device stays when its client goes: the servos hold, and the next client finds them
/// so. Never blocks.
class ServoSocket {
 public:
  /// Listens. Throws std::runtime_error.
  ServoSocket(const std::string& path, Ssc32Options options);
  ServoSocket(const ServoSocket&) = delete;
  ServoSocket& operator=(const ServoSocket&) = delete;
  ~ServoSocket() { drop_client(); }

  /// Adds the descriptors to be polled: step() is due when one of them is readable.
  void add_to(std::vector<pollfd>& fds) const;
  /// Takes the received bytes, sends the answers that have left, and accepts the next client.
  void step(std::int64_t now_ns);
  /// Returns the time at which step() has an answer to send.
  [[nodiscard]] std::optional<std::int64_t> next_answer_ns() const;

  [[nodiscard]] Ssc32Device& device() { return device_; }
  [[nodiscard]] bool has_client() const { return client_ >= 0; }

 private:
  void receive(std::int64_t now_ns);
  void drop_client();

  UnixListener listener_;
  Ssc32Device device_;
  int client_{-1};
};

}  // namespace corbot::sim
