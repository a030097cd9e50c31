// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

#include "shm/descriptor.h"

namespace corbot::cli {

/// One message of the protocol of sd_notify(3).
struct Notification {
  pid_t sender{};  ///< verified by the kernel, not taken from the message
  bool ready{false};
  bool watchdog{false};
  bool store{false};                  ///< FDSTORE=1
  bool remove{false};                 ///< FDSTOREREMOVE=1
  std::string fd_name;                ///< FDNAME=
  std::optional<std::string> status;  ///< STATUS=
  std::vector<Descriptor> descriptors;
};

/// Parses the fields that corbot knows and ignores others, like systemd.
[[nodiscard]] Notification parse_notification(std::string_view text);

/// The socket $NOTIFY_SOCKET on which children report that they are ready and alive, as they would to
/// systemd. Its file is in a directory that only this user may enter, so no other user can fill its queue.
class NotifySocket {
 public:
  /// Throws Failure.
  explicit NotifySocket(std::string path);
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;
  ~NotifySocket();

  /// Returns the next complete message, or nothing.
  [[nodiscard]] std::optional<Notification> receive();
  /// Creates the socket anew if its file was removed: children could not reach it any more.
  void restore();

  [[nodiscard]] int fd() const noexcept { return fd_.get(); }
  [[nodiscard]] const std::string& path() const noexcept { return path_; }

 private:
  void open();
  std::string path_;
  Descriptor fd_;
  dev_t device_{};
  ino_t inode_{};
};

}  // namespace corbot::cli
