// SPDX-License-Identifier: Apache-2.0
#include "shm/segment.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace corbot {
namespace {

using Kind = SegmentError::Kind;

constexpr int kSizeSeals = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL;
constexpr unsigned kNoExecSeal = 0x0008U;  // MFD_NOEXEC_SEAL, Linux 6.3

std::string label(std::string_view robot, SegmentKind kind) {
  const char* const role = kind == SegmentKind::kTask      ? "real-time task"
                           : kind == SegmentKind::kServant ? "servant"
                                                           : "stop requests";
  return "segment of the " + std::string(role) + " of " + std::string(robot);
}

[[noreturn]] void throw_system(std::string_view robot, const char* what, int error) {
  throw SegmentError(Kind::kSystem,
                     "shared memory of " + std::string(robot) + ": " + what + ": " + std::strerror(error));
}

std::string octal(mode_t mode) {
  std::string text = "0";
  for (int shift = 6; shift >= 0; shift -= 3) text += static_cast<char>('0' + ((mode >> shift) & 7));
  return text;
}

void check_file(const Descriptor& memory, const SegmentExpectation& expected, const std::string& what,
                bool one_writer) {
  struct stat status {};
  if (::fstat(memory.get(), &status) != 0) throw_system(expected.robot, "fstat", errno);
  if (!S_ISREG(status.st_mode) || status.st_uid != expected.owner || (status.st_mode & 0077) != 0) {
    throw SegmentError(Kind::kPermission, what + ": made by uid " + std::to_string(status.st_uid) +
                                              ", mode " + octal(status.st_mode) + "; must be a file of uid " +
                                              std::to_string(expected.owner) + " that is open to no other");
  }
  const int seals = ::fcntl(memory.get(), F_GET_SEALS);
  const bool is_fixed = seals >= 0 && (seals & kSizeSeals) == kSizeSeals;
  if (!is_fixed || (one_writer && (seals & (F_SEAL_FUTURE_WRITE | F_SEAL_WRITE)) == 0)) {
    throw SegmentError(Kind::kUnsealed, what + ": is not sealed: others could shrink it or write it");
  }
  // Checked after the seals, which also forbid releasing memory. The stop segment is writable, so its memory
  // can be released.
  constexpr blkcnt_t kBlock = 512;
  if (::fstat(memory.get(), &status) != 0) throw_system(expected.robot, "fstat", errno);
  if (status.st_blocks < (status.st_size + kBlock - 1) / kBlock) {
    throw SegmentError(Kind::kSparse, what + ": only " + std::to_string(status.st_blocks * kBlock) + " of " +
                                          std::to_string(status.st_size) +
                                          " bytes have memory: reading the rest could fail");
  }
}

}  // namespace

void check_robot_name(std::string_view name) {
  constexpr std::string_view kAllowed = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-";
  if (!name.empty() && name.size() <= kMaxSegmentName &&
      name.find_first_not_of(kAllowed) == std::string_view::npos)
    return;
  std::string shown(name.substr(0, 2 * kMaxSegmentName));
  for (char& c : shown) {
    if (c < ' ' || c > '~') c = '?';  // the message is safe for a terminal, whatever the name
  }
  throw SegmentError(Kind::kBadName,
                     "robot name '" + shown + "': 1 to 48 letters, digits, '_' or '-' are allowed");
}

namespace segment_detail {

Descriptor create(std::string_view robot, std::size_t size) {
  check_robot_name(robot);
  const std::string name = "corbot." + std::string(robot);  // visible only in /proc
  constexpr unsigned kFlags = MFD_CLOEXEC | MFD_ALLOW_SEALING;
  Descriptor memory(::memfd_create(name.c_str(), kFlags | kNoExecSeal));
  if (!memory && errno == EINVAL) memory = Descriptor(::memfd_create(name.c_str(), kFlags));
  if (!memory) throw_system(robot, "memfd_create", errno);
  // Otherwise the holder of a descriptor could reopen it through /proc/self/fd with rights that were not
  // given.
  if (::fchmod(memory.get(), 0600) != 0) throw_system(robot, "fchmod", errno);
  if (::ftruncate(memory.get(), static_cast<off_t>(size)) != 0) throw_system(robot, "ftruncate", errno);
  if (const int error = ::posix_fallocate(memory.get(), 0, static_cast<off_t>(size)); error != 0)
    throw_system(robot, "no room", error);
  return memory;
}

void seal(const Descriptor& memory, std::string_view robot, bool one_writer) {
  const int seals = kSizeSeals | (one_writer ? F_SEAL_FUTURE_WRITE : 0);
  if (::fcntl(memory.get(), F_ADD_SEALS, seals) != 0) throw_system(robot, "F_ADD_SEALS", errno);
}

Descriptor open_read_only(const Descriptor& memory, std::string_view robot) {
  const std::string path = "/proc/self/fd/" + std::to_string(memory.get());
  Descriptor reader(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!reader) throw_system(robot, path.c_str(), errno);
  return reader;
}

void fill_header(SegmentHeader& header, std::string_view robot, std::uint64_t fingerprint, SegmentKind kind,
                 std::size_t size) {
  header.magic = kSegmentMagic;
  header.abi = kSegmentAbi;
  header.kind = kind;
  header.total_size = size;
  header.fingerprint = fingerprint;
  header.pid = ::getpid();
  std::memcpy(header.name, robot.data(), robot.size());
  if (::getrandom(&header.id, sizeof(header.id), 0) != sizeof(header.id))
    throw_system(robot, "getrandom", errno);
}

void* map(const Descriptor& memory, std::size_t size, bool writable, std::string_view robot) {
  const int protection = PROT_READ | (writable ? PROT_WRITE : 0);
  void* const address = ::mmap(nullptr, size, protection, MAP_SHARED, memory.get(), 0);
  if (address == MAP_FAILED) throw_system(robot, "mmap", errno);
  return address;
}

void unmap(void* address, std::size_t size) noexcept { ::munmap(address, size); }

void check(const Descriptor& memory, const SegmentExpectation& expected, SegmentKind kind, std::size_t size) {
  const std::string what = label(expected.robot, kind);
  check_file(memory, expected, what, kind != SegmentKind::kStop);
  SegmentHeader header{};
  const ssize_t got = ::pread(memory.get(), &header, sizeof(header), 0);
  if (got < 16 || header.magic != kSegmentMagic)
    throw SegmentError(Kind::kForeign, what + ": not a corbot segment");
  if (header.abi != kSegmentAbi) {
    throw SegmentError(Kind::kWrongVersion, what + ": version " + std::to_string(header.abi) +
                                                ", this program speaks version " +
                                                std::to_string(kSegmentAbi) +
                                                "; stop the other version of corbot ('corbot down')");
  }
  struct stat status {};
  if (::fstat(memory.get(), &status) != 0) throw_system(expected.robot, "fstat", errno);
  const auto actual = static_cast<std::size_t>(status.st_size);
  if (got < static_cast<ssize_t>(sizeof(header)) || header.kind != kind)
    throw SegmentError(Kind::kForeign, what + ": is a segment of another kind");
  if (header.total_size != size || actual != size) {
    throw SegmentError(Kind::kWrongSize,
                       what + ": " + std::to_string(actual) + " bytes, made for a layout of " +
                           std::to_string(header.total_size) + "; this program's has " +
                           std::to_string(size) + "; the two were not built from the same source");
  }
  if (std::string_view(header.name, ::strnlen(header.name, sizeof(header.name))) != expected.robot)
    throw SegmentError(Kind::kForeign, what + ": made for a robot of another name");
  if (expected.fingerprint && header.fingerprint != *expected.fingerprint) {
    throw SegmentError(Kind::kWrongFingerprint,
                       what +
                           ": made for an arm of other geometry or limits; start both "
                           "sides from the same profile");
  }
}

}  // namespace segment_detail
}  // namespace corbot
