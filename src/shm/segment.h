// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <new>
#include <string>
#include <string_view>
#include <utility>

#include "shm/segment_check.h"

namespace corbot {

/// One robot's shared memory: /dev/shm/corbot.NAME, mode 0600, owned by the effective user. Set-up and
/// tear-down only: nothing here but layout() and adopted() is real-time safe.
///
/// Who is there is told by locks on the file, which the kernel releases when their holder dies, however it
/// dies. They belong to the open file, which a forked child shares: do not fork while holding a Segment (exec
/// closes it).
///
/// Entering and leaving are serialised by a third lock. A file whose magic is not there yet, or whose creator
/// died before that, is taken for absent by everyone but a real-time task, which (holding its lock)
/// initialises it.
class Segment {
 public:
  /// The real-time task: creates the segment, or adopts the one that a dead task left (incarnation + 1,
  /// everything else as it was; the caller flushes the command ring). Of two that start at once exactly one
  /// gets it, the other kInUse.
  [[nodiscard]] static Segment create_or_adopt(std::string_view name, std::uint64_t fingerprint);
  /// The servant. Whether the real-time task lives is told by peer_alive().
  [[nodiscard]] static Segment attach(std::string_view name, std::uint64_t fingerprint);
  /// Any number of readers; writing through layout() is a segmentation fault. No lock, no fingerprint.
  [[nodiscard]] static Segment observe(std::string_view name);

  Segment(Segment&&) noexcept = default;
  Segment& operator=(Segment&&) noexcept = default;
  /// Unmaps and gives the locks back, as death would; the file stays.
  ~Segment() = default;

  [[nodiscard]] SegmentLayout& layout() noexcept { return *mapping_.get(); }
  [[nodiscard]] const SegmentLayout& layout() const noexcept { return *mapping_.get(); }
  [[nodiscard]] bool adopted() const noexcept { return adopted_; }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }

  /// Does the other side (for an observer: the real-time task) hold its lock? One system call.
  [[nodiscard]] bool peer_alive() const noexcept {
    return file_.held_by_other(role_ == Role::kRealTimeTask ? LockByte::kServant : LockByte::kRealTimeTask);
  }
  /// Is this still the file of that name? False when the last one out has removed it: attach anew. Not
  /// real-time safe.
  [[nodiscard]] bool linked() const { return file_.status(name_).st_nlink > 0; }

  /// A clean exit: the last of the two sides removes the file. The segment must not be used afterwards.
  /// Throws kInUse when another process has been entering or leaving for two seconds; the destructor still
  /// gives the locks back.
  void leave();

 private:
  using File = segment_detail::File;
  using Kind = SegmentError::Kind;
  using LockByte = segment_detail::LockByte;
  enum class Role { kRealTimeTask, kServant, kObserver };

  Segment(File file, segment_detail::Mapping mapping, std::string_view name, Role role, bool adopted)
      : file_(std::move(file)), mapping_(std::move(mapping)), name_(name), role_(role), adopted_(adopted) {}

  static File open_or_create(std::string_view name);
  [[noreturn]] static void throw_in_use(const File& file, std::string_view name, Role role);

  File file_;
  segment_detail::Mapping mapping_;
  std::string name_;
  Role role_;
  bool adopted_;
};

inline Segment::File Segment::open_or_create(std::string_view name) {
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

inline void Segment::throw_in_use(const File& file, std::string_view name, Role role) {
  std::int32_t pid = 0;  // open-file-description locks do not tell their holder; the header does
  const bool task = role == Role::kRealTimeTask;
  const auto offset = task ? offsetof(SegmentHeader, rt_pid) : offsetof(SegmentHeader, servant_pid);
  (void)!::pread(file.fd(), &pid, sizeof(pid), static_cast<off_t>(offset));
  throw SegmentError(Kind::kInUse, segment_detail::shm_path(name) + ": in use by another " +
                                       (task ? "real-time task" : "servant") + ", pid " +
                                       std::to_string(pid) +
                                       "; stop it with 'corbot down', or give this robot another name");
}

inline Segment Segment::create_or_adopt(std::string_view name, std::uint64_t fingerprint) {
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

inline Segment Segment::attach(std::string_view name, std::uint64_t fingerprint) {
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

inline Segment Segment::observe(std::string_view name) {
  using namespace segment_detail;
  check_name(name);
  File file = open_existing(name, O_RDONLY);
  check_size(file, name);
  Mapping mapping(file, PROT_READ, name);
  check_header(*mapping.get(), name, std::nullopt);
  return Segment(std::move(file), std::move(mapping), name, Role::kObserver, false);
}

inline void Segment::leave() {
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
