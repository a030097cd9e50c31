// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

// Descriptors that the supervisor of this process keeps for the next process, over the protocol of
// sd_notify(3) and sd_listen_fds(3). Without a supervisor nothing is kept. Not real-time safe; never blocks.

namespace corbot {

struct KeptDescriptor {
  std::string name;
  int fd;  ///< the caller closes it
};

/// Returns the descriptors that were kept for this process. To be called once.
[[nodiscard]] std::vector<KeptDescriptor> take_kept_descriptors();

/// Sends a descriptor, which remains the caller's, to the supervisor. Returns false if there is no
/// supervisor, or its queue is full.
[[nodiscard]] bool keep_descriptor(const std::string& name, int fd) noexcept;
/// Removes a kept descriptor. Returns false like keep_descriptor().
bool drop_descriptor(const std::string& name) noexcept;

}  // namespace corbot
