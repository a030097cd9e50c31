// SPDX-License-Identifier: Apache-2.0
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <pthread.h>
#include <stddef.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <functional>
#include <mutex>
#include <new>
#include <string>
#include <vector>

#include "../../support/arm_motions.h"
#include "corbot/kinematics/tool_pose.h"
#include "rt/bad_line.h"
#include "rt/rate_command.h"
#include "rt/rig.h"
#include "support/paths.h"

// Proves the cycle's promise by interposition. This program brings its own malloc, operator new and mutex
// functions, which count while armed. It runs the cycle in a child, which dies of every system call but
// exit_group and write.

#if CORBOT_SANITIZED

TEST(CycleSystemCalls, AreNotCountedUnderSanitizers) {
  GTEST_SKIP() << "the sanitizer brings its own malloc";
}

#else

namespace {

volatile bool armed = false;
volatile int allocations = 0;
volatile int locks = 0;

void count_allocation() {
  if (armed) allocations = allocations + 1;
}

}  // namespace

extern "C" {
void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void* __libc_memalign(size_t, size_t);
void __libc_free(void*);

void* malloc(size_t size) noexcept {
  count_allocation();
  return __libc_malloc(size);
}
void* calloc(size_t count, size_t size) noexcept {
  count_allocation();
  return __libc_calloc(count, size);
}
void* realloc(void* old, size_t size) noexcept {
  count_allocation();
  return __libc_realloc(old, size);
}
void* aligned_alloc(size_t alignment, size_t size) noexcept {
  count_allocation();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** result, size_t alignment, size_t size) noexcept {
  count_allocation();
  *result = __libc_memalign(alignment, size);
  return *result == nullptr ? ENOMEM : 0;
}
void free(void* memory) noexcept {
  count_allocation();
  __libc_free(memory);
}

using MutexFunction = int (*)(pthread_mutex_t*);

int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
  static const auto real = reinterpret_cast<MutexFunction>(dlsym(RTLD_NEXT, "pthread_mutex_lock"));
  if (armed) locks = locks + 1;
  return real(mutex);
}
int pthread_mutex_trylock(pthread_mutex_t* mutex) noexcept {
  static const auto real = reinterpret_cast<MutexFunction>(dlsym(RTLD_NEXT, "pthread_mutex_trylock"));
  if (armed) locks = locks + 1;
  return real(mutex);
}
}

namespace corbot::test {
namespace {

constexpr int kAllocated = 11;
constexpr int kLocked = 12;
constexpr int kNotMoved = 13;
constexpr int kNoFilter = 14;

bool forbid_system_calls() {
  sock_filter code[] = {
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_exit_group, 2, 0),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_write, 1, 0),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
  };
  const sock_fprog program{sizeof(code) / sizeof(code[0]), code};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}

/// Runs `work` in a child under watch. The wait status.
int watched(const std::function<bool()>& work) {
  std::mutex warm;
  warm.lock();  // resolves the real function now
  warm.unlock();
  (void)warm.try_lock();
  warm.unlock();
  const pid_t child = fork();
  if (child == 0) {
    if (!forbid_system_calls()) _exit(kNoFilter);
    armed = true;
    const bool done = work();
    armed = false;
    _exit(allocations > 0 ? kAllocated : locks > 0 ? kLocked : done ? 0 : kNotMoved);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return status;
}

/// Any arm, with motions of every kind that it can do.
class OfEveryArm : public ::testing::TestWithParam<const char*> {
 protected:
  OfEveryArm() {
    rig.step();
    const auto add = [this](const PlanResult& plan) {
      const std::vector<Command> more = rig.with_knots(plan);
      commands.insert(commands.end(), more.begin(), more.end());
    };
    add(rig.planner.move_joints(rig.start(), {}, motions.there_q, 0.0));
    add(rig.planner.gripper({motions.there_q, 0.0}, 0.5));
    add(rig.planner.dwell({motions.there_q, 0.5}, 0.1));
    if (motions.line_to_m) {
      const auto p = tool_pose(rig.arm.kinematics, motions.there_q).position_m;
      add(rig.planner.move_c({motions.there_q, 0.5}, motions.settings, p, motions.arc_m[0],
                             motions.arc_m[1]));
      add(rig.planner.move_s({commands.back().end_q, 0.5}, motions.settings, p, 0.0));
    }
    const PlanStart end{commands.back().end_q, 0.5};
    last =
        rig.with_knots(motions.line_to_m ? rig.planner.move_s(end, motions.settings, *motions.line_to_m, 10.0)
                                         : rig.planner.ready(end, {}))
            .front();
  }

  /// Every kind of motion, then one with pause, resume, override and stop, a refusal, and a fault.
  bool whole_life() {
    const std::uint64_t id = rig.submit(commands);
    for (int i = 0; i < 200'000 && rig.snapshot.last_done_id != id; ++i) rig.step();
    const bool arrived = rig.snapshot.last_done_id == id && id == commands.size();
    last = rig.stamp(last);
    (void)rig.push(last);
    rig.step(40);
    rig.pause(true);
    rig.step(400);
    rig.pause(false);
    rig.step(20);
    rig.override_to(0.5);
    rig.step(20);
    rig.stop();
    rig.step(3000);
    const bool stopped = rig.stops_done() == 1 && rig.snapshot.last_done_id == last.id &&
                         rig.snapshot.position_q != last.end_q;
    last.id += 1;
    last.epoch = rig.snapshot.stops_done;
    (void)rig.push(last);  // not from here
    rig.step(3);
    rig.backend.set_plugged(false);
    rig.step(3);
    rig.clear();
    rig.step(3);
    return arrived && stopped && rig.snapshot.state == RtState::kError &&
           rig.snapshot.last_done_id == last.id;
  }

  Rig rig{arm_of(GetParam())};
  const ArmMotions motions = motions_of(rig.arm);
  std::vector<Command> commands;
  Command last{};
};

class CycleSystemCalls : public ::testing::Test {
 protected:
  CycleSystemCalls() {
    rig.step();
    rig.submit(rig.planner.move_joints(rig.start(), {}, {0.8, 1.2, 1.5, 0.5}, 0.0));
  }
  Rig rig;
};

int code_of(int status) { return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status); }

TEST_P(OfEveryArm, NoAllocationNoLockNoSystemCall) {
  EXPECT_EQ(motions.line_to_m.has_value(), has_paths(rig.arm)) << "lines and arcs";
  EXPECT_EQ(code_of(watched([this] { return whole_life(); })), 0);
}

TEST_P(OfEveryArm, NorOnTheRampOfAPress) {
  EXPECT_EQ(code_of(watched([this] {
              rig.submit(commands);
              rig.step(100);
              rig.emergency_stop->set(StopSource::kGpio, true);
              const bool is_slowed_down = !rig.step().at_rest;
              rig.step(1000);
              return is_slowed_down && (rig.snapshot.flags & kSnapshotPowerOff) != 0;
            })),
            0);
}

INSTANTIATE_TEST_SUITE_P(CycleSystemCalls, OfEveryArm, ::testing::ValuesIn(kTestArms),
                         [](const auto& arm) { return std::string(arm.param); });

/// Knots are copied, checked and followed; forged ones are refused.
TEST_F(CycleSystemCalls, NorBetweenKnots) {
  Rig other(load_profile(std::filesystem::path(CORBOT_PROFILES) / "xarm6.toml").arm);
  other.step();
  const Vector3 there = other.arm.kinematics.forward({}).position_m + Vector3{0.02, 0.15, -0.08};
  const PlanResult plan = other.planner.move_s(other.start(), {}, there, 0.0);
  other.submit(plan);
  Command forged = other.stamp(std::get<std::vector<Command>>(plan).front());
  forged.start_q = forged.end_q;
  forged.line.knots.slot = 9;
  (void)other.push(forged);
  const std::unique_ptr<ServantSegment> former =
      std::exchange(other.servant, std::make_unique<ServantSegment>());
  other.servant->next_command_id.store(former->next_command_id.load());
  const ServantOffer offer{other.servant.get(), ++other.session};
  EXPECT_EQ(code_of(watched([&] {
              other.step(50);
              const bool moves = other.snapshot.command_id != 0;
              other.servants.post(offer);
              other.step(4000);
              return moves && other.snapshot.last_done_id == forged.id &&
                     norm(other.snapshot.tool.position_m - there) < 1e-9;
            })),
            0);
}

/// Two lines with rates are checked and followed; the second one's servant is replaced before.
TEST_F(CycleSystemCalls, NorAlongARate) {
  Rig other(arm_of("puma560"));
  other.restart({.position_q = {0.3, -0.8, 0.4, 0.2, 0.3, 0.1}, .position_known = true});
  other.step();
  PlanStart from = other.start();
  for (const double by_m : {-0.05, 0.05}) {
    const Vector3 there = other.arm.kinematics.forward(from.position_q).position_m + Vector3{0.0, by_m, by_m};
    const PlanResult plan = other.planner.move_s(from, {}, there, 0.0);
    const Command line = other.stamp(std::get<std::vector<Command>>(plan).front());
    const Command command = with_rate(other, line, by_m > 0.0 ? 3 : 5);
    (void)other.push(command);
    from.position_q = command.end_q;
  }
  const std::unique_ptr<ServantSegment> former =
      std::exchange(other.servant, std::make_unique<ServantSegment>());
  other.servant->next_command_id.store(former->next_command_id.load());
  const ServantOffer offer{other.servant.get(), ++other.session};
  EXPECT_EQ(code_of(watched([&] {
              other.step(50);
              const bool moves = other.snapshot.command_id == 1;
              other.servants.post(offer);
              other.step(4000);
              return moves && other.snapshot.last_done_id == 2 &&
                     other.snapshot.position_q == from.position_q &&
                     other.snapshot.state == RtState::kStandby;
            })),
            0);
}

TEST_F(CycleSystemCalls, NorOnTheRampOfAPathThatIsLeft) {
  Rig on_line;
  BadLine().begin(on_line);
  EXPECT_EQ(code_of(watched([&] {
              on_line.step(3000);  // off its path in the middle
              return (on_line.snapshot.flags & kSnapshotPowerOff) != 0;
            })),
            0);
}

TEST_F(CycleSystemCalls, OneNewIsCaught) {
  EXPECT_EQ(code_of(watched([this] {
              rig.step();
              int* volatile leaked = new int(1);
              return leaked != nullptr;
            })),
            kAllocated);
}

TEST_F(CycleSystemCalls, OneLockIsCaught) {
  EXPECT_EQ(code_of(watched([this] {
              static std::mutex mutex;
              rig.step();
              const std::lock_guard<std::mutex> guard(mutex);
              return true;
            })),
            kLocked);
}

TEST_F(CycleSystemCalls, OneSystemCallIsCaught) {
  EXPECT_EQ(code_of(watched([this] {
              rig.step();
              return syscall(SYS_getppid) > 0;
            })),
            1000 + SIGSYS);
}

}  // namespace
}  // namespace corbot::test

#endif
