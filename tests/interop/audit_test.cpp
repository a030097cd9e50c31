// SPDX-License-Identifier: Apache-2.0
// The audit log of calls that came through a real ORB: where each came from, on every way in.
#include <gmock/gmock.h>
#include <signal.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include <fmt/core.h>

#include "support/cut_proxy.h"
#include "support/giop.h"
#include "support/paths.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

using ::testing::HasSubstr;

class Audit : public RobotRig {
 protected:
  void SetUp() override {
    take_name("audit");
    directory_ = fmt::format("{}/{}", CORBOT_SCRATCH_DIR, name_);
    start_rt();
    if (HasFatalFailure()) return;
    start_servant({"--state-dir", directory_});
    if (HasFatalFailure()) return;
    arm_ = connect();
    ASSERT_TRUE(wait_for(Corbot::Standby)) << servant_->errors();
  }
  void TearDown() override {
    RobotRig::TearDown();
    std::filesystem::remove_all(directory_);
  }
  /// Whole lines so far.
  [[nodiscard]] std::vector<nlohmann::json> entries() const {
    std::ifstream stream(fmt::format("{}/{}.audit", directory_, name_));
    std::vector<nlohmann::json> found;
    for (std::string line; std::getline(stream, line) && !stream.eof();)
      found.push_back(nlohmann::json::parse(line));
    return found;
  }
  /// The entries of calls that begin so, once there are `count` of them: a thread of its own writes.
  [[nodiscard]] std::vector<nlohmann::json> of_call(const std::string& call, std::size_t count = 1) const {
    std::vector<nlohmann::json> found;
    EXPECT_TRUE(wait_until(within(30), [&] {
      found.clear();
      for (const nlohmann::json& entry : entries()) {
        if (entry.value("call", "").starts_with(call)) found.push_back(entry);
      }
      return found.size() >= count;
    })) << call;
    return found;
  }

  [[nodiscard]] std::string holder() const {
    Corbot::ControlInfo_var info = arm_->Control();
    return info->holder.in();
  }

  std::string directory_;
};

TEST_F(Audit, SaysFromWhichConnectionACallCame) {
  std::vector<RawConnection> connections;
  for (int i = 0; i < 3; ++i) connections.emplace_back(port_);
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(connections[i].send(giop_request(1, name_, "Speed", {50.0 + i})));
    ASSERT_TRUE(connections[i].reply(within(30)));
  }
  for (int i = 0; i < 3; ++i) {
    const auto found = of_call(fmt::format("Speed({})", 50 + i));
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0]["from"], fmt::format("127.0.0.1:{}", connections[i].local_port()));
    EXPECT_EQ(found[0]["who"], "");
    EXPECT_EQ(found[0]["outcome"], "ok");
  }
}

TEST_F(Audit, SaysWhichUserCameOverAUnixSocket) {
  if (on_orbit2()) GTEST_SKIP() << "skipped: no client of ours speaks ORBit2's Unix sockets";
  const std::string socket = fmt::format("{}/{}.orb", CORBOT_SCRATCH_DIR, name_);
  EXPECT_EQ(servant_->terminate(), 0);
  start_servant({"--state-dir", directory_, "--unix", socket});
  if (HasFatalFailure()) return;
  Corbot::Arm_var local = connect(fmt::format("corbaloc:omniunix:{}:/{}", socket, name_));
  local->Speed(50.0);
  const auto found = of_call("Speed(50)");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0]["from"], fmt::format("local uid {}", ::getuid()));
}

/// Also those that are counted only, and wait with others.
TEST_F(Audit, SaysFromWhereEachOfManyStopsCame) {
  constexpr std::uint32_t kStops = 40;
  RawConnection connection(port_);
  std::string all;
  for (std::uint32_t i = 1; i <= kStops; ++i) all += giop_request(i, name_, "Stop");
  ASSERT_TRUE(connection.send(all));
  for (std::uint32_t i = 1; i <= kStops; ++i) ASSERT_TRUE(connection.reply(within(30)));
  const auto found = of_call("Stop()", kStops);
  EXPECT_EQ(found.size(), kStops);
  for (const nlohmann::json& entry : found)
    EXPECT_EQ(entry["from"], fmt::format("127.0.0.1:{}", connection.local_port()));
}

TEST_F(Audit, NamesTheHolder) {
  Corbot::Arm_var mine = arm_->Acquire("cell 7", 600.0);
  mine->Drive(0, 1, 20);
  const auto found = of_call("Drive(");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0]["who"], "cell 7");
  EXPECT_THAT(found[0]["from"].get<std::string>(), HasSubstr("127.0.0.1:"));
  mine->Release();
}

/// The user that runs the robot's processes ends control that no client can use, since the reply with its
/// reference was lost.
TEST_F(Audit, TheRobotsUserEndsControlThatNobodyHasTheKeyOf) {
  CutProxy proxy(port_);
  Corbot::Arm_var arm = connect(fmt::format("corbaloc::127.0.0.1:{}/{}", proxy.port(), name_));
  proxy.cut_at({"Acquire", CutPoint::Part::kReply, 0.0, true});
  EXPECT_NE(raised_by([&] { Corbot::Arm_var lost = arm->Acquire("lost", 600.0); }), "");
  ASSERT_EQ(holder(), "lost");
  EXPECT_EQ(raised_by([&] { Corbot::Arm_var none = arm_->Acquire("next", 600.0); }), "NotReady");
  servant_->signal(SIGUSR1);
  EXPECT_TRUE(wait_until(within(30), [&] { return holder().empty(); }));
  const auto found = of_call("release --force");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0]["call"], "release --force (control of 'lost')");
  EXPECT_EQ(found[0]["from"], fmt::format("local uid {}, process {}", ::getuid(), ::getpid()));
  EXPECT_EQ(found[0]["outcome"], "ok");
  Corbot::Arm_var next = arm_->Acquire("next", 600.0);
  next->Drive(0, 1, 20);
}

TEST_F(Audit, ControlThatIsEndedByForceStopsTheArm) {
  Corbot::Arm_var mine = arm_->Acquire("first", 600.0);
  const Corbot::Ticket running = mine->StartDrive(0, 80, 2);
  const Corbot::Ticket queued = mine->StartDrive(0, -80, 2);
  const auto state_of = [&](Corbot::Ticket ticket) {
    Corbot::MotionInfo_var info = arm_->Progress(ticket);
    return info->state;
  };
  ASSERT_TRUE(wait_until(within(30), [&] { return state_of(running) == Corbot::MotionRunning; }));
  std::string waiting;
  std::thread waits([&] { waiting = raised_by([&] { mine->Drive(0, 1, 20); }); });
  ASSERT_TRUE(wait_until(within(30), [&] {
    return raised_by([&] { Corbot::MotionInfo_var info = arm_->Progress(queued + 1); }).empty();
  }));
  servant_->signal(SIGUSR1);
  EXPECT_TRUE(wait_until(within(30), [&] { return holder().empty(); }));
  EXPECT_EQ(arm_->Status(), Corbot::Standby) << "control ends when the arm is at rest";
  EXPECT_EQ(state_of(running), Corbot::MotionStopped);
  EXPECT_EQ(state_of(queued), Corbot::MotionStopped);
  waits.join();
  EXPECT_EQ(waiting, "Stopped");
  EXPECT_EQ(raised_by([&] { mine->Drive(0, 1, 20); }), "NotReady");
  arm_->Drive(0, 1, 20);
  servant_->signal(SIGUSR1);  // nobody has control
  const auto found = of_call("release --force", 2);
  EXPECT_EQ(found[1]["outcome"], "NotReady: no client has control of the arm");
  arm_->Drive(0, 1, 20);
}

}  // namespace
}  // namespace corbot::test
