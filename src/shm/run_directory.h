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

/// $XDG_RUNTIME_DIR/corbot or /tmp/corbot-UID: where this user's robots have their files while they are up.
[[nodiscard]] std::string user_run_directory();
/// The same under another XDG_RUNTIME_DIR: that of a login session, and none.
[[nodiscard]] std::vector<std::string> other_user_run_directories();
/// Of this user's, and open to no other; false where there is none.
[[nodiscard]] bool is_user_run_directory(const std::string& path) noexcept;
/// Of this user's, and open to no other; created with mode 0700 if `create`. None when there is none. Throws
/// SegmentError.
[[nodiscard]] Descriptor open_user_run_directory(bool create);

/// Where the real-time tasks of this machine listen, one Unix socket a robot: $CORBOT_RUN_DIR, or
/// user_run_directory(). That a task lives is seen by its listening: there is no lock.
/// A socket that nobody listens on was left by a task that was killed. Set-up and tear-down only.
class RunDirectory {
 public:
  /// Nothing when there is none, unless `create`. Throws kPermission when others than its owner may write
  /// it, or, unless it was chosen by CORBOT_RUN_DIR, when it is another user's.
  [[nodiscard]] static std::optional<RunDirectory> open(bool create);

  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  [[nodiscard]] std::string socket_path(std::string_view robot) const;
  /// The users whose process a client takes for a real-time task: the directory's owner, or its own user.
  [[nodiscard]] bool is_trusted(uid_t peer) const noexcept;

  struct Listening {
    Descriptor socket;
    bool left_behind;  ///< an earlier task's socket was there
    dev_t device;      ///< and inode: of the file
    ino_t inode;
  };
  /// Throws kInUse when a task of that robot listens already. `group`: may connect, too.
  [[nodiscard]] Listening listen(std::string_view robot, std::optional<gid_t> group) const;
  /// Can others still find it? False when somebody has removed the file, or the directory.
  [[nodiscard]] bool is_found(std::string_view robot, const Listening& listening) const noexcept;
  /// A connection to the task. Throws kAbsent when none listens.
  [[nodiscard]] Descriptor connect(std::string_view robot) const;

  /// The header id of the segment of the last task that may have moved this robot; nothing where it is not
  /// known.
  [[nodiscard]] std::optional<std::uint64_t> last_task(std::string_view robot) const noexcept;
  /// Replaces it at once. False, and it is not known any more, when that is not possible.
  bool set_last_task(std::string_view robot, std::uint64_t segment) const noexcept;

  /// Ends listening; `keep` is asked, while no other process connects or listens anew, whether the socket is
  /// to be left in the directory.
  /// `has_successor`: that finds the last task's segment elsewhere, and is to know that it was the last.
  template <class Keep>
  void end(std::string_view robot, Listening& listening, Keep&& keep, bool has_successor) const {
    const Gate gate(*this);
    if (!keep() && is_found(robot, listening)) {
      remove(robot, kSocket);
      if (!has_successor) remove(robot, kLastTask);
    }
    const Descriptor closed(std::move(listening.socket));
  }
  /// Removes a socket that nobody listens on; true when there was one. Never throws but for a stuck gate.
  bool remove_left_behind(std::string_view robot) const;
  /// The robots for which that would remove something, sorted.
  [[nodiscard]] std::vector<std::string> left_behind() const { return robots(false); }
  /// The robots whose task lives, whether it responds or not, sorted.
  [[nodiscard]] std::vector<std::string> listening() const { return robots(true); }

 private:
  enum class State { kNone, kLeftBehind, kListening };
  /// Held for a few system calls, so that nobody listens on what is being removed. The lock is on a file that
  /// only the directory's owner can open: others who may enter the directory cannot hold it. Removed when it
  /// is released.
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

/// Removes the socket that a killed task of that robot has left, and what is known of the last one. True when
/// it did; false when there is none, a task listens on it, or it belongs to another user. The shared memory
/// goes with the processes.
bool remove_left_behind(const std::string& robot) noexcept;
/// The robots whose socket that would remove.
[[nodiscard]] std::vector<std::string> sockets_left_behind();

}  // namespace corbot
