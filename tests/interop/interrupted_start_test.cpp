// SPDX-License-Identifier: Apache-2.0
// A real-time task that is ended, or stopped, while it approaches the start position.
#include <gmock/gmock.h>
#include <signal.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "support/paths.h"
#include "support/process.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const std::string kBin = CORBOT_BIN_DIR;

class InterruptedStart : public ::testing::Test {
 protected:
  void SetUp() override {
    name_ = unique_name("interrupted");
    directory_ = CORBOT_SCRATCH_DIR + ("/" + name_);
    fs::create_directory(directory_);
    std::ifstream from(CORBOT_TEST_PROFILE);
    std::stringstream text;
    text << from.rdbuf();
    const std::string all = text.str();
    std::ofstream(directory_ + "/arm.toml")
        << all.substr(0, all.find("[backend]"))
        << "[backend]\nkind = \"ssc32\"\n[backend.ssc32]\nstop_input = \"B\"\nport = \"" << directory_
        << "/line\"\n";
    emulator_.emplace(std::vector<std::string>{kBin + "/corbot-sim", "ssc32", "--pty", directory_ + "/line"});
    ASSERT_TRUE(emulator_->wait_line("ready", within(20)));
    emulator_->send("input B 0");  // a contact that is closed: not pressed
    task_.emplace(std::vector<std::string>{kBin + "/corbot-rt", directory_ + "/arm.toml", "--name", name_,
                                           "--state-dir", directory_});
    // The approach lasts seconds, and is the only time when servos have pulses and the task is not ready.
    ASSERT_TRUE(wait_until(within(20), [&] { return has_pulses(); })) << task_->errors();
  }
  void TearDown() override {
    task_.reset();
    emulator_.reset();
    EXPECT_FALSE(channel_exists(name_));
    fs::remove_all(directory_);
  }
  bool has_pulses() { return pulses().find_first_of("123456789") != std::string::npos; }
  std::string pulses() {
    emulator_->send("pulses");
    return emulator_->wait_line("pulses", within(20)).value_or("");
  }
  void expect_held() {
    const std::string held = pulses();
    for (int i = 0; i < 20; ++i) EXPECT_EQ(pulses(), held);
  }

  std::string name_;
  std::string directory_;
  std::optional<Process> emulator_;
  std::optional<Process> task_;
};

TEST_F(InterruptedStart, EndsInOrderOnASignal) {
  task_->signal(SIGTERM);
  const auto status = task_->wait(within(20));
  ASSERT_TRUE(status);
  EXPECT_EQ(*status, 0) << task_->errors();
  EXPECT_THAT(task_->errors(), HasSubstr("the task was ended before the arm had reached its start position"));
  EXPECT_EQ(task_->output().find("ready"), std::string::npos);
}

TEST_F(InterruptedStart, EndsWhenTheStopIsPressed) {
  emulator_->send("input B 1");
  const auto status = task_->wait(within(20));
  ASSERT_TRUE(status);
  EXPECT_NE(*status, 0);
  EXPECT_THAT(task_->errors(), HasSubstr("the emergency stop was pressed"));
  emulator_->send("input B 0");
  expect_held();
}

}  // namespace
}  // namespace corbot::test
