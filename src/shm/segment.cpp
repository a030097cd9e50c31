// SPDX-License-Identifier: Apache-2.0
#include "shm/segment.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <optional>

namespace corbot {

bool Segment::peer_alive() const noexcept {
  return file_.held_by_other(role_ == Role::kRealTimeTask ? LockByte::kServant : LockByte::kRealTimeTask);
}

Segment::File Segment::open_or_create(std::string_view name) {
  for (;;) {
    const int fd =
        ::shm_open(segment_detail::shm_name(name).c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (fd >= 0) {
      File file(fd);
      // The umask can only have taken bits away; give them back, or check_permissions refuses its own file.
      if (::fchmod(fd, 0600) != 0) segment_detail::throw_system(name, "fchmod", errno);
      return file;
    }
    if (errno != EEXIST) segment_detail::throw_system(name, "shm_open", errno);
    try {
      return segment_detail::open_existing(name, O_RDWR);
    } catch (const SegmentError& error) {
      if (error.kind() != Kind::kAbsent) throw;  // removed between the two calls: once more
    }
  }
}

void Segment::throw_in_use(const File& file, std::string_view name, Role role) {
  std::int32_t pid = 0;  // open-file-description locks do not name their holder; the header does
  const bool task = role == Role::kRealTimeTask;
  const auto offset = task ? offsetof(SegmentHeader, rt_pid) : offsetof(SegmentHeader, servant_pid);
  (void)!::pread(file.fd(), &pid, sizeof(pid), static_cast<off_t>(offset));
  throw SegmentError(Kind::kInUse, segment_detail::shm_path(name) + ": in use by another " +
                                       (task ? "real-time task" : "servant") + ", pid " +
                                       std::to_string(pid) +
                                       "; stop it with 'corbot down', or give this robot another name");
}

Segment Segment::create_or_adopt(std::string_view name, std::uint64_t fingerprint) {
  using namespace segment_detail;
  check_name(name);
  for (;;) {
    File file = open_or_create(name);
    const Gate gate(file, name);
    if (file.status(name).st_nlink == 0) continue;  // the last one out was faster
    if (!file.lock(LockByte::kRealTimeTask)) throw_in_use(file, name, Role::kRealTimeTask);
    const bool adopt = !is_unborn(file, name);
    if (adopt) {
      check_size(file, name);
    } else if (const int error = ::posix_fallocate(file.fd(), 0, sizeof(SegmentLayout)); error != 0) {
      ::shm_unlink(shm_name(name).c_str());
      throw_system(name, "no room for the segment", error);  // now, rather than SIGBUS in the cycle
    }
    Mapping mapping(file, PROT_READ | PROT_WRITE, name);
    if (adopt) {
      SegmentHeader& header = mapping.get()->header;
      check_header(*mapping.get(), name, fingerprint);
      header.rt_pid.store(::getpid(), std::memory_order_relaxed);
      header.incarnation.fetch_add(1, std::memory_order_release);
    } else {
      initialise(mapping.get(), name, fingerprint);
    }
    return Segment(std::move(file), std::move(mapping), name, Role::kRealTimeTask, adopt);
  }
}

Segment Segment::attach(std::string_view name, std::uint64_t fingerprint) {
  using namespace segment_detail;
  check_name(name);
  for (;;) {
    File file = open_existing(name, O_RDWR);
    const Gate gate(file, name);
    if (file.status(name).st_nlink == 0) continue;  // removed since it was opened: absent, or a new one
    check_size(file, name);
    Mapping mapping(file, PROT_READ | PROT_WRITE, name);
    check_header(*mapping.get(), name, fingerprint);
    if (!file.lock(LockByte::kServant)) throw_in_use(file, name, Role::kServant);
    mapping.get()->header.servant_pid.store(::getpid(), std::memory_order_relaxed);
    return Segment(std::move(file), std::move(mapping), name, Role::kServant, false);
  }
}

Segment Segment::observe(std::string_view name) {
  using namespace segment_detail;
  check_name(name);
  File file = open_existing(name, O_RDONLY);
  check_size(file, name);
  Mapping mapping(file, PROT_READ, name);
  check_header(*mapping.get(), name, std::nullopt);
  return Segment(std::move(file), std::move(mapping), name, Role::kObserver, false);
}

void Segment::leave() {
  if (mapping_.get() == nullptr) return;
  if (role_ != Role::kObserver) {
    const segment_detail::Gate gate(file_, name_);
    // Still linked means that the name is this file's: only a holder of the gate removes it.
    if (!peer_alive() && linked()) ::shm_unlink(segment_detail::shm_name(name_).c_str());
    file_.unlock(role_ == Role::kRealTimeTask ? LockByte::kRealTimeTask : LockByte::kServant);
  }
  const segment_detail::Mapping unmapped(std::move(mapping_));
  const File closed(std::move(file_));
}

}  // namespace corbot
