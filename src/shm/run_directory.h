// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "shm/descriptor.h"
#include "shm/segment_error.h"

namespace corbot {

/// Returns $XDG_RUNTIME_DIR/corbot or /tmp/corbot-UID, which contains the files of this user's running
/// robots.
[[nodiscard]] std::string user_run_directory();
/// Returns the same for other values of XDG_RUNTIME_DIR: that of a login session, and none.
[[nodiscard]] std::vector<std::string> other_user_run_directories();
/// Returns true for a directory of this user that is open to no other user; false if there is none.
[[nodiscard]] bool is_user_run_directory(const std::string& path) noexcept;
/// Opens a directory of this user that is open to no other user. Creates it with mode 0700 if `create`.
/// Returns none if there is none. Throws SegmentError.
[[nodiscard]] Descriptor open_user_run_directory(bool create);

/// The directory in which the real-time tasks of this machine listen, with one Unix socket for each robot:
/// $CORBOT_RUN_DIR, or user_run_directory(). A task lives if it listens: there is no lock. A task that was
/// killed leaves a socket without a listener. For set-up and tear-down only.
class RunDirectory {
 public:
  /// Returns nothing if there is no directory, unless `create`. Throws kPermission if users other than its
  /// owner may write to it. Also throws it for another user's directory, unless CORBOT_RUN_DIR selects the
  /// directory.
  [[nodiscard]] static std::optional<RunDirectory> open(bool create);

  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  [[nodiscard]] std::string socket_path(std::string_view robot) const;
  /// Returns true for a user whose process a client accepts as a real-time task: the directory's owner, or
  /// the client's own user.
  [[nodiscard]] bool is_trusted(uid_t peer) const noexcept;

  struct Listening {
    Descriptor socket;
    bool left_behind;  ///< there was an earlier task's socket
    dev_t device;      ///< device and inode of the file
    ino_t inode;
  };
  /// Listens. Throws kInUse if a task of that robot listens already. `group` may connect, too.
  [[nodiscard]] Listening listen(std::string_view robot, std::optional<gid_t> group) const;
  /// Returns true if other processes can still find the socket. Returns false if the file or the directory
  /// was removed.
  [[nodiscard]] bool is_found(std::string_view robot, const Listening& listening) const noexcept;
  /// Returns a connection to the task. Throws kAbsent if none listens.
  [[nodiscard]] Descriptor connect(std::string_view robot) const;

  /// Returns the header id of the segment of the last task that may have moved this robot, or nothing if it
  /// is not known.
  [[nodiscard]] std::optional<std::uint64_t> last_task(std::string_view robot) const noexcept;
  /// Replaces that id atomically. Returns false if that is not possible; the id is then unknown.
  bool set_last_task(std::string_view robot, std::uint64_t segment) const noexcept;

  /// Ends listening. While no other process can connect or listen, calls `keep`, which returns whether the
  /// socket stays in the directory. `has_successor`: the next task finds the last task's segment elsewhere,
  /// and needs to know that it was the last.
  template <class Keep>
  void end(std::string_view robot, Listening& listening, Keep&& keep, bool has_successor) const {
    const Gate gate(*this);
    if (!keep() && is_found(robot, listening)) {
      remove(robot, kSocket);
      if (!has_successor) remove(robot, kLastTask);
    }
    const Descriptor closed(std::move(listening.socket));
  }
  /// Removes a socket without a listener; returns true if there was one. Throws only if the gate is stuck.
  bool remove_left_behind(std::string_view robot) const;
  /// Returns the robots for which remove_left_behind() would remove a socket, sorted.
  [[nodiscard]] std::vector<std::string> left_behind() const { return robots(false); }
  /// Returns the robots whose task lives, responding or not, sorted.
  [[nodiscard]] std::vector<std::string> listening() const { return robots(true); }

 private:
  enum class State { kNone, kLeftBehind, kListening };
  /// A lock held for a few system calls, so that no process listens on a file that is being removed. Only the
  /// directory's owner can open the lock's file, so other users who may enter the directory cannot hold it.
  /// The file is removed on release.
  class Gate {
   public:
    explicit Gate(const RunDirectory& directory);
    Gate(const Gate&) = delete;
    Gate& operator=(const Gate&) = delete;
    ~Gate();

   private:
    [[nodiscard]] bool try_lock();
    const RunDirectory& directory_;
    Descriptor lock_;
  };

  RunDirectory(std::string path, Descriptor fd, uid_t owner)
      : path_(std::move(path)), fd_(std::move(fd)), owner_(owner) {}
  [[nodiscard]] State probe(std::string_view robot, Descriptor& connection) const;
  static constexpr const char* kSocket = ".sock";
  static constexpr const char* kLastTask = ".last";
  void remove(std::string_view robot, const char* file) const noexcept;
  [[nodiscard]] std::vector<std::string> robots(bool living) const;

  std::string path_;
  Descriptor fd_;
  uid_t owner_;
};

/// Removes the socket that a killed task of that robot has left, and the record of the last task. Returns
/// true if it did. Returns false if there is none, a task listens on it, or it belongs to another user. The
/// shared memory ends with the processes.
bool remove_left_behind(const std::string& robot) noexcept;
/// Returns the robots whose socket remove_left_behind() would remove.
[[nodiscard]] std::vector<std::string> sockets_left_behind();

}  // namespace corbot
