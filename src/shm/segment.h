// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "shm/segment_check.h"

namespace corbot {

/// One robot's shared memory: /dev/shm/corbot.NAME, mode 0600, owned by the effective user. Set-up and
/// tear-down only: nothing here but layout() and adopted() is real-time safe.
///
/// Locks on the file say which processes are connected; the kernel releases them when their holder dies,
/// however it dies. They belong to the open file, which a forked child shares: do not fork while holding a
/// Segment (exec closes it).
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
  /// The servant. peer_alive() says whether the real-time task lives.
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
  [[nodiscard]] bool peer_alive() const noexcept;
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

}  // namespace corbot
