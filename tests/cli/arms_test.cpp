// SPDX-License-Identifier: Apache-2.0
// Robots whose profiles describe other arms than the paper's: they come up on the simulator, turn and slide.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <signal.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "cli_rig.h"

namespace corbot::test {
namespace {

using testing::HasSubstr;

std::string shipped(const std::string& arm) { return std::string(CORBOT_PROFILES) + "/" + arm + ".toml"; }

class Arms : public CliRig {
 protected:
  pid_t pid_of(const char* key) { return state().value(key, 0); }
};

TEST_F(Arms, OfSixJointsMoveOnTheSimulator) {
  up({}, shipped("puma560"));
  ASSERT_EQ(corbot({"joints", "20", "-10", "5", "10", "15", "-20"}).code, 0);
  const auto joints = status().at("joints_deg");
  ASSERT_EQ(joints.size(), 6u);
  EXPECT_NEAR(joints.at(1).get<double>(), -10.0, 1e-6);
  EXPECT_NEAR(joints.at(5).get<double>(), -20.0, 1e-6);
  EXPECT_EQ(corbot({"joints", "161", "0", "0", "0", "0", "0"}).code, 1);
  EXPECT_EQ(corbot({"ready"}).code, 0);
}

TEST_F(Arms, OfSixJointsTakePosesOffsetsAndAnOrientation) {
  up({}, shipped("puma560"));
  const auto tool = [&](const char* key) { return status().at("tool").at(key).get<double>(); };
  const std::string x = fmt::format("{}", tool("x_m")), y = fmt::format("{}", tool("y_m")),
                    z = fmt::format("{}", tool("z_m"));
  const double a = tool("a_deg"), b = tool("b_deg"), c = tool("c_deg");
  const auto angle = [](double value) { return fmt::format("{}", value); };
  ASSERT_EQ(corbot({"movepose", x, y, z, angle(a), angle(b + 10), angle(c)}).code, 0);
  EXPECT_NEAR(tool("b_deg"), b + 10, 1e-6);
  ASSERT_EQ(corbot({"movepose", x, y, z, angle(a), angle(b), angle(c), "--line", "--time", "0.5"}).code, 0);
  EXPECT_NEAR(tool("b_deg"), b, 1e-6);
  ASSERT_EQ(corbot({"moverelative", "-0.02", "0.01", "0", "--line"}).code, 0);
  EXPECT_NEAR(tool("x_m"), std::stod(x) - 0.02, 1e-9);
  EXPECT_NEAR(tool("y_m"), std::stod(y) + 0.01, 1e-9);
  ASSERT_EQ(corbot({"moverelative", "0", "0", "-0.02", "1", "0", "0", "0", "--tool"}).code, 0);
  EXPECT_NEAR(tool("b_deg"), b, 1e-6);
  EXPECT_TRUE(status().at("tool_orientation").is_null());
  ASSERT_EQ(corbot({"orientation", angle(a), angle(b + 10), angle(c)}).code, 0);
  EXPECT_EQ(status().at("tool_orientation").size(), 4u);
  EXPECT_THAT(corbot({"status"}).output, HasSubstr("  set tool  w "));
  ASSERT_EQ(corbot({"move", x, y, z}).code, 0);
  EXPECT_NEAR(tool("b_deg"), b + 10, 1e-6);
  ASSERT_EQ(corbot({"orientation", "--reset"}).code, 0);
  EXPECT_TRUE(status().at("tool_orientation").is_null());
  const RunResult longer = corbot({"orientation", "1", "1", "0", "0"});
  EXPECT_EQ(longer.code, 1);
  EXPECT_THAT(longer.errors, HasSubstr("has length 1.41421, allowed 1 within 1e-06"));
}

TEST_F(Arms, OfFourJointsSayHowFarAnOrientationIsOff) {
  std::ifstream stream(shipped("lynx5"));
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  text.insert(text.find("name = "), "orientation_error_deg = 5\n");
  up({}, put("arm.toml", text));
  ASSERT_EQ(corbot({"movepose", "0.2", "0", "0.1", "0", "0", "4.9"}).code, 0);
  const RunResult rolled = corbot({"movepose", "0.2", "0", "0.1", "0", "0", "5.1"});
  EXPECT_EQ(rolled.code, 1);
  EXPECT_THAT(rolled.errors, HasSubstr("than 5.1 degrees, allowed up to 5 degrees"));
  const RunResult set = corbot({"orientation", "0", "0", "0"});
  EXPECT_EQ(set.code, 1);
  EXPECT_THAT(set.errors, HasSubstr("follows the tool pitch alone"));
}

/// The profile and its URDF are read once, at the start.
TEST_F(Arms, ByAUrdfOutliveItsFile) {
  const std::string urdf = (directory_ / "arm.urdf").string();
  ASSERT_EQ(corbot({"export", "--urdf", shipped("scara_cobra600"), "--output", urdf}).code, 0);
  std::ifstream stream(shipped("scara_cobra600"));
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  const auto cut = [&text](const std::string& from, const std::string& to) {
    const auto begin = text.find(from);
    ASSERT_NE(begin, std::string::npos) << from;
    text.erase(begin, text.find(to, begin) - begin);
  };
  cut("dh = \"standard\"", "[[joint]]");
  for (int i = 0; i < 4; ++i) cut("dh = {", "range_");
  cut("kind = \"sliding\"", "range_");
  text.insert(text.find("[[joint]]"),
              "urdf = \"arm.urdf\"\nbase_link = \"base_link\"\ntip_link = \"tool0\"\n\n");
  up({}, put("arm.toml", text));
  ASSERT_EQ(corbot({"joints", "10", "20", "0", "30"}).code, 0);
  std::filesystem::remove(urdf);
  std::filesystem::remove(directory_ / "arm.toml");
  const pid_t first = pid_of("rt_pid");
  ASSERT_EQ(::kill(first, SIGKILL), 0);
  ASSERT_TRUE(wait_until(within(20), [&] {
    const pid_t now = pid_of("rt_pid");
    return now != 0 && now != first;
  })) << supervisor_->errors();
  ASSERT_TRUE(wait_until(within(20), [&] {
    return corbot({"joints", "5", "20", "0", "30"}).code == 0;
  })) << supervisor_->errors();
  EXPECT_NEAR(status().at("joints_deg").at(3).get<double>(), 30.0, 1e-6);
}

TEST_F(Arms, WithoutServosAreNotCalibrated) {
  const RunResult result = corbot({"calibrate", shipped("omx"), "--name", name_});
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.errors, HasSubstr("there is nothing to calibrate"));
}

TEST_F(Arms, AreExplainedWithoutARobot) {
  const RunResult text = corbot({"kinematics", shipped("omx"), "--pose", "-0.1,-0.05,0.2"});
  EXPECT_EQ(text.code, 0) << text.errors;
  EXPECT_THAT(text.output, HasSubstr("solutions at -0.1, -0.05, 0.2 m"));
  EXPECT_EQ(corbot({"kinematics", shipped("omx"), "--pose", "1,2,3", "--joints", "0,0,0,0"}).code, 2);
  EXPECT_EQ(corbot({"kinematics"}).code, 2);
  EXPECT_EQ(corbot({"kinematics", "/nowhere.toml"}).code, 2);
  EXPECT_EQ(corbot({"export", shipped("omx")}).code, 2);
  EXPECT_THAT(corbot({"export", "--urdf", shipped("omx")}).output, HasSubstr("<robot name=\"omx\">"));
}

}  // namespace
}  // namespace corbot::test
