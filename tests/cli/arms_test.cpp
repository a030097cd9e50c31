// SPDX-License-Identifier: Apache-2.0
// Robots whose profiles describe other arms than the paper's: they come up on the simulator, turn and slide.
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
using testing::Not;

std::string shipped(const std::string& arm) { return std::string(CORBOT_PROFILES) + "/" + arm + ".toml"; }

class Arms : public CliRig {
 protected:
  pid_t pid_of(const char* key) { return state().value(key, 0); }
};

TEST_F(Arms, OfSixJointsMoveOnTheSimulator) {
  up({}, shipped("puma560"));
  ASSERT_EQ(corbot({"joints", "20", "-10", "5", "10", "15", "-20"}).code, 0);
  const auto joints = status().at("joints");
  ASSERT_EQ(joints.size(), 6u);
  EXPECT_NEAR(joints.at(1).at("value_deg").get<double>(), -10.0, 1e-6);
  EXPECT_NEAR(joints.at(5).at("value_deg").get<double>(), -20.0, 1e-6);
  EXPECT_EQ(corbot({"joints", "161", "0", "0", "0", "0", "0"}).code, 1);
  EXPECT_EQ(corbot({"ready"}).code, 0);
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
  EXPECT_NEAR(status().at("joints").at(3).at("value_deg").get<double>(), 30.0, 1e-6);
}

TEST_F(Arms, WithoutServosAreNotCalibrated) {
  const RunResult result = corbot({"calibrate", shipped("omx"), "--name", name_});
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.errors, HasSubstr("there is nothing to calibrate"));
}

TEST_F(Arms, SolutionsNameTheJointsBeyondTheirRanges) {
  const RunResult position = corbot({"kinematics", shipped("lynx5"), "--pose", "0.2,0.1,0.1"});
  EXPECT_THAT(position.output, HasSubstr("-68.0820  out of range: elbow, wrist\n"));
  EXPECT_THAT(position.output, Not(HasSubstr("degrees off"))) << "the position alone was asked for";
  const auto data = nlohmann::json::parse(
      corbot({"kinematics", shipped("lynx5"), "--pose", "0.2,0.1,0.1", "--json"}).output);
  EXPECT_EQ(data.at("solutions").at(1).at("beyond_range"), (nlohmann::json{"elbow", "wrist"}));
  EXPECT_EQ(data.at("solutions").at(0).at("beyond_range").size(), 0u);
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
