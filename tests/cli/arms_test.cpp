// SPDX-License-Identifier: Apache-2.0
// Robots whose profiles describe other arms than the paper's: they come up on the simulator, turn and slide.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <signal.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli_rig.h"
#include "support/test_arms.h"

namespace corbot::test {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

class Arms : public CliRig {
 protected:
  pid_t pid_of(const char* key) { return state().value(key, 0); }
};

TEST_F(Arms, OfSixJointsMoveOnTheSimulator) {
  up({}, profile_path("puma560"));
  ASSERT_EQ(corbot({"joints", "20", "-10", "5", "10", "15", "-20"}).code, 0);
  const auto joints = status().at("joints");
  ASSERT_EQ(joints.size(), 6u);
  EXPECT_NEAR(joints.at(1).at("value_deg").get<double>(), -10.0, 1e-6);
  EXPECT_NEAR(joints.at(5).at("value_deg").get<double>(), -20.0, 1e-6);
  EXPECT_EQ(corbot({"joints", "161", "0", "0", "0", "0", "0"}).code, 1);
  EXPECT_EQ(corbot({"ready"}).code, 0);
}

TEST_F(Arms, OfSixJointsTakePosesOffsetsAndAnOrientation) {
  up({}, profile_path("puma560"));
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
  std::ifstream stream(profile_path("lynx5"));
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  text.insert(text.find("name = "), "orientation_error_deg = 5\n");
  up({}, put("arm.toml", text));
  ASSERT_EQ(corbot({"movepose", "0.2", "0", "0.1", "0", "0", "4.9"}).code, 0);
  const RunResult rolled = corbot({"movepose", "0.2", "0", "0.1", "0", "0", "5.1"});
  EXPECT_EQ(rolled.code, 1);
  EXPECT_THAT(rolled.errors, HasSubstr("than 5.1 degrees, allowed up to 5 degrees"));
  const RunResult set = corbot({"orientation", "0", "0", "0"});
  EXPECT_EQ(set.code, 1);
  EXPECT_THAT(set.errors, StartsWith("corbot: refused: this arm follows the tool pitch alone, no other"));
  EXPECT_THAT(corbot({"pitch", "999"}).errors,
              StartsWith("corbot: refused: tool pitch 999 degrees, allowed -180 to 180; this command"));
  EXPECT_THAT(corbot({"move", "0.1", "0", "0.02"}).errors,
              HasSubstr("is not within -30 to 150 degrees; the tool pitch is 0 degrees ('corbot pitch' sets "
                        "another); this command moved nothing"));
  EXPECT_THAT(corbot({"move", "-0.05", "0.25", "0.1"}).errors,
              HasSubstr("of joint 0: 101.31 is not within -90 to 90 degrees; this command moved nothing"))
      << "the heading is the same at every pitch";
}

/// The tool frames are along the gripper, raw, tilted in the arm's plane, and turned out of it.
TEST_F(Arms, OfFourJointsTakeThePoseThatStatusShows) {
  up({}, profile_path("lynx5"));
  ASSERT_EQ(corbot({"joints", "20", "-10", "15", "5"}).code, 0);
  const auto joint = [&](std::size_t i) { return status().at("joints").at(i).at("value_deg").get<double>(); };
  const std::array<double, 4> before{joint(0), joint(1), joint(2), joint(3)};
  const std::string half = "0.70710678118654757";
  const std::vector<std::pair<std::vector<std::string>, std::optional<double>>> frames{
      {{half, "-" + half, "0", "0"}, 0.0},
      {{"1", "0", "0", "0"}, 90.0},
      {{"0.6", "0", "0", "0.8"}, 90.0},
      {{"0.6", "0", "0.8", "0"}, std::nullopt}};
  for (const auto& [frame, roll_deg] : frames) {
    std::vector<std::string> tool{"tool", "0.02", "0", "0.01"};
    tool.insert(tool.end(), frame.begin(), frame.end());
    ASSERT_EQ(corbot(tool).code, 0);
    const auto shown = status().at("tool");
    if (roll_deg) {
      EXPECT_NEAR(shown.at("c_deg").get<double>(), *roll_deg, 1e-9);
    }
    std::vector<std::string> pose{"movepose"};
    for (const char* key : {"x_m", "y_m", "z_m", "a_deg", "b_deg", "c_deg"})
      pose.push_back(fmt::format("{}", shown.at(key).get<double>()));
    const RunResult moved = corbot(pose);
    EXPECT_EQ(moved.code, 0) << moved.errors << shown.dump();
    for (std::size_t i = 0; i < before.size(); ++i) EXPECT_NEAR(joint(i), before[i], 1e-6);
  }
}

TEST_F(Arms, OnATableDoNotGoThroughIt) {
  up({}, put("arm.toml", read_profile_text(CORBOT_TEST_PROFILE) + "\n[workspace]\nfloor_m = 0.0\n"));
  ASSERT_EQ(corbot({"pitch", "-80"}).code, 0);
  for (const char* command : {"move", "moves"}) {
    const RunResult refused = corbot({command, "0.2", "0", "-0.06"});
    EXPECT_EQ(refused.code, 1) << command;
    EXPECT_THAT(refused.errors,
                HasSubstr("refused: the tool would be 60 mm below 'floor' at 100 % of the path"));
    EXPECT_THAT(refused.errors, HasSubstr("; this command moved nothing"));
  }
  EXPECT_EQ(corbot({"move", "0.2", "0", "0.01"}).code, 0);
}

/// Without a closed form: to points, along lines and arcs, its tool turned as it was; what cannot be is
/// refused.
TEST_F(Arms, WithoutAClosedFormFollowLinesAndArcs) {
  up({}, profile_path("xarm6"));
  const auto tool = [&](const char* axis) { return status().at("tool").at(axis).get<double>(); };
  ASSERT_EQ(corbot({"moves", "0.35", "0.1", "0.3"}).code, 0);
  EXPECT_NEAR(tool("x_m"), 0.35, 1e-9);
  EXPECT_NEAR(tool("y_m"), 0.1, 1e-9);
  EXPECT_NEAR(tool("z_m"), 0.3, 1e-9);
  ASSERT_EQ(corbot({"movec", "0.35", "0.1", "0.3", "0.37", "0.15", "0.3", "0.35", "0.2", "0.32"}).code, 0);
  EXPECT_NEAR(tool("y_m"), 0.2, 1e-9);
  ASSERT_EQ(corbot({"move", "0.3", "-0.2", "0.3"}).code, 0);
  EXPECT_NEAR(tool("y_m"), -0.2, 1e-9);
  const RunResult far = corbot({"moves", "2", "0", "0"});
  EXPECT_EQ(far.code, 1);
  EXPECT_THAT(far.errors, HasSubstr("% of it, beyond which the path leaves the arm's reach"));
  EXPECT_NEAR(tool("y_m"), -0.2, 1e-9);
  EXPECT_EQ(corbot({"move", "2", "0", "0"}).code, 1);
}

/// Values are metres or degrees as their joint slides or turns, also in what is refused.
TEST_F(Arms, ThatTurnAndSlideShowTheUnitOfEachJoint) {
  up({}, profile_path("scara_gx4"));
  const auto refusal = [&](const std::vector<std::string>& command) {
    const RunResult refused = corbot(command);
    EXPECT_EQ(refused.code, 1) << refused.output;
    return refused.errors;
  };
  EXPECT_THAT(refusal({"drive", "2", "-0.2", "0.1"}),
              HasSubstr("joint range of joint 2: -0.2 is not within -0.15 to 0 m;"));
  EXPECT_THAT(refusal({"drive", "2", "-0.1", "5"}), HasSubstr("5 is not within 0 to 0.5 m a second;"));
  EXPECT_THAT(refusal({"joints", "150", "0", "0", "0"}), HasSubstr("150 is not within -140 to 140 degrees;"));
  EXPECT_THAT(refusal({"limit", "2", "-0.2", "0"}), HasSubstr("-0.2 is not within -0.15 to 0 m;"));
  ASSERT_EQ(corbot({"drive", "2", "-0.05", "0.4"}).code, 0);
  ASSERT_EQ(corbot({"limit", "2", "-0.1", "-0.02"}).code, 0);
  const RunResult ready = corbot({"ready"});
  EXPECT_EQ(ready.code, 1) << "a limit for which the interface has no exception";
  EXPECT_THAT(ready.errors, HasSubstr("joint 2 would be at 0 m"));

  const RunResult all = corbot({"solutions", "0.22", "0.13", "-0.01"});
  EXPECT_THAT(all.output, testing::MatchesRegex("[ ]+shoulder[ ]+elbow[ ]+shaft[ ]+rotation\n"
                                                "[ ]+degrees[ ]+degrees[ ]+m[ ]+degrees\n 0\\*.*"));
  EXPECT_THAT(all.output, HasSubstr("  beyond the limits: shaft\n"));
  const auto data = nlohmann::json::parse(corbot({"solutions", "0.22", "0.13", "-0.01", "--json"}).output);
  ASSERT_EQ(data.at("joints").size(), 4u);
  EXPECT_EQ(data.at("joints").at(2), (nlohmann::json{{"name", "shaft"}, {"unit", "m"}}));
  EXPECT_EQ(data.at("joints").at(3).at("unit"), "degrees");
  EXPECT_EQ(data.at("solutions").at(0).at("beyond_limits"), nlohmann::json::array({"shaft"}));
  EXPECT_NEAR(data.at("solutions").at(0).at("joints").at(2).get<double>(), -0.01, 1e-9);
}

/// A table of no family, with five joints, one of which slides.
TEST_F(Arms, OfNoFamilyMoveToo) {
  std::string text = "[robot]\nname = \"odd\"\nkind = \"other\"\n\n[geometry]\ndh = \"standard\"\n\n";
  const char* const rows[] = {"theta_deg = 10, d_m = 0.2, a_m = 0.05, alpha_deg = -80",
                              "theta_deg = -60, d_m = 0.03, a_m = 0.25, alpha_deg = 12",
                              "theta_deg = 70, d_m = -0.02, a_m = 0.04, alpha_deg = -85",
                              "theta_deg = 20, d_m = 0.2, a_m = 0, alpha_deg = 75",
                              "theta_deg = -30, d_m = 0.02, a_m = 0.12, alpha_deg = -70"};
  for (int i = 0; i < 5; ++i) {
    const bool slides = i == 3;
    text += "[[joint]]\nname = \"j" + std::to_string(i) + "\"\ndh = { " + rows[i] + " }\n";
    text +=
        slides
            ? "kind = \"sliding\"\nrange_m = [-0.1, 0.1]\nspeed_m_s = 0.2\nacceleration_m_s2 = 1\njerk_m_s3 "
              "= 10\n\n"
            : "range_deg = [-150, 150]\nspeed_deg_s = 120\nacceleration_deg_s2 = 600\njerk_deg_s3 = 6000\n\n";
  }
  text +=
      "[gripper]\ntravel_s = 0.5\n\n[path]\nspeed_m_s = 0.25\nacceleration_m_s2 = 1\njerk_m_s3 = 10\n"
      "rotation_speed_deg_s = 90\nrotation_acceleration_deg_s2 = 400\nrotation_jerk_deg_s3 = 4000\n\n"
      "[backend]\nkind = \"loopback\"\n\n[loop]\ngap_fault_ms = 10000\nfrozen_ms = 2000\n";
  const std::string file = put("odd.toml", text);
  EXPECT_THAT(corbot({"kinematics", file}).output, HasSubstr("follows 2 angles of the tool, which lines"));
  up({}, file);
  const auto tool = [&](const char* axis) { return status().at("tool").at(axis).get<double>(); };
  const double x = tool("x_m"), y = tool("y_m"), z = tool("z_m");
  const auto at = [](double value) { return std::to_string(value); };
  const RunResult line = corbot({"moves", at(x - 0.02), at(y + 0.04), at(z + 0.02)});
  ASSERT_EQ(line.code, 0) << line.errors;
  EXPECT_NEAR(tool("y_m"), y + 0.04, 1e-6);
  const RunResult arc = corbot({"movec", at(x - 0.02), at(y + 0.04), at(z + 0.02), at(x), at(y + 0.02),
                                at(z + 0.01), at(x), at(y), at(z)});
  ASSERT_EQ(arc.code, 0) << arc.errors;
  EXPECT_NEAR(tool("z_m"), z, 1e-6);
  const RunResult move = corbot({"move", at(x - 0.05), at(y), at(z)});
  ASSERT_EQ(move.code, 0) << move.errors;
  EXPECT_NEAR(tool("x_m"), x - 0.05, 1e-6);
}

/// The profile and its URDF are read once, at the start.
TEST_F(Arms, ByAUrdfOutliveItsFile) {
  const std::string urdf = (directory_ / "arm.urdf").string();
  ASSERT_EQ(corbot({"export", "--urdf", profile_path("scara_cobra600"), "--output", urdf}).code, 0);
  std::ifstream stream(profile_path("scara_cobra600"));
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
  const RunResult result = corbot({"calibrate", profile_path("omx"), "--name", name_});
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.errors, HasSubstr("has no servo for some joint or the gripper"));
}

TEST_F(Arms, WithASlideAreCalibratedInMillimetres) {
  std::ifstream stream(profile_path("servo_slides"));
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  const std::string profile = put("arm.toml", text);
  const auto session = begin({"calibrate", profile, "--name", name_});
  // Really: x 1010 + 2.1 mm.
  for (const char* command : {"on", "joint x", "goto 1010", "mark 0", "goto 1640", "mark 300", "goto 1850",
                              "limit high", "joint y", "goto 1100", "limit high", "write", "quit"})
    session->send(command);
  const auto status = session->wait(within(60));
  ASSERT_TRUE(status && WIFEXITED(*status));
  EXPECT_EQ(WEXITSTATUS(*status), 0) << session->errors();
  EXPECT_THAT(session->output(), HasSubstr("x 1640 us, 315.0 mm by the present calibration"));
  EXPECT_THAT(session->output(),
              HasSubstr("us_per_mm 2.1, direction 1, range_m 0 to 0.4772; marked 0 mm at 1010 us"));
  std::ifstream written(profile);
  const std::string now{std::istreambuf_iterator<char>(written), {}};
  EXPECT_THAT(now, HasSubstr("servo = { channel = 0, zero_us = 1010, us_per_mm = 2.1, direction = 1,"));
  EXPECT_THAT(now, HasSubstr("range_m = [0, 0.4]\n"));
  EXPECT_THAT(now, HasSubstr("range_m = [0, 0.45]\n"));
  up({}, profile);
  EXPECT_EQ(corbot({"joints", "0.41", "0", "0"}).code, 1) << "beyond the new range";
  EXPECT_EQ(corbot({"joints", "0.39", "0.44", "0"}).code, 0);
}

TEST_F(Arms, SolutionsNameTheJointsBeyondTheirRanges) {
  const RunResult position = corbot({"kinematics", profile_path("lynx5"), "--pose", "0.2,0.1,0.1"});
  EXPECT_THAT(position.output, HasSubstr("-27.7350  out of range: shoulder, elbow\n"));
  EXPECT_THAT(position.output, Not(HasSubstr("degrees off"))) << "the position alone was asked for";
  const auto data = nlohmann::json::parse(
      corbot({"kinematics", profile_path("lynx5"), "--pose", "0.2,0.1,0.1", "--json"}).output);
  EXPECT_EQ(data.at("solutions").at(1).at("beyond_range"), (nlohmann::json{"shoulder", "elbow"}));
  EXPECT_EQ(data.at("solutions").at(0).at("beyond_range").size(), 0u);
}

TEST_F(Arms, AreExplainedWithoutARobot) {
  const RunResult text = corbot({"kinematics", profile_path("omx"), "--pose", "-0.1,-0.05,0.2"});
  EXPECT_EQ(text.code, 0) << text.errors;
  EXPECT_THAT(text.output, HasSubstr("solutions at -0.1, -0.05, 0.2 m"));
  EXPECT_EQ(corbot({"kinematics", profile_path("omx"), "--pose", "1,2,3", "--joints", "0,0,0,0"}).code, 2);
  EXPECT_EQ(corbot({"kinematics"}).code, 2);
  EXPECT_EQ(corbot({"kinematics", "/nowhere.toml"}).code, 2);
  EXPECT_EQ(corbot({"export", profile_path("omx")}).code, 2);
  EXPECT_THAT(corbot({"export", "--urdf", profile_path("omx")}).output, HasSubstr("<robot name=\"omx\">"));
}

}  // namespace
}  // namespace corbot::test
