// SPDX-License-Identifier: Apache-2.0
// The messages for a serial line that cannot be opened.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include <fmt/core.h>

#include "support/robot_rig.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;

class SerialDevices : public RobotRig {
 protected:
  void SetUp() override {
    name_ = unique_name("serial");
    directory_ = fmt::format("{}/{}", CORBOT_SCRATCH_DIR, name_);
    fs::create_directory(directory_);
    line_ = directory_ + "/tty";
    start_emulator();
    if (HasFatalFailure()) return;
    std::ifstream from(CORBOT_PROFILE);
    std::stringstream text;
    text << from.rdbuf();
    const std::string all = text.str();
    profile_ = directory_ + "/arm.toml";
    std::ofstream(profile_) << all.substr(0, all.find("[backend]"))
                            << fmt::format(
                                   "[backend]\nkind = \"ssc32\"\nposition_known_at_start = "
                                   "true\n[backend.ssc32]\nport = \"{}\"\n",
                                   line_);
    start_rt();
  }
  void TearDown() override {
    RobotRig::TearDown();
    if (emulator_) {
      EXPECT_EQ(emulator_->terminate(), 0) << emulator_->errors();
    }
    fs::remove_all(directory_);
  }
  void start_emulator() {
    emulator_ = std::make_unique<Process>(
        std::vector<std::string>{std::string(CORBOT_BIN_DIR) + "/corbot-sim", "ssc32", "--pty", line_});
    ASSERT_TRUE(emulator_->wait_line("ready", within(30))) << emulator_->errors();
  }

  std::string directory_;
  std::string line_;
  std::unique_ptr<Process> emulator_;
};

TEST_F(SerialDevices, ReportTheFaultAtTheStart) {
  const std::string rt = std::string(CORBOT_BIN_DIR) + "/corbot-rt";
  const RunResult second = run({rt, profile_, "--name", name_ + "b"});
  EXPECT_EQ(second.code, 1);
  EXPECT_THAT(second.errors, ::testing::HasSubstr(line_)) << "names the device";
  EXPECT_EQ(rt_->terminate(), 0);
  EXPECT_EQ(emulator_->terminate(), 0);
  emulator_.reset();
  const RunResult absent = run({rt, profile_, "--name", name_ + "b"});
  EXPECT_EQ(absent.code, 1);
  EXPECT_THAT(absent.errors, ::testing::HasSubstr(line_ + ": No such file or directory"));
  EXPECT_FALSE(channel_exists(name_ + "b"));
  start_emulator();
  start_rt();
}

}  // namespace
}  // namespace corbot::test
