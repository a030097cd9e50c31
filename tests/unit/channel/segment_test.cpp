// SPDX-License-Identifier: Apache-2.0
#include "shm/segment.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "segment_fixture.h"

// Tests a segment's form, and that no process but its creator can change it.

namespace corbot {
namespace {

using Kind = SegmentError::Kind;
using testing::HasSubstr;

constexpr int kSizeSeals = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL;

Segment<TaskSegment> make_task() { return Segment<TaskSegment>::create("arm", kTestFingerprint); }

Descriptor copy_of(const Descriptor& memory) { return Descriptor(::dup(memory.get())); }

SegmentExpectation expected() { return {"arm", ::geteuid(), kTestFingerprint}; }

/// But for the one against execution, which newer kernels have.
int seals_of(const Descriptor& memory) {
  return ::fcntl(memory.get(), F_GET_SEALS) & (kSizeSeals | F_SEAL_WRITE | F_SEAL_FUTURE_WRITE);
}

/// The errno of a mapping, or 0.
int mapping_error(int fd, std::size_t size, int protection) {
  void* const address = ::mmap(nullptr, size, protection, MAP_SHARED, fd, 0);
  if (address == MAP_FAILED) return errno;
  ::munmap(address, size);
  return 0;
}

TEST(SegmentMemory, IsCreatedComplete) {
  const auto task = make_task();
  EXPECT_EQ(task->header.magic, kSegmentMagic);
  EXPECT_EQ(task->header.abi, kSegmentAbi);
  EXPECT_EQ(task->header.kind, SegmentKind::kTask);
  EXPECT_EQ(task->header.total_size, sizeof(TaskSegment));
  EXPECT_EQ(task->header.fingerprint, kTestFingerprint);
  EXPECT_STREQ(task->header.name, "arm");
  EXPECT_EQ(task->header.pid, ::getpid());
  EXPECT_EQ(task->incarnation, 1u);
  EXPECT_NE(task->header.id, make_task()->header.id);
  const auto servant = Segment<ServantSegment>::create("arm", kTestFingerprint);
  EXPECT_EQ(servant->next_command_id.load(), 1u);
  EXPECT_EQ(servant->control.override_ratio.load(), 1.0);
  EXPECT_EQ(ring_size(servant->commands, task->commands_tail), 0u);
}

TEST(SegmentMemory, IsOpenToNoOtherUserAndAllocatedWhateverTheUmask) {
  const mode_t before = ::umask(0);
  const auto task = make_task();
  ::umask(before);
  struct stat status {};
  ASSERT_EQ(::fstat(task.memory().get(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777, 0600u);
  EXPECT_EQ(status.st_uid, ::geteuid());
  EXPECT_GE(static_cast<std::size_t>(status.st_blocks) * 512, sizeof(TaskSegment));
}

TEST(SegmentMemory, OnlyItsCreatorCanEverWriteIt) {
  const auto task = make_task();
  // All that another process can do with what it receives: use it, or open it again.
  const std::string path = "/proc/self/fd/" + std::to_string(task.memory().get());
  const Descriptor again(::open(path.c_str(), O_RDWR | O_CLOEXEC));
  ASSERT_TRUE(again) << "its own user may open it";
  constexpr std::size_t kSize = sizeof(TaskSegment);
  EXPECT_EQ(mapping_error(task.memory().get(), kSize, PROT_READ), 0);
  for (const int fd : {task.memory().get(), again.get()}) {
    EXPECT_NE(mapping_error(fd, kSize, PROT_READ | PROT_WRITE), 0);
    EXPECT_NE(mapping_error(fd, kSize, PROT_WRITE), 0);
    EXPECT_EQ(::pwrite(fd, "x", 1, 0), -1);
    EXPECT_EQ(::ftruncate(fd, 0), -1);
    EXPECT_EQ(::ftruncate(fd, 2 * kSize), -1);
    EXPECT_EQ(::fallocate(fd, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, 0, 4096), -1);
  }
  EXPECT_EQ(mapping_error(again.get(), kSize, PROT_READ | PROT_WRITE), EPERM);
  EXPECT_EQ(seals_of(task.memory()), kSizeSeals | F_SEAL_FUTURE_WRITE);
  auto seen = Segment<const TaskSegment>::open(copy_of(again), expected());
  void* const address = const_cast<TaskSegment*>(&*seen);
  EXPECT_EQ(::mprotect(address, kSize, PROT_READ | PROT_WRITE), -1);
  EXPECT_EQ(errno, EACCES);
  task->wake.store(7);
  EXPECT_EQ(seen->wake.load(), 7u) << "its creator does write it";
}

TEST(SegmentMemory, TheStopCountIsWrittenByWhoeverHasIt) {
  const auto stop = Segment<StopSegment>::create("arm", kTestFingerprint);
  const auto seen = Segment<StopSegment>::open(copy_of(stop.memory()), expected());
  seen->count.fetch_add(1);
  EXPECT_EQ(stop->count.load(), 1u);
  EXPECT_EQ(::ftruncate(stop.memory().get(), 0), -1);
  EXPECT_EQ(seals_of(stop.memory()), kSizeSeals);
}

/// A memory as another process might offer it.
class Forged {
 public:
  explicit Forged(std::size_t size = sizeof(TaskSegment))
      : memory_(::memfd_create("forged", MFD_CLOEXEC | MFD_ALLOW_SEALING)) {
    if (::posix_fallocate(memory_.get(), 0, static_cast<off_t>(size)) != 0) ::abort();
    ::fchmod(memory_.get(), 0600);
    segment_detail::fill_header(header, "arm", kTestFingerprint, SegmentKind::kTask, sizeof(TaskSegment));
  }
  std::optional<SegmentError> opened(int seals = kSizeSeals | F_SEAL_FUTURE_WRITE,
                                     SegmentExpectation expectation = expected()) {
    if (::pwrite(memory_.get(), &header, sizeof(header), 0) != sizeof(header)) ::abort();
    ::fcntl(memory_.get(), F_ADD_SEALS, seals);
    return error_of([&] { (void)Segment<const TaskSegment>::open(copy_of(memory_), expectation); });
  }
  void set_mode(mode_t mode) { ::fchmod(memory_.get(), mode); }
  /// Removes one page of the memory file.
  void punch_hole(off_t at) {
    if (::fallocate(memory_.get(), FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, at, 4096) != 0) ::abort();
  }
  SegmentHeader header{};

 private:
  Descriptor memory_;
};

void expect_refused(const std::optional<SegmentError>& error, Kind kind, const char* text) {
  ASSERT_TRUE(error) << text;
  EXPECT_EQ(static_cast<int>(error->kind()), static_cast<int>(kind)) << error->what();
  EXPECT_THAT(error->what(), HasSubstr(text));
}

TEST(SegmentCheck, WhatIsRightIsOpened) {
  EXPECT_FALSE(Forged().opened()) << "or the cases below prove nothing";
}

TEST(SegmentCheck, WhatIsNotSealedIsRefused) {
  for (const int seals : {0, F_SEAL_FUTURE_WRITE, kSizeSeals, F_SEAL_SHRINK | F_SEAL_FUTURE_WRITE,
                          F_SEAL_GROW | F_SEAL_SEAL | F_SEAL_FUTURE_WRITE}) {
    expect_refused(Forged().opened(seals), Kind::kUnsealed, "not sealed");
  }
}

TEST(SegmentCheck, WhatHasNoMemoryIsRefused) {
  for (const off_t at : {off_t{4096}, static_cast<off_t>(sizeof(TaskSegment) / 4096) * 4096}) {
    Forged sparse;
    sparse.punch_hole(at);
    expect_refused(sparse.opened(), Kind::kSparse, "reading the rest could fail");
  }
}

TEST(SegmentCheck, WhatAnotherUserMadeOrMayOpenIsRefused) {
  expect_refused(Forged().opened(kSizeSeals | F_SEAL_FUTURE_WRITE, {"arm", ::geteuid() + 1, {}}),
                 Kind::kPermission, "made by uid");
  for (const mode_t mode : {0640u, 0604u, 0666u, 0777u}) {
    Forged open;
    open.set_mode(mode);
    expect_refused(open.opened(), Kind::kPermission, "open to no other");
  }
}

TEST(SegmentCheck, EveryFieldOfTheHeaderCounts) {
  const auto spoiled = [](const std::function<void(SegmentHeader&)>& spoil) {
    Forged forged;
    spoil(forged.header);
    return forged.opened();
  };
  expect_refused(spoiled([](SegmentHeader& h) { h.magic ^= 1; }), Kind::kForeign, "not a corbot segment");
  expect_refused(spoiled([](SegmentHeader& h) { ++h.abi; }), Kind::kWrongVersion,
                 "this program speaks version");
  expect_refused(spoiled([](SegmentHeader& h) { h.kind = SegmentKind::kServant; }), Kind::kForeign,
                 "another kind");
  expect_refused(spoiled([](SegmentHeader& h) { h.total_size += 8; }), Kind::kWrongSize,
                 "not built from the same source");
  expect_refused(spoiled([](SegmentHeader& h) { h.fingerprint ^= 1; }), Kind::kWrongFingerprint,
                 "same profile");
  expect_refused(spoiled([](SegmentHeader& h) { h.name[0] = '#'; }), Kind::kForeign, "another name");
  expect_refused(spoiled([](SegmentHeader& h) { std::memset(h.name, 'a', sizeof(h.name)); }), Kind::kForeign,
                 "another name");
}

TEST(SegmentCheck, AnotherSizeIsRefusedBeforeItIsMapped) {
  for (const std::size_t size : {sizeof(SegmentHeader), sizeof(TaskSegment) - 1, sizeof(TaskSegment) + 1}) {
    expect_refused(Forged(size).opened(), Kind::kWrongSize, "made for a layout of");
  }
  const Descriptor pipe_end = [] {
    int ends[2];
    if (::pipe(ends) != 0) ::abort();
    ::close(ends[1]);
    return Descriptor(ends[0]);
  }();
  EXPECT_TRUE(error_of([&] { (void)Segment<const TaskSegment>::open(copy_of(pipe_end), expected()); }));
  EXPECT_TRUE(error_of([&] { (void)Segment<const TaskSegment>::open(Descriptor(), expected()); }));
}

TEST(SegmentCheck, NamesAreChecked) {
  const std::string kBad[] = {
      "", "..", "a/b", "a b", "a.b", "é", std::string(49, 'a'), std::string("a\0b", 3), "a\n"};
  for (const std::string& bad : kBad) {
    expect_refused(error_of([&] { (void)Segment<TaskSegment>::create(bad, 1); }), Kind::kBadName,
                   "letters, digits");
    expect_refused(error_of([&] { (void)Observer::of(bad); }), Kind::kBadName, "letters, digits");
    expect_refused(error_of([&] { ChannelServer(bad, 1, {}); }), Kind::kBadName, "letters, digits");
  }
  const std::string longest(kMaxSegmentName, 'Z');
  EXPECT_EQ(Segment<TaskSegment>::create(longest, 1)->header.name, longest);
}

}  // namespace
}  // namespace corbot
