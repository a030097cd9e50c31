// SPDX-License-Identifier: Apache-2.0
#include "shm/segment.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "segment_fixture.h"

namespace corbot {
namespace {

using Kind = SegmentError::Kind;

TEST_F(SegmentTest, IsCreatedComplete) {
  Segment rt = task();
  EXPECT_FALSE(rt.adopted());
  const SegmentHeader& header = rt.layout().header;
  EXPECT_EQ(header.magic.load(), kSegmentMagic);
  EXPECT_EQ(header.abi, kSegmentAbi);
  EXPECT_EQ(header.total_size, sizeof(SegmentLayout));
  EXPECT_EQ(header.fingerprint, kTestFingerprint);
  EXPECT_EQ(header.name, name());
  EXPECT_EQ(header.incarnation.load(), 1u);
  EXPECT_EQ(header.rt_pid.load(), ::getpid());
  EXPECT_EQ(header.next_command_id.load(), 1u);
  EXPECT_EQ(rt.layout().control.override_ratio.load(), 1.0);
  EXPECT_EQ(rt.layout().commands.size(), 0u);
  struct stat status {};
  ASSERT_EQ(::stat(path().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777, 0600u);
  EXPECT_EQ(status.st_uid, ::geteuid());
}

TEST_F(SegmentTest, IsCreatedWithMode0600WhateverTheUmask) {
  const mode_t before = ::umask(0777);
  std::optional<SegmentError> error;
  struct stat status {};
  {
    std::optional<Segment> rt;
    error = error_of([&] { rt.emplace(task()); });
    (void)::stat(path().c_str(), &status);
  }
  ::umask(before);
  EXPECT_FALSE(error) << error->what();
  EXPECT_EQ(status.st_mode & 07777, 0600u);
}

TEST_F(SegmentTest, CarriesRecordsBothWays) {
  Segment rt = task();
  Segment user = servant();
  EXPECT_EQ(rt.layout().header.servant_pid.load(), ::getpid());
  Command command{};
  command.id = 5;
  ASSERT_TRUE(RingProducer(user.layout().commands).push(command));
  Command taken{};
  ASSERT_EQ(RingConsumer(rt.layout().commands).pop(taken), PopResult::kOk);
  EXPECT_EQ(taken.id, 5u);
  ASSERT_TRUE(RingProducer(rt.layout().completions).push(Completion{5, Verdict::kDone, 0, 77}));
  Completion completion{};
  ASSERT_EQ(RingConsumer(user.layout().completions).pop(completion), PopResult::kOk);
  EXPECT_EQ(completion.cycle, 77u);
}

TEST_F(SegmentTest, ObserverReadsWhileBothAreThereAndKeepsNoProcessOut) {
  Segment rt = task();
  Snapshot snapshot{};
  snapshot.cycle = 9;
  rt.layout().snapshot.store(snapshot);
  const Segment first = Segment::observe(name());
  const Segment second = Segment::observe(name());
  Segment user = servant();
  Snapshot seen{};
  ASSERT_TRUE(second.layout().snapshot.load(seen));
  EXPECT_EQ(seen.cycle, 9u);
  EXPECT_TRUE(first.peer_alive());
  user.leave();
  rt.leave();
  EXPECT_FALSE(first.peer_alive());
  EXPECT_FALSE(first.linked());
  EXPECT_FALSE(exists()) << "an observer does not keep the segment";
}

TEST_F(SegmentTest, ObserverCannotWrite) {
  Segment rt = task();
  Segment observer = Segment::observe(name());
  // The kernel is asked to write there: it answers EFAULT where a store of our own would be
  // a segmentation fault.
  const int zero = ::open("/dev/zero", O_RDONLY | O_CLOEXEC);
  ASSERT_GE(zero, 0);
  EXPECT_EQ(::read(zero, &rt.layout().control, 1), 1);
  EXPECT_EQ(::read(zero, &observer.layout().control, 1), -1);
  EXPECT_EQ(errno, EFAULT);
  ::close(zero);
}

TEST_F(SegmentTest, AdoptionKeepsEverythingButTheIncarnation) {
  {
    Segment rt = task();
    Snapshot snapshot{};
    snapshot.cycle = 123;
    snapshot.position_rad[2] = 0.25;
    rt.layout().snapshot.store(snapshot);
    rt.layout().header.next_command_id.store(17);
    rt.layout().control.stop_count.store(3);
  }  // as at death: no leave()
  Segment rt = task();
  EXPECT_TRUE(rt.adopted());
  EXPECT_EQ(rt.layout().header.incarnation.load(), 2u);
  EXPECT_EQ(rt.layout().header.next_command_id.load(), 17u);
  EXPECT_EQ(rt.layout().control.stop_count.load(), 3u);
  Snapshot snapshot{};
  ASSERT_TRUE(last_snapshot(rt.layout(), snapshot));
  EXPECT_EQ(snapshot.cycle, 123u);
  EXPECT_EQ(snapshot.position_rad[2], 0.25);
}

TEST_F(SegmentTest, AdoptionIsSeenByTheServantThatStayed) {
  auto rt = std::make_unique<Segment>(task());
  Segment user = servant();
  EXPECT_TRUE(user.peer_alive());
  rt.reset();
  EXPECT_FALSE(user.peer_alive());
  const Segment again = task();
  EXPECT_TRUE(user.peer_alive());
  EXPECT_TRUE(user.linked());
  EXPECT_EQ(user.layout().header.incarnation.load(), 2u);
}

TEST_F(SegmentTest, TheLastOneOutUnlinks) {
  for (const bool task_first : {true, false}) {
    Segment rt = task();
    Segment user = servant();
    Segment& first = task_first ? rt : user;
    Segment& last = task_first ? user : rt;
    first.leave();
    EXPECT_TRUE(exists());
    EXPECT_FALSE(last.peer_alive());
    first.leave();  // twice does no harm
    last.leave();
    EXPECT_FALSE(exists());
  }
}

TEST_F(SegmentTest, LeavingAnUnlinkedSegmentLeavesItsSuccessorAlone) {
  Segment old = task();
  std::filesystem::remove(path());  // what an impatient person does
  EXPECT_FALSE(old.linked());
  const Segment fresh = task();
  EXPECT_FALSE(fresh.adopted());
  old.leave();
  EXPECT_TRUE(exists());
  EXPECT_TRUE(fresh.linked());
}

TEST_F(SegmentTest, UnfinishedCreationIsAbsentToOthersAndTakenOverByATask) {
  for (const std::uintmax_t size : {std::uintmax_t{0}, std::uintmax_t{sizeof(SegmentLayout)}}) {
    const int fd = ::shm_open(("/corbot." + name()).c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    ASSERT_GE(fd, 0);
    ASSERT_EQ(::ftruncate(fd, static_cast<off_t>(size)), 0);
    ::close(fd);
    auto error = error_of([&] { (void)servant(); });
    ASSERT_TRUE(error);
    EXPECT_EQ(error->kind(), Kind::kAbsent);
    error = error_of([&] { (void)Segment::observe(name()); });
    ASSERT_TRUE(error);
    EXPECT_EQ(error->kind(), Kind::kAbsent);
    Segment rt = task();
    EXPECT_FALSE(rt.adopted());
    EXPECT_EQ(rt.layout().header.incarnation.load(), 1u);
    rt.leave();
    EXPECT_FALSE(exists());
  }
}

TEST_F(SegmentTest, MovesItsOwnership) {
  Segment first = task();
  Segment second = std::move(first);
  EXPECT_EQ(second.layout().header.incarnation.load(), 1u);
  const Segment user = servant();
  EXPECT_TRUE(user.peer_alive());
}

}  // namespace
}  // namespace corbot
