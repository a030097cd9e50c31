// SPDX-License-Identifier: Apache-2.0
// Tests against Python's canopen package, which is independent of corbot: as a master for the emulated
// drives, and as drives for the backend. If both sides of this project agree with it, they agree with the
// standard.
#include <gmock/gmock.h>

#include <filesystem>

#include "rt/backends/bus/bus_backend.h"
#include "rt/backends/can/socketcan.h"
#include "support/emulated_drives.h"
#include "support/paths.h"

namespace corbot::test {
namespace {

using ::testing::HasSubstr;

class CanopenPeer : public ::testing::Test {
 protected:
  void SetUp() override {
    const RunResult made = run({CORBOT_CLIENTS_DIR "/canopen/prepare", CORBOT_CLIENTS_OUT "/canopen"}, 500.0);
    if (made.code == 77) GTEST_SKIP() << "skipped: " << made.errors;
    ASSERT_EQ(made.code, 0) << made.errors;
    directory_ = std::string(CORBOT_SCRATCH_DIR) + "/" + unique_name("peer");
    std::filesystem::create_directory(directory_);
  }
  void TearDown() override {
    if (drives_) {
      EXPECT_EQ(drives_->stop(), 0);
    }
    std::filesystem::remove_all(directory_);
  }
  void start(int nodes) {
    drives_.emplace(CORBOT_BIN_DIR "/corbot-sim", directory_, nodes);
    drives_->start();
  }

  const std::string peer_ = CORBOT_CLIENTS_OUT "/canopen/client";
  std::string directory_;
  std::optional<EmulatedDrives> drives_;
};

TEST_F(CanopenPeer, MastersTheEmulatedDrive) {
  start(2);
  const RunResult result = run({peer_, "master", drives_->bus()}, 60.0);
  EXPECT_EQ(result.code, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("ok\n"));
}

TEST_F(CanopenPeer, IsDrivenByTheBackend) {
  start(0);
  Process peer({peer_, "drives", drives_->bus(), "2"});
  ASSERT_TRUE(peer.wait_line("ready", within(60))) << peer.errors();
  ArmModel arm;
  arm.dof = 2;
  arm.period_ns = 20'000'000;  // what an interpreter can follow
  rt::Cia402Settings settings;
  settings.interface = drives_->bus();
  settings.loop_ns = arm.period_ns;
  settings.heartbeat_ms = 500;
  settings.joints = {{1, 10'000.0, 0.0, 1.0}, {2, 10'000.0, 0.0, -1.0}};
  // The peer's statusword has no more than the states.
  for (rt::JointDrive& joint : settings.joints) joint.reports_following = false;
  EmergencyStop stop;
  ServoFrame frame;
  frame.servo_count = 3;
  frame.position_q[0] = 0.1;
  frame.position_q[1] = 0.2;
  rt::BusBackend backend(arm, std::make_unique<rt::Cia402Drives>(settings), {"socketcan", true, false, 0.2},
                         stop);
  ASSERT_NO_THROW(backend.open(frame)) << peer.errors();
  EXPECT_TRUE(wait_until(within(30),
                         [&] {
                           backend.write(frame);
                           peer.send("positions");
                           return peer.wait_line("positions", within(10)) == "positions 1=1000 2=-2000";
                         }))
      << to_string(backend.drain_log()) << peer.errors();
  EXPECT_TRUE(wait_until(within(30), [&] {
    const ServoFeedback feedback = backend.read();
    return feedback.measured && std::abs(feedback.position_q[1] - 0.2) < 1e-9;
  }));
  backend.close();
}

}  // namespace
}  // namespace corbot::test
