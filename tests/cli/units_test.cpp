// SPDX-License-Identifier: Apache-2.0
// The systemd units as they are installed, but with the programs of the build.
#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>

#include "cli_rig.h"
#include "support/paths.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class Units : public CliRig, public testing::WithParamInterface<const char*> {
 protected:
  [[nodiscard]] static std::string text_of(const std::string& unit) {
    std::ifstream stream(std::string(CORBOT_BINARY_DIR "/packaging") + "/" + unit);
    return {std::istreambuf_iterator<char>{stream}, {}};
  }
  /// Replaces the installation's programs with those of the build.
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
  // Checks that systemd-analyze would report a fault.
  put(GetParam(), with_build_programs(text) + "\n[Service]\nWatchdogSec=soon\nFrobnicate=1\n");
  const RunResult bad = run({"/usr/bin/systemd-analyze", "verify", "--man=no", file});
  EXPECT_THAT(bad.errors, AllOf(HasSubstr("sec value"), HasSubstr("Frobnicate")));
}

/// The settings of a unit, as `Key=Value`, in which a key may occur more than once.
class UnitFile {
 public:
  explicit UnitFile(const std::string& unit) {
    std::ifstream stream(std::string(CORBOT_BINARY_DIR "/packaging") + "/" + unit);
    for (std::string line; std::getline(stream, line);) {
      const std::size_t equals = line.find('=');
      if (line.empty() || line[0] == '#' || line[0] == '[' || equals == std::string::npos) continue;
      settings_.emplace(line.substr(0, equals), line.substr(equals + 1));
    }
  }
  /// "": none. Where there is more than one, that which begins with `begin`, without it.
  [[nodiscard]] std::string value(const std::string& key, const std::string& begin = "") const {
    const auto [first, last] = settings_.equal_range(key);
    for (auto each = first; each != last; ++each) {
      if (each->second.starts_with(begin)) return each->second.substr(begin.size());
    }
    return "";
  }
  /// The words of a value.
  [[nodiscard]] std::vector<std::string> words(const std::string& key) const {
    std::istringstream stream(value(key));
    return {std::istream_iterator<std::string>(stream), {}};
  }

 private:
  std::multimap<std::string, std::string> settings_;
};

TEST(UnitFiles, WhatHasTheDevicesHasTheirGroupsAndTheServantHasNone) {
  const UnitFile whole("corbot@.service");
  const UnitFile task("corbot-rt@.service");
  const UnitFile servant("corbot-servant@.service");
  const std::vector<std::string> groups{"dialout", "i2c", "gpio"};
  EXPECT_EQ(whole.words("SupplementaryGroups"), groups);
  EXPECT_EQ(task.words("SupplementaryGroups"), groups);
  EXPECT_TRUE(servant.words("SupplementaryGroups").empty());
  EXPECT_EQ(servant.value("PrivateDevices"), "yes");
  EXPECT_EQ(whole.value("PrivateDevices"), "") << "or it would have no device";
  EXPECT_EQ(task.value("PrivateDevices"), "");
  EXPECT_EQ(servant.value("LimitRTPRIO"), "0");
  EXPECT_EQ(whole.value("LimitRTPRIO"), "98");
  EXPECT_EQ(task.value("LimitRTPRIO"), "98");
  EXPECT_EQ(task.value("LimitMEMLOCK"), "infinity");
  // systemd starts nothing with a user or a group that is not there.
  std::ifstream stream(CORBOT_SOURCE_DIR "/packaging/sysusers/corbot.conf");
  std::set<std::string> made;
  for (std::string line; std::getline(stream, line);) {
    std::istringstream fields(line);
    std::string type;
    std::string name;
    if (fields >> type >> name && (type == "g" || type == "u")) made.insert(type + (" " + name));
  }
  for (const std::string& group : groups) EXPECT_EQ(made.count("g " + group), 1u) << group;
  for (const UnitFile* unit : {&task, &servant}) {
    EXPECT_EQ(made.count("u " + unit->value("User")), 1u) << unit->value("User");
    EXPECT_EQ(made.count("g " + unit->value("Group")), 1u) << unit->value("Group");
  }
  EXPECT_THAT(task.value("ExecStart"), AllOf(HasSubstr(" --servant-user " + servant.value("User") + " "),
                                             HasSubstr(" --stop-group " + servant.value("Group") + " ")));
}

TEST(UnitFiles, WhereTheProgramsLookIsWhatSystemdMakes) {
  const UnitFile whole("corbot@.service");
  const UnitFile task("corbot-rt@.service");
  const UnitFile servant("corbot-servant@.service");
  for (const UnitFile* unit : {&whole, &task, &servant}) {
    ASSERT_NE(unit->value("StateDirectory"), "");
    EXPECT_EQ(unit->value("Environment", "CORBOT_STATE_DIR="), "%S/" + unit->value("StateDirectory"));
    EXPECT_EQ(unit->value("StateDirectoryMode"), "0700");
  }
  EXPECT_NE(task.value("StateDirectory"), servant.value("StateDirectory")) << "two users";
  ASSERT_NE(whole.value("RuntimeDirectory"), "");
  EXPECT_EQ(whole.value("Environment", "XDG_RUNTIME_DIR="), "%t/" + whole.value("RuntimeDirectory"));
  EXPECT_EQ(whole.value("RuntimeDirectoryMode"), "0700");
  ASSERT_NE(task.value("RuntimeDirectory"), "");
  EXPECT_EQ(task.value("Environment", "CORBOT_RUN_DIR="), "%t/" + task.value("RuntimeDirectory"));
  EXPECT_EQ(task.value("RuntimeDirectoryMode"), "0750") << "the servant's group may enter, nobody else";
  EXPECT_EQ(servant.value("Environment", "CORBOT_RUN_DIR="), task.value("Environment", "CORBOT_RUN_DIR="));
  EXPECT_EQ(servant.value("RuntimeDirectory"), "") << "or it would be removed with the servant";
  for (const UnitFile* unit : {&whole, &task})
    EXPECT_EQ(unit->value("RuntimeDirectoryPreserve"), "restart") << "which segment was the last";
  // systemd gives the descriptors back that the task stores: as many as the program may store.
  EXPECT_EQ(task.value("FileDescriptorStoreMax"), "16");
  EXPECT_EQ(whole.value("FileDescriptorStoreMax"), "32") << "of two processes";
}

TEST_P(Units, AreWatchedAndKeepDescriptors) {
  EXPECT_THAT(text_of(GetParam()),
              AllOf(HasSubstr("\nType=notify\n"), HasSubstr("\nWatchdogSec="),
                    HasSubstr("\nRestart=on-failure\n"), HasSubstr("\nNoNewPrivileges=yes\n")));
}

/// The shell's part of the task's unit, as systemd calls it when the task has ended.
TEST_F(CliRig, ATaskThatDidNotRespondIsFollowedByOneThatBeginsInError) {
  std::ifstream stream(CORBOT_BINARY_DIR
                       "/packaging"
                       "/corbot-rt@.service");
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
