// SPDX-License-Identifier: Apache-2.0
#include "shm/segment_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "corbot/channel/layout.h"

namespace corbot::segment_detail {
namespace {

using Kind = SegmentError::Kind;

struct flock lock_range(LockByte byte, short type) noexcept {
  struct flock lock {};
  lock.l_type = type;
  lock.l_whence = SEEK_SET;
  lock.l_start = static_cast<off_t>(byte);
  lock.l_len = 1;
  return lock;
}

bool set_lock(int fd, LockByte byte, short type) noexcept {
  struct flock lock = lock_range(byte, type);
  return ::fcntl(fd, F_OFD_SETLK, &lock) == 0;
}

}  // namespace

std::string shm_name(std::string_view name) { return "/corbot." + std::string(name); }
std::string shm_path(std::string_view name) { return "/dev/shm/corbot." + std::string(name); }

void check_name(std::string_view name) {
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

void throw_system(std::string_view name, const char* what, int error) {
  throw SegmentError(Kind::kSystem, shm_path(name) + ": " + what + ": " + std::strerror(error));
}

File::~File() {
  if (fd_ >= 0) ::close(fd_);
}

bool File::lock(LockByte byte) const noexcept { return set_lock(fd_, byte, F_WRLCK); }
void File::unlock(LockByte byte) const noexcept { unlock(fd_, byte); }
void File::unlock(int fd, LockByte byte) noexcept { (void)set_lock(fd, byte, F_UNLCK); }

bool File::held_by_other(LockByte byte) const noexcept {
  struct flock lock = lock_range(byte, F_WRLCK);
  return ::fcntl(fd_, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
}

struct stat File::status(std::string_view name) const {
  struct stat status {};
  if (::fstat(fd_, &status) != 0) throw_system(name, "fstat", errno);
  return status;
}

Gate::Gate(const File& file, std::string_view name) : fd_(file.fd()) {
  constexpr timespec kPause{0, 1'000'000};
  for (int attempt = 0; !file.lock(LockByte::kGate); ++attempt) {
    if (attempt >= 2000) {
      throw SegmentError(Kind::kInUse,
                         shm_path(name) +
                             ": another process has been entering or leaving the segment for two seconds; "
                             "see which with 'lsof " +
                             shm_path(name) + "'");
    }
    ::nanosleep(&kPause, nullptr);
  }
}

void check_permissions(const File& file, std::string_view name) {
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

File open_existing(std::string_view name, int access) {
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
