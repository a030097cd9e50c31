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
  pid_t sender{};  ///< as the kernel says, not as the message does
  bool ready{false};
  bool watchdog{false};
  bool store{false};                  ///< FDSTORE=1
  bool remove{false};                 ///< FDSTOREREMOVE=1
  std::string fd_name;                ///< FDNAME=
  std::optional<std::string> status;  ///< STATUS=
  std::vector<Descriptor> descriptors;
};

/// The fields of a message that corbot knows; others are left out, as systemd does.
[[nodiscard]] Notification parse_notification(std::string_view text);

/// The socket to which children report that they are ready and well, as they would to systemd:
/// $NOTIFY_SOCKET. A file in a directory that only this user may enter, so no other user can fill its queue.
class NotifySocket {
 public:
  /// Throws Failure.
  explicit NotifySocket(std::string path);
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;
  ~NotifySocket();

  /// The next message that is whole; nothing when there is none.
  [[nodiscard]] std::optional<Notification> receive();
  /// Makes the socket anew where its file has been removed: children could reach it no more.
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
