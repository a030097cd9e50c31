// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "segment_fixture.h"

// Processes that die, and processes that start at once.

namespace corbot {
namespace {

using Kind = SegmentError::Kind;
using SegmentFault = SegmentTest;

/// Runs `body` in `count` processes released at one instant; their exit codes.
std::vector<int> race(int count, const std::function<int(int)>& body) {
  void* const shared = ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (shared == MAP_FAILED) ::abort();
  auto* const waiting = new (shared) std::atomic<int>(0);
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
  ::munmap(shared, 4096);
  return codes;
}

TEST_F(SegmentFault, KillingATaskFreesItsRoleAndKeepsTheSnapshot) {
  Child rt([&] {
    auto* segment = new Segment(task());
    Snapshot snapshot{};
    snapshot.cycle = 321;
    segment->layout().snapshot.store(snapshot);
  });
  ASSERT_TRUE(rt.ready());
  const Segment user = servant();
  EXPECT_TRUE(user.peer_alive());
  rt.kill();
  EXPECT_FALSE(user.peer_alive());
  const Segment again = task();
  EXPECT_TRUE(again.adopted());
  EXPECT_EQ(again.layout().header.incarnation.load(), 2u);
  Snapshot snapshot{};
  ASSERT_TRUE(last_snapshot(again.layout(), snapshot));
  EXPECT_EQ(snapshot.cycle, 321u);
  EXPECT_TRUE(user.peer_alive());
}

TEST_F(SegmentFault, KillingAServantFreesItsRoleAndKeepsItsNumbers) {
  const Segment rt = task();
  for (std::uint64_t round = 1; round <= 3; ++round) {
    Child user([&] {
      auto* segment = new Segment(servant());
      SegmentHeader& header = segment->layout().header;
      header.next_command_id.store(header.next_command_id.load() + 10);
    });
    ASSERT_TRUE(user.ready());
    EXPECT_TRUE(rt.peer_alive());
    user.kill();
    EXPECT_FALSE(rt.peer_alive());
    EXPECT_EQ(rt.layout().header.next_command_id.load(), 1 + 10 * round);
  }
}

TEST_F(SegmentFault, ATaskKilledInTheMiddleOfAStoreLeavesTheCycleBefore) {
  std::uint64_t torn = 0;
  // About every fifth kill meets a store; enough of them must, or the test has tested nothing.
  constexpr std::uint64_t kTornWanted = 5;
  for (int round = 0; round < 500 && torn < kTornWanted; ++round) {
    Child rt([&] {
      auto* segment = new Segment(task());
      std::thread([segment] {
        Snapshot snapshot{};
        for (std::uint64_t cycle = 1;; ++cycle) {
          snapshot.cycle = cycle;
          for (double& pulse : snapshot.pulse_us) pulse = static_cast<double>(cycle);
          segment->layout().trace.append(snapshot);
          segment->layout().snapshot.store(snapshot);
        }
      }).detach();
      while (segment->layout().trace.next() < 100) ::sched_yield();
    });
    ASSERT_TRUE(rt.ready());
    rt.kill();
    const Segment again = task();
    Snapshot snapshot{};
    torn += !again.layout().snapshot.load(snapshot);
    ASSERT_TRUE(last_snapshot(again.layout(), snapshot));
    EXPECT_GE(snapshot.cycle, 1u);
    EXPECT_LE(again.layout().trace.next() - snapshot.cycle, 1u) << "the last or the one before";
    for (const double pulse : snapshot.pulse_us) ASSERT_EQ(pulse, static_cast<double>(snapshot.cycle));
    std::filesystem::remove(path());  // the next round counts from 1 again
  }
  EXPECT_EQ(torn, kTornWanted);
}

TEST_F(SegmentFault, OfTasksThatStartAtOnceExactlyOneGetsTheSegment) {
  for (int round = 0; round < 50; ++round) {
    constexpr int kTasks = 6;
    // The winner stays until all have decided: the losers' number is counted in the segment's own memory.
    void* const shared = ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    ASSERT_NE(shared, MAP_FAILED);
    auto* const decided = new (shared) std::atomic<int>(0);
    const std::vector<int> codes = race(kTasks, [&](int) {
      try {
        Segment rt = task();
        decided->fetch_add(1);
        while (decided->load() < kTasks) ::sched_yield();
        const bool sound = rt.layout().header.magic.load() == kSegmentMagic && rt.linked() &&
                           rt.layout().header.incarnation.load() == 1 &&
                           rt.layout().header.rt_pid.load() == ::getpid();
        rt.leave();
        return sound ? 0 : 1;
      } catch (...) {
        decided->fetch_add(1);
        throw;
      }
    });
    ::munmap(shared, 4096);
    EXPECT_EQ(std::count(codes.begin(), codes.end(), 0), 1);
    EXPECT_EQ(std::count(codes.begin(), codes.end(), 50 + static_cast<int>(Kind::kInUse)), kTasks - 1)
        << testing::PrintToString(codes);
    EXPECT_FALSE(exists());
  }
}

TEST_F(SegmentFault, AProcessThatAttachesWhileItIsMadeSeesNothingOrAllOfIt) {
  for (int round = 0; round < 50; ++round) {
    constexpr int kOthers = 4;
    const std::vector<int> codes = race(1 + kOthers, [&](int index) {
      if (index == 0) {
        const Segment rt = task();
        return 0;
      }
      for (;;) {
        try {
          const Segment seen = Segment::observe(name());
          const SegmentHeader& header = seen.layout().header;
          return header.abi == kSegmentAbi && header.name == name() && header.incarnation.load() == 1 &&
                         header.next_command_id.load() == 1 &&
                         seen.layout().control.override_ratio.load() == 1.0
                     ? 0
                     : 1;
        } catch (const SegmentError& error) {
          if (error.kind() != Kind::kAbsent)
            throw;  // anything else would be half a segment taken for a bad one
          ::sched_yield();
        }
      }
    });
    EXPECT_EQ(codes, std::vector<int>(1 + kOthers, 0));
    std::filesystem::remove(path());
  }
}

TEST_F(SegmentFault, EnteringAndLeavingAtOnceLeavesNothingBehind) {
  for (int round = 0; round < 50; ++round) {
    const std::vector<int> codes = race(4, [&](int index) {
      for (int turn = 0; turn < 20; ++turn) {
        try {
          Segment segment = index % 2 == 0 ? task() : servant();
          if (!segment.linked()) return 1;  // inside, and the name is gone
          segment.leave();
        } catch (const SegmentError& error) {
          if (error.kind() != Kind::kAbsent && error.kind() != Kind::kInUse) throw;
        }
      }
      return 0;
    });
    EXPECT_EQ(codes, std::vector<int>(4, 0));
    EXPECT_FALSE(exists()) << "round " << round;
  }
}

TEST_F(SegmentFault, NoProcessEntersOrLeavesWhileAnotherDoes) {
  Segment rt = task();
  const segment_detail::File file = segment_detail::open_existing(name(), O_RDWR);
  ASSERT_TRUE(file.lock(segment_detail::LockByte::kGate));
  const int refused = 50 + static_cast<int>(Kind::kInUse);
  const auto text_tells = [](const SegmentError& error) {
    return std::string_view(error.what()).find("entering or leaving") != std::string_view::npos;
  };
  const std::vector<int> codes = race(3, [&](int index) {  // at once: each gives up after two seconds
    try {
      if (index == 0) (void)task();
      if (index == 1) (void)servant();
      if (index == 2) rt.leave();
    } catch (const SegmentError& error) {
      if (text_tells(error)) throw;
      return 1;
    }
    return 0;
  });
  EXPECT_EQ(codes, std::vector<int>(3, refused));
  file.unlock(segment_detail::LockByte::kGate);
  Segment user = servant();
  user.leave();
  rt.leave();
  EXPECT_FALSE(exists());
}

TEST_F(SegmentFault, TheTwoSidesLeavingAtOnceLeaveNothingBehind) {
  constexpr int kTurns = 1000;
  void* const shared = ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(shared, MAP_FAILED);
  auto* const arrived = new (shared) std::atomic<int>(0);
  const auto meet = [arrived](int meeting) {
    arrived->fetch_add(1);
    for (int spin = 0; arrived->load() < 2 * meeting; ++spin) {
      if (spin > 1000) ::sched_yield();
    }
  };
  const std::vector<int> codes = race(2, [&](int index) {
    for (int turn = 0; turn < kTurns; ++turn) {
      std::optional<Segment> segment;
      if (index == 0) segment.emplace(task());
      meet(4 * turn + 1);
      if (index == 1) segment.emplace(servant());
      meet(4 * turn + 2);
      segment->leave();
      meet(4 * turn + 3);
      if (exists()) return 2;
      meet(4 * turn + 4);
    }
    return 0;
  });
  ::munmap(shared, 4096);
  EXPECT_EQ(codes, std::vector<int>(2, 0)) << "2: the file was still there when both had left";
}

TEST_F(SegmentFault, ACreatorKilledAnywhereBlocksNoOther) {
  const unsigned seed = std::random_device{}();
  RecordProperty("seed", std::to_string(seed));
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  for (int round = 0; round < 100; ++round) {
    const pid_t pid = ::fork();
    if (pid == 0) {
      for (;;) {
        try {
          Segment rt = task();
          rt.leave();
        } catch (...) {
          ::_exit(1);
        }
      }
    }
    // Not a wait for anything: the instant of the kill is what is random.
    const timespec pause{0, static_cast<long>(random() % 2'000'000)};
    ::nanosleep(&pause, nullptr);
    ::kill(pid, SIGKILL);
    ::waitpid(pid, nullptr, 0);
    Segment rt = task();
    const Segment user = servant();
    EXPECT_TRUE(user.peer_alive());
    EXPECT_EQ(rt.layout().control.override_ratio.load(), 1.0);
    std::filesystem::remove(path());
  }
}

}  // namespace
}  // namespace corbot
