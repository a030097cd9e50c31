// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "cli/doctor/doctor.h"
#include "support/paths.h"
#include "support/process.h"

namespace corbot::cli {

namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// A machine made of files.
class Machine : public testing::Test {
 protected:
  Machine() {
    std::string path = testing::TempDir() + "corbot-doctor-XXXXXX";
    root_ = ::mkdtemp(path.data());
    files_.sys = (root_ / "sys").string();
    files_.proc = (root_ / "proc").string();
  }
  ~Machine() override { fs::remove_all(root_); }

  void put(const std::string& file, const std::string& text) const { put_below("sys", file, text); }
  void put_below(const char* top, const std::string& file, const std::string& text) const {
    const fs::path path = root_ / top / file;
    fs::create_directories(path.parent_path());
    std::ofstream(path) << text << "\n";
  }
  [[nodiscard]] Finding find(const std::string& subject, std::optional<int> cpu = -1) const {
    const auto findings = examine_machine(files_, cpu);
    const auto found =
        std::find_if(findings.begin(), findings.end(), [&](const auto& f) { return f.subject == subject; });
    return found == findings.end() ? Finding{} : *found;
  }

  fs::path root_;
  MachineFiles files_;
};

TEST_F(Machine, KernelIsRecognisedByItsFile) {
  put("kernel/realtime", "1");
  EXPECT_EQ(find("kernel").level, Level::kOk);
  EXPECT_THAT(find("kernel").text, HasSubstr("PREEMPT_RT"));
}

TEST_F(Machine, GovernorMustBePerformance) {
  put("devices/system/cpu/cpu2/cpufreq/scaling_governor", "powersave");
  EXPECT_EQ(find("cpu frequency", 2).level, Level::kWarn);
  EXPECT_THAT(find("cpu frequency", 2).fix, HasSubstr("performance"));
  put("devices/system/cpu/cpu2/cpufreq/scaling_governor", "performance");
  EXPECT_EQ(find("cpu frequency", 2).level, Level::kOk);
}

TEST_F(Machine, TaskGroupsAreReported) {
  EXPECT_EQ(find("task groups").level, Level::kOk);
  put_below("proc", "sys/kernel/sched_autogroup_enabled", "1");
  EXPECT_EQ(find("task groups").level, Level::kWarn);
  EXPECT_THAT(find("task groups").fix, HasSubstr("sched_autogroup_enabled=0"));
  put_below("proc", "sys/kernel/sched_autogroup_enabled", "0");
  EXPECT_EQ(find("task groups").level, Level::kOk);
}

TEST_F(Machine, SlowClockSourceIsReported) {
  put("devices/system/clocksource/clocksource0/current_clocksource", "hpet");
  EXPECT_EQ(find("clock source").level, Level::kWarn);
  put("devices/system/clocksource/clocksource0/current_clocksource", "tsc");
  EXPECT_EQ(find("clock source").level, Level::kOk);
}

TEST_F(Machine, ACpuMustBeOnlineAndShouldBeIsolated) {
  put("devices/system/cpu/online", "0-3");
  put("devices/system/cpu/isolated", "2-3");
  EXPECT_EQ(find("cpu", -1).level, Level::kOk);
  EXPECT_THAT(find("cpu", -1).text, HasSubstr("the profile binds the loop to none"));
  EXPECT_THAT(find("cpu", std::nullopt).text, HasSubstr("none is given"));
  EXPECT_EQ(find("cpu", 3).level, Level::kOk);
  EXPECT_EQ(find("cpu", 1).level, Level::kWarn);
  EXPECT_EQ(find("cpu", 4).level, Level::kFail);
}

TEST_F(Machine, SharedMemoryCanBeSealed) { EXPECT_EQ(find("shared memory").level, Level::kOk); }

TEST_F(Machine, EveryFindingThatIsNotOkSaysHowToFixIt) {
  put("devices/system/cpu/online", "0");
  for (const auto& finding : examine_machine(files_, 7)) {
    EXPECT_EQ(finding.fix.empty(), finding.level == Level::kOk) << finding.subject;
  }
  for (const auto& finding : examine_privileges(99)) {
    EXPECT_EQ(finding.fix.empty(), finding.level == Level::kOk) << finding.subject;
  }
}

TEST(CpuList, IsRead) {
  EXPECT_TRUE(cpu_list_contains("0", 0));
  EXPECT_TRUE(cpu_list_contains("0-2,5", 5));
  EXPECT_TRUE(cpu_list_contains("0-2,5", 1));
  EXPECT_FALSE(cpu_list_contains("0-2,5", 3));
  EXPECT_FALSE(cpu_list_contains("", 0));
  EXPECT_FALSE(cpu_list_contains("x-y", 0));
}

TEST(Installation, DoubtsAboutTheGeometryAreWarnings) {
  std::ifstream from(CORBOT_PROFILES "/scara_gx4.toml");
  std::string text{std::istreambuf_iterator<char>{from}, {}};
  text.replace(text.find("theta_deg = 0"), 13, "theta_deg = 1.5708");
  const std::string path =
      testing::TempDir() + "corbot-doctor-radians-" + std::to_string(::getpid()) + ".toml";
  std::ofstream(path) << text;
  const auto findings = examine_installation(path);
  const auto found =
      std::find_if(findings.begin(), findings.end(), [](const auto& f) { return f.subject == "geometry"; });
  ASSERT_NE(found, findings.end());
  EXPECT_EQ(found->level, Level::kWarn);
  EXPECT_THAT(found->text, HasSubstr("1.5708: radians?"));
  fs::remove(path);
}

TEST(Installation, ASerialDeviceIsChecked) {
  std::ifstream from(CORBOT_PROFILES "/lynx5.toml");
  const std::string all{std::istreambuf_iterator<char>{from}, {}};
  const std::string path =
      testing::TempDir() + "corbot-doctor-device-" + std::to_string(::getpid()) + ".toml";
  // A robot of the shipped name may be up on this machine.
  const std::string name = test::unique_name("doctor");
  const std::size_t shipped = all.find("name = \"lynx5\"");
  const auto finding_for = [&](const std::string& line) {
    std::ofstream(path) << all.substr(0, shipped) << "name = \"" << name << '"'
                        << all.substr(shipped + 14, all.find("[backend]") - shipped - 14)
                        << "[backend]\nkind = \"ssc32\"\n[backend.ssc32]\nport = \"" << line << "\"\n";
    const auto findings = examine_installation(path);
    return *std::find_if(findings.begin(), findings.end(),
                         [](const auto& f) { return f.subject == "devices"; });
  };
  const Finding absent = finding_for("/nonexistent/tty");
  EXPECT_EQ(absent.level, Level::kFail);
  EXPECT_NE(absent.text.find("/nonexistent/tty: No such file"), std::string::npos) << absent.text;
  EXPECT_NE(absent.fix.find("backend.ssc32.port"), std::string::npos) << absent.fix;
  for (const std::string& other : {std::string("/dev/null"), path, testing::TempDir()}) {
    EXPECT_EQ(finding_for(other).level, Level::kFail);
  }
  EXPECT_THAT(finding_for("/dev/null").text, HasSubstr("/dev/null is not a serial line"));

  const int master = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  ASSERT_EQ(::grantpt(master) | ::unlockpt(master), 0);
  const std::string line = ::ptsname(master);
  EXPECT_EQ(finding_for(line).level, Level::kOk);
  const int holder = ::open(line.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  ASSERT_EQ(::flock(holder, LOCK_EX | LOCK_NB), 0) << "it was given back";
  const Finding taken = finding_for(line);
  EXPECT_EQ(taken.level, Level::kFail);
  EXPECT_THAT(taken.text, HasSubstr(line + ": another program has it open"));
  ::close(holder);
  ::close(master);
  std::filesystem::remove(path);
}

TEST(Installation, AWrongProfileFails) {
  const auto findings = examine_installation("/nonexistent/robot.toml");
  EXPECT_TRUE(std::any_of(findings.begin(), findings.end(),
                          [](const auto& f) { return f.subject == "profile" && f.level == Level::kFail; }));
}

}  // namespace
}  // namespace corbot::cli
