// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

namespace corbot::sim {

/// A listening Unix socket, non-blocking. It replaces a socket that a killed program has left, nothing else.
class UnixListener {
 public:
  /// `type`: SOCK_STREAM or SOCK_SEQPACKET. `mode`: of the socket's file; absent: by the umask. Throws
  /// std::runtime_error.
  UnixListener(std::string path, int type, std::optional<mode_t> mode = std::nullopt);
  UnixListener(const UnixListener&) = delete;
  UnixListener& operator=(const UnixListener&) = delete;
  /// Removes the socket's file, unless another program has replaced it.
  ~UnixListener();

  /// Returns the descriptor to be polled: readable when a client waits.
  [[nodiscard]] int fd() const { return fd_; }
  /// Returns the next client's descriptor, non-blocking; the caller closes it. -1 if no client waits.
  [[nodiscard]] int accept() const;

 private:
  std::string path_;
  int fd_{-1};
  ino_t inode_{0};
};

}  // namespace corbot::sim
