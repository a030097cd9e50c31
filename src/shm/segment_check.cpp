// SPDX-License-Identifier: Apache-2.0
#include "shm/segment_check.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <new>
#include <string>

namespace corbot::segment_detail {
namespace {

using Kind = SegmentError::Kind;

}  // namespace

Mapping::Mapping(const File& file, int protection, std::string_view name) {
  void* const address = ::mmap(nullptr, sizeof(SegmentLayout), protection, MAP_SHARED, file.fd(), 0);
  if (address == MAP_FAILED) throw_system(name, "mmap", errno);
  layout_ = static_cast<SegmentLayout*>(address);
}

Mapping::~Mapping() {
  if (layout_ != nullptr) ::munmap(layout_, sizeof(SegmentLayout));
}

bool is_unborn(const File& file, std::string_view name) {
  const auto size = static_cast<std::uint64_t>(file.status(name).st_size);
  if (size == 0) return true;
  std::uint64_t magic = 0;
  return size == sizeof(SegmentLayout) && ::pread(file.fd(), &magic, sizeof(magic), 0) == sizeof(magic) &&
         magic == 0;
}

void check_size(const File& file, std::string_view name) {
  const auto size = static_cast<std::uint64_t>(file.status(name).st_size);
  struct {
    std::uint64_t magic;
    std::uint32_t abi;
    std::uint32_t reserved;
    std::uint64_t total_size;
  } start{};
  const ssize_t got = ::pread(file.fd(), &start, sizeof(start), 0);
  const std::string path = shm_path(name);
  if (size == 0 || (size == sizeof(SegmentLayout) && got >= 8 && start.magic == 0)) {
    throw SegmentError(
        Kind::kAbsent,
        path + ": its creator has not finished it; try again, or start the robot with 'corbot up'");
  }
  if (got >= 8 && start.magic != kSegmentMagic) {
    throw SegmentError(Kind::kForeign,
                       path + ": not a corbot segment (its first eight bytes are another program's); " +
                           "remove it, or give the robot another name");
  }
  if (got < static_cast<ssize_t>(sizeof(start))) {
    throw SegmentError(Kind::kTruncated, path + ": truncated: " + std::to_string(size) +
                                             " bytes, too short for a header; remove it");
  }
  if (start.abi != kSegmentAbi) {
    throw SegmentError(Kind::kWrongVersion,
                       path + ": version " + std::to_string(start.abi) + ", this program speaks version " +
                           std::to_string(kSegmentAbi) +
                           "; stop the other version of corbot ('corbot down'), or remove the file");
  }
  if (start.total_size != sizeof(SegmentLayout)) {
    throw SegmentError(Kind::kWrongSize,
                       path + ": made for a layout of " + std::to_string(start.total_size) +
                           " bytes, this program's has " + std::to_string(sizeof(SegmentLayout)) +
                           "; the two were not built from the same source; remove the file");
  }
  if (size < sizeof(SegmentLayout)) {
    throw SegmentError(Kind::kTruncated, path + ": truncated: " + std::to_string(size) + " of " +
                                             std::to_string(sizeof(SegmentLayout)) + " bytes; remove it");
  }
  if (size > sizeof(SegmentLayout)) {
    throw SegmentError(Kind::kWrongSize, path + ": " + std::to_string(size) + " bytes, " +
                                             std::to_string(sizeof(SegmentLayout)) + " expected; remove it");
  }
}

void check_header(const SegmentLayout& layout, std::string_view name,
                  std::optional<std::uint64_t> fingerprint) {
  const SegmentHeader& header = layout.header;
  if (header.magic.load(std::memory_order_acquire) != kSegmentMagic ||
      std::string_view(header.name, ::strnlen(header.name, sizeof(header.name))) != name) {
    throw SegmentError(Kind::kForeign, shm_path(name) + ": made for a robot of another name; remove it");
  }
  if (fingerprint && header.fingerprint != *fingerprint) {
    throw SegmentError(Kind::kWrongFingerprint,
                       shm_path(name) +
                           ": made for an arm of other geometry or limits; start both sides from "
                           "the same profile, or, if none is running, remove the file");
  }
}

void initialise(SegmentLayout* memory, std::string_view name, std::uint64_t fingerprint) noexcept {
  SegmentLayout* const layout = ::new (static_cast<void*>(memory)) SegmentLayout{};
  SegmentHeader& header = layout->header;
  header.abi = kSegmentAbi;
  header.total_size = sizeof(SegmentLayout);
  header.fingerprint = fingerprint;
  std::memcpy(header.name, name.data(), name.size());
  header.incarnation.store(1, std::memory_order_relaxed);
  header.rt_pid.store(::getpid(), std::memory_order_relaxed);
  header.magic.store(kSegmentMagic, std::memory_order_release);
}

}  // namespace corbot::segment_detail
