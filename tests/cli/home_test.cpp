// SPDX-License-Identifier: Apache-2.0
// `corbot home` against emulated drives that lose their counts with their power.
#include <gmock/gmock.h>
#include <signal.h>

#include <fstream>
#include <set>

#include "cli_rig.h"
#include "support/emulated_drives.h"
#include "support/paths.h"
#include "support/ports.h"

namespace corbot::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class Home : public CliRig {
 protected:
  Home() : drives_(CORBOT_BIN_DIR "/corbot-sim", directory_.string(), 5) {
    drives_.start();
    std::ifstream stream(CORBOT_TEST_PROFILE);
    const std::string text{std::istreambuf_iterator<char>{stream}, {}};
    std::string backend =
        "[backend]\nkind = \"socketcan\"\n[backend.socketcan]\ninterface = \"" + drives_.bus() + "\"\n";
    for (int node = 1; node <= 4; ++node) {
      backend +=
          "[[backend.socketcan.drive]]\nnode = " + std::to_string(node) + "\ncounts_per_degree = 1000\n";
      if (node == 1) backend += "homing_method = 19\nhoming_offset = 1500\n";
      if (node == 3) backend += "homing_method = 37\n";
    }
    backend += "[backend.socketcan.gripper]\nnode = 5\nclosed_count = 0\nopen_count = 40000\n";
    text_ = text.substr(0, text.find("[backend]")) + backend;
    profile_ = put("arm.toml", text_);
    for (const char* command : {"incremental on 1", "incremental on 3", "switch home 2000 1"})
      drives_.command(command);
  }
  ~Home() override {
    supervisor_.reset();
    EXPECT_EQ(drives_.stop(), 0);
  }
  void start(std::vector<std::string> joints = {}) {
    std::vector<std::string> arguments{"home", profile_};
    arguments.insert(arguments.end(), joints.begin(), joints.end());
    arguments.insert(arguments.end(), {"--name", name_});
    session_ = begin(arguments);
    ASSERT_TRUE(session_->wait_line("KEEP CLEAR", within(30))) << session_->errors();
  }
  int end() {
    const auto status = session_->wait(within(30));
    return status && WIFEXITED(*status) ? WEXITSTATUS(*status) : -1;
  }

  /// The nodes whose motors have current now, by the emulator's record.
  std::set<int> powered() {
    std::set<int> now;
    for (const DeviceRow& row : drives_.rows()) {
      const auto node = static_cast<int>(row.channel);
      if (!row.has_power) {
        now.erase(node);
        continue;
      }
      now.insert(node);
      ever_powered_.insert(node);
    }
    return now;
  }

  EmulatedDrives drives_;
  std::string text_;
  std::string profile_;
  std::set<int> ever_powered_;
  std::unique_ptr<Process> session_;
};

TEST_F(Home, IsAskedForAndLetsTheRobotStart) {
  const std::string endpoint = "127.0.0.1:" + std::to_string(free_port());
  const auto refused = begin({"up", profile_, "--name", name_, "--endpoint", endpoint});
  EXPECT_TRUE(wait_until(within(30),
                         [&] {
                           const std::string said = refused->output() + refused->errors();
                           return said.find("node 1: has not been homed since its power-up") !=
                                      std::string::npos &&
                                  said.find("corbot home ") != std::string::npos;
                         }))
      << refused->output() << refused->errors();
  (void)refused->terminate();
  start();
  if (HasFatalFailure()) return;
  EXPECT_THAT(session_->output(), AllOf(HasSubstr("base (node 1): method 19, 5 degrees a second, then 1"),
                                        HasSubstr("elbow (node 3): method 37")));
  EXPECT_EQ(drives_.counts(), (std::map<int, std::int32_t>{{1, 0}, {2, 0}, {3, 0}, {4, 0}, {5, 0}}));
  session_->send("on");
  EXPECT_TRUE(session_->wait_line("base is homed: count 1", within(60))) << session_->errors();
  EXPECT_TRUE(session_->wait_line("elbow is homed: count 0, 0.00 degrees", within(60))) << session_->errors();
  EXPECT_EQ(end(), 0) << session_->errors();
  const auto counts = drives_.counts();
  EXPECT_NEAR(counts.at(1), 1500, 50);
  EXPECT_EQ(counts.at(2), 0) << "has held";
  up({}, profile_);
  EXPECT_TRUE(wait_state("Standby"));
}

TEST_F(Home, IsRefusedWhileAHoldIsInForce) {
  start();
  if (HasFatalFailure()) return;
  session_->send("on");
  ASSERT_EQ(end(), 0) << session_->errors();
  up({}, profile_);
  if (HasFatalFailure()) return;
  EXPECT_EQ(corbot({"hold"}).code, 0);
  EXPECT_EQ(corbot({"down"}).code, 0);
  supervisor_.reset();
  const RunResult held = corbot({"home", profile_, "--name", name_});
  EXPECT_EQ(held.code, 1);
  EXPECT_THAT(held.errors, AllOf(HasSubstr("'" + name_ + "' is held"), HasSubstr("delete "),
                                 HasSubstr(name_ + ".position")));
}

/// By the signals that end a program.
class HomeIsEnded : public Home, public testing::WithParamInterface<int> {};

TEST_P(HomeIsEnded, AndHaltsTheDriveAndTakesTheVoltageOff) {
  drives_.command("switch home 900000 1");
  start({"base", "elbow"});
  if (HasFatalFailure()) return;
  session_->send("on");
  ASSERT_TRUE(wait_until(within(30), [&] { return drives_.counts().at(1) > 500; }));
  session_->signal(GetParam());
  EXPECT_EQ(end(), 4);
  EXPECT_THAT(session_->errors(),
              HasSubstr("base was halted, and is not homed; the drives are de-energised"));
  EXPECT_THAT(session_->output(), Not(HasSubstr("elbow is being homed")));
  const std::int32_t at = drives_.counts().at(1);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(drives_.counts().at(1), at);
  EXPECT_EQ(powered(), std::set<int>{});
}

TEST_P(HomeIsEnded, WhileTheDrivesAreBeingEnabled) {
  std::string text = text_;
  text.replace(text.find("[backend.socketcan]\n"), 20, "[backend.socketcan]\nstagger_ms = 2000\n");
  profile_ = put("arm.toml", text);
  start();
  if (HasFatalFailure()) return;
  session_->send("on");
  ASSERT_TRUE(wait_until(within(30), [&] { return powered().count(1) > 0; }));
  session_->signal(GetParam());
  EXPECT_EQ(end(), 4);
  EXPECT_THAT(session_->errors(), HasSubstr("the drives are disabled again, and nothing has moved"));
  EXPECT_EQ(powered(), std::set<int>{});
  EXPECT_EQ(ever_powered_.count(5), 0u) << "whose turn was eight seconds later";
  EXPECT_EQ(drives_.counts(), (std::map<int, std::int32_t>{{1, 0}, {2, 0}, {3, 0}, {4, 0}, {5, 0}}));
}

INSTANTIATE_TEST_SUITE_P(By, HomeIsEnded, testing::Values(SIGINT, SIGTERM));

TEST_F(Home, MovesNothingWithoutOn) {
  start();
  if (HasFatalFailure()) return;
  session_->send("quit");
  EXPECT_EQ(end(), 4);
  EXPECT_THAT(session_->errors(), HasSubstr("nothing has moved"));
  EXPECT_EQ(drives_.counts("targets"), (std::map<int, std::int32_t>{{1, 0}, {2, 0}, {3, 0}, {4, 0}, {5, 0}}));
}

TEST_F(Home, IsForDrivesThatNeedIt) {
  RunResult result = corbot({"home", profile_, "wrist", "--name", name_});
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.errors, HasSubstr("joint wrist has no homing_method"));
  result = corbot({"home", profile_, "3", "--name", name_});  // numbers begin at 0, as in all commands
  EXPECT_THAT(result.errors, HasSubstr("joint wrist has no homing_method"));
  result = corbot({"home", profile_, "4", "--name", name_});
  EXPECT_THAT(result.errors, HasSubstr("JOINT '4': the arm has no such joint"));
  result = corbot({"home", profile_, "thumb", "--name", name_});
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(
      result.errors,
      HasSubstr("JOINT 'thumb': the arm has no such joint; its joints are base, shoulder, elbow, wrist"));
  result = corbot({"home", profile_, "gripper", "--name", name_});
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.errors, HasSubstr("corbot does not home the gripper, which would take a held piece"));
  result = corbot({"home", CORBOT_TEST_PROFILE, "--name", name_});
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.errors, HasSubstr("corbot homes only drives on a CAN bus (socketcan)"));
}

using HomeOfASlide = CliRig;

/// And then driven by the robot, to Ready and back.
TEST_F(HomeOfASlide, IsInMetres) {
  EmulatedDrives drives(CORBOT_BIN_DIR "/corbot-sim", directory_.string(), 3);
  drives.start();
  std::ifstream stream(std::string(CORBOT_PROFILES) + "/cartesian_ppp.toml");
  const std::string shipped{std::istreambuf_iterator<char>{stream}, {}};
  std::string text =
      shipped.substr(0, shipped.find("[backend]")) +
      "[loop]\ngap_fault_ms = 10000\nfrozen_ms = 2000\n[backend]\nkind = \"socketcan\"\n[backend.socketcan]\n"
      "interface = \"" +
      drives.bus() + "\"\n";
  for (int node = 1; node <= 3; ++node) {
    text += "[[backend.socketcan.drive]]\nnode = " + std::to_string(node) + "\ncounts_per_m = 200000\n";
    if (node == 1) text += "homing_method = 19\nhoming_offset = 1500\nhoming_speed_m_s = 0.05\n";
  }
  const std::string profile = put("arm.toml", text);
  for (const char* command : {"incremental on 1", "switch home 2000 1"}) drives.command(command);
  const auto session = begin({"home", profile, "--name", name_});
  ASSERT_TRUE(session->wait_line("KEEP CLEAR", within(30))) << session->errors();
  EXPECT_THAT(session->output(), HasSubstr("x (node 1): method 19, 0.05 m a second, then 0.002"));
  session->send("on");
  const auto homed = session->wait_line("x is homed: count 1", within(60));
  ASSERT_TRUE(homed) << session->errors();
  EXPECT_THAT(*homed, testing::EndsWith(" m"));
  const auto status = session->wait(within(30));
  ASSERT_TRUE(status && WIFEXITED(*status));
  EXPECT_EQ(WEXITSTATUS(*status), 0) << session->errors();
  EXPECT_NEAR(drives.counts().at(1), 1500, 50);

  up({}, profile);
  ASSERT_TRUE(wait_state("Standby"));
  const RunResult moved = corbot({"joints", "0.1", "0.05", "0.02"});
  ASSERT_EQ(moved.code, 0) << moved.errors;
  const auto stand_at = [&](const std::map<int, std::int32_t>& wanted) {
    return wait_until(within(20), [&] { return drives.counts() == wanted; });
  };
  EXPECT_TRUE(stand_at({{1, 20'000}, {2, 10'000}, {3, 4'000}}));
  ASSERT_EQ(corbot({"ready"}).code, 0);
  EXPECT_TRUE(stand_at({{1, 0}, {2, 0}, {3, 0}}));
  supervisor_.reset();
  EXPECT_EQ(drives.stop(), 0);
}

}  // namespace
}  // namespace corbot::test
