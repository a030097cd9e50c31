// SPDX-License-Identifier: Apache-2.0
// Processes that are absent, die, come back, or find their place taken.
#include <signal.h>

#include <atomic>
#include <set>
#include <string>
#include <thread>

#include <fmt/core.h>

#include "support/paths.h"
#include "support/ports.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

class Lifecycle : public RobotRig {
 protected:
  void kill_rt() {
    rt_->signal(SIGKILL);
    ASSERT_TRUE(rt_->wait(within(10)));
  }
  std::vector<std::string> servant_command(int port) const {
    return {servant_program(CORBOT_BIN_DIR),  profile_, "--name", name_, "--endpoint",
            fmt::format("127.0.0.1:{}", port)};
  }
};

TEST_F(Lifecycle, WithoutATaskEverythingThatMovesRaisesNotReady) {
  kill_rt();
  ASSERT_TRUE(wait_for(Corbot::Error));
  expect_no_motion_accepted();
  EXPECT_EQ(raised_by([&] { arm_->Stop(); }), "NotReady");
  EXPECT_EQ(raised_by([&] { arm_->Pause(); }), "NotReady");
  EXPECT_EQ(raised_by([&] { arm_->Clear(); }), "NotReady");
  Corbot::JointCoord_var joints = arm_->ArtiCoord();  // where it was
  EXPECT_EQ(joints->length(), 4u);
  ASSERT_GE(alarms().size(), 1u);
  EXPECT_EQ(alarms().back().code, 150);
  EXPECT_TRUE(alarms().back().active);
  start_rt();
  ASSERT_TRUE(wait_for(Corbot::Standby));
  arm_->Move(0.2, 0, 0.1, 0, 0);
  for (const Corbot::AlarmInfo& alarm : alarms()) EXPECT_FALSE(alarm.active) << alarm.text;
}

TEST_F(Lifecycle, ARestartedTaskContinuesWhereTheArmIs) {
  arm_->Move(0.20, 0.05, 0.10, 0.0, 0.0);
  Corbot::JointCoord_var before = arm_->ArtiCoord();
  kill_rt();
  start_rt();
  ASSERT_TRUE(wait_for(Corbot::Standby));
  Corbot::JointCoord_var after = arm_->ArtiCoord();
  EXPECT_EQ(distance_deg(before, after), 0.0);
}

TEST_F(Lifecycle, ARestartedServantReadsWhereTheArmIs) {
  const Corbot::Ticket ticket = arm_->StartMove(0.20, 0.05, 0.10, 0.0, 1.0);
  servant_->signal(SIGKILL);
  ASSERT_TRUE(servant_->wait(within(10)));
  start_servant();
  ASSERT_TRUE(wait_for(Corbot::Standby)) << "what was accepted is carried out";
  EXPECT_NEAR(arm_->CartCoord().y, 0.05, 1e-6) << "and the old reference leads to the new servant";
  EXPECT_GT(arm_->StartReady(), ticket) << "numbers go on";
  ASSERT_TRUE(wait_for(Corbot::Standby));
}

TEST_F(Lifecycle, ClientsOfManyConnectionsFindARestartedServant) {
  constexpr int kCalls = 4;
  std::vector<std::thread> callers;
  std::atomic<int> stopped{0};
  for (int i = 0; i < kCalls; ++i) {
    callers.emplace_back([&] {
      if (raised_by([&] { arm_->Delay(600.0); }) == "Stopped") ++stopped;
    });
  }
  ASSERT_TRUE(wait_until(within(30), [&] {
    return raised_by([&] { Corbot::MotionInfo_var info = arm_->Progress(kCalls); }).empty();
  }));
  arm_->Stop();
  for (auto& caller : callers) caller.join();
  EXPECT_EQ(stopped, kCalls);
  EXPECT_EQ(servant_->terminate(), 0);
  start_servant();
  arm_->Ready();
}

TEST_F(Lifecycle, BlockedCallsFailWhenTheServantEnds) {
  std::string raised;
  std::thread caller([&] { raised = raised_by([&] { arm_->Delay(600.0); }); });
  ASSERT_TRUE(wait_for(Corbot::Waiting));
  EXPECT_EQ(servant_->terminate(), 0) << servant_->errors();
  caller.join();
  EXPECT_EQ(raised, "NotReady");
  start_servant();
  // Over a connection to a servant that has ended the first call fails.
  EXPECT_TRUE(wait_until(within(10), [&] { return raised_by([&] { arm_->Stop(); }).empty(); }));
}

TEST_F(Lifecycle, AServantThatEndsOrStartsIsNotSaidNotToExist) {
  std::atomic<bool> over{false};
  std::set<std::string> raised;
  std::thread caller([&] {
    // Over connections of before the end, and over new ones.
    while (!over) raised.insert(raised_by([&] { (void)arm_->Status(); }));
  });
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(servant_->terminate(), 0) << servant_->errors();
    start_servant();
  }
  over = true;
  caller.join();
  raised.erase("");
  for (const std::string& exception : raised)
    EXPECT_TRUE(exception == "COMM_FAILURE" || exception == "TRANSIENT") << exception;
}

TEST_F(Lifecycle, APortInUseIsNamed) {
  const RunResult second = run({servant_program(CORBOT_BIN_DIR), profile_, "--name", name_ + "b",
                                "--endpoint", fmt::format("127.0.0.1:{}", port_)});
  EXPECT_EQ(second.code, 1);
  EXPECT_NE(second.errors.find(std::to_string(port_)), std::string::npos) << second.errors;
  EXPECT_NE(second.errors.find("in use"), std::string::npos) << second.errors;
}

TEST_F(Lifecycle, ASecondServantOrTaskOfTheSameRobotIsRefused) {
  const RunResult servant = run(servant_command(free_port()));
  EXPECT_EQ(servant.code, 1);
  EXPECT_NE(servant.errors.find("in use"), std::string::npos) << servant.errors;
  const RunResult task = run({std::string(CORBOT_BIN_DIR) + "/corbot-rt", profile_, "--name", name_});
  EXPECT_EQ(task.code, 1);
  EXPECT_NE(task.errors.find("in use"), std::string::npos) << task.errors;
  arm_->Ready();
}

TEST_F(Lifecycle, BadCommandLinesAreRefused) {
  const std::string servant = servant_program(CORBOT_BIN_DIR);
  EXPECT_EQ(run({servant}).code, 2);
  EXPECT_EQ(run({servant, profile_, "--endpoint", "nonsense"}).code, 2);
  EXPECT_EQ(run({servant, profile_, "--endpoint", "127.0.0.1:99999"}).code, 2);
  EXPECT_EQ(run({servant, profile_, "--endpoint", "0.0.0.0:2000"}).code, 2);
  EXPECT_EQ(run({servant, "/nonexistent.toml"}).code, 1);
  EXPECT_EQ(run({servant, "--help"}).code, 0);
}

}  // namespace
}  // namespace corbot::test
