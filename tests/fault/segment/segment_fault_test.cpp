// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>

#include <atomic>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "segment_fixture.h"
#include "support/cases.h"

// Processes that die, and processes that start at once.

namespace corbot {
namespace {

using Kind = SegmentError::Kind;
using SegmentFault = SegmentTest;

/// Memory that the processes of a test share besides.
template <class T>
class Shared {
 public:
  Shared() {
    void* const memory =
        ::mmap(nullptr, sizeof(T), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) ::abort();
    value_ = new (memory) T{};
  }
  Shared(const Shared&) = delete;
  Shared& operator=(const Shared&) = delete;
  ~Shared() { ::munmap(value_, sizeof(T)); }
  T& operator*() const { return *value_; }
  T* operator->() const { return value_; }

 private:
  T* value_;
};

/// Runs `body` in `count` processes released at one instant; their exit codes.
std::vector<int> race(int count, const std::function<int(int)>& body) {
  const Shared<std::atomic<int>> waiting;
  std::vector<pid_t> pids;
  for (int i = 0; i < count; ++i) {
    const pid_t pid = ::fork();
    if (pid == 0) {
      waiting->fetch_add(1);
      while (waiting->load() < count) ::sched_yield();
      int code = 99;
      try {
        code = body(i);
      } catch (const SegmentError& error) {
        code = 50 + static_cast<int>(error.kind());
      }
      ::_exit(code);
    }
    pids.push_back(pid);
  }
  std::vector<int> codes;
  for (const pid_t pid : pids) {
    int status = 0;
    ::waitpid(pid, &status, 0);
    codes.push_back(WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status));
  }
  return codes;
}

TEST_F(SegmentFault, KillingAServantFreesItsRoleAndKeepsItsNumbers) {
  const Shared<std::atomic<std::uint64_t>> last;
  Child rt([&] {
    auto* const end = new std::unique_ptr<TaskEnd>(task());
    std::thread([end] {
      for (;;) (void)(*end)->await_servant();
    }).detach();
  });
  ASSERT_TRUE(rt.ready());
  for (std::uint64_t round = 1; round <= 5; ++round) {
    Child user([&] {
      auto* const port = new std::unique_ptr<ServantPort>(servant());
      auto* const channel = new std::shared_ptr<ServantChannel>(connect(**port));
      (*channel)->own().next_command_id.fetch_add(10);
      last->store((*channel)->own().next_command_id.load());
    });
    ASSERT_TRUE(user.ready()) << "round " << round;
    user.kill();
    EXPECT_EQ(last->load(), 1 + 10 * round);
  }
}

TEST_F(SegmentFault, ATaskKilledInTheMiddleOfAStoreLeavesTheCycleBefore) {
  std::uint64_t torn = 0;
  // About every fifth kill meets a store; enough of them must, or the test has tested nothing.
  const auto wanted = static_cast<std::uint64_t>(test::cases(20));
  for (int round = 0; round < 2000 && torn < wanted; ++round) {
    Child rt([&] {
      auto* const end = new std::unique_ptr<TaskEnd>(task());
      TaskSegment& segment = *(*end)->task;
      std::thread([&segment] {
        Snapshot snapshot{};
        for (std::uint64_t cycle = 1;; ++cycle) {
          snapshot.cycle = cycle;
          for (double& pulse : snapshot.pulse_us) pulse = static_cast<double>(cycle);
          segment.trace.append(snapshot);
          segment.snapshot.store(snapshot);
        }
      }).detach();
      while (segment.trace.next() < 100) ::sched_yield();
    });
    ASSERT_TRUE(rt.ready());
    const Observer left = Observer::of(name());
    rt.kill();
    Snapshot snapshot{};
    torn += !left.task().snapshot.load(snapshot);
    ASSERT_TRUE(last_snapshot(left.task(), snapshot));
    EXPECT_GE(snapshot.cycle, 1u);
    EXPECT_LE(left.task().trace.next() - snapshot.cycle, 1u) << "the last or the one before";
    for (const double pulse : snapshot.pulse_us) ASSERT_EQ(pulse, static_cast<double>(snapshot.cycle));
  }
  EXPECT_EQ(torn, wanted);
}

TEST_F(SegmentFault, OfTasksThatStartAtOnceExactlyOneListens) {
  for (int round = 0; round < test::cases(100); ++round) {
    constexpr int kTasks = 6;
    const Shared<std::atomic<int>> decided;  // the winner stays until all have decided
    const std::vector<int> codes = race(kTasks, [&](int) {
      try {
        const auto rt = task();
        decided->fetch_add(1);
        while (decided->load() < kTasks) ::sched_yield();
        return Observer::of(name()).task().header.pid == ::getpid() ? 0 : 1;
      } catch (...) {
        decided->fetch_add(1);
        throw;
      }
    });
    EXPECT_EQ(std::count(codes.begin(), codes.end(), 0), 1);
    EXPECT_EQ(std::count(codes.begin(), codes.end(), 50 + static_cast<int>(Kind::kInUse)), kTasks - 1)
        << testing::PrintToString(codes);
    EXPECT_FALSE(exists());
  }
}

TEST_F(SegmentFault, WhoeverConnectsWhileATaskStartsSeesNothingOrAllOfIt) {
  for (int round = 0; round < test::cases(100); ++round) {
    constexpr int kOthers = 4;
    const Shared<std::atomic<int>> done;
    const std::vector<int> codes = race(1 + kOthers, [&](int index) {
      if (index == 0) {
        const auto rt = task();
        while (done->load() < kOthers) ::sched_yield();
        return 0;
      }
      for (;;) {
        try {
          const Observer seen = Observer::of(name());
          done->fetch_add(1);
          const SegmentHeader& header = seen.task().header;
          return header.abi == kSegmentAbi && header.name == name() && seen.task().incarnation == 1 ? 0 : 1;
        } catch (const SegmentError& error) {
          if (error.kind() != Kind::kAbsent) throw;  // anything else would be half a task taken for a bad one
          ::sched_yield();
        }
      }
    });
    EXPECT_EQ(codes, std::vector<int>(1 + kOthers, 0));
  }
}

TEST_F(SegmentFault, ComingAndGoingAtOnceLeavesNothingBehind) {
  for (int round = 0; round < test::cases(40); ++round) {
    const std::vector<int> codes = race(4, [&](int index) {
      for (int turn = 0; turn < 20; ++turn) {
        try {
          if (index % 2 == 0) {
            const auto rt = task();
            if (!exists()) return 1;  // listening, and the name is gone
          } else {
            const auto port = servant();
            connect(*port)->disconnect();
          }
        } catch (const SegmentError& error) {
          if (error.kind() != Kind::kAbsent && error.kind() != Kind::kInUse) throw;
        }
        if (index % 2 != 0) remove_left_behind(name());
      }
      return 0;
    });
    EXPECT_EQ(codes, std::vector<int>(4, 0));
    EXPECT_FALSE(exists()) << "round " << round;
  }
}

/// The servant's last message is unread as the task ends, in some of the turns.
TEST_F(SegmentFault, ATaskThatEndsJustAfterItsServantLeavesNothingBehind) {
  const int turns = test::cases(600);
  const Shared<std::atomic<int>> started;
  const Shared<std::atomic<int>> ended;
  const std::vector<int> codes = race(2, [&](int index) {
    int left = 0;
    for (int turn = 1; turn <= turns; ++turn) {
      if (index == 0) {
        auto rt = task();
        started->store(turn);
        while (ended->load() < turn) ::sched_yield();
        rt.reset();
        if (exists()) ++left;
        remove_left_behind(name());
      } else {
        const auto port = servant();
        while (started->load() < turn) ::sched_yield();
        connect(*port)->disconnect();
        ended->store(turn);
      }
    }
    return std::min(left, 40);
  });
  EXPECT_EQ(codes, std::vector<int>(2, 0)) << "the first: turns that left a socket";
}

TEST_F(SegmentFault, NobodyStartsOrEndsATaskWhileAnotherDoes) {
  const auto directory = RunDirectory::open(true);
  const Descriptor gate(::open((directory->path() + "/.lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));
  ASSERT_EQ(::flock(gate.get(), LOCK_EX), 0);
  const std::vector<int> codes = race(2, [&](int index) {  // at once: each gives up after two seconds
    try {
      if (index == 0) (void)task();
      if (index == 1) (void)directory->remove_left_behind(name());
    } catch (const SegmentError& error) {
      if (std::string_view(error.what()).find("starting or ending") != std::string_view::npos) throw;
      return 1;
    }
    return 0;
  });
  EXPECT_EQ(codes, std::vector<int>(2, 50 + static_cast<int>(Kind::kInUse)));
}

TEST_F(SegmentFault, ATaskKilledAnywhereBlocksNoOther) {
  const unsigned seed = std::random_device{}();
  RecordProperty("seed", std::to_string(seed));
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  for (int round = 0; round < test::cases(200); ++round) {
    const pid_t pid = ::fork();
    if (pid == 0) {
      for (;;) {
        try {
          (void)task();
        } catch (...) {
          ::_exit(1);
        }
      }
    }
    // Not a wait for anything: the instant of the kill is what is random.
    const timespec pause{0, static_cast<long>(random() % 5'000'000)};
    ::nanosleep(&pause, nullptr);
    ::kill(pid, SIGKILL);
    ::waitpid(pid, nullptr, 0);
    const auto rt = task();
    const auto port = servant();
    EXPECT_TRUE(connect(*port)->task_alive());
  }
}

}  // namespace
}  // namespace corbot
