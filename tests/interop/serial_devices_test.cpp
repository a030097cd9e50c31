// SPDX-License-Identifier: Apache-2.0
// The whole chain down to emulated servo controllers on pseudo-terminals: what a client asks for arrives at
// the servos, and a plug that is pulled is survived.
#include <gmock/gmock.h>
#include <signal.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <sstream>
#include <thread>

#include <fmt/core.h>

#include "config/profile.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;

struct DeviceKind {
  std::string name;                   ///< of the test
  std::vector<std::string> emulator;  ///< words of corbot-sim
  std::string backend;                ///< kind in the profile
  std::string options;                ///< more keys of its table
  double unit_us;                     ///< resolution of the device, or of what it reads back
};

void PrintTo(const DeviceKind& kind, std::ostream* out) { *out << kind.name; }

class SerialDevices : public RobotRig, public ::testing::WithParamInterface<DeviceKind> {
 protected:
  void SetUp() override {
    name_ = unique_name("serial");
    port_ = free_port();
    reference_ = fmt::format("corbaloc::127.0.0.1:{}/{}", port_, name_);
    directory_ = fmt::format("{}/{}", CORBOT_SCRATCH_DIR, name_);
    fs::create_directory(directory_);
    line_ = directory_ + "/tty";
    start_emulator();
    if (HasFatalFailure()) return;
    write_profile();
    start_rt();
    if (!HasFatalFailure()) start_servant();
    if (HasFatalFailure()) return;
    arm_ = connect();
    ASSERT_TRUE(wait_for(Corbot::Standby)) << servant_->errors() << rt_->errors();
  }
  void TearDown() override {
    RobotRig::TearDown();
    if (emulator_) {
      EXPECT_EQ(emulator_->terminate(), 0) << emulator_->errors();
    }
    fs::remove_all(directory_);
  }
  void start_emulator() {
    std::vector<std::string> command{std::string(CORBOT_BIN_DIR) + "/corbot-sim"};
    command.insert(command.end(), GetParam().emulator.begin(), GetParam().emulator.end());
    command.insert(command.end(), {"--pty", line_});
    emulator_ = std::make_unique<Process>(command);
    ASSERT_TRUE(emulator_->wait_line("ready", within(30))) << emulator_->errors();
  }
  /// The Lynx 5, its backend replaced.
  void write_profile() {
    std::ifstream from(CORBOT_PROFILE);
    std::stringstream text;
    text << from.rdbuf();
    const std::string all = text.str();
    profile_ = directory_ + "/arm.toml";
    std::ofstream(profile_) << all.substr(0, all.find("[backend]"))
                            << fmt::format("[backend]\nkind = \"{}\"\n[backend.{}]\nport = \"{}\"\n{}",
                                           GetParam().backend, GetParam().backend, line_, GetParam().options);
    model_ = load_profile(profile_).arm;
  }
  /// What leaves the emulated controller now, by channel.
  std::map<std::uint32_t, double> pulses() {
    emulator_->send("pulses");
    const auto line = emulator_->wait_line("pulses", within(10));
    std::map<std::uint32_t, double> found;
    if (!line) return found;
    std::istringstream words(line->substr(6));
    for (std::string word; words >> word;) {
      const std::size_t equal = word.find('=');
      found[static_cast<std::uint32_t>(std::stoul(word.substr(0, equal)))] =
          std::stod(word.substr(equal + 1));
    }
    return found;
  }
  /// The largest difference between the pulses at the servos and those of the joints that the arm reports.
  double off_us() {
    Corbot::JointCoord_var joints = arm_->ArtiCoord();
    const auto now = pulses();
    double worst = 0.0;
    for (std::uint32_t i = 0; i < model_.dof; ++i) {
      const ServoMap& map = model_.servos[i];
      const auto found = now.find(map.channel);
      if (found == now.end()) return HUGE_VAL;
      const double wanted = map.zero_us + map.direction * map.us_per_rad * joints[i] * M_PI / 180.0;
      worst = std::max(worst, std::abs(found->second - wanted));
    }
    return worst;
  }
  bool arrives() {
    return wait_until(within(20), [&] { return off_us() <= GetParam().unit_us / 2 + 1e-6; });
  }

  std::string directory_;
  std::string line_;
  ArmModel model_;
  std::unique_ptr<Process> emulator_;
};

TEST_P(SerialDevices, CarryOutThePapersPickAndPlace) {
  EXPECT_TRUE(arrives()) << off_us();
  arm_->Open();
  for (const double above_m : {0.06, 0.0, 0.06}) {
    arm_->MoveS(0.22, -0.08, 0.02, above_m, 0.0);
    EXPECT_TRUE(arrives()) << "above " << above_m << ": " << off_us() << " us off";
    if (above_m == 0.0) arm_->Close();
  }
  const auto closed = pulses();
  ASSERT_TRUE(closed.contains(model_.gripper.channel));
  EXPECT_NEAR(closed.at(model_.gripper.channel), model_.gripper.closed_us, GetParam().unit_us / 2);
  arm_->Move(0.20, 0.10, 0.02, 0.06, 1.0);
  arm_->MoveS(0.20, 0.10, 0.02, 0.0, 0.0);
  EXPECT_TRUE(arrives()) << off_us();
  arm_->Open();
  arm_->MoveC({0.20, 0.10, 0.08}, {0.24, 0.0, 0.12}, {0.22, -0.08, 0.08});
  EXPECT_TRUE(arrives()) << off_us();
  arm_->Ready();
  EXPECT_TRUE(arrives()) << off_us();
}

TEST_P(SerialDevices, SurviveAPulledPlugAtRandomInstants) {
  const char* text = std::getenv("CORBOT_SEED");
  const std::uint64_t seed = text != nullptr ? std::strtoull(text, nullptr, 10) : std::random_device{}();
  fmt::print("CORBOT_SEED={}\n", seed);
  std::mt19937_64 random(seed);
  const char* times = std::getenv("CORBOT_PLUGS");
  const int rounds = times != nullptr ? std::atoi(times) : 3;
  for (int i = 0; i < rounds; ++i) {
    std::string raised;
    std::thread caller(
        [&] { raised = raised_by([&] { arm_->Move(0.20, i % 2 == 0 ? 0.10 : -0.10, 0.10, 0.0, 3.0); }); });
    EXPECT_TRUE(wait_for(Corbot::Waiting));
    const timespec pause{0, std::uniform_int_distribution<long>(0, 400'000'000)(random)};
    ::nanosleep(&pause, nullptr);
    emulator_->send("unplug");
    EXPECT_TRUE(wait_for(Corbot::Error)) << rt_->errors();
    caller.join();
    EXPECT_EQ(raised, "NotReady");
    EXPECT_EQ(raised_by([&] { arm_->Clear(); }), "NotReady") << "the plug is out";
    Corbot::JointCoord_var held = arm_->ArtiCoord();
    Corbot::AlarmList_var alarms = arm_->Alarms();
    EXPECT_THAT(std::string(alarms[alarms->length() - 1].text), ::testing::HasSubstr("lost: "));
    emulator_->send("plug");
    ASSERT_TRUE(wait_until(within(60), [&] { return raised_by([&] { arm_->Clear(); }).empty(); }))
        << rt_->errors();
    Corbot::JointCoord_var still = arm_->ArtiCoord();
    EXPECT_LE(distance_deg(held, still), 0.1 * GetParam().unit_us) << "no jump";  // 10 us a degree
    EXPECT_TRUE(arrives()) << off_us();
  }
  arm_->Ready();
  EXPECT_TRUE(arrives());
}

TEST_P(SerialDevices, TellAtTheStartWhatIsWrong) {
  arm_ = Corbot::Arm::_nil();
  EXPECT_EQ(rt_->terminate(), 0);
  const std::string rt = std::string(CORBOT_BIN_DIR) + "/corbot-rt";
  start_rt();  // the line is free again
  const RunResult second = run({rt, profile_, "--name", name_ + "b"});
  EXPECT_EQ(second.code, 1);
  EXPECT_THAT(second.errors, ::testing::HasSubstr(line_)) << "names the device";
  EXPECT_EQ(rt_->terminate(), 0);
  EXPECT_EQ(emulator_->terminate(), 0);
  emulator_.reset();
  const RunResult absent = run({rt, profile_, "--name", name_ + "b"});
  EXPECT_EQ(absent.code, 1);
  EXPECT_THAT(absent.errors, ::testing::HasSubstr(line_ + ": No such file or directory"));
  EXPECT_FALSE(segment_exists(name_ + "b"));
  start_emulator();
  start_rt();
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, SerialDevices,
    ::testing::Values(
        DeviceKind{"ssc32", {"ssc32", "--model", "ssc32"}, "ssc32", "", 1.0},
        DeviceKind{"ssc32u", {"ssc32", "--model", "ssc32u"}, "ssc32", "readback = true\n", 20.0},
        DeviceKind{"maestro", {"maestro"}, "maestro", "readback = true\n", 0.5},
        DeviceKind{
            "maestro_checked", {"maestro", "--crc"}, "maestro", "device_number = 12\ncrc = true\n", 0.25}),
    [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace corbot::test
