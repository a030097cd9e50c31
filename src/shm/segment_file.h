// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/stat.h>
#include <sys/types.h>

#include <string>
#include <string_view>
#include <utility>

#include "shm/segment_error.h"

// The file under a segment: name, permissions, locks. Set-up only, not real-time safe. Used by segment.h.

namespace corbot::segment_detail {

/// Bytes of the file that are locked; a lock says which process is connected, its holder's death releases it.
/// Open-file-description locks rather than POSIX locks: the latter vanish when any descriptor of the process
/// is closed.
enum class LockByte : off_t {
  kRealTimeTask = 0,
  kServant = 1,
  /// Held for the moment of entering or leaving, so that no process enters what is being unlinked.
  kGate = 2,
};

[[nodiscard]] std::string shm_name(std::string_view name);
[[nodiscard]] std::string shm_path(std::string_view name);

/// Throws kBadName.
void check_name(std::string_view name);

[[noreturn]] void throw_system(std::string_view name, const char* what, int error);

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
  ~File();

  [[nodiscard]] int fd() const noexcept { return fd_; }

  /// True when the lock is ours now; false when another open file holds it.
  [[nodiscard]] bool lock(LockByte byte) const noexcept;
  void unlock(LockByte byte) const noexcept;
  static void unlock(int fd, LockByte byte) noexcept;

  /// Does another open file hold it? Works on a read-only descriptor, too.
  [[nodiscard]] bool held_by_other(LockByte byte) const noexcept;

  [[nodiscard]] struct stat status(std::string_view name) const;

 private:
  int fd_{-1};
};

/// Holds the gate, for a few system calls; a wait of two seconds means that its holder is stuck.
class Gate {
 public:
  Gate(const File& file, std::string_view name);
  Gate(const Gate&) = delete;
  Gate& operator=(const Gate&) = delete;
  ~Gate() { File::unlock(fd_, LockByte::kGate); }

 private:
  int fd_;  // not a File&: the File moves into the Segment while the gate is held
};

/// Refuses what another user made or may write:
/// a network-facing process and a machine that moves depend on it.
void check_permissions(const File& file, std::string_view name);

/// Opens an existing file; kAbsent, kPermission or kSystem otherwise.
[[nodiscard]] File open_existing(std::string_view name, int access);

}  // namespace corbot::segment_detail
