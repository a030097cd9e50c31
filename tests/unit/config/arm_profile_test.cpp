// SPDX-License-Identifier: Apache-2.0
// Profiles of any arm: D-H tables, home, frames, servos and drives of slides; and what is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <numbers>
#include <string>
#include <vector>

#include "config/load_profile.h"
#include "support/paths.h"

namespace corbot::arm_profile_test {
namespace {

using testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180.0;

std::string shipped(const std::string& name) {
  std::ifstream stream{std::string{CORBOT_PROFILES} + "/" + name + ".toml"};
  return {std::istreambuf_iterator<char>{stream}, {}};
}

/// The first `from` after `after` becomes `to`.
std::string edited(std::string text, const std::string& from, const std::string& to,
                   const std::string& after = "") {
  const auto start = text.find(after);
  EXPECT_NE(start, std::string::npos) << after;
  const auto at = text.find(from, start);
  EXPECT_NE(at, std::string::npos) << "the profile no longer holds " << from;
  if (at != std::string::npos) text.replace(at, from.size(), to);
  return text;
}

std::vector<ConfigFault> faults_of(const std::string& text) {
  try {
    (void)parse_profile(text, "arm.toml");
  } catch (const ConfigError& error) {
    return error.faults();
  }
  return {};
}

/// One edit of a shipped profile and the one fault that it must give.
struct Case {
  std::string name;
  std::string arm;
  std::string from;
  std::string to;
  std::string line_of;  ///< text on the line of the fault, after the edit
  std::string key;
  std::string value;
  std::string allowed;
};
void PrintTo(const Case& test, std::ostream* out) { *out << test.name; }

class ArmRefused : public testing::TestWithParam<Case> {};

TEST_P(ArmRefused, WithFileLineKeyValueAndWhatIsAllowed) {
  const Case& test = GetParam();
  const std::string text = edited(shipped(test.arm), test.from, test.to);
  const auto faults = faults_of(text);
  std::string all;
  for (const auto& fault : faults) all += fault.text() + "\n";
  ASSERT_EQ(faults.size(), 1u) << all;
  const auto at = text.find(test.line_of);
  ASSERT_NE(at, std::string::npos) << test.line_of;
  EXPECT_EQ(faults[0].file, "arm.toml");
  EXPECT_EQ(faults[0].line,
            1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n'))
      << all;
  EXPECT_EQ(faults[0].key, test.key);
  EXPECT_EQ(faults[0].value, test.value);
  EXPECT_THAT(faults[0].allowed, HasSubstr(test.allowed));
}

const std::vector<Case> kCases{
    {"Convention", "puma560", "dh = \"standard\"", "dh = \"craig\"", "\"craig\"", "geometry.dh", "\"craig\"",
     "must be \"standard\" (distal"},
    {"LengthsBesidesATable", "puma560", "dh = \"standard\"", "l0_m = 0.1\ndh = \"standard\"", "l0_m",
     "geometry.l0_m", "0.1", "is unknown"},
    {"RowMissing", "puma560", "dh = { theta_deg = 0, d_m = 0.67183, a_m = 0, alpha_deg = 90 }", "",
     "[[joint]]\nname = \"waist\"", "joint[0].dh", "", "add a table [joint[0].dh] to the profile"},
    {"AngleNan", "puma560", "alpha_deg = 90", "alpha_deg = nan", "alpha_deg = nan", "joint[0].dh.alpha_deg",
     "nan", "from -360 to 360 degrees"},
    {"OffsetInMillimetres", "puma560", "d_m = 0.67183", "d_m = 671.83", "d_m = 671.83", "joint[0].dh.d_m",
     "671.83", "from -10 to 10 m; numbers are metres: 20 cm is 0.20"},
    {"KindOfAnotherFamily", "puma560", "kind = \"anthropomorphic\"", "kind = \"scara\"", "\"scara\"",
     "robot.kind", "\"scara\"",
     "must be \"anthropomorphic\", or left out: the geometry belongs to the family '"},
    {"KindInTheOtherConvention", "puma560", "\"standard\"", "\"modified\"", "kind = ", "robot.kind",
     "\"anthropomorphic\"", "as \"standard\" it is of the family 'ortho-parallel arm with spherical wrist'"},
    {"KindOfNone", "ur5e", "kind = \"anthropomorphic\"", "kind = \"humanoid\"", "\"humanoid\"", "robot.kind",
     "\"humanoid\"", "is no kind of arm; allowed here: \"anthropomorphic\""},
    {"KindNotText", "ur5e", "kind = \"anthropomorphic\"", "kind = 6", "kind = 6", "robot.kind", "6",
     "must be a string"},
    {"KindOfAnArmWithoutForm", "xarm6", "kind = \"other\"", "kind = \"anthropomorphic\"",
     "\"anthropomorphic\"", "robot.kind", "\"anthropomorphic\"", "axes 4"},
    {"JointKind", "cartesian_ppp", "kind = \"sliding\"", "kind = \"linear\"", "\"linear\"", "joint[0].kind",
     "\"linear\"", "must be \"turning\" or \"sliding\""},
    {"RangeOfASlideInDegrees", "cartesian_ppp", "range_m = [0, 0.4772]", "range_deg = [0, 90]", "range_deg",
     "joint[0].range_deg", "[0, 90]", "must be range_m: the joint slides"},
    {"SpeedOfATurnInMetres", "puma560", "speed_deg_s = 90", "speed_m_s = 1", "speed_m_s",
     "joint[0].speed_m_s", "1", "must be speed_deg_s: the joint turns"},
    {"RangeWithoutReady", "stanford", "range_m = [-0.1952, 0.77]", "range_m = [0.3, 0.77]", "range_m",
     "joint[2].range_m", "[0.3, 0.77]", "must contain 0"},
    {"RangeOfASlideInMillimetres", "cartesian_ppp", "range_m = [0, 0.4772]", "range_m = [0, 477.2]", "477.2",
     "joint[0].range_m[1]", "477.2", "from -10 to 10 m"},
    {"HomeNan", "stanford", "home_m = 0.5", "home_m = nan", "home_m", "joint[2].home_m", "nan",
     "from -10 to 10 m"},
    {"HomeInDegrees", "stanford", "home_m = 0.5", "home_deg = 5", "home_deg = 5", "joint[2].home_deg", "5",
     "must be home_m: the joint slides"},
    {"HomeOfThePapersArm", "al5d", "range_deg = [-90, 90]", "home_deg = 5\nrange_deg = [-90, 90]", "home_deg",
     "joint[0].home_deg", "5", "is unknown"},
    {"BaseOfThePapersArm", "al5d", "[gripper]", "[base]\nposition_m = [0, 0, 1]\n[gripper]", "[base]", "base",
     "a table", "needs the key dh or urdf in [geometry]"},
    {"PositionShort", "so101", "position_m = [0.0388353, 0, 0]", "position_m = [0, 0]", "position_m = [0, 0]",
     "base.position_m", "[0, 0]", "3 numbers in brackets"},
    {"ToolInMillimetres", "so101", "position_m = [0.0079, ", "position_m = [79, ", "position_m = [79, ",
     "tool.position_m[0]", "79", "from -10 to 10 m"},
    {"TwoOrientations", "so101", "rpy_deg = [180, 0, 0]",
     "rpy_deg = [180, 0, 0]\nquaternion_wxyz = [1, 0, 0, 0]", "quaternion_wxyz", "base.quaternion_wxyz",
     "[1, 0, 0, 0]", "contradicts rpy_deg"},
    {"QuaternionOfNoRotation", "so101", "rpy_deg = [180, 0, 0]", "quaternion_wxyz = [1, 0, 0, 1]",
     "quaternion_wxyz", "base.quaternion_wxyz", "[1, 0, 0, 1]", "must have length 1"},
    {"OrientationInRadians", "so101", "rpy_deg = [180, 0, 0]", "rpy_rad = [3.14, 0, 0]", "rpy_rad",
     "base.rpy_rad", "[3.14, 0, 0]", "is unknown; allowed here: position_m, rpy_deg, quaternion_wxyz"},
    {"ServoOfASlideInDegrees", "cartesian_ppp", "speed_m_s = 0.35",
     "servo = { channel = 0, zero_us = 600, us_per_degree = 3, direction = 1, pulse_range_us = [500, 2500] "
     "}\n"
     "speed_m_s = 0.35",
     "us_per_degree", "joint[0].servo.us_per_degree", "3", "must be us_per_mm: the joint slides"},
    {"PulseOfASlide", "cartesian_ppp", "speed_m_s = 0.35",
     "servo = { channel = 0, zero_us = 600, us_per_mm = 5, direction = 1, pulse_range_us = [500, 2500] }\n"
     "speed_m_s = 0.35",
     "range_m = [0, 0.4772]", "joint[0].range_m", "[0, 0.4772]", "needs a pulse of 2986 us at 0.4772 m"},
    {"TwoNamesOfOneLimit", "omx", "rotation_speed_deg_s = 90",
     "turn_speed_deg_s = 90\nrotation_speed_deg_s = 90", "turn_speed_deg_s", "path.turn_speed_deg_s", "90",
     "is an older name of rotation_speed_deg_s"},
    {"RotationMissing", "omx", "rotation_jerk_deg_s3 = 4000", "", "[path]", "path.rotation_jerk_deg_s3", "",
     "is missing"},
    {"FollowingOfASlide", "cartesian_ppp", "speed_m_s = 0.35", "following_error_m = 2\nspeed_m_s = 0.35",
     "following_error_m", "joint[0].following_error_m", "2", "at most 1 m"},
};

INSTANTIATE_TEST_SUITE_P(Profile, ArmRefused, testing::ValuesIn(kCases),
                         [](const auto& parameter) { return parameter.param.name; });

std::vector<std::string> keys_of(const std::vector<ConfigFault>& faults) {
  std::vector<std::string> keys;
  for (const auto& fault : faults) keys.push_back(fault.key);
  return keys;
}

TEST(ArmProfile, ABackendThatSendsPulsesNeedsEveryServo) {
  const std::string text =
      edited(shipped("omx"), "kind = \"loopback\"", "kind = \"ssc32\"\nssc32 = { port = \"/dev/x\" }");
  EXPECT_THAT(
      keys_of(faults_of(text)),
      testing::UnorderedElementsAre("joint[0].servo", "joint[1].servo", "joint[2].servo", "joint[3].servo",
                                    "gripper.channel", "gripper.closed_us", "gripper.open_us"));
}

TEST(ArmProfile, HowFarAnOrientationMayBeOff) {
  EXPECT_EQ(parse_profile(shipped("omx"), "omx.toml").arm.orientation_error_rad, 0.0);
  const std::string text = edited(shipped("omx"), "[robot]", "[robot]\norientation_error_deg = 2.5");
  EXPECT_EQ(parse_profile(text, "omx.toml").arm.orientation_error_rad, 2.5 * kDegree);
}

TEST(ArmProfile, AnOrientationErrorThatWouldBeIgnoredIsRefused) {
  std::string text = edited(shipped("omx"), "kind = \"anthropomorphic\"", "kind = \"other\"");
  text = edited(text, "a_m = 0.124, alpha_deg = 0", "a_m = 0.124, alpha_deg = 12");
  EXPECT_EQ(parse_profile(text, "arm.toml").arm.kinematics.solution_count(), 0u);
  EXPECT_THAT(faults_of(edited(text, "[robot]", "[robot]\norientation_error_deg = 0")), testing::IsEmpty());
  const auto faults = faults_of(edited(text, "[robot]", "[robot]\norientation_error_deg = 2.5"));
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].key, "robot.orientation_error_deg");
  EXPECT_EQ(faults[0].value, "2.5");
  EXPECT_THAT(faults[0].allowed,
              HasSubstr("must be 0, or be left out: an arm of 4 joints without a closed form"));
  // Six joints take every orientation, and with three it is an output that is compared with the limit.
  for (const char* other : {"xarm6", "cartesian_ppp"}) {
    EXPECT_THAT(faults_of(edited(shipped(other), "[robot]", "[robot]\norientation_error_deg = 2.5")),
                testing::IsEmpty());
  }
}

TEST(ArmProfile, ARowInRadiansIsToldTwice) {
  const std::string text = edited(shipped("puma560"), "alpha_deg = 90", "alpha_rad = 1.57");
  EXPECT_THAT(keys_of(faults_of(text)),
              testing::UnorderedElementsAre("joint[0].dh.alpha_deg", "joint[0].dh.alpha_rad"));
}

TEST(ArmProfile, HasOneToSixJoints) {
  std::string text = shipped("puma560");
  const auto joint = text.find("[[joint]]");
  const std::string one = text.substr(joint, text.find("[[joint]]", joint + 1) - joint);
  text.insert(joint, edited(one, "waist", "seventh"));
  const auto faults = faults_of(text);
  ASSERT_EQ(faults.size(), 1u);
  EXPECT_EQ(faults[0].key, "joint");
  EXPECT_EQ(faults[0].allowed, "are 7 joints, but an arm has 1 to 6");
}

TEST(ArmProfile, OfOneJointIsAnOther) {
  std::string text = edited(shipped("puma560"), "kind = \"anthropomorphic\"", "");
  const auto second = text.find("[[joint]]", text.find("[[joint]]") + 1);
  text.erase(second, text.find("[gripper]") - second);
  const Profile profile = parse_profile(text, "arm.toml");
  EXPECT_EQ(profile.arm.dof, 1u);
  EXPECT_EQ(profile.arm.kind, ArmKind::kOther);
  EXPECT_THAT(profile.description.reason, HasSubstr("no family has joints R"));
}

TEST(ArmProfile, KindMayBeLeftOut) {
  EXPECT_EQ(parse_profile(edited(shipped("stanford"), "kind = \"polar\"", ""), "arm.toml").arm.kind,
            ArmKind::kPolar);
  EXPECT_EQ(parse_profile(edited(shipped("lynx5"), "kind = \"anthropomorphic\"", ""), "arm.toml").arm.kind,
            ArmKind::kAnthropomorphic);
}

/// The tables of a modified and of a standard profile are of one arm: alpha and a stand one row later.
TEST(ArmProfile, ByAModifiedTableIsTheSameArm) {
  std::string text = edited(shipped("omx"), "\"standard\"", "\"modified\"");
  for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{
           {"d_m = 0.0595, a_m = 0, alpha_deg = -90", "d_m = 0.0595, a_m = 0, alpha_deg = 0"},
           {"d_m = 0, a_m = 0.13023056476879766, alpha_deg = 0", "d_m = 0, a_m = 0, alpha_deg = -90"},
           {"d_m = 0, a_m = 0.124, alpha_deg = 0", "d_m = 0, a_m = 0.13023056476879766, alpha_deg = 0"},
           {"d_m = 0, a_m = 0.126, alpha_deg = 90", "d_m = 0, a_m = 0.124, alpha_deg = 0"},
           {"[[joint]]", "[tool]\nposition_m = [0.126, 0, 0]\nrpy_deg = [90, 0, 0]\n[[joint]]"}}) {
    text = edited(text, from, to);
  }
  const Profile modified = parse_profile(text, "arm.toml"),
                standard = parse_profile(shipped("omx"), "arm.toml");
  EXPECT_STREQ(modified.arm.kinematics.family(), standard.arm.kinematics.family());
  const Joints q{0.3, -0.4, 0.5, 0.6};
  const Pose a = modified.arm.kinematics.forward(q), b = standard.arm.kinematics.forward(q);
  EXPECT_LT(norm(a.position_m - b.position_m), 1e-15);
  EXPECT_LT(angle_between(a.orientation, b.orientation), 1e-15);
}

TEST(ArmProfile, HomeIsWhereJointsAreZero) {
  const Profile home = parse_profile(shipped("stanford"), "arm.toml");
  const Profile shifted = parse_profile(edited(edited(shipped("stanford"), "home_m = 0.5", "home_m = 0.4"),
                                               "[-0.1952, 0.77]", "[-0.0952, 0.87]"),
                                        "arm.toml");
  const Joints at{0.1, 0.2, 0.3, 0.4, 0.5, 0.6}, same{0.1, 0.2, 0.4, 0.4, 0.5, 0.6};
  EXPECT_LT(
      norm(home.arm.kinematics.forward(at).position_m - shifted.arm.kinematics.forward(same).position_m),
      1e-15);
  EXPECT_EQ(home.description.home_q[2], 0.5);
  EXPECT_EQ(home.description.table.rows[2].d_m, 0.0);  // as given
}

TEST(ArmProfile, FramesMoveTheArmAndItsTool) {
  const std::string frames =
      "[base]\nposition_m = [1, 2, 3]\nrpy_deg = [0, 0, 90]\n"
      "[tool]\nposition_m = [0, 0, 0.1]\nquaternion_wxyz = [0.7071068, 0, 0.7071068, 0]\n[gripper]";
  const Kinematics bare = parse_profile(shipped("puma560"), "arm.toml").arm.kinematics;
  const Kinematics moved =
      parse_profile(edited(shipped("puma560"), "[gripper]", frames), "arm.toml").arm.kinematics;
  const Joints q{0.1, 0.2, 0.3, 0.4, 0.5, 0.6};
  const double half = std::sqrt(0.5);
  const Pose expected =
      Pose{{1, 2, 3}, {half, 0, 0, half}} * bare.forward(q) * Pose{{0, 0, 0.1}, {half, 0, half, 0}};
  EXPECT_LT(norm(moved.forward(q).position_m - expected.position_m), 1e-14);
  EXPECT_LT(angle_between(moved.forward(q).orientation, expected.orientation), 1e-14);
}

TEST(ArmProfile, UnitsOfSlidesAreMetres) {
  const std::string text = edited(
      shipped("cartesian_ppp"), "speed_m_s = 0.35",
      "servo = { channel = 7, zero_us = 600, us_per_mm = 3, direction = 1, pulse_range_us = [500, 2500] }\n"
      "following_error_m = 0.003\nspeed_m_s = 0.35");
  const Profile profile = parse_profile(text, "arm.toml");
  EXPECT_EQ(profile.arm.joints[0].upper_q, 0.4772);
  EXPECT_EQ(profile.arm.joints[0].speed_q_s, 0.35);
  EXPECT_EQ(profile.arm.joints[0].acceleration_q_s2, 0.8);
  EXPECT_EQ(profile.arm.servos[0].us_per_q, 3000.0);
  EXPECT_EQ(profile.arm.servos[0].channel, 7u);
  EXPECT_EQ(profile.following[0].error_q, 0.003);
  EXPECT_EQ(profile.following[0].goal_q, 0.001);
  EXPECT_EQ(profile.following[1].error_q, 0.02);
  EXPECT_TRUE(profile.has_servo[0]);
  EXPECT_FALSE(profile.has_servo[1]);
}

/// A simulated servo's scale is that of the joint's range, or less where the servo would be too slow.
TEST(ArmProfile, SimulatedServosKeepUpWithTheirJoints) {
  const Profile profile =
      parse_profile(edited(shipped("cartesian_ppp"), "lag_s = 0.02", "rate_us_per_s = 1000"), "arm.toml");
  EXPECT_DOUBLE_EQ(profile.arm.servos[0].us_per_q, 800.0 / 0.35);
  EXPECT_DOUBLE_EQ(profile.arm.servos[2].us_per_q, 800.0 / 0.10);
  EXPECT_DOUBLE_EQ(profile.arm.gripper.open_us - profile.arm.gripper.closed_us, 400.0);
}

const std::string kDrives = R"(kind = "socketcan"
[backend.socketcan]
interface = "unix:/tmp/can"
[[backend.socketcan.drive]]
node = 1
counts_per_m = 1e6
[[backend.socketcan.drive]]
node = 2
counts_per_m = 2e6
homing_method = 17
homing_speed_m_s = 0.05
[[backend.socketcan.drive]]
node = 3
counts_per_m = 1e6
)";

TEST(ArmProfile, DrivesOfSlidesCountMetres) {
  const Profile profile =
      parse_profile(edited(shipped("cartesian_ppp"), "kind = \"loopback\"\n", kDrives), "arm.toml");
  EXPECT_EQ(profile.backend.socketcan.drives[1].counts_per_q, 2e6);
  EXPECT_EQ(profile.backend.socketcan.drives[1].homing.speed_q_s, 0.05);
  EXPECT_EQ(profile.backend.socketcan.drives[1].homing.creep_q_s, 0.002);
  const auto one_fault = [](const std::string& from, const std::string& to) {
    const auto faults =
        faults_of(edited(shipped("cartesian_ppp"), "kind = \"loopback\"\n", edited(kDrives, from, to)));
    return faults.size() == 1 ? faults[0].key + ": " + faults[0].allowed
                              : std::to_string(faults.size()) + " faults";
  };
  EXPECT_EQ(one_fault("counts_per_m = 1e6", "counts_per_degree = 10"),
            "backend.socketcan.drive[0].counts_per_degree: must be counts_per_m: the joint slides");
  EXPECT_EQ(one_fault("homing_speed_m_s", "homing_speed_deg_s"),
            "backend.socketcan.drive[1].homing_speed_deg_s: must be homing_speed_m_s: the joint slides");
  EXPECT_THAT(one_fault("counts_per_m = 1e6", "counts_per_m = 1e6\nzero_count = 1e9"), HasSubstr("0 faults"));
  EXPECT_THAT(one_fault("counts_per_m = 1e6", "counts_per_m = 1e9\nzero_count = 1e9\ndirection = 1"),
              HasSubstr("0 faults"));
  const auto far = faults_of(edited(edited(shipped("cartesian_ppp"), "kind = \"loopback\"\n",
                                           edited(kDrives, "counts_per_m = 1e6", "counts_per_m = 1e9")),
                                    "[0, 0.4772]", "[0, 3]"));
  ASSERT_EQ(far.size(), 1u);
  EXPECT_EQ(far[0].allowed,
            "gives 3000000000 counts at the end of the joint's range, but a drive counts up to 2147483647: "
            "correct it, or the range");
}

/// The document's profile is the one to begin with for an arm of one's own.
TEST(ArmProfile, TheOneInTheDocumentIsComplete) {
  std::ifstream stream{CORBOT_PROFILES "/../docs/profiles.md"};
  const std::string text{std::istreambuf_iterator<char>{stream}, {}};
  const std::string begin = "```toml\n";
  const auto at = text.find(begin);
  ASSERT_NE(at, std::string::npos);
  const auto from = at + begin.size();
  const Profile profile = parse_profile(text.substr(from, text.find("```", from) - from), "my-arm.toml");
  EXPECT_EQ(profile.arm.kind, ArmKind::kAnthropomorphic);
  EXPECT_EQ(profile.arm.dof, 4u);
  EXPECT_TRUE(profile.description.reason.empty()) << "a closed form";
}

}  // namespace
}  // namespace corbot::arm_profile_test
