// SPDX-License-Identifier: Apache-2.0
// An arm by its URDF.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>

#include "config/arms/roll_pitch_yaw.h"
#include "config/arms/urdf_chain.h"
#include "config/geometry_schema.h"
#include "config/load_profile.h"
#include "config/profile_edit.h"

namespace corbot::urdf_profile_test {
namespace {

using testing::HasSubstr;

/// A SCARA with a gripper's fingers beyond its tip: turn, fixed, turn, slide down, turn.
const std::string kScara = R"(<?xml version="1.0"?>
<robot name="scara">
  <link name="world"/><link name="base"/><link name="arm"/><link name="bracket"/><link name="fore"/>
  <link name="quill"/><link name="flange"/><link name="tool"/><link name="finger"/>
  <joint name="stand" type="fixed"><parent link="world"/><child link="base"/><origin xyz="0 0 9"/></joint>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/>
    <origin xyz="0 0 0.3"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1" velocity="10"/></joint>
  <joint name="bolt" type="fixed"><parent link="arm"/><child link="bracket"/><origin xyz="0.1 0 0"/></joint>
  <joint name="elbow" type="revolute"><parent link="bracket"/><child link="fore"/>
    <origin xyz="0.12 0 0" rpy="3.14159265358979 0 0"/><axis xyz="0 0 -2"/>
    <limit lower="-2.5" upper="2.5" effort="1" velocity="10"/></joint>
  <joint name="lift" type="prismatic"><parent link="fore"/><child link="quill"/>
    <origin xyz="0.13 0 0"/><axis xyz="0 0 1"/><limit lower="0" upper="0.2" effort="1" velocity="10"/></joint>
  <joint name="spin" type="continuous"><parent link="quill"/><child link="flange"/><axis xyz="0 0 1"/></joint>
  <joint name="mount" type="fixed"><parent link="flange"/><child link="tool"/><origin xyz="0 0 0.05"/></joint>
  <joint name="grip" type="prismatic"><parent link="tool"/><child link="finger"/><axis xyz="1 0 0"/>
    <mimic joint="lift"/><limit lower="0" upper="0.1" effort="1" velocity="1"/></joint>
</robot>)";

const std::string kRest = R"(
[gripper]
travel_s = 0.5
[path]
speed_m_s = 0.5
acceleration_m_s2 = 2
jerk_m_s3 = 20
rotation_speed_deg_s = 90
rotation_acceleration_deg_s2 = 400
rotation_jerk_deg_s3 = 4000
[backend]
kind = "loopback"
)";

std::string joint(const std::string& name, const std::string& unit, const std::string& range,
                  const std::string& more = "") {
  return "[[joint]]\nname = \"" + name + "\"\nrange_" + unit + " = " + range + "\nspeed_" + unit +
         "_s = 1\nacceleration_" + unit + "_s2 = 5\njerk_" + unit + "_s3 = 50\n" + more;
}

std::string profile_text(const std::string& urdf, const std::string& joints = "") {
  return "[robot]\nname = \"scara\"\n[geometry]\nurdf = '''" + urdf +
         "'''\nbase_link = \"base\"\ntip_link = \"tool\"\n" +
         (joints.empty()
              ? joint("shoulder", "deg", "[-114, 114]") + joint("elbow", "deg", "[-140, 140]") +
                    joint("lift", "m", "[-0.1, 0.1]", "home_m = 0.1\n") + joint("spin", "deg", "[-360, 360]")
              : joints) +
         kRest;
}

std::string edited(std::string text, const std::string& from, const std::string& to) {
  EXPECT_NE(text.find(from), std::string::npos) << from;
  return text.replace(text.find(from), from.size(), to);
}

std::vector<ConfigFault> faults_of(const std::string& text) {
  try {
    (void)parse_profile(text, "arm.toml");
  } catch (const ConfigError& error) {
    return error.faults();
  }
  return {};
}

TEST(UrdfProfile, IsTheChainBetweenTwoLinks) {
  const Profile profile = parse_profile(profile_text(kScara), "arm.toml");
  EXPECT_EQ(profile.arm.dof, 4u);
  EXPECT_EQ(profile.arm.kind, ArmKind::kScara);
  EXPECT_STREQ(profile.arm.kinematics.family(), ScaraArm::kName);
  EXPECT_EQ(profile.arm.kinematics.joint_kind(2), JointKind::kPrismatic);
  EXPECT_EQ(profile.description.urdf, "inline");
  EXPECT_EQ(profile.description.home_q[2], 0.1);
  // Half a turn of the elbow's frame and an axis of -2 z: it turns as the shoulder does; the slide goes down.
  const double a = 0.3, b = 0.4;
  const Pose pose = profile.arm.kinematics.forward({a, b, 0.02, 0.5});
  EXPECT_NEAR(pose.position_m[0], 0.22 * std::cos(a) + 0.13 * std::cos(a + b), 1e-12);
  EXPECT_NEAR(pose.position_m[1], 0.22 * std::sin(a) + 0.13 * std::sin(a + b), 1e-12);
  EXPECT_NEAR(pose.position_m[2], 0.3 - 0.12 - 0.05, 1e-12);
}

TEST(UrdfProfile, MayStandInAFileBesideIt) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("urdf_profile." + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "scara.urdf") << kScara;
  std::ofstream(folder / "scara.toml") << edited(profile_text("XX"), "'''XX'''", "\"scara.urdf\"");
  EXPECT_EQ(load_profile(folder / "scara.toml").description.urdf, "scara.urdf");
  std::ofstream(folder / "scara.urdf") << std::string(kMaxUrdfBytes + 1, ' ');
  EXPECT_THROW((void)load_profile(folder / "scara.toml"), ConfigError);
  std::filesystem::remove_all(folder);
}

/// 'corbot up' keeps a copy: restarted processes read the arm as it was at the start.
TEST(UrdfProfile, IsCopiedWithItsFile) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("urdf_copy." + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  const std::string xml = edited(kScara, "name=\"scara\"", "name=\"a'b\\c\td\"");
  std::ofstream(folder / "scara.urdf") << xml;
  const std::string file = folder / "scara.toml";
  for (const std::string value :
       {"\"scara.urdf\"", "'scara.urdf'  # a \"comment\"", "\"\"\"scara.urdf\"\"\""}) {
    const std::string text = "# \u00e4\n" + edited(profile_text("XX"), "'''XX'''", value);
    const std::string copy = with_urdf_text(text, file);
    EXPECT_EQ(with_urdf_text(copy, "/elsewhere/x.toml"), copy);
    EXPECT_EQ(std::count(copy.begin(), copy.end(), '\n'), std::count(text.begin(), text.end(), '\n'));
    const Profile profile = parse_profile(copy, "/elsewhere/x.toml");
    EXPECT_EQ(profile.arm.dof, 4u);
    EXPECT_EQ(profile.description.urdf, "inline");
  }
  EXPECT_EQ(with_urdf_text("[geometry]\nl0_m = 1\n", file), "[geometry]\nl0_m = 1\n");
  std::filesystem::remove(folder / "scara.urdf");
  EXPECT_THROW((void)with_urdf_text("geometry = { urdf = \"scara.urdf\" }", file), std::runtime_error);
  std::filesystem::remove_all(folder);
}

struct Wrong {
  std::string name;
  std::string from;  ///< of the URDF
  std::string to;
  std::string allowed;
};
void PrintTo(const Wrong& wrong, std::ostream* out) { *out << wrong.name; }
class UrdfRefused : public testing::TestWithParam<Wrong> {};

TEST_P(UrdfRefused, SaysWhatIsWrong) {
  const auto faults = faults_of(profile_text(edited(kScara, GetParam().from, GetParam().to)));
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].key, "geometry.urdf");
  EXPECT_EQ(faults[0].line, 4u);
  EXPECT_THAT(faults[0].allowed, HasSubstr(GetParam().allowed));
}

INSTANTIATE_TEST_SUITE_P(
    Profile, UrdfRefused,
    testing::Values(Wrong{"NotXml", "<robot", "<", "is no URDF: "},
                    Wrong{"NoNumber", "xyz=\"0 0 0.3\"", "xyz=\"0 0 high\"", "is no URDF: "},
                    Wrong{"NoBase", "<link name=\"base\"/>", "", "is no URDF: "},
                    Wrong{"OtherWay", "<parent link=\"flange\"/>", "<parent link=\"world\"/>",
                          "no chain of joints from link \"base\" outwards to link \"tool\""},
                    Wrong{"Floating", "name=\"lift\" type=\"prismatic\"", "name=\"lift\" type=\"floating\"",
                          "\"lift\" that is not revolute, continuous, prismatic or fixed"},
                    Wrong{"Mimic", "name=\"spin\" type=\"continuous\">",
                          "name=\"spin\" type=\"continuous\"><mimic joint=\"elbow\"/>",
                          "\"spin\" that follows \"elbow\" (mimic)"},
                    Wrong{"FarAway", "xyz=\"0.12 0 0\"", "xyz=\"1e300 0 0\"",
                          "origin of joint \"elbow\" further than 100 m from link \"base\""},
                    Wrong{"LimitsSwapped", "lower=\"-2.5\" upper=\"2.5\"", "lower=\"2.5\" upper=\"-2.5\"",
                          "\"elbow\" whose lower limit is above its upper one"},
                    Wrong{"Degrees", "rpy=\"3.14159265358979 0 0\"", "rpy=\"180 0 0\"",
                          "has rpy=\"180 0 0\", which looks like degrees: write radians in a URDF"},
                    Wrong{"NoAxis", "<axis xyz=\"0 0 -2\"/>", "<axis xyz=\"0 0 0\"/>",
                          "\"elbow\" without an axis"}),
    [](const auto& test) { return test.param.name; });

TEST(UrdfProfile, RefusesOtherLinksAndFiles) {
  const auto fault = [](const std::string& from, const std::string& to) {
    const auto faults = faults_of(edited(profile_text(kScara), from, to));
    return faults.size() == 1 ? faults[0].text() : std::to_string(faults.size()) + " faults";
  };
  EXPECT_THAT(fault("tip_link = \"tool\"", "tip_link = \"hand\""), HasSubstr("has no link \"hand\""));
  EXPECT_THAT(fault("tip_link = \"tool\"", ""), HasSubstr("geometry.tip_link: is missing"));
  EXPECT_THAT(fault("base_link = \"base\"", "base_link = \"base\"\ndh = \"standard\""),
              HasSubstr("contradicts urdf"));
  EXPECT_THAT(faults_of(edited(profile_text("XX"), "'''XX'''", "\"/nowhere/x.urdf\"")).at(0).text(),
              HasSubstr("is no file: /nowhere/x.urdf"));
}

TEST(UrdfProfile, JointsAreThoseOfTheChain) {
  const auto text = [](const std::string& joints) {
    const auto faults = faults_of(profile_text(kScara, joints));
    return faults.size() == 1 ? faults[0].text() : std::to_string(faults.size()) + " faults";
  };
  const std::string shoulder = joint("a", "deg", "[-100, 100]"), elbow = joint("b", "deg", "[-100, 100]"),
                    lift = joint("c", "m", "[0, 0.2]"), spin = joint("d", "deg", "[-180, 180]");
  EXPECT_THAT(text(shoulder + elbow + lift),
              HasSubstr("joint = [a table, a table, a table]: are 3 joints, but the URDF has 4 between the "
                        "links base_link and tip_link: shoulder, elbow, lift, spin"));
  EXPECT_THAT(
      text(joint("a", "deg", "[-120, 100]") + elbow + lift + spin),
      HasSubstr(
          "joint[0].range_deg = [-120, 100]: is beyond the limits of \"shoulder\" in the URDF, -114.592 to "
          "114.592 degrees"));
  EXPECT_THAT(text(shoulder + elbow + joint("c", "m", "[0, 0.2]", "home_m = 0.1\n") + spin),
              HasSubstr("in the URDF, -0.1 to 0.1 m"));
  EXPECT_THAT(text(shoulder + elbow + lift + joint("d", "deg", "[-180, 180]", "kind = \"turning\"\n")),
              HasSubstr("joint[3].kind = \"turning\": is unknown"));
  const auto faults = faults_of(profile_text(kScara, shoulder + elbow + joint("c", "deg", "[0, 10]") + spin));
  ASSERT_EQ(faults.size(), 4u);
  EXPECT_THAT(faults[0].text(), HasSubstr("must be range_m: \"lift\" slides in the URDF"));
}

TEST(RollPitchYaw, ComeBackAlsoUpright) {
  constexpr double kRight = std::numbers::pi / 2;
  for (const double beside : {0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 0.1}) {
    for (const double pitch : {kRight - beside, -kRight + beside, beside}) {
      for (const double roll : {0.0, 0.7, -2.0, std::numbers::pi}) {
        const Quaternion q = config::to_quaternion({roll, pitch, 1.1});
        const Quaternion back = config::to_quaternion(config::to_roll_pitch_yaw(q));
        EXPECT_LT(angle_between(q, back), 1e-14) << pitch << " " << roll;
      }
    }
  }
}

TEST(UrdfProfile, JointsThatHaveItsNamesStandInItsOrder) {
  const std::string rest = joint("c", "m", "[0, 0.2]") + joint("d", "deg", "[-180, 180]");
  const auto faults = faults_of(
      profile_text(kScara, joint("elbow", "deg", "[-100, 100]") + joint("arm", "deg", "[-100, 100]") + rest));
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_THAT(faults[0].text(), HasSubstr("joint[0].name = \"elbow\": is joint 1 of the URDF, whose joint 0 "
                                          "is \"shoulder\": write the joints in the order of the URDF"));
}

}  // namespace
}  // namespace corbot::urdf_profile_test
