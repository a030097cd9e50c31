// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "architecture/linked_libraries.h"
#include "support/paths.h"
#include "support/process.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Returns the faults that scripts/house finds in a tree, a line each.
std::vector<std::string> breaches(const fs::path& root) {
  const RunResult result =
      run({"python3", CORBOT_SOURCE_DIR "/scripts/house", "--check", "--root", root.string()});
  EXPECT_EQ(result.errors, "");
  std::vector<std::string> lines;
  std::istringstream stream(result.output);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  EXPECT_EQ(result.code, lines.empty() ? 0 : 1);
  return lines;
}

TEST(Architecture, TheTreeKeepsItsRules) { EXPECT_THAT(breaches(CORBOT_SOURCE_DIR), IsEmpty()); }

TEST(Architecture, TheGraphHasEveryRoomAndNoArrowBack) {
  const RunResult result = run({"python3", CORBOT_SOURCE_DIR "/scripts/house"});
  EXPECT_EQ(result.code, 0) << result.errors;
  for (const auto& entry : fs::recursive_directory_iterator(CORBOT_SOURCE_DIR "/rt")) {
    if (entry.path().extension() != ".cpp") continue;
    const fs::path room = entry.path().parent_path().lexically_relative(CORBOT_SOURCE_DIR);
    EXPECT_THAT(result.output, HasSubstr("\n" + room.string() + " "));
  }
  EXPECT_THAT(result.output, HasSubstr(" arrows, 0 of them back\n"));
}

TEST(Architecture, TheRealTimeTaskLinksNoOrb) {
  const auto libraries = linked_libraries(CORBOT_BIN_DIR "/corbot-rt");
  EXPECT_THAT(libraries, ::testing::Contains(HasSubstr("libc.so")));
  EXPECT_THAT(orbs_among(libraries), IsEmpty());
}

TEST(Architecture, AnOrbWouldBeRecognised) {
  EXPECT_THAT(
      orbs_among({"libc.so.6", "libomniORB4.so.2", "libomnithread.so.4", "libORBit-2.so.0", "libm.so.6"}),
      ElementsAre("libomniORB4.so.2", "libomnithread.so.4", "libORBit-2.so.0"));
}

/// A tree of its own in which one file breaks one rule.
class PlantedBreach : public ::testing::Test {
 protected:
  PlantedBreach() : root_(fs::temp_directory_path() / ("corbot-architecture-" + std::to_string(::getpid()))) {
    fs::create_directories(root_);
  }
  ~PlantedBreach() override { fs::remove_all(root_); }

  void plant(const std::string& name, const std::string& text) {
    fs::create_directories((root_ / name).parent_path());
    std::ofstream(root_ / name) << text;
  }
  void expect_breach(const std::string& name, const std::string& text, const std::string& why = "") {
    plant(name, text);
    EXPECT_THAT(breaches(root_), ElementsAre(::testing::AllOf(HasSubstr(name), HasSubstr(why)))) << text;
    fs::remove(root_ / name);
  }
  void expect_good(const std::string& name, const std::string& text) {
    plant(name, text);
    EXPECT_THAT(breaches(root_), IsEmpty()) << text;
    fs::remove(root_ / name);
  }
  [[nodiscard]] const fs::path& root() const { return root_; }

 private:
  fs::path root_;
};

TEST_F(PlantedBreach, InWhatRunsWhileTheArmMovesIsFound) {
  expect_breach("rt/cycle/cycle.cpp", "#include \"config/profile.h\"\n");
  expect_breach("rt/cycle/cycle.cpp", "#include \"../../src/planner/planner.h\"\n");
  expect_breach("rt/cycle/cycle.cpp", "#include \"rt/backends/bus/bus_backend.h\"\n");
  expect_breach("rt/cycle/cycle.cpp", "#include \"sim/servo_model.h\"\n");
  expect_breach("rt/cycle/cycle.cpp", "#include \"tests/unit/rt/rig.h\"\n");
  expect_breach("rt/cycle/governor.h", "// x\n  #  include <iostream>\n");
  expect_breach("rt/cycle/servo_map.cpp", "#include <spdlog/spdlog.h>\n");
  expect_breach("rt/cycle/a_new_file.cpp", "#include <fstream>\n");
  expect_breach("rt/cycle/a_new_file.cc", "#include <syslog.h>\n");
  expect_breach("rt/cycle/a_new_file.cpp", "#include <mutex>\n", "nothing waits");
  expect_breach("rt/inputs/safety_lines.cpp", "#include \"config/profile.h\"\n");
  expect_breach("rt/backends/serial/ssc32.cpp", "#include \"robot/link.h\"\n");
  expect_breach("rt/backends/serial/ssc32.cpp", "#include \"sim/devices/ssc32_device.h\"\n");
  expect_breach("rt/backends/serial/ssc32.cpp", "#include \"rt/backends/can/can_port.h\"\n");
  expect_breach("rt/backends/serial/ssc32.cpp", "#include <fstream>\n");
  expect_breach("rt/cycle/cycle.cpp", "#include <omniORB4/CORBA.h>\n");
  expect_good("rt/cycle/cycle.cpp",
              "#include \"rt/cycle/cycle.h\"\n#include \"corbot/channel/ring.h\"\n#include <cmath>\n");
  expect_good("rt/main.cpp", "#include \"config/profile.h\"\n#include <spdlog/spdlog.h>\n");
  expect_good("rt/backends/registry.cpp", "#include \"config/profile.h\"\n");
  expect_good("rt/backends/can/can_port.cpp", "#include <net/if.h>\n#include <mutex>\n");
}

TEST_F(PlantedBreach, ElsewhereIsFound) {
  expect_breach("rt/main.cpp", "#include <omniORB4/CORBA.h>\n");
  expect_breach("include/corbot/motion/x.h", "#include \"planner/planner.h\"\n");
  expect_breach("include/corbot/motion/x.h", "#include \"rt/cycle/cycle.h\"\n");
  expect_breach("include/corbot/motion/x.h", "#include \"../../../sim/servo_model.h\"\n");
  expect_breach("include/corbot/motion/x.h", "#include <iostream>\n");
  expect_breach("include/corbot/motion/x.h", "#include <mutex>\n");
  expect_breach("src/robot/link.cpp", "#include <omniORB4/CORBA.h>\n");
  expect_breach("src/robot/link.c", "#include <orbit/orbit.h>\n");
  expect_breach("src/alarms/alarm_text.cpp", "#include \"arm.hh\"\n");
  expect_breach("src/planner/arc.cpp", "#include \"shm/segment.h\"\n", "does not include");
  expect_breach("sim/devices/scene.cpp", "#include \"config/profile.h\"\n");
  expect_breach("sim/devices/scene.cpp", "#include \"rt/backends/serial/ssc32.h\"\n");
  expect_good("src/orb/omniorb/servant.cpp", "#include <omniORB4/CORBA.h>\n#include \"arm.hh\"\n");
  expect_good("src/robot/link.cpp", "#include \"corbot/channel/ring.h\"\n#include \"planner/planner.h\"\n");
}

TEST_F(PlantedBreach, BetweenServantAndTaskIsFound) {
  expect_breach("src/robot/robot.cpp", "#include \"rt/backends/registry.h\"\n");
  expect_breach("src/orb/omniorb/servant.cpp", "#include \"rt/cycle/cycle.h\"\n");
  expect_breach("rt/housekeeping.cpp", "#include \"robot/link.h\"\n");
  expect_breach("src/client/client.cpp", "#include \"rt/loop.h\"\n");
}

TEST_F(PlantedBreach, ByAnIncludeThatLeadsNowhereIsFound) {
  expect_breach("rt/cycle/cycle.cpp", "#include \"governor.h\"\n", "no such file");
  expect_breach("src/robot/link.cpp", "#include \"../robot/robot.h\"\n", "no such file");
}

TEST_F(PlantedBreach, ByASourceThatIsIncludedIsFound) {
  expect_breach("src/robot/link.cpp", "#include \"robot/robot.cpp\"\n", "not included");
}

TEST_F(PlantedBreach, OfTheLengthOfAFunctionIsFound) {
  const auto function_of = [](int lines) {
    std::string text = "int f(int a,\n      int b) {\n";
    for (int i = 0; i < lines; ++i) text += "  ++a;\n";
    return text + "}\n";
  };
  for (const std::string file : {"rt/cycle/cycle.cpp", "tests/unit/rt/hold_test.cpp"}) {
    expect_breach(file, function_of(70), ":2: a function of 71 lines");
    expect_good(file, "namespace {\n" + function_of(69) + function_of(2) + "}\n");
  }
}

TEST_F(PlantedBreach, ByAShortNameWithoutUseIsFound) {
  const std::string name = "src/cell/frames.cpp";
  expect_breach(name, "using Eigen::Vector3d;\n", "Vector3d is not used");
  expect_breach(name, "namespace fs = std::filesystem;\n", "fs is not used");
  expect_good(name, "using Eigen::Vector3d;\nnamespace fs = std::filesystem;\nVector3d at(fs::path file);\n");
}

TEST_F(PlantedBreach, ByAnArrowBackIsFound) {
  expect_breach("src/client/find_robot.cpp", "#include \"cli/show.h\"\n", "an arrow back");
  expect_breach("src/cli/doctor/doctor.cpp", "#include \"cli/commands.h\"\n", "an arrow back");
  expect_breach("src/planner/arc.cpp", "#include \"robot/link.h\"\n", "an arrow back");
  expect_breach("src/config/schema.cpp", "#include \"rt/backends/registry.h\"\n", "an arrow back");
  expect_breach("rt/backends/bus/x.h", "#include \"rt/backends/serial/serial_port.h\"\n", "an arrow back");
  expect_breach("rt/backends/registry.h", "#include \"rt/inputs/safety_lines.h\"\n", "an arrow back");
  expect_breach("include/corbot/kinematics/x.h", "#include \"corbot/arm/arm_model.h\"\n", "an arrow back");
  expect_good("src/cli/commands.cpp", "#include \"cli/doctor/doctor.h\"\n#include \"client/client.h\"\n");
}

TEST_F(PlantedBreach, OfTwoRoomsThatIncludeEachOtherIsFound) {
  plant("sim/devices/a.h", "#include \"sim/b.h\"\n");
  expect_breach("sim/b.h", "#include \"sim/devices/c.h\"\n", "an arrow back");
}

TEST_F(PlantedBreach, ByARoomThatIsNotInTheListIsFound) {
  expect_breach("src/new_room/file.cpp", "#include <cmath>\n", "no room");
}

TEST_F(PlantedBreach, ByACircleOfFilesIsFound) {
  plant("src/robot/link.h", "#include \"robot/robot.h\"\n");
  plant("src/robot/robot.h", "#include \"robot/tickets.h\"\n");
  plant("src/robot/tickets.h", "\n");
  EXPECT_THAT(breaches(root()), IsEmpty());
  // By way of a source: it belongs to its header.
  plant("src/robot/tickets.cpp", "#include \"robot/tickets.h\"\n#include \"robot/link.h\"\n");
  EXPECT_THAT(breaches(root()),
              ElementsAre(HasSubstr("a circle of files: src/robot/link -> src/robot/robot -> "
                                    "src/robot/tickets -> src/robot/link")));
}

TEST_F(PlantedBreach, ByAPromiseWithoutATestIsFound) {
  const std::string head = "| Promise | Test |\n|---|---|\n";
  plant("tests/unit/a_test.cpp", "TEST(Stop, IsAStop) {}\nTEST_F(Stop,\n       IsLatched) {}\n");
  expect_good("docs/safety.md", head + "| a | `Stop.IsAStop`, on `arm.Stop()` |\n| b | `Stop.IsLatched` |\n");
  expect_breach("docs/safety.md", head + "| a | `Stop.IsAStop` |\n| b | by hand |\n",
                ":4: no test of it is named");
  expect_breach("docs/safety.md", head + "| a | `Stop.IsGone` |\n", ":3: there is no test Stop.IsGone");
  expect_breach("docs/wiring/README.md", "See `Stop.IsGone`.\n", ":1: there is no test Stop.IsGone");
}

TEST_F(PlantedBreach, ByATestOfTheSameNameIsFound) {
  expect_good("tests/unit/stop_test.cpp", "TEST(Stop, IsAStop) {\n");
  expect_breach("tests/unit/stop_test.cpp", "TEST(Stop, IsAStop) {\nTEST_F(Stop, IsAStop) {\n",
                "Stop.IsAStop is the name of a test in tests/unit/stop_test.cpp, too");
}

/// One program may have both files.
TEST_F(PlantedBreach, ByWhatTwoFilesDefineIsFound) {
  const std::string arm = "inline Arm lynx5() {\n  return {};\n}\n";
  const auto in = [](const std::string& space, const std::string& text) {
    return "namespace " + space + "{\n" + text + "}  // namespace\n";
  };
  plant("tests/unit/rt/rig.h", in("corbot::test ", arm));
  expect_breach("tests/unit/planner/arm.h", in("corbot::test ", arm),
                "corbot::test::lynx5() is defined in tests/unit/");
  expect_good("tests/unit/planner/arm.h", in("corbot::cell ", arm));
  expect_good("tests/unit/planner/arm_test.cpp", in("corbot::test ", in("", arm)));
  plant("tests/unit/rt/wait.h", in("corbot::test ",
                                   "template <class F>\nbool wait(F&& f,\n          int ms = 5) {\n}\ninline "
                                   "constexpr int kMs = 5;\n"));
  expect_breach("tests/unit/planner/wait.h",
                in("corbot::test ", "template <class F>\nbool wait(F&&, int) {\n}\n"),
                "corbot::test::wait(F&&, int) is defined in tests/unit/");
  expect_good("tests/unit/planner/wait.h",
              in("corbot::test ", "template <class F>\nbool wait(F&&, long) {\n}\n"));
  expect_breach("tests/unit/planner/wait.h", in("corbot::test ", "inline constexpr long kMs{7};\n"),
                "corbot::test::kMs is defined in tests/unit/");
  plant("rt/inputs/stop_input.h", in("corbot::rt ", "class StopInput : public Input {\n};\n"));
  expect_breach("rt/cycle/stop_input.h", in("corbot::rt ", "struct StopInput final {\n};\n"),
                "corbot::rt::StopInput is defined in rt/");
}

}  // namespace
}  // namespace corbot::test
