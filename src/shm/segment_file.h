// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>

#include "corbot/channel/layout.h"
#include "shm/segment_error.h"

// The file under a segment: name, permissions, locks. Set-up only, not real-time safe. Used by segment.h.

namespace corbot::segment_detail {

using Kind = SegmentError::Kind;

/// Bytes of the file that are locked; a lock says who is there, its holder's death releases it.
/// Open-file-description locks rather than POSIX locks: the latter vanish when any descriptor of the process
/// is closed.
enum class LockByte : off_t {
  kRealTimeTask = 0,
  kServant = 1,
  kGate = 2,  ///< held for the moment of entering or leaving, so that nobody enters what is being unlinked
};

inline std::string shm_name(std::string_view name) { return "/corbot." + std::string(name); }
inline std::string shm_path(std::string_view name) { return "/dev/shm/corbot." + std::string(name); }

inline void check_name(std::string_view name) {
  constexpr std::string_view kAllowed = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-";
  if (name.empty() || name.size() > kMaxSegmentName ||
      name.find_first_not_of(kAllowed) != std::string_view::npos) {
    std::string shown(name.substr(0, 2 * kMaxSegmentName));
    for (char& c : shown) {
      if (c < ' ' || c > '~') c = '?';  // a message for a terminal, whatever was asked for
    }
    throw SegmentError(Kind::kBadName,
                       "robot name '" + shown + "': 1 to 48 letters, digits, '_' or '-' are allowed");
  }
}

[[noreturn]] inline void throw_system(std::string_view name, const char* what, int error) {
  throw SegmentError(Kind::kSystem, shm_path(name) + ": " + what + ": " + std::strerror(error));
}

/// An open descriptor of the segment's file.
class File {
 public:
  File() = default;
  explicit File(int fd) noexcept : fd_(fd) {}
  File(File&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  File& operator=(File&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~File() {
    if (fd_ >= 0) ::close(fd_);
  }

  [[nodiscard]] int fd() const noexcept { return fd_; }

  /// True when the lock is ours now; false when somebody else holds it.
  [[nodiscard]] bool lock(LockByte byte) const noexcept { return set(byte, F_WRLCK); }
  void unlock(LockByte byte) const noexcept { (void)set(byte, F_UNLCK); }
  static void unlock(int fd, LockByte byte) noexcept {
    struct flock lock = range(byte, F_UNLCK);
    (void)::fcntl(fd, F_OFD_SETLK, &lock);
  }

  /// Does another open file hold it? Works on a read-only descriptor, too.
  [[nodiscard]] bool held_by_other(LockByte byte) const noexcept {
    struct flock lock = range(byte, F_WRLCK);
    return ::fcntl(fd_, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
  }

  [[nodiscard]] struct stat status(std::string_view name) const {
    struct stat status {};
    if (::fstat(fd_, &status) != 0) throw_system(name, "fstat", errno);
    return status;
  }

 private:
  static struct flock range(LockByte byte, short type) noexcept {
    struct flock lock {};
    lock.l_type = type;
    lock.l_whence = SEEK_SET;
    lock.l_start = static_cast<off_t>(byte);
    lock.l_len = 1;
    return lock;
  }
  bool set(LockByte byte, short type) const noexcept {
    struct flock lock = range(byte, type);
    return ::fcntl(fd_, F_OFD_SETLK, &lock) == 0;
  }

  int fd_{-1};
};

/// Holds the gate. Whoever is inside does a few system calls; two seconds mean that something is stuck.
class Gate {
 public:
  Gate(const File& file, std::string_view name) : fd_(file.fd()) {
    constexpr timespec kPause{0, 1'000'000};
    for (int attempt = 0; !file.lock(LockByte::kGate); ++attempt) {
      if (attempt >= 2000) {
        throw SegmentError(Kind::kInUse, shm_path(name) +
                                             ": another process has been entering or leaving the segment " +
                                             "for two seconds; see which with 'lsof " + shm_path(name) + "'");
      }
      ::nanosleep(&kPause, nullptr);
    }
  }
  Gate(const Gate&) = delete;
  Gate& operator=(const Gate&) = delete;
  ~Gate() { File::unlock(fd_, LockByte::kGate); }

 private:
  int fd_;  // not a File&: the File moves into the Segment while the gate is held
};

/// Refuses what another user made or may touch: a network-facing process and a machine that moves are behind
/// it.
inline void check_permissions(const File& file, std::string_view name) {
  const struct stat status = file.status(name);
  if (S_ISREG(status.st_mode) && status.st_uid == ::geteuid() && (status.st_mode & 07777) == 0600) return;
  char mode[8];
  mode[0] = '0';
  for (int digit = 0; digit < 4; ++digit)
    mode[1 + digit] = static_cast<char>('0' + ((status.st_mode >> (9 - 3 * digit)) & 7));
  mode[5] = '\0';
  throw SegmentError(Kind::kPermission, shm_path(name) + ": owned by uid " + std::to_string(status.st_uid) +
                                            ", mode " + mode + "; must be a file of uid " +
                                            std::to_string(::geteuid()) +
                                            ", mode 0600. If no corbot process uses it, remove it.");
}

/// Opens an existing file; kAbsent, kPermission or kSystem otherwise.
inline File open_existing(std::string_view name, int access) {
  const int fd = ::shm_open(shm_name(name).c_str(), access | O_CLOEXEC, 0);
  if (fd < 0) {
    const int error = errno;
    if (error == ENOENT) {
      throw SegmentError(
          Kind::kAbsent,
          shm_path(name) + ": absent: no real-time task runs for this robot; start it with 'corbot up'");
    }
    if (error == EACCES || error == EPERM || error == ELOOP) {
      throw SegmentError(Kind::kPermission,
                         shm_path(name) + ": " + std::strerror(error) +
                             ": run as the user who started the robot, or remove a file left over");
    }
    throw_system(name, "shm_open", error);
  }
  File file(fd);
  check_permissions(file, name);
  return file;
}

}  // namespace corbot::segment_detail
