// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

// Descriptors that the supervisor of this process keeps for the next one, over the protocol of sd_notify(3) and
// sd_listen_fds(3). Without a supervisor nothing is kept. Not real-time safe; never blocks.

namespace corbot {

struct KeptDescriptor {
  std::string name;
  int fd;  ///< the caller's to close
};

/// What was kept for this process. Once.
[[nodiscard]] std::vector<KeptDescriptor> take_kept_descriptors();

/// The descriptor remains the caller's. False when there is no supervisor, or it could not be sent: its queue is full.
[[nodiscard]] bool keep_descriptor(const std::string& name, int fd) noexcept;
/// False likewise.
bool drop_descriptor(const std::string& name) noexcept;

}  // namespace corbot
