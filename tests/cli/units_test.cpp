// SPDX-License-Identifier: Apache-2.0
// The systemd units as they are installed, but with the programs of the build.
#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "cli_rig.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class Units : public CliRig, public testing::WithParamInterface<const char*> {
 protected:
  [[nodiscard]] static std::string text_of(const std::string& unit) {
    std::ifstream stream(std::string(CORBOT_UNITS) + "/" + unit);
    return {std::istreambuf_iterator<char>{stream}, {}};
  }
  /// Where it starts a program of the installation, one of the build.
  [[nodiscard]] static std::string with_build_programs(std::string text) {
    const std::string installed = "ExecStart=" CORBOT_INSTALLED_BIN "/";
    const std::size_t at = text.find(installed);
    EXPECT_NE(at, std::string::npos);
    return text.replace(at, installed.size(), "ExecStart=" CORBOT_BIN_DIR "/");
  }
};

TEST_P(Units, AreAccepted) {
  if (::access("/usr/bin/systemd-analyze", X_OK) != 0) GTEST_SKIP() << "skipped: no systemd-analyze here";
  const std::string text = text_of(GetParam());
  ASSERT_FALSE(text.empty());
  const std::string file = put(GetParam(), with_build_programs(text));
  const RunResult good = run({"/usr/bin/systemd-analyze", "verify", "--man=no", file});
  EXPECT_EQ(good.code, 0) << good.errors;
  EXPECT_THAT(good.errors, Not(HasSubstr("corbot")));
  // That it would report a fault.
  put(GetParam(), with_build_programs(text) + "\n[Service]\nWatchdogSec=soon\nFrobnicate=1\n");
  const RunResult bad = run({"/usr/bin/systemd-analyze", "verify", "--man=no", file});
  EXPECT_THAT(bad.errors, AllOf(HasSubstr("sec value"), HasSubstr("Frobnicate")));
}

TEST_P(Units, AreWatchedAndKeepDescriptors) {
  EXPECT_THAT(text_of(GetParam()),
              AllOf(HasSubstr("\nType=notify\n"), HasSubstr("\nWatchdogSec="),
                    HasSubstr("\nRestart=on-failure\n"), HasSubstr("\nNoNewPrivileges=yes\n")));
}

/// The shell's part of the task's unit, as systemd calls it when the task has ended.
TEST_F(CliRig, ATaskThatDidNotRespondIsFollowedByOneThatBeginsInError) {
  std::ifstream stream(CORBOT_UNITS "/corbot-rt@.service");
  const std::string text{std::istreambuf_iterator<char>{stream}, {}};
  const std::string begin = "ExecStopPost=/bin/sh -c '";
  const std::size_t at = text.find(begin);
  ASSERT_NE(at, std::string::npos);
  std::string script = text.substr(at + begin.size(), text.find("'\n", at) - at - begin.size());
  const std::string directory = "%t/corbot-rt-%i";
  ASSERT_NE(script.find(directory), std::string::npos);
  script.replace(script.find(directory), directory.size(), directory_.string());
  const fs::path file = directory_ / "after-gap";
  struct Case {
    const char* result;
    const char* status;
    bool begins_in_error;
  };
  for (const Case& each : {Case{"watchdog", "KILL", true}, Case{"signal", "XCPU", true},
                           Case{"signal", "SEGV", false}, Case{"success", "0", false}}) {
    fs::remove(file);
    const RunResult ended =
        run({"/bin/sh", "-c", script}, 30,
            {std::string("SERVICE_RESULT=") + each.result, std::string("EXIT_STATUS=") + each.status});
    EXPECT_EQ(ended.code, 0) << ended.errors;
    EXPECT_EQ(fs::exists(file), each.begins_in_error) << each.result << " " << each.status;
    std::ifstream written(file);
    std::string line;
    std::getline(written, line);
    EXPECT_EQ(line, each.begins_in_error ? "AFTER_GAP=--after-gap" : "");
  }
}

INSTANTIATE_TEST_SUITE_P(Installed, Units,
                         testing::Values("corbot@.service", "corbot-rt@.service", "corbot-servant@.service"),
                         [](const auto& unit) { return "unit" + std::to_string(unit.index); });

}  // namespace
}  // namespace corbot::test
