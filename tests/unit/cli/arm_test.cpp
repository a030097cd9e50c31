// SPDX-License-Identifier: Apache-2.0
// corbot kinematics and corbot export, over the shipped profiles.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <numbers>
#include <regex>
#include <sstream>
#include <string>

#include "cli/arm/arm_line.h"
#include "cli/arm/arm_picture.h"
#include "cli/arm/doubts.h"
#include "cli/arm/kinematics.h"
#include "cli/arm/outline.h"
#include "cli/arm/solutions.h"
#include "client/failure.h"
#include "config/load_profile.h"
#include "planner/workspace.h"
#include "support/paths.h"

namespace corbot::cli {
namespace {

using client::ExitCode;
using client::Failure;
using testing::HasSubstr;

std::string profile_file(const std::string& arm) {
  return std::string(CORBOT_PROFILES) + "/" + arm + ".toml";
}

std::string printed(const KinematicsOptions& options) {
  testing::internal::CaptureStdout();
  try {
    kinematics(options);
  } catch (...) {
    (void)testing::internal::GetCapturedStdout();
    throw;
  }
  return testing::internal::GetCapturedStdout();
}

std::string refusal(const KinematicsOptions& options) {
  try {
    (void)printed(options);
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.code(), ExitCode::kUsage);
    return failure.what();
  }
  return "not refused";
}

/// Largest horizontal distances from axis 1, as they were computed elsewhere (to the millimetre).
TEST(Workspace, HasTheKnownReach) {
  const std::vector<std::pair<const char*, double>> reaches{
      {"al5d", 0.433},      {"al5d_wr", 0.447},        {"omx", 0.380},       {"px100", 0.320},
      {"so101", 0.441},     {"puma560", 0.877},        {"irb2400", 1.635},   {"ur5e", 0.969},
      {"xarm6", 0.764},     {"scara_cobra600", 0.600}, {"scara_gx4", 0.350}, {"cylindrical_rpp", 1.458},
      {"polar_rrp", 1.277}, {"stanford", 1.277}};
  for (const auto& [arm, reach_m] : reaches) {
    const Workspace space = workspace_of(load_profile(profile_file(arm)).arm);
    EXPECT_TRUE(space.about_axis) << arm;
    EXPECT_NEAR(space.radius_m[1], reach_m, 5.1e-4) << arm;
    EXPECT_LE(space.radius_m[0], space.radius_m[1]) << arm;
  }
  const Workspace gantry = workspace_of(load_profile(profile_file("cartesian_ppp")).arm);
  EXPECT_FALSE(gantry.about_axis);
  EXPECT_NEAR(gantry.extent_m[0][1] - gantry.extent_m[0][0], 0.4772, 1e-9);
  EXPECT_NEAR(gantry.extent_m[1][1] - gantry.extent_m[1][0], 0.4938, 1e-9);
  EXPECT_NEAR(gantry.extent_m[2][1] - gantry.extent_m[2][0], 0.2, 1e-9);
}

TEST(Regularity, IsZeroWithAStraightWristAndNamesItsJoints) {
  const Kinematics arm = load_profile(profile_file("puma560")).arm.kinematics;
  const Joints straight{0.3, 0.2, 0.1, 0.4, -std::numbers::pi / 4, 0.5};  // less home: 45 degrees
  const Regularity singular = regularity_at(arm, straight);
  EXPECT_LT(singular.smallest, 1e-12);
  EXPECT_NEAR(std::abs(singular.idle_q_s[3]), std::sqrt(0.5), 1e-9);
  EXPECT_NEAR(std::abs(singular.idle_q_s[5]), std::sqrt(0.5), 1e-9);
  EXPECT_GT(regularity_at(arm, {}).smallest, 0.02);
}

/// By what each arm follows of an orientation: only the paper's arms are stretched at Ready.
TEST(Regularity, IsThatOfThePathsOfEveryArm) {
  for (const auto& file : std::filesystem::directory_iterator(CORBOT_PROFILES)) {
    if (file.path().extension() != ".toml") continue;
    const Profile profile = load_profile(file.path());
    const bool is_stretched = profile.description.form == config::GeometryForm::kLengths;
    const double smallest = regularity_at(profile.arm.kinematics, {}).smallest;
    EXPECT_TRUE(is_stretched ? smallest < 1e-9 : smallest > 0.02) << file.path() << ": " << smallest;
  }
  const Kinematics omx = load_profile(profile_file("omx")).arm.kinematics;
  EXPECT_LT(regularity_at(omx, {0.3, 0.2, -std::atan2(0.128, 0.024), 0.1}).smallest, 1e-9);
}

/// A shipped arm's profile without `kind`, with edits.
std::vector<std::string> doubts_after(const std::string& arm,
                                      const std::vector<std::pair<std::string, std::string>>& edits) {
  std::ifstream from(profile_file(arm));
  std::string text{std::istreambuf_iterator<char>{from}, {}};
  text = std::regex_replace(text, std::regex("\nkind = \"[a-z]+\"(?=[^[]*\\[geometry)"), "");
  for (const auto& [old_text, new_text] : edits) {
    const auto at = text.find(old_text);
    EXPECT_NE(at, std::string::npos) << old_text;
    if (at != std::string::npos) text.replace(at, old_text.size(), new_text);
  }
  const Profile profile = parse_profile(text, "arm.toml");
  return doubts_of(profile, workspace_of(profile.arm));
}

TEST(Doubts, NoShippedArmHasAny) {
  for (const auto& file : std::filesystem::directory_iterator(CORBOT_PROFILES)) {
    if (file.path().extension() != ".toml") continue;
    const Profile profile = load_profile(file.path());
    EXPECT_THAT(doubts_of(profile, workspace_of(profile.arm)), testing::IsEmpty()) << file.path();
  }
}

TEST(Doubts, NameTheFamilyThatTheOtherConventionGives) {
  for (const auto& [arm, family] : std::vector<std::pair<std::string, std::string>>{
           {"puma560", "ortho-parallel arm with spherical wrist"}, {"omx", "base and planar arm"}}) {
    EXPECT_THAT(
        doubts_after(arm, {{"\"standard\"", "\"modified\""}}),
        testing::Contains(
            "geometry.dh = \"modified\" gives the family 'other', but as \"standard\" it is of the family '" +
            family + "'"))
        << arm;
  }
}

TEST(Doubts, NameASpeedThatLooksLikeMillimetres) {
  EXPECT_THAT(doubts_after("puma560", {{"\nspeed_m_s = ", "\nspeed_m_s = 250  #"},
                                       {"\nacceleration_m_s2 = ", "\nacceleration_m_s2 = 1000  #"}}),
              testing::ElementsAre("path.speed_m_s = 250 m/s: millimetres? Then 0.25 is meant",
                                   "path.acceleration_m_s2 = 1000 m/s2: millimetres? Then 1 is meant"));
}

TEST(Doubts, NameLengthsThatLookLikeCentimetres) {
  EXPECT_THAT(doubts_after("omx", {{"d_m = 0.0595", "d_m = 10"},
                                   {"a_m = 0.13023056476879766", "a_m = 8"},
                                   {"a_m = 0.124", "a_m = 9"},
                                   {"a_m = 0.126", "a_m = 5"}}),
              testing::Contains("the arm reaches 22 m: centimetres? Then 0.22 m is meant"));
}

TEST(Doubts, NameAnglesThatLookLikeRadians) {
  EXPECT_THAT(doubts_after("puma560", {{"alpha_deg = 90", "alpha_deg = 1.5708"}}),
              testing::Contains("joint 'waist': alpha_deg 1.5708: radians? Then 90 degrees is meant"));
  EXPECT_THAT(doubts_after("puma560", {{"home_deg = -180", "home_deg = -3.1416"}}),
              testing::Contains(HasSubstr("home_deg -3.1416: radians? Then -180 degrees")));
  EXPECT_THAT(doubts_after("puma560", {{"[-160, 160]", "[-2.79, 0.7854]"}}),
              testing::ElementsAre(HasSubstr("range_deg 0.7854: radians? Then 45 degrees")));
  EXPECT_THAT(doubts_after("puma560", {{"[-160, 160]", "[-2.79, 0.5]"}}),
              testing::ElementsAre("joint 'waist': range_deg is within 2.79 degrees of 0: radians? Then 160 "
                                   "degrees are meant"));
  EXPECT_THAT(doubts_after("puma560", {{"[-160, 160]", "[-7, 7]"}}), testing::IsEmpty());
}

TEST(Doubts, SayThatTheWorkspaceIsFlatOrEveryPoseIsSingular) {
  EXPECT_THAT(doubts_after("scara_gx4", {{"kind = \"sliding\"", ""},
                                         {"range_m = ", "range_deg = "},
                                         {"speed_m_s", "speed_deg_s"},
                                         {"acceleration_m_s2", "acceleration_deg_s2"},
                                         {"jerk_m_s3", "jerk_deg_s3"}}),
              testing::Contains(HasSubstr("the workspace is flat: z is ")));
  // Joints 4 and 6 about the same line, whatever the others do.
  EXPECT_THAT(doubts_after("stanford", {{"theta_deg = 0, d_m = 0, a_m = 0, alpha_deg = -90",
                                         "theta_deg = 0, d_m = 0, a_m = 0, alpha_deg = 0"}}),
              testing::Contains(HasSubstr("singular wherever its joints are near 0")));
}

TEST(Kinematics, PrintsTheDoubts) {
  const std::string file = testing::TempDir() + "corbot-doubts-" + std::to_string(::getpid()) + ".toml";
  std::ifstream from(profile_file("scara_gx4"));
  std::string text{std::istreambuf_iterator<char>{from}, {}};
  text.replace(text.find("theta_deg = 0"), 13, "theta_deg = 1.5708");
  std::ofstream(file) << text;
  EXPECT_THAT(printed({.profile = file}), HasSubstr("  warning: joint '"));
  EXPECT_THAT(printed({.profile = file, .json = true}), HasSubstr("theta_deg 1.5708: radians?"));
  std::filesystem::remove(file);
}

TEST(Solutions, AreAllThatThereAreAndKnowTheirRanges) {
  for (const char* name : {"puma560", "xarm6", "scara_gx4", "so101", "stanford"}) {
    const ArmModel arm = load_profile(profile_file(name)).arm;
    const Joints asked{0.2, 0.1, 0.02, 0.15, 0.1, 0.1};
    const Pose pose = arm.kinematics.forward(asked);
    const PoseSolutions found = solutions_at(arm, pose, true, asked);
    bool has_asked = false;
    for (const PoseSolution& solution : found.solutions) {
      const Pose back = arm.kinematics.forward(solution.joints_q);
      EXPECT_LT(norm(back.position_m - pose.position_m), 1e-9) << name;
      EXPECT_EQ(solution.number.has_value(), std::string(name) != "xarm6");
      bool in_range = true;
      for (std::size_t i = 0; i < arm.dof; ++i)
        in_range = in_range && solution.joints_q[i] >= arm.joints[i].lower_q - 1e-9 &&
                   solution.joints_q[i] <= arm.joints[i].upper_q + 1e-9;
      EXPECT_EQ(solution.beyond_range.empty(), in_range) << name;
      has_asked = has_asked || arm.kinematics.same(solution.joints_q, asked, 1e-6);
    }
    EXPECT_TRUE(has_asked) << name;
  }
}

TEST(Solutions, ThatAreNoneSayWhy) {
  const ArmModel omx = load_profile(profile_file("omx")).arm;
  const Pose far{{2.0, 0.0, 0.1}, {}};
  EXPECT_THAT(solutions_at(omx, far, false, {}).refusal, HasSubstr("too far: "));
  Pose rolled = omx.kinematics.forward({});
  rolled.orientation = rolled.orientation * about({1, 0, 0}, 0.5);
  EXPECT_THAT(solutions_at(omx, rolled, true, {}).refusal, HasSubstr("28.65 degrees off"));
  EXPECT_EQ(solutions_at(omx, rolled, false, {}).refusal, "");
  const ArmModel xarm6 = load_profile(profile_file("xarm6")).arm;
  EXPECT_THAT(solutions_at(xarm6, far, true, {}).refusal,
              HasSubstr("no solution was found: the nearest of "));
}

TEST(KinematicsCommand, TellsFamilyTableAndSolutions) {
  const std::string text = printed({.profile = profile_file("puma560"), .joints = "10,20,30,40,50,60"});
  EXPECT_THAT(
      text,
      HasSubstr("puma560: family 'ortho-parallel arm with spherical wrist', kind anthropomorphic, 6 joints"));
  EXPECT_THAT(text, HasSubstr("standard D-H, by table values"));
  EXPECT_THAT(text, HasSubstr("0 + q2             0.15005            0.0203     -90"));
  EXPECT_THAT(text, HasSubstr("10.0000   20.0000   30.0000   40.0000   50.0000   60.0000\n"));
  EXPECT_THAT(text, HasSubstr("0.8770 from axis 1"));
  EXPECT_THAT(printed({.profile = profile_file("puma560")}),
              testing::Not(testing::ContainsRegex("-0\\.0000[ \n]")));
  EXPECT_THAT(printed({.profile = profile_file("xarm6")}),
              HasSubstr("no closed form, solved numerically: ortho-parallel arm with spherical wrist: axis"));
  EXPECT_THAT(printed({.profile = profile_file("scara_gx4")}),
              testing::ContainsRegex("solutions at [^\n]*\n *degrees   degrees         m   degrees\n  0  "));
  EXPECT_THAT(
      printed({.profile = profile_file("so101")}),
      HasSubstr("follows pitch and roll of the tool in the arm's plane; other orientations are refused\n"));
  EXPECT_THAT(printed({.profile = profile_file("cartesian_ppp")}), HasSubstr("at most 1 solution a pose"));
  EXPECT_THAT(printed({.profile = profile_file("al5d")}), HasSubstr("SINGULAR (smallest singular value"));
}

TEST(KinematicsCommand, SpeaksJson) {
  const auto json = nlohmann::json::parse(
      printed({.profile = profile_file("cartesian_pppr"), .pose = "0.2,0.2,0.1,0,1,0,0", .json = true}));
  EXPECT_EQ(json["family"], "gantry");
  EXPECT_EQ(json["joints"][0]["unit"], "m");
  ASSERT_EQ(json["solutions"].size(), 1u);
  EXPECT_NEAR(json["solutions"][0]["joints"][0].get<double>(), 0.2772, 1e-12);
  EXPECT_NEAR(json["solutions"][0]["joints"][3].get<double>(), 0.0, 1e-9);
  EXPECT_TRUE(json["solutions"][0]["in_range"].get<bool>());
  const auto numeric = nlohmann::json::parse(printed({.profile = profile_file("xarm6"), .json = true}));
  EXPECT_TRUE(numeric["solutions"][0]["number"].is_null());
}

TEST(KinematicsCommand, RefusesWhatItCannotRead) {
  const std::string arm = profile_file("omx");
  EXPECT_THAT(refusal({.profile = "/nowhere.toml"}), HasSubstr("no such file"));
  EXPECT_THAT(refusal({.profile = arm, .pose = "1,2"}), HasSubstr("--pose: write X,Y,Z in metres"));
  EXPECT_THAT(refusal({.profile = arm, .pose = "1,2,x"}), HasSubstr("'x' is not a number"));
  EXPECT_THAT(refusal({.profile = arm, .pose = "1,2,"}), HasSubstr("--pose: "));
  EXPECT_THAT(refusal({.profile = arm, .pose = "1,2,3,1,1,0,0"}), HasSubstr("length 1"));
  EXPECT_THAT(refusal({.profile = arm, .joints = "1,2,3"}), HasSubstr("3 numbers, but the arm has 4 joints"));
}

/// The box of a text, px: left, right, baseline.
using TextBox = std::array<double, 3>;

std::vector<TextBox> texts_of(const std::string& svg) {
  constexpr double kLetter_px = 8.0;  // of 15 px, a wide one on the average
  std::vector<TextBox> boxes;
  const std::regex text("<text class=\"([a-z]*)\" x=\"([-0-9.]+)\" y=\"([0-9.]+)\">([^<]*)</text>");
  std::smatch found;
  for (auto at = svg.cbegin(); std::regex_search(at, svg.cend(), found, text); at = found[0].second) {
    const double letter_px = found[1] == "title" ? kLetter_px * 20.0 / 15.0 : kLetter_px;
    const double length_px = letter_px * static_cast<double>(found[4].length());
    const double share = found[1] == "middle" ? 0.5 : found[1] == "end" ? 1.0 : 0.0;
    const double left_px = std::stod(found[2]) - share * length_px;
    boxes.push_back({left_px, left_px + length_px, std::stod(found[3])});
  }
  return boxes;
}

void expect_apart(const std::vector<TextBox>& boxes, double width_px) {
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    EXPECT_GE(boxes[i][0], 0.0);
    EXPECT_LE(boxes[i][1], width_px);
    for (std::size_t k = 0; k < i; ++k) {
      const bool beside = boxes[i][1] < boxes[k][0] || boxes[k][1] < boxes[i][0];
      EXPECT_TRUE(beside || std::abs(boxes[i][2] - boxes[k][2]) > 15.0) << "texts " << i << " and " << k;
    }
  }
}

TEST(ArmPicture, IsOutlinedAroundPartsAndHoles) {
  ReachRegion ring{{-1.0, -1.0}, 0.1, 20, 20, std::vector<char>(400, 0)};
  for (std::size_t row = 2; row < 18; ++row) {
    for (std::size_t column = 2; column < 18; ++column)
      ring.marked[row * 20 + column] = row < 7 || row > 12 || column < 7 || column > 12;
  }
  EXPECT_EQ(outlines_of(ring).size(), 2u);
  for (const Outline& outline : outlines_of(ring)) {
    const double side_m = std::abs(outline[0][1]);
    EXPECT_TRUE(std::abs(side_m - 0.8) < 0.1 || std::abs(side_m - 0.3) < 0.1) << side_m;
  }
}

TEST(ArmPicture, ShowsTheArmFromBaseToTool) {
  for (const char* name :
       {"lynx5", "scara_gx4", "cylindrical_rpp", "cartesian_ppp", "polar_rrp", "puma560", "so101"}) {
    const Profile profile = load_profile(profile_file(name));
    const Joints q{};
    const std::vector<Vector3> line = arm_line(profile.arm.kinematics, q).points_m;
    EXPECT_EQ(line.front(), profile.arm.kinematics.chain().base_T_0.position_m) << name;
    EXPECT_LT(norm(line.back() - profile.arm.kinematics.forward(q).position_m), 1e-12) << name;
    const std::string svg = arm_picture(profile, q);
    EXPECT_TRUE(svg.starts_with("<svg ") && svg.ends_with("</svg>\n")) << name;
    EXPECT_THAT(svg, testing::Not(testing::ContainsRegex("nan|inf"))) << name;
    std::size_t arms = 0;
    for (auto at = svg.find("class=\"arm\" points"); at != std::string::npos;
         at = svg.find("class=\"arm\" points", at + 1))
      ++arms;
    EXPECT_EQ(arms, 2u);
    EXPECT_THAT(svg, HasSubstr("from the side"));
    EXPECT_THAT(svg, HasSubstr("from above"));
    SCOPED_TRACE(name);
    expect_apart(texts_of(svg), std::stod(svg.substr(svg.find("width=\"") + 7)));
    EXPECT_THAT(svg, HasSubstr("@media (prefers-color-scheme:dark)"));
    EXPECT_LT(svg.size(), 40'000u);
  }
}

TEST(ArmPicture, HasAThumbnailWithItsScaleAlone) {
  const std::string thumbnail =
      arm_picture(load_profile(profile_file("puma560")), {}, PictureSize::kThumbnail);
  EXPECT_THAT(thumbnail, HasSubstr("width=\"200\""));
  EXPECT_EQ(texts_of(thumbnail).size(), 1u);
}

/// Returns the numbers of each shaded path.
std::vector<std::vector<double>> forbidden_of(const std::string& svg) {
  const std::string mark = "class=\"forbidden\" d=\"";
  std::vector<std::vector<double>> found;
  for (auto at = svg.find(mark); at != std::string::npos; at = svg.find(mark, at + 1)) {
    std::string path = svg.substr(at + mark.size(), svg.find('"', at + mark.size()) - at - mark.size());
    for (char& letter : path)
      if (std::isalpha(static_cast<unsigned char>(letter)) != 0) letter = ' ';
    std::istringstream stream(path);
    found.emplace_back(std::istream_iterator<double>(stream), std::istream_iterator<double>());
  }
  return found;
}

TEST(ArmPicture, ShadesWhatTheWorkspaceForbids) {
  Profile profile = load_profile(profile_file("cartesian_ppp"));
  const Joints q{};
  EXPECT_TRUE(forbidden_of(arm_picture(profile, q)).empty());
  WorkspaceLimits& workspace = profile.arm.workspace;
  const auto add = [&](const WorkspaceShape& shape) { workspace.shapes[workspace.count++] = shape; };
  add(plane_shape({{0, 0, 1}, 0.1}, 1));
  const auto floor = forbidden_of(arm_picture(profile, q));
  ASSERT_EQ(floor.size(), 1u) << "the view from above looks along the floor's normal";
  ASSERT_EQ(floor[0].size(), 8u) << "the lower part of the panel";
  EXPECT_NE(floor[0][1], floor[0][5]);
  add(box_shape(ShapeKind::kOutside, {0.1, 0.1, 0.1}, {0.2, 0.3, 0.2}, 1));
  const auto both = forbidden_of(arm_picture(profile, q));
  ASSERT_EQ(both.size(), 3u) << "from the side and from above";
  const auto extent = [](const std::vector<double>& path, std::size_t axis) {
    double low = 1e9, high = -1e9;
    for (std::size_t i = axis; i < path.size(); i += 2)
      low = std::min(low, path[i]), high = std::max(high, path[i]);
    return high - low;
  };
  EXPECT_NEAR(extent(both[2], 1), 2.0 * extent(both[2], 0), 0.3) << "0.1 m by 0.2 m from above";
  EXPECT_NEAR(extent(both[1], 1), extent(both[1], 0), 0.3) << "0.1 m by 0.1 m from the side";
  workspace.count = 0;
  add(box_shape(ShapeKind::kInside, {0.1, 0.1, 0.1}, {0.2, 0.3, 0.2}, 1));
  EXPECT_EQ(forbidden_of(arm_picture(profile, q)).front().size(), 16u) << "the panel, and the box in it";
  EXPECT_THAT(arm_picture(profile, q), HasSubstr("outside [workspace]"));
}

TEST(ArmPicture, AndUrdfAreWrittenWhereTheyAreAskedFor) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("arm_test." + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  (void)printed({.profile = profile_file("omx"), .svg = folder / "omx.svg"});
  EXPECT_GT(std::filesystem::file_size(folder / "omx.svg"), 1000u);
  (void)printed({.profile = profile_file("omx"), .svg = folder / "small.svg", .thumbnail = true});
  EXPECT_LT(std::filesystem::file_size(folder / "small.svg"), std::filesystem::file_size(folder / "omx.svg"));
  export_urdf({.profile = profile_file("omx"), .output = folder / "omx.urdf"});
  std::ifstream stream(folder / "omx.urdf");
  const std::string urdf{std::istreambuf_iterator<char>(stream), {}};
  EXPECT_THAT(urdf, HasSubstr("<robot name=\"omx\">"));
  EXPECT_THAT(urdf, HasSubstr("<joint name=\"elbow\" type=\"revolute\">"));
  EXPECT_THROW(export_urdf({.profile = profile_file("omx"), .output = folder / "no" / "omx.urdf"}), Failure);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace corbot::cli
