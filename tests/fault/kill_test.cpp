// SPDX-License-Identifier: Apache-2.0
// Kills servant, real-time task and client with SIGKILL at random instants of a motion. Nothing hangs,
// nothing is left behind, and the set-point never jumps. The test checks every cycle of the trace, across
// restarts too.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <fmt/core.h>

#include "config/load_profile.h"
#include "fault/jump_watch.h"
#include "support/arm_motions.h"
#include "support/cases.h"
#include "support/paths.h"
#include "support/ports.h"
#include "support/process.h"
#include "support/test_arms.h"

namespace corbot::test {
namespace {

const std::string kBin = CORBOT_BIN_DIR;

/// Kills per test, of four tests, one with a third of it: 40 in all. CORBOT_KILLS changes it.
int kills() {
  const char* text = std::getenv("CORBOT_KILLS");
  return text != nullptr ? std::atoi(text) : 12;
}

void random_pause(std::mt19937_64& random) {
  const timespec pause{0, std::uniform_int_distribution<long>(0, 150'000'000)(random)};
  ::nanosleep(&pause, nullptr);
}

class Kill : public ::testing::Test {
 protected:
  void SetUp() override { begin("lynx5"); }
  /// Its client moves it around the place where it is ready; the Lynx 5, which is stretched there, elsewhere.
  void begin(const std::string& arm) {
    name_ = unique_name("kill");
    port_ = free_port();
    reference_ = fmt::format("corbaloc::127.0.0.1:{}/{}", port_, name_);
    file_ = profile_path(arm);
    profile_ = load_profile(file_);
    if (arm != "lynx5") {
      const ArmMotions motions = motions_from_ready(profile_.arm, 0.08);
      ASSERT_EQ(motions.line_to_m.has_value(), has_paths(profile_.arm)) << arm;
      places_ = {"drive"};
      if (motions.line_to_m) {
        const auto from_m = tool_pose(profile_.arm.kinematics, motions.there_q).position_m;
        const auto& to_m = *motions.line_to_m;
        places_.clear();
        for (const auto& p : {to_m, from_m})
          for (const double x : p) places_.push_back(fmt::format("{:.9f}", x));
      }
    }
    start_rt();
    start_servant();
    watch_ = std::make_unique<JumpWatch>(name_, profile_.arm);
    start_client();
  }
  void TearDown() override {
    client_.reset();
    if (watch_) watch_->finish();
    watch_.reset();
    if (servant_) {
      EXPECT_EQ(servant_->terminate(), 0) << servant_->errors();
    }
    if (rt_) {
      EXPECT_EQ(rt_->terminate(), 0) << rt_->errors();
    }
    EXPECT_FALSE(channel_exists(name_)) << channel_path(name_) << " was left behind";
  }

  void start_rt() {
    rt_ = std::make_unique<Process>(std::vector<std::string>{kBin + "/corbot-rt", file_, "--name", name_});
    ASSERT_TRUE(rt_->wait_line("ready", within(30))) << rt_->errors();
  }
  void start_servant() {
    servant_ = std::make_unique<Process>(std::vector<std::string>{
        servant_program(kBin), file_, "--name", name_, "--endpoint", fmt::format("127.0.0.1:{}", port_)});
    ASSERT_TRUE(servant_->wait_line("ready", within(30))) << servant_->errors();
  }
  void start_client() {
    std::vector<std::string> command{std::string(CORBOT_TESTS_DIR) + "/fault_client", reference_};
    command.insert(command.end(), places_.begin(), places_.end());
    client_ = std::make_unique<Process>(command);
  }
  /// A motion is under way.
  [[nodiscard]] bool moving() const { return watch_->newest().state == RtState::kMoving; }

  void wait_until_moving(int round) {
    ASSERT_TRUE(client_->wait_line("ok", within(30))) << "round " << round << "\n" << client_->output();
    ASSERT_TRUE(wait_until(within(30), [&] { return moving(); }));
    random_pause(random_);
  }
  void kill_task(int round);
  void kill_servant(int round);
  void kill_client(int round);
  void freeze_task(int round);

  std::mt19937_64 random_{test::drawn_seed()};
  std::vector<double> took_s_;  ///< until the blocked call of a task that died ended
  std::string name_;
  int port_ = 0;
  std::string reference_;
  std::string file_;
  std::vector<std::string> places_;  ///< the client's arguments
  Profile profile_;
  std::unique_ptr<Process> rt_;
  std::unique_ptr<Process> servant_;
  std::unique_ptr<Process> client_;
  std::unique_ptr<JumpWatch> watch_;
};

void Kill::kill_task(int round) {
  wait_until_moving(round);
  rt_->signal(SIGKILL);
  const auto killed = std::chrono::steady_clock::now();
  ASSERT_TRUE(rt_->wait(within(30)));
  ASSERT_TRUE(client_->wait_line("NotReady", within(30))) << client_->output();
  took_s_.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - killed).count());
  ASSERT_TRUE(servant_->running()) << servant_->errors();
  start_rt();
}

void Kill::kill_servant(int round) {
  wait_until_moving(round);
  servant_->signal(SIGKILL);
  ASSERT_TRUE(servant_->wait(within(30)));
  const std::uint64_t cycle = watch_->newest().cycle;
  // The task goes on, finishes what was accepted, and holds.
  ASSERT_TRUE(wait_until(within(30), [&] {
    const Snapshot now = watch_->newest();
    return now.cycle > cycle && now.state == RtState::kStandby && now.command_id == 0;
  }));
  start_servant();
  if (HasFatalFailure()) return;
  client_.reset();
  start_client();
}

void Kill::kill_client(int round) {
  wait_until_moving(round);
  client_->signal(SIGKILL);
  ASSERT_TRUE(client_->wait(within(30)));
  // Its motion is carried out; the servant serves the next client.
  ASSERT_TRUE(wait_until(within(30), [&] { return watch_->newest().state == RtState::kStandby; }));
  ASSERT_TRUE(servant_->running());
  start_client();
}

/// For less than a gap that is a fault: the motion begins again from rest, and ends.
void Kill::freeze_task(int round) {
  wait_until_moving(round);
  rt_->signal(SIGSTOP);
  random_pause(random_);
  rt_->signal(SIGCONT);
  ASSERT_TRUE(client_->wait_line("ok", within(30))) << client_->output();
}

TEST_F(Kill, RealTimeTask) {
  for (int i = 0; i < kills(); ++i) ASSERT_NO_FATAL_FAILURE(kill_task(i));
  std::sort(took_s_.begin(), took_s_.end());
  const double median_s = took_s_[took_s_.size() / 2];
  fmt::print("blocked call ended after the task's death: median {:.0f} ms, worst {:.0f} ms\n", 1e3 * median_s,
             1e3 * took_s_.back());
  EXPECT_LE(median_s, 0.2) << "the worst is that of a machine that stood still";
  ASSERT_TRUE(client_->wait_line("ok", within(30)));
  EXPECT_GT(watch_->moving_cycles(), 0u);
  EXPECT_EQ(watch_->jumps(), 0) << watch_->first_jump();
}

/// Runs several clients, so that there is always a call between ticket and push, in the ring or just run when
/// the task dies. The next task adopts at once. Each client gets the end of every call.
TEST_F(Kill, RealTimeTaskAmongSeveralClients) {
  std::vector<std::unique_ptr<Process>> clients;
  for (int i = 0; i < 3; ++i) {
    start_client();
    clients.push_back(std::move(client_));
  }
  start_client();
  for (int i = 0; i <= kills() / 3; ++i) {
    ASSERT_TRUE(wait_until(within(30), [&] { return moving(); })) << "round " << i;
    random_pause(random_);
    rt_->signal(SIGKILL);
    ASSERT_TRUE(rt_->wait(within(30)));
    start_rt();
    if (HasFatalFailure()) return;
    // The motion that each client waited for has ended, and so has a call that it made since.
    for (const auto& client : clients) {
      ASSERT_TRUE(client->wait_line("NotReady", within(30))) << "round " << i << "\n" << client->output();
      ASSERT_TRUE(client->wait_line("ok", within(30))) << "round " << i << "\n" << client->output();
    }
  }
  EXPECT_EQ(watch_->jumps(), 0) << watch_->first_jump();
}

TEST_F(Kill, Servant) {
  for (int i = 0; i < kills(); ++i) ASSERT_NO_FATAL_FAILURE(kill_servant(i));
  ASSERT_TRUE(client_->wait_line("ok", within(30)));
  EXPECT_EQ(watch_->jumps(), 0) << watch_->first_jump();
}

TEST_F(Kill, Client) {
  for (int i = 0; i < kills(); ++i) ASSERT_NO_FATAL_FAILURE(kill_client(i));
  ASSERT_TRUE(client_->wait_line("ok", within(30)));
  EXPECT_EQ(watch_->jumps(), 0) << watch_->first_jump();
}

/// Arms of all kinds: each of the three is killed by turns, and the task frozen.
class KillOfArm : public Kill, public ::testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override { begin(GetParam()); }
};

TEST_P(KillOfArm, TaskServantAndClientByTurns) {
  for (int i = 0; i < 2; ++i) {
    ASSERT_NO_FATAL_FAILURE(kill_task(i));
    ASSERT_NO_FATAL_FAILURE(kill_servant(i));
    ASSERT_NO_FATAL_FAILURE(kill_client(i));
    ASSERT_NO_FATAL_FAILURE(freeze_task(i));
  }
  ASSERT_TRUE(client_->wait_line("ok", within(30)));
  EXPECT_GT(watch_->moving_cycles(), 0u);
  EXPECT_EQ(watch_->jumps(), 0) << watch_->first_jump();
}

/// The Lynx 5 has the tests above.
INSTANTIATE_TEST_SUITE_P(Arms, KillOfArm, ::testing::ValuesIn(kTestArms.begin() + 1, kTestArms.end()),
                         [](const auto& arm) { return std::string(arm.param); });

}  // namespace
}  // namespace corbot::test
