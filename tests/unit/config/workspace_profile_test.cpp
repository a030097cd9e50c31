// SPDX-License-Identifier: Apache-2.0
// [workspace] of a profile.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <vector>

#include "config/load_profile.h"
#include "config/segment_fingerprint.h"
#include "corbot/kinematics/arm_parts.h"
#include "support/test_arms.h"

namespace corbot::workspace_profile_test {
namespace {

using testing::HasSubstr;

Profile with(const std::string& workspace, const std::string& arm = "lynx5") {
  return parse_profile(read_profile_text(test::profile_path(arm)) + "\n" + workspace, "arm.toml");
}

std::vector<std::string> faults_of(const std::string& workspace, const std::string& arm = "lynx5") {
  std::vector<std::string> texts;
  try {
    (void)with(workspace, arm);
  } catch (const ConfigError& error) {
    for (const ConfigFault& fault : error.faults()) texts.push_back(fault.text());
  }
  return texts;
}

void expect_fault(const std::string& workspace, const std::string& text, const std::string& arm = "lynx5") {
  EXPECT_THAT(faults_of(workspace, arm), testing::ElementsAre(HasSubstr(text))) << workspace;
}

const std::string kPost = "[[workspace.box]]\nname = \"post\"\nfrom_m = [0.1, 0.1, 0]\n";

TEST(WorkspaceProfile, HasNoShapesWithoutTheTable) { EXPECT_EQ(with("").arm.workspace.count, 0u); }

TEST(WorkspaceProfile, GivesFloorPlanesAndBoxes) {
  const WorkspaceLimits limits = with(
                                     "[workspace]\nfloor_m = 0.01\n"
                                     "[[workspace.plane]]\nname = \"wall\"\nnormal = [0, -2, 0]\n"
                                     "offset_m = -0.3\nparts = [\"elbow\"]\n" +
                                     kPost + "to_m = [0.2, 0.2, 1]\nstay = \"out\"\n" +
                                     "[[workspace.box]]\nname = \"cage\"\nfrom_m = [-1, -1, -1]\n"
                                     "to_m = [1, 1, 1]\nstay = \"in\"\n")
                                     .arm.workspace;
  ASSERT_EQ(limits.count, 4u);
  const auto name = [&limits](std::size_t i) { return std::string(limits.shapes[i].name.data()); };
  EXPECT_EQ(name(0), "floor");
  EXPECT_EQ(limits.shapes[0].parts, bit_of(0) | bit_of(1));
  EXPECT_NEAR(clearance_m(limits.shapes[0], {0.3, 0.3, 0.0}), -0.01, 1e-12);
  EXPECT_EQ(name(1), "wall");
  EXPECT_EQ(limits.shapes[1].parts, bit_of(2));
  EXPECT_NEAR(clearance_m(limits.shapes[1], {0.0, 0.2, 0.0}), 0.1, 1e-12);
  EXPECT_EQ(name(2), "post");
  EXPECT_NEAR(clearance_m(limits.shapes[2], {0.15, 0.17, 0.5}), -0.03, 1e-12);
  EXPECT_NEAR(clearance_m(limits.shapes[2], {0.25, 0.15, 0.5}), 0.05, 1e-12);
  EXPECT_EQ(name(3), "cage");
  EXPECT_NEAR(clearance_m(limits.shapes[3], {0.9, 0.0, 0.0}), 0.1, 1e-12);
  EXPECT_NEAR(clearance_m(limits.shapes[3], {1.2, 0.0, 0.0}), -0.2, 1e-12);
}

TEST(WorkspaceProfile, RefusesWhatIsNoShape) {
  expect_fault("[workspace]\nfloor = 0\n", "did you mean floor_m?");
  expect_fault("[workspace]\nfloor_m = 1e9\n", "workspace.floor_m = 1000000000: must be a number from -100");
  expect_fault("[[workspace.plane]]\nname = \"wall\"\nnormal = [0, 0, 0]\noffset_m = 0\n",
               "a vector longer than 0");
  expect_fault("[[workspace.plane]]\nname = \"a b\"\nnormal = [0, 0, 1]\noffset_m = 0\n", "1 to 32");
  expect_fault(kPost + "to_m = [0.2, 0.1, 1]\nstay = \"out\"\n", "greater than from_m");
  expect_fault(kPost + "to_m = [0.2, 0.2, 1]\nstay = \"off\"\n", "must be \"out\" or \"in\"");
  expect_fault(kPost + "to_m = [0.2, 0.2, 1]\n", "stay: is missing");
  expect_fault(kPost + "to_m = [0.2, 0.2, 1]\nstay = \"out\"\nparts = [\"hand\"]\n",
               "\"elbow\" and \"links\"");
}

TEST(WorkspaceProfile, RefusesANameTwiceAndAShapeTooMany) {
  const std::string post = kPost + "to_m = [0.2, 0.2, 1]\nstay = \"out\"\n";
  expect_fault(post + post, "is the name of another");
  expect_fault(
      "[workspace]\nfloor_m = 0\n[[workspace.plane]]\nname = \"floor\"\nnormal = [0, 0, 1]\n"
      "offset_m = 0\n",
      "is the name of another");
  std::string many = "[workspace]\nfloor_m = 0\n";
  for (int i = 0; i < 16; ++i)
    many += "[[workspace.plane]]\nname = \"p" + std::to_string(i) + "\"\nnormal = [0, 0, 1]\noffset_m = 0\n";
  expect_fault(many, "at most 16");
}

TEST(WorkspaceProfile, OfTheDocumentIsRead) {
  std::ifstream stream{CORBOT_PROFILES "/../docs/profiles.md"};
  const std::string text{std::istreambuf_iterator<char>{stream}, {}};
  const auto from = text.find("[workspace]\nfloor_m");
  ASSERT_NE(from, std::string::npos);
  EXPECT_EQ(with(text.substr(from, text.find("```", from) - from)).arm.workspace.count, 3u);
}

TEST(WorkspaceProfile, RefusesAPartThatTheArmDoesNotHave) {
  const std::string plane = "[[workspace.plane]]\nname = \"wall\"\nnormal = [0, 0, 1]\noffset_m = 0\n";
  expect_fault(plane + "parts = [\"tool\", \"wrist\"]\n", "which this arm does not have", "cartesian_ppp");
  EXPECT_EQ(with(plane, "cartesian_ppp").arm.workspace.count, 1u);
}

const std::string kTable = "[[workspace.plane]]\nname = \"table\"\nnormal = [0, 0, 1]\noffset_m = -1\n";
const std::string kLinked = kTable + "parts = [\"tool\", \"links\"]\n";

TEST(WorkspaceProfile, GivesEachLinkARadius) {
  const WorkspaceLimits limits =
      with("[workspace]\nlink_radius_m = [0.03, 0.02, 0.01]\n" + kLinked).arm.workspace;
  EXPECT_EQ(limits.link_radius_m, (std::array{0.03, 0.02, 0.01}));
  EXPECT_EQ(limits.shapes[0].parts, bit_of(0) | bit_of(3) | bit_of(4) | bit_of(5));
  EXPECT_EQ(with(kTable).arm.workspace.shapes[0].parts, bit_of(0) | bit_of(1) | bit_of(2));
}

TEST(WorkspaceProfile, RefusesLinksWithoutRadiiAndRadiiWithoutLinks) {
  expect_fault(kLinked, "link_radius_m must give a radius for each");
  expect_fault("[workspace]\nlink_radius_m = [0.03, 0.02]\n", "3 numbers");
  expect_fault("[workspace]\nlink_radius_m = [0.03, 0.02, 0]\n", "from 0.001");
  expect_fault("[workspace]\nlink_radius_m = [0.03]\n", "this arm has no links", "cartesian_ppp");
}

TEST(WorkspaceProfile, TaskAndServantMustHaveTheSameWorkspace) {
  std::set<std::uint64_t> segments, models;
  for (const char* text : {"", "[workspace]\nfloor_m = 0.0\n", "[workspace]\nfloor_m = 0.1\n",
                           "[workspace]\nfloor_m = 0.1\nlink_radius_m = [0.03, 0.02, 0.01]\n",
                           "[workspace]\nlink_radius_m = [0.03, 0.02, 0.01]\n",
                           "[workspace]\nlink_radius_m = [0.03, 0.02, 0.02]\n",
                           "[[workspace.plane]]\nname = \"a\"\nnormal = [0, 0, 1]\noffset_m = 0.1\n"}) {
    const Profile profile = with(text);
    segments.insert(segment_fingerprint(profile));
    models.insert(fingerprint(profile.arm));
  }
  EXPECT_EQ(segments.size(), 7u) << "the floor holds for tool and wrist, the plane for all parts";
  EXPECT_EQ(models.size(), 1u) << "a saved position stays valid";
}

}  // namespace
}  // namespace corbot::workspace_profile_test
