// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "architecture/source_rules.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(Architecture, TheTreeKeepsItsRules) { EXPECT_THAT(breaches(CORBOT_SOURCE_DIR), IsEmpty()); }

TEST(Architecture, TheRealTimeTaskLinksNoOrb) {
  const auto libraries = linked_libraries(CORBOT_RT_PROGRAM);
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
  void expect_breach(const std::string& name, const std::string& text) {
    plant(name, text);
    EXPECT_THAT(breaches(root_), ElementsAre(HasSubstr(name))) << text;
    fs::remove(root_ / name);
  }
  void expect_good(const std::string& name, const std::string& text) {
    plant(name, text);
    EXPECT_THAT(breaches(root_), IsEmpty()) << text;
    fs::remove(root_ / name);
  }

 private:
  fs::path root_;
};

TEST_F(PlantedBreach, InTheCyclicPartIsFound) {
  expect_breach("rt/cycle/cycle.cpp", "#include \"config/profile.h\"\n");
  expect_breach("rt/cycle/cycle.cpp", "#include \"../src/planner/planner.h\"\n");
  expect_breach("rt/cycle/governor.h", "// x\n  #  include <iostream>\n");
  expect_breach("rt/cycle/servo_map.cpp", "#include <spdlog/spdlog.h>\n");
  expect_breach("rt/a_new_file.cpp", "#include <fstream>\n");
  expect_breach("rt/backends/serial/ssc32.cpp", "#include \"robot/link.h\"\n");
  expect_breach("rt/cycle/cycle.cpp", "#include <omniORB4/CORBA.h>\n");
  expect_good("rt/cycle/cycle.cpp",
              "#include \"rt/cycle.h\"\n#include \"corbot/channel/ring.h\"\n#include <cmath>\n");
  expect_good("rt/main.cpp", "#include \"config/profile.h\"\n#include <spdlog/spdlog.h>\n");
}

TEST_F(PlantedBreach, ElsewhereIsFound) {
  expect_breach("rt/main.cpp", "#include <omniORB4/CORBA.h>\n");
  expect_breach("include/corbot/motion/x.h", "#include \"planner/planner.h\"\n");
  expect_breach("include/corbot/motion/x.h", "#include \"rt/cycle.h\"\n");
  expect_breach("include/corbot/motion/x.h", "#include \"../../../sim/servo_model.h\"\n");
  expect_breach("src/robot/link.cpp", "#include <omniORB4/CORBA.h>\n");
  expect_breach("src/robot/link.c", "#include <orbit/orbit.h>\n");
  expect_breach("sim/scene.cpp", "#include \"config/profile.h\"\n");
  expect_good("src/orb/omniorb/servant.cpp", "#include <omniORB4/CORBA.h>\n");
  expect_good("src/robot/link.cpp", "#include \"corbot/channel/ring.h\"\n#include \"planner/planner.h\"\n");
}

TEST_F(PlantedBreach, ByLengthIsFound) {
  const auto lines = [](int count) {
    std::string text;
    for (int i = 0; i < count; ++i) text += "//\n";
    return text;
  };
  expect_good("src/cli/long.h", lines(250));
  expect_breach("src/cli/long.h", lines(251));
  expect_good("src/cli/long.cpp", lines(400));
  expect_breach("src/cli/long.cpp", lines(401));
  expect_breach("tests/unit/long.cpp", lines(401));
}

}  // namespace
}  // namespace corbot::test
