// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <vector>

#include "segment_fixture.h"

// How task, servant and others meet, and what each of them gets.

namespace corbot {
namespace {

using Kind = SegmentError::Kind;
using testing::AllOf;
using testing::HasSubstr;
using MeetingTest = SegmentTest;

constexpr std::chrono::milliseconds kWindow{10'000};

/// Whether the kernel may write there on this process's behalf: EFAULT where a store would be a fault.
bool is_writable(const void* address) {
  const Descriptor zero(::open("/dev/zero", O_RDONLY | O_CLOEXEC));
  return ::read(zero.get(), const_cast<void*>(address), 1) == 1;
}

TEST_F(MeetingTest, CarriesRecordsBothWays) {
  const auto rt = task();
  const auto port = servant();
  const auto channel = connect(*port);
  EXPECT_FALSE(channel->is_served()) << "not before the cycle has taken it";
  const ServantOffer* const offer = rt->await_servant();
  EXPECT_TRUE(channel->is_served());
  EXPECT_TRUE(channel->task_alive());
  EXPECT_EQ(rt->kept, 1);
  Command command{};
  command.id = 5;
  ASSERT_TRUE(RingProducer(channel->own().commands, channel->task().commands_tail).push(command));
  EXPECT_EQ(channel->queued(), 1u);
  Command taken{};
  ASSERT_EQ(RingConsumer(offer->segment->commands, rt->task->commands_tail).pop(taken), PopResult::kOk);
  EXPECT_EQ(taken.id, 5u);
  EXPECT_EQ(channel->queued(), 0u);
  ASSERT_TRUE(RingProducer(rt->task->completions, offer->segment->completions_tail)
                  .push(Completion{5, Verdict::kDone, 0, 77}));
  Completion completion{};
  ASSERT_EQ(RingConsumer(channel->task().completions, channel->own().completions_tail).pop(completion),
            PopResult::kOk);
  EXPECT_EQ(completion.cycle, 77u);
  EXPECT_EQ(channel->request_stop(), 1u);
  EXPECT_EQ(offer->segment->control.stop_count.load(), 1u);
}

TEST_F(MeetingTest, EachRoleCanWriteWhatItMayAndNoMore) {
  const auto rt = task();
  const auto port = servant();
  const auto channel = connect(*port);
  const ServantOffer* const offer = rt->await_servant();
  const Observer observer = Observer::of(name());
  StopPort stop = StopPort::of(name());
  EXPECT_TRUE(is_writable(&channel->own().control)) << "or the rest proves nothing";
  EXPECT_FALSE(is_writable(&channel->task().snapshot));
  EXPECT_FALSE(is_writable(&offer->segment->control)) << "not even the task writes the servant's";
  EXPECT_FALSE(is_writable(&observer.task().snapshot));
  ASSERT_NE(observer.servant(), nullptr);
  EXPECT_EQ(observer.servant()->header.id, port->own().header.id);
  EXPECT_FALSE(is_writable(&observer.servant()->control));
  stop.request();
  EXPECT_EQ(rt->stop->count.load(), 1u);
}

TEST_F(MeetingTest, ThereIsOneServantAtATime) {
  const auto rt = task();
  const auto first = servant();
  auto channel = connect(*first);
  const auto second = servant();
  const auto error = error_of([&] { (void)connect(*second); });
  ASSERT_TRUE(error);
  EXPECT_EQ(error->kind(), Kind::kInUse);
  EXPECT_THAT(error->what(), HasSubstr("another servant, pid " + std::to_string(::getpid()) + ";"));
  channel->disconnect();
  EXPECT_NO_THROW((void)connect(*second));
}

TEST_F(MeetingTest, ThereIsOneTaskAtATime) {
  const auto rt = task();
  const auto error = error_of([&] { (void)task(); });
  ASSERT_TRUE(error);
  EXPECT_EQ(error->kind(), Kind::kInUse);
  EXPECT_THAT(error->what(),
              AllOf(HasSubstr("another real-time task, pid " + std::to_string(::getpid()) + ";"),
                    HasSubstr(path().string())));
  EXPECT_NO_THROW((void)Observer::of(name())) << "the first goes on";
}

TEST_F(MeetingTest, WithoutATaskTheTextSaysHowToStartOne) {
  for (const auto& action : {std::function<void()>([&] { (void)connect(*servant()); }),
                             std::function<void()>([&] { (void)Observer::of(name()); }),
                             std::function<void()>([&] { (void)StopPort::of(name()); })}) {
    const auto error = error_of(action);
    ASSERT_TRUE(error);
    EXPECT_EQ(error->kind(), Kind::kAbsent);
    EXPECT_THAT(error->what(), HasSubstr("corbot up"));
  }
  EXPECT_FALSE(task_runs(name()));
}

TEST_F(MeetingTest, AnEndIsSeenByEveryone) {
  auto rt = task();
  const auto port = servant();
  const auto channel = connect(*port);
  const Observer observer = Observer::of(name());
  StopPort stop = StopPort::of(name());
  EXPECT_TRUE(task_runs(name()));
  rt.reset();
  EXPECT_FALSE(channel->task_alive());
  EXPECT_FALSE(observer.task_alive());
  stop.request();
  EXPECT_EQ(stop.outcome(), StopPort::Outcome::kTaskGone);
  EXPECT_FALSE(task_runs(name()));
  EXPECT_EQ(observer.task().header.magic, kSegmentMagic) << "what it wrote stays readable";
}

TEST_F(MeetingTest, TheLastOneOutRemovesTheSocket) {
  auto rt = task();
  struct stat status {};
  ASSERT_EQ(::stat(path().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777, 0600u);
  rt.reset();
  EXPECT_FALSE(exists());
  rt = task();
  const auto port = servant();
  auto channel = connect(*port);
  rt.reset();
  EXPECT_TRUE(exists()) << "the servant holds what the next task needs";
  channel->disconnect();
  EXPECT_TRUE(remove_left_behind(name()));
  EXPECT_FALSE(exists());
  EXPECT_FALSE(remove_left_behind(name()));
}

TEST_F(MeetingTest, ALivingTasksSocketIsNotRemoved) {
  const auto rt = task();
  EXPECT_FALSE(remove_left_behind(name()));
  EXPECT_TRUE(RunDirectory::open(false)->left_behind().empty());
  EXPECT_TRUE(exists());
}

TEST_F(MeetingTest, ASocketThatIsRemovedComesBack) {
  const auto rt = task();
  const auto port = servant();
  const auto channel = connect(*port);
  // At once: the task may listen again while remove_all takes file after file.
  const std::string removed = directory_.string() + ".removed";
  std::filesystem::rename(directory_, removed);
  std::filesystem::remove_all(removed);
  for (bool found = false; !found; ::sched_yield()) found = task_runs(name());
  EXPECT_NO_THROW((void)Observer::of(name()));
  EXPECT_TRUE(channel->task_alive());
}

TEST_F(MeetingTest, AKilledTasksSocketIsReplaced) {
  Child dead([&] { new std::unique_ptr<TaskEnd>(task()); });
  ASSERT_TRUE(dead.ready());
  EXPECT_TRUE(task_runs(name()));
  dead.kill();
  EXPECT_TRUE(exists());
  EXPECT_EQ(RunDirectory::open(false)->left_behind(), std::vector<std::string>{name()});
  const auto error = error_of([&] { (void)Observer::of(name()); });
  ASSERT_TRUE(error);
  EXPECT_EQ(error->kind(), Kind::kAbsent);
  const auto rt = task();
  EXPECT_TRUE(rt->server.left_behind());
  EXPECT_NO_THROW((void)Observer::of(name()));
}

TEST_F(MeetingTest, AStoppedTaskDoesNotAnswerAndIsNotReplaced) {
  Child frozen([&] { new std::unique_ptr<TaskEnd>(task()); });
  ASSERT_TRUE(frozen.ready());
  ::kill(frozen.pid(), SIGSTOP);
  ::waitpid(frozen.pid(), nullptr, WUNTRACED);
  auto error = error_of([&] { (void)Observer::of(name()); });
  ASSERT_TRUE(error);
  EXPECT_EQ(error->kind(), Kind::kSilent);
  error = error_of([&] { (void)task(); });
  ASSERT_TRUE(error);
  EXPECT_EQ(error->kind(), Kind::kInUse);
}

TEST_F(MeetingTest, ADirectoryThatOthersMayWriteIsRefused) {
  for (const mode_t mode : {0770u, 0707u}) {
    std::filesystem::permissions(directory_, static_cast<std::filesystem::perms>(mode));
    const auto error = error_of([&] { (void)task(); });
    ASSERT_TRUE(error);
    EXPECT_EQ(error->kind(), Kind::kPermission);
  }
  std::filesystem::permissions(directory_, std::filesystem::perms::owner_all);
  std::filesystem::create_symlink("/etc/passwd", path());
  const auto error = error_of([&] { (void)task(); });
  ASSERT_TRUE(error);
  EXPECT_EQ(error->kind(), Kind::kForeign) << "no socket";
}

/// Any process that may enter the directory can lock it, and read the files that it has permission for.
TEST_F(MeetingTest, ALockOnTheDirectoryKeepsNobodyOut) {
  const Descriptor directory(::open(directory_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  ASSERT_EQ(::flock(directory.get(), LOCK_EX | LOCK_NB), 0);
  auto rt = task();
  rt.reset();
  EXPECT_TRUE(std::filesystem::is_empty(directory_));
}

TEST_F(MeetingTest, TheLockIsItsOwnersAndIsRemoved) {
  const Descriptor left(
      ::open((directory_ / ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));  // by one that was killed
  const auto rt = task();
  EXPECT_FALSE(std::filesystem::exists(directory_ / ".lock"));
  const Descriptor held(::open((directory_ / ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));
  ASSERT_EQ(::flock(held.get(), LOCK_EX | LOCK_NB), 0);
  const auto error = error_of([&] { (void)task(); });
  ASSERT_TRUE(error);
  EXPECT_EQ(error->kind(), Kind::kInUse);
  EXPECT_THAT(error->what(), HasSubstr(".lock"));
}

TEST_F(MeetingTest, TheDirectoryOfTheEnvironmentIsUsed) {
  ::unsetenv("CORBOT_RUN_DIR");
  ::setenv("XDG_RUNTIME_DIR", directory_.c_str(), 1);
  const auto rt = task();
  EXPECT_TRUE(std::filesystem::is_socket(directory_ / "corbot" / "arm.sock"));
  ::unsetenv("XDG_RUNTIME_DIR");
}

/// A servant's numbers, flags and tails.
TEST_F(MeetingTest, AServantGoesOnWhereTheFormerOneEnded) {
  const auto rt = task();
  for (int i = 1; i <= 3; ++i) {
    ASSERT_TRUE(RingProducer(rt->task->completions, RingTail<>{})
                    .push(Completion{static_cast<std::uint64_t>(i), Verdict::kDone, 0, 0}));
  }
  {
    const auto former = servant();
    const auto channel = connect(*former);
    (void)rt->await_servant();
    channel->own().next_command_id.store(17);
    channel->own().control.pause.store(1);
    channel->own().control.clear_count.store(3);
    channel->own().control.override_ratio.store(0.25);
    RingConsumer completions(channel->task().completions, channel->own().completions_tail);
    Completion taken{};
    ASSERT_EQ(completions.pop(taken), PopResult::kOk);
    ASSERT_EQ(completions.pop(taken), PopResult::kOk);
    channel->disconnect();
  }
  bool inherited = false;
  ServantPort port(name(), kTestFingerprint, [&](const Inheritance& inheritance) {
    const ServantSegment* const former = inheritance.former;
    inherited = former != nullptr && former->next_command_id == 17 && port.own().next_command_id == 17;
  });
  const auto channel = connect(port);
  EXPECT_TRUE(inherited);
  EXPECT_EQ(channel->own().next_command_id.load(), 17u);
  EXPECT_EQ(channel->own().control.pause.load(), 1u);
  EXPECT_EQ(channel->own().control.clear_count.load(), 3u);
  EXPECT_EQ(channel->own().control.override_ratio.load(), 0.25);
  RingConsumer completions(channel->task().completions, channel->own().completions_tail);
  Completion taken{};
  ASSERT_EQ(completions.pop(taken), PopResult::kOk);
  EXPECT_EQ(taken.id, 2u) << "it may have been killed before it had recorded it";
  ASSERT_EQ(completions.pop(taken), PopResult::kOk);
  EXPECT_EQ(taken.id, 3u);
}

TEST_F(MeetingTest, AServantsNumbersAreBeyondThoseThatTheTaskHasSeen) {
  const auto rt = task();
  Snapshot seen{};
  seen.last_done_id = 40;
  seen.command_id = 41;
  rt->task->snapshot.store(seen);
  {
    const auto former = servant();
    former->own().next_command_id.store(~std::uint64_t{0});  // broken
    connect(*former)->disconnect();
  }
  (void)rt->await_servant();
  const auto port = servant();
  EXPECT_EQ(connect(*port)->own().next_command_id.load(), 42u);
}

/// The task before, as a living servant gives it back.
class Predecessor : public MeetingTest {
 protected:
  /// A task that was killed, and the servant that was connected to it.
  void leave_behind() {
    Child dead([&] {
      auto* end = new std::unique_ptr<TaskEnd>(task());
      Snapshot last{};
      last.cycle = 321;
      (*end)->task->snapshot.store(last);
    });
    ASSERT_TRUE(dead.ready());
    channel_ = connect(*port_);
    dead.kill();
  }
  /// Returns the segment that a new task gets when `servant` tries to connect.
  std::optional<Segment<const TaskSegment>> found(ServantPort& port) {
    next_ = std::make_unique<TaskEnd>(name(), ChannelPolicy{});
    EXPECT_TRUE(next_->server.left_behind());
    std::thread servant([&] { again_ = port.connect([] { return false; }); });
    const std::atomic<bool> cancelled{false};
    auto before = next_->server.await_predecessor(kWindow, cancelled);
    next_->serve();
    servant.join();
    return before;
  }

  std::unique_ptr<ServantPort> port_ = servant();
  std::shared_ptr<ServantChannel> channel_;
  std::shared_ptr<ServantChannel> again_;
  std::unique_ptr<TaskEnd> next_;
};

TEST_F(Predecessor, IsGivenBackByALivingServant) {
  leave_behind();
  if (HasFatalFailure()) return;
  const auto before = found(*port_);
  ASSERT_TRUE(before);
  Snapshot last{};
  ASSERT_TRUE(last_snapshot(**before, last));
  EXPECT_EQ(last.cycle, 321u);
  EXPECT_NE(next_->task->header.id, (*before)->header.id);
  EXPECT_EQ(again_->task().header.id, next_->task->header.id) << "and it works with the new one";
}

TEST_F(Predecessor, AServantThatHasSeenNoneEndsTheWait) {
  leave_behind();
  if (HasFatalFailure()) return;
  const auto other = servant();
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_FALSE(found(*other));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, kWindow);
  EXPECT_NE(again_, nullptr);
}

/// Offers any descriptor as the last task's segment.
TEST_F(Predecessor, WhatAServantForgesIsNotTakenOver) {
  const auto forged = [&](int seals, std::uint64_t fingerprint, SegmentKind kind) {
    Descriptor memory(::memfd_create("forged", MFD_CLOEXEC | MFD_ALLOW_SEALING));
    ::fchmod(memory.get(), 0600);
    if (::posix_fallocate(memory.get(), 0, sizeof(TaskSegment)) != 0) ::abort();
    auto* const layout = static_cast<TaskSegment*>(
        ::mmap(nullptr, sizeof(TaskSegment), PROT_READ | PROT_WRITE, MAP_SHARED, memory.get(), 0));
    segment_detail::fill_header(layout->header, name(), fingerprint, kind, sizeof(TaskSegment));
    Snapshot jump{};
    jump.position_q[0] = 1.0;
    layout->snapshot.store(jump);
    ::munmap(layout, sizeof(TaskSegment));
    ::fcntl(memory.get(), F_ADD_SEALS, seals);
    return memory;
  };
  constexpr int kSize = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL;
  std::vector<Descriptor> offers;
  offers.push_back(forged(0, kTestFingerprint, SegmentKind::kTask));      // it could change it meanwhile
  offers.push_back(forged(kSize, kTestFingerprint, SegmentKind::kTask));  // the same
  offers.push_back(forged(kSize | F_SEAL_FUTURE_WRITE, kTestFingerprint, SegmentKind::kServant));
  offers.push_back(forged(kSize | F_SEAL_FUTURE_WRITE, 99, SegmentKind::kTask));
  offers.push_back(Descriptor(
      ::fcntl(Segment<ServantSegment>::create(name(), kTestFingerprint).memory().get(), F_DUPFD_CLOEXEC, 0)));
  offers.push_back(Descriptor(
      ::fcntl(Segment<TaskSegment>::create("other", kTestFingerprint).memory().get(), F_DUPFD_CLOEXEC, 0)));
  for (const Descriptor& offer : offers) {
    const TaskEnd rt(name(), {});
    const Descriptor connection = RunDirectory::open(false)->connect(name());
    const auto own = Segment<ServantSegment>::create(name(), kTestFingerprint);
    ASSERT_TRUE(send_message(connection, Message::make(MessageType::kServantHello, name()),
                             {{kCarriesTask, offer.get()}, {kCarriesServant, own.memory().get()}}));
    const std::atomic<bool> cancelled{false};
    EXPECT_FALSE(const_cast<TaskEnd&>(rt).server.await_predecessor(kWindow, cancelled));
    EXPECT_TRUE(rt.server.servant_waits());
  }
}

}  // namespace
}  // namespace corbot
