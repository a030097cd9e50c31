// SPDX-License-Identifier: Apache-2.0
// The whole chain across a power-down: the last position is restored, and the first motion is slow.
#include <gmock/gmock.h>
#include <signal.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include <fmt/core.h>

#include "config/profile.h"
#include "shm/channel_client.h"
#include "support/paths.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class PowerUp : public RobotRig {
 protected:
  void SetUp() override {
    take_name("power");
    directory_ = fmt::format("{}/{}", CORBOT_SCRATCH_DIR, name_);
    fs::create_directory(directory_);
  }
  void TearDown() override {
    power_down();
    EXPECT_FALSE(channel_exists(name_));
    fs::remove_all(directory_);
  }
  /// The Lynx 5 with another backend.
  void write_profile(const std::string& backend) {
    std::ifstream from(CORBOT_TEST_PROFILE);
    std::stringstream text;
    text << from.rdbuf();
    const std::string all = text.str();
    profile_ = directory_ + "/arm.toml";
    std::ofstream(profile_) << all.substr(0, all.find("[backend]")) << backend;
  }
  void start_both() {
    start_rt({"--state-dir", directory_});
    if (!HasFatalFailure()) start_servant({"--state-dir", directory_});
    if (HasFatalFailure()) return;
    // Over a connection to a servant that was killed the first call fails.
    ASSERT_TRUE(wait_until(within(30), [&] { return raised_by([&] { arm_ = connect(); }).empty(); }));
  }
  void power_up() {
    start_both();
    if (HasFatalFailure()) return;
    ASSERT_TRUE(wait_for(Corbot::Standby)) << servant_->errors() << rt_->errors();
  }
  /// Both end, and the segment with them.
  void power_down() {
    arm_ = Corbot::Arm::_nil();
    if (servant_) {
      EXPECT_EQ(servant_->terminate(), 0) << servant_->errors();
    }
    if (rt_) {
      EXPECT_EQ(rt_->terminate(), 0) << rt_->errors();
    }
    servant_.reset();
    rt_.reset();
  }
  bool uncertain() {
    Corbot::DeviceInfo_var device = arm_->Device();
    return device->positionUncertain;
  }
  Corbot::JointCoord joints() {
    Corbot::JointCoord_var now = arm_->ArtiCoord();
    return now.in();
  }
  /// The highest rate of virtual time of any cycle in the flight recorder.
  double fastest_rate() const {
    const Observer channel = Observer::of(name_);
    const Trace& trace = channel.task().trace;
    double fastest = 0.0;
    const std::uint64_t end = trace.next();
    for (std::uint64_t i = end - std::min<std::uint64_t>(end, Trace::capacity()); i < end; ++i) {
      Snapshot snapshot{};
      if (trace.read(i, snapshot)) fastest = std::max(fastest, snapshot.virtual_rate);
    }
    return fastest;
  }
  [[nodiscard]] std::string kept() const {
    std::ifstream file(fmt::format("{}/{}.loopback.position", directory_, name_));
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
  }

  std::string directory_;
};

TEST_F(PowerUp, TheLastPositionIsTakenUpAndTheFirstMotionIsSlow) {
  write_profile("[backend]\nkind = \"loopback\"\nposition_known_at_start = false\n");
  power_up();
  if (HasFatalFailure()) return;
  EXPECT_THAT(rt_->output(), HasSubstr("position UNKNOWN"));
  EXPECT_TRUE(uncertain());
  EXPECT_NEAR(arm_->OverridePercent(), 10.0, 1e-9);
  arm_->Drive(0, 5.0, 90.0);
  EXPECT_FALSE(uncertain());
  arm_->Move(0.20, 0.05, 0.10, 0.0, 0.0);
  arm_->Open();
  const Corbot::JointCoord before = joints();
  power_down();
  ASSERT_FALSE(channel_exists(name_));

  power_up();
  if (HasFatalFailure()) return;
  EXPECT_THAT(rt_->errors(), HasSubstr("where corbot left it"));
  EXPECT_LT(distance_deg(before, joints()), 1e-9);
  EXPECT_EQ(arm_->GripperStatus(), Corbot::Open);
  EXPECT_TRUE(uncertain());
  arm_->Drive(0, -3.0, 90.0);
  EXPECT_NEAR(fastest_rate(), 0.1, 1e-9);
  EXPECT_FALSE(uncertain());
  EXPECT_NEAR(arm_->OverridePercent(), 100.0, 1e-9);
  arm_->Drive(0, 3.0, 90.0);
  EXPECT_NEAR(fastest_rate(), 1.0, 1e-9);
}

/// The person who requested the hold may still stand at the arm.
TEST_F(PowerUp, AHoldOutlivesAChangeOfTheProfile) {
  write_profile("[backend]\nkind = \"loopback\"\n");
  power_up();
  if (HasFatalFailure()) return;
  arm_->StopAndHold();
  power_down();
  std::ifstream stream(profile_);
  std::string text{std::istreambuf_iterator<char>{stream}, {}};
  const std::size_t servo = text.find("zero_us = 1500");
  ASSERT_NE(servo, std::string::npos);
  std::ofstream(profile_) << text.replace(servo, 14, "zero_us = 1490");
  for (int i = 0; i < 2; ++i) {
    start_both();
    if (HasFatalFailure()) return;
    ASSERT_TRUE(wait_for(Corbot::Error));
    Corbot::ControlInfo_var info = arm_->Control();
    EXPECT_TRUE(info->held);
    EXPECT_EQ(raised_by([&] { arm_->Ready(); }), "NotReady");
    EXPECT_EQ(i == 0, rt_->errors().find("still held by a StopAndHold") != std::string::npos)
        << rt_->errors();
    power_down();
  }
  start_both();
  if (HasFatalFailure()) return;
  ASSERT_TRUE(wait_until(within(30), [&] { return raised_by([&] { arm_->Clear(); }).empty(); }));
  EXPECT_TRUE(wait_for(Corbot::Standby));
}

/// Whatever ends, and however: only a person clears.
TEST_F(PowerUp, AnErrorOutlivesEveryProcess) {
  const auto start = [&] {
    start_both();
    if (HasFatalFailure()) return;
    ASSERT_TRUE(wait_for(Corbot::Error)) << rt_->errors();
    EXPECT_EQ(alarms().back().code, 131);
    EXPECT_EQ(raised_by([&] { arm_->Ready(); }), "NotReady");
  };
  write_profile("[backend]\nkind = \"loopback\"\n");
  power_up();
  if (HasFatalFailure()) return;
  rt_->signal(SIGUSR1);  // its device is lost
  ASSERT_TRUE(wait_for(Corbot::Error));
  ASSERT_TRUE(wait_until(within(20), [&] { return kept().find("in_error = true") != std::string::npos; }))
      << kept();
  rt_->signal(SIGKILL);
  servant_->signal(SIGKILL);
  ASSERT_TRUE(rt_->wait(within(30)) && servant_->wait(within(30)));
  rt_.reset();
  servant_.reset();
  start();
  if (HasFatalFailure()) return;
  power_down();
  start();  // ended in order, likewise
  if (HasFatalFailure()) return;
  ASSERT_TRUE(wait_until(within(30), [&] { return raised_by([&] { arm_->Clear(); }).empty(); }));
  ASSERT_TRUE(wait_for(Corbot::Standby));
  power_down();
  power_up();  // cleared is cleared
}

TEST_F(PowerUp, WhenBothAreKilledWhatTheServantKeptIsLeft) {
  write_profile("[backend]\nkind = \"loopback\"\n");
  power_up();
  if (HasFatalFailure()) return;
  arm_->Move(0.20, 0.05, 0.10, 0.0, 0.0);
  const Corbot::JointCoord before = joints();
  const std::string expected = fmt::format("{}", before[0]).substr(0, 8);
  ASSERT_TRUE(wait_until(within(20), [&] { return kept().find(expected) != std::string::npos; })) << kept();
  rt_->signal(SIGKILL);  // as a power cut would end both
  servant_->signal(SIGKILL);
  ASSERT_TRUE(rt_->wait(within(30)) && servant_->wait(within(30)));
  rt_.reset();
  servant_.reset();
  power_up();
  if (HasFatalFailure()) return;
  EXPECT_LT(distance_deg(before, joints()), 1e-9);
  EXPECT_FALSE(uncertain()) << "the position of the simulator is verified";
}

TEST_F(PowerUp, IsWrittenWhileTheArmMoves) {
  write_profile("[backend]\nkind = \"loopback\"\n");
  power_up();
  if (HasFatalFailure()) return;
  const Corbot::Ticket ticket = arm_->StartMove(0.20, 0.05, 0.10, 0.0, 4.0);
  EXPECT_TRUE(wait_until(within(20), [&] { return kept().find("at_rest = false") != std::string::npos; }));
  Corbot::MotionInfo_var info = arm_->Wait(ticket, 30.0);
  EXPECT_TRUE(wait_until(within(20), [&] { return kept().find("at_rest = true") != std::string::npos; }));
}

/// It does not prove that the arm was not in Error.
TEST_F(PowerUp, AFileThatProvesNothingIsAnError) {
  write_profile("[backend]\nkind = \"loopback\"\n");
  const std::string file = fmt::format("{}/{}.loopback.position", directory_, name_);
  std::ofstream(file) << "format = 3\njoints = [1e300]\n";
  start_both();
  if (HasFatalFailure()) return;
  ASSERT_TRUE(wait_for(Corbot::Error)) << rt_->errors();
  EXPECT_EQ(alarms().back().code, 131);
  EXPECT_THAT(rt_->errors(), HasSubstr("the last position is rejected: " + file));
  EXPECT_THAT(rt_->output(), HasSubstr("in Error until Clear: " + file));
  EXPECT_EQ(Corbot::DeviceInfo_var(arm_->Device())->health, Corbot::DeviceClosed) << "no energy";
  EXPECT_EQ(raised_by([&] { arm_->Ready(); }), "NotReady");
  EXPECT_EQ(joints()[0], 0.0);
  ASSERT_TRUE(wait_until(within(30), [&] { return raised_by([&] { arm_->Clear(); }).empty(); }));
  power_down();
  power_up();  // cleared is cleared
}

TEST_F(PowerUp, ADirectoryThatCannotBeWrittenIsLoggedOnce) {
  write_profile("[backend]\nkind = \"loopback\"\n");
  start_rt({"--state-dir", "/dev/null/nowhere"});
  start_servant({"--state-dir", "/dev/null/nowhere"});
  if (HasFatalFailure()) return;
  arm_ = connect();
  ASSERT_TRUE(wait_for(Corbot::Standby));
  arm_->Drive(0, 5.0, 90.0);
  ASSERT_TRUE(wait_until(
      within(20), [&] { return servant_->errors().find("position is not saved") != std::string::npos; }));
  ASSERT_EQ(alarms().size(), 2u);
  EXPECT_EQ(alarms()[0].code, 155) << "nor can the audit log";
  EXPECT_EQ(alarms()[1].code, 152);
  EXPECT_FALSE(alarms()[0].active || alarms()[1].active);
}

TEST_F(PowerUp, AnotherServoMapMovesNothing) {
  write_profile("[backend]\nkind = \"loopback\"\n");
  power_up();
  if (HasFatalFailure()) return;
  arm_->Drive(0, 60.0, 90.0);
  const auto pulse_us = [&] {
    Snapshot last{};
    EXPECT_TRUE(last_snapshot(Observer::of(name_).task(), last));
    return last.pulse_us[0];
  };
  const double before_us = pulse_us();
  rt_->signal(SIGKILL);
  ASSERT_TRUE(rt_->wait(within(30)));
  std::ifstream from(profile_);
  std::stringstream text;
  text << from.rdbuf();
  std::string changed = text.str();
  const std::string direction = "direction = 1,";
  ASSERT_NE(changed.find(direction), std::string::npos);
  std::ofstream(profile_) << changed.replace(changed.find(direction), direction.size(), "direction = -1,");
  start_rt({"--state-dir", directory_});
  if (HasFatalFailure()) return;
  EXPECT_THAT(rt_->output(), HasSubstr("-60.0 0.0 0.0 0.0 degrees"));
  EXPECT_THAT(rt_->output(), HasSubstr("THE SERVO MAP HAS CHANGED"));
  ASSERT_TRUE(wait_until(within(20), [&] { return raised_by([&] { arm_->Drive(1, 0.0, 90.0); }).empty(); }));
  EXPECT_NEAR(pulse_us(), before_us, 1e-6);
  EXPECT_TRUE(uncertain());
}

TEST_F(PowerUp, ATaskWhoseLogIsNotReadEndsInOrder) {
  write_profile("[backend]\nkind = \"loopback\"\n");
  const auto of_caller = ::signal(SIGPIPE, SIG_DFL);  // a child inherits it
  start_rt({"--state-dir", directory_});
  ::signal(SIGPIPE, of_caller);
  if (HasFatalFailure()) return;
  rt_->close_errors();
  rt_->signal(SIGUSR1);  // an alarm
  Snapshot last{};
  const Observer channel = Observer::of(name_);
  ASSERT_TRUE(wait_until(
      within(20), [&] { return last_snapshot(channel.task(), last) && last.state == RtState::kError; }));
  EXPECT_EQ(rt_->terminate(), 0);
  EXPECT_THAT(kept(), HasSubstr("joints"));
  EXPECT_FALSE(channel_exists(name_));
}

TEST_F(PowerUp, ATaskWhoseTerminalIsClosedEndsInOrder) {
  write_profile("[backend]\nkind = \"loopback\"\n");
  const auto of_caller = ::signal(SIGHUP, SIG_DFL);  // these tests may run under nohup
  start_rt({"--state-dir", directory_});
  ::signal(SIGHUP, of_caller);
  if (HasFatalFailure()) return;
  rt_->signal(SIGHUP);
  EXPECT_EQ(rt_->wait(within(30)), 0) << rt_->errors();
  EXPECT_THAT(kept(), HasSubstr("joints"));
  EXPECT_FALSE(channel_exists(name_));
}

class PowerUpOnADevice : public PowerUp {
 protected:
  void SetUp() override {
    PowerUp::SetUp();
    line_ = directory_ + "/tty";
    start_emulator();
    write_device_profile();
  }
  void write_device_profile() {
    write_profile(fmt::format("[backend]\nkind = \"ssc32\"\n[backend.ssc32]\nport = \"{}\"\n", line_));
  }
  void TearDown() override {
    PowerUp::TearDown();
    EXPECT_EQ(emulator_->terminate(), 0);
  }
  void start_emulator() {
    emulator_ = std::make_unique<Process>(
        std::vector<std::string>{std::string(CORBOT_BIN_DIR) + "/corbot-sim", "ssc32", "--pty", line_});
    ASSERT_TRUE(emulator_->wait_line("ready", within(30))) << emulator_->errors();
  }
  std::string pulses() {
    emulator_->send("pulses");
    return emulator_->wait_line("pulses", within(30)).value_or("");
  }
  std::string line_;
  std::unique_ptr<Process> emulator_;
};

/// The simulator's servant still runs, and has the segment of its task.
TEST_F(PowerUpOnADevice, TheSegmentOfASimulatedArmIsNotUsed) {
  write_profile("[backend]\nkind = \"loopback\"\n");
  power_up();
  if (HasFatalFailure()) return;
  arm_->Drive(0, 40.0, 90.0);
  rt_->signal(SIGKILL);
  ASSERT_TRUE(rt_->wait(within(30)));
  write_device_profile();
  start_rt({"--state-dir", directory_});
  if (HasFatalFailure()) return;
  EXPECT_THAT(rt_->output(), HasSubstr("position UNKNOWN"));
  EXPECT_THAT(pulses(), Not(HasSubstr("0=1900")));
}

TEST_F(PowerUpOnADevice, AControllerThatKeptItsPowerReportsTheServos) {
  power_up();
  if (HasFatalFailure()) return;
  EXPECT_TRUE(uncertain()) << "the emulator has just been switched on";
  Corbot::DeviceInfo_var device = arm_->Device();
  EXPECT_STREQ(device->backend, "ssc32");
  EXPECT_EQ(device->health, Corbot::DeviceOpen);
  EXPECT_TRUE(wait_until(within(30), [&] {
    Corbot::DeviceInfo_var now = arm_->Device();
    return now->frames > 1 && now->age > 0.0 && now->ageMax >= now->age;
  }));
  arm_->Drive(0, 5.5, 90.0);
  arm_->Drive(2, 31.4, 90.0);
  const Corbot::JointCoord before = joints();
  std::string there;
  ASSERT_TRUE(wait_until(within(30), [&] {
    there = pulses();
    return there.find("0=1555") != std::string::npos && there.find("2=1786") != std::string::npos;
  })) << there;
  power_down();

  power_up();
  if (HasFatalFailure()) return;
  EXPECT_THAT(rt_->errors(), HasSubstr("by the pulses that the device sends"));
  EXPECT_FALSE(uncertain());
  EXPECT_LT(distance_deg(before, joints()), 1e-9) << "not rounded to the 10 us that it reports";
  EXPECT_EQ(pulses(), there) << "nothing has moved";
  power_down();

  fs::remove(fmt::format("{}/{}.position", directory_, name_));
  power_up();
  if (HasFatalFailure()) return;
  EXPECT_FALSE(uncertain());
  EXPECT_LE(distance_deg(before, joints()), 1.0 + 1e-9) << "10 us are a degree";
  power_down();

  EXPECT_EQ(emulator_->terminate(), 0);
  start_emulator();
  power_up();
  if (HasFatalFailure()) return;
  EXPECT_TRUE(uncertain()) << "the controller has been without power";
  EXPECT_LE(distance_deg(before, joints()), 1.0 + 1e-9) << "but where it was is on disk";
}

/// From a pulse that no angle of the profile stands for, every start would be a jump.
TEST_F(PowerUpOnADevice, AControllerWhosePulsesAreOutOfRangeIsNotStarted) {
  power_up();
  if (HasFatalFailure()) return;
  EXPECT_EQ(raised_by([&] { arm_->Drive(0, 60.0, 90.0); }), "");
  power_down();
  const std::string there = pulses();
  std::ifstream stream(profile_);
  std::string text{std::istreambuf_iterator<char>{stream}, {}};
  const std::string range = "range_deg = [-90, 90]";
  std::ofstream(profile_) << text.replace(text.find(range), range.size(), "range_deg = [-90, 30]");
  const RunResult start =
      run({std::string(CORBOT_BIN_DIR) + "/corbot-rt", profile_, "--name", name_, "--state-dir", directory_},
          60.0, {});
  EXPECT_EQ(start.code, 1);
  EXPECT_THAT(start.errors, HasSubstr("joint base is at 60.0 degrees, outside its range of -90.0 to 30.0"));
  EXPECT_THAT(start.errors, HasSubstr("corbot calibrate"));
  EXPECT_EQ(pulses(), there) << "nothing has moved";
}

}  // namespace
}  // namespace corbot::test
