// SPDX-License-Identifier: Apache-2.0
// Every shipped profile as a URDF, and back by liburdfdom.
#include <gtest/gtest.h>

#include <filesystem>
#include <random>
#include <string>

#include "config/arms/recognise.h"
#include "config/arms/urdf_chain.h"
#include "config/arms/write_urdf.h"
#include "config/load_profile.h"
#include "support/paths.h"

namespace corbot::urdf_export_test {
namespace {

using config::kUrdfBase;
using config::kUrdfTip;

std::vector<std::filesystem::path> shipped() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(CORBOT_PROFILES)) {
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  }
  return files;
}

TEST(UrdfExport, ComesBackAsTheSameArm) {
  const auto files = shipped();
  ASSERT_GE(files.size(), 19u);
  std::mt19937_64 random(1751);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (const auto& file : files) {
    const Profile profile = load_profile(file);
    const ArmModel& arm = profile.arm;
    const std::string xml = config::write_urdf(arm, profile.name, profile.joint_names);
    const config::UrdfChain back = config::read_urdf_chain(xml, kUrdfBase, kUrdfTip);
    ASSERT_EQ(back.chain.count, arm.dof) << file;
    for (std::size_t i = 0; i < arm.dof; ++i) {
      EXPECT_EQ(back.chain.axes[i].kind, arm.kinematics.joint_kind(i)) << file;
      EXPECT_EQ(back.joints[i].name, profile.joint_names[i]) << file;
      EXPECT_EQ(back.joints[i].lower_q, arm.joints[i].lower_q) << file;
      EXPECT_EQ(back.joints[i].upper_q, arm.joints[i].upper_q) << file;
    }
    for (int n = 0; n < 200; ++n) {
      Joints q{};
      for (std::size_t i = 0; i < arm.dof; ++i)
        q[i] = arm.joints[i].lower_q + unit(random) * (arm.joints[i].upper_q - arm.joints[i].lower_q);
      const Pose a = arm.kinematics.forward(q), b = forward(back.chain, q);
      ASSERT_LT(norm(a.position_m - b.position_m), 1e-12) << file;
      ASSERT_LT(angle_between(a.orientation, b.orientation), 1e-12) << file;
    }
    EXPECT_STREQ(config::recognise_arm(back.chain).kinematics.family(), arm.kinematics.family()) << file;
  }
}

/// A profile may name what another one has exported.
TEST(UrdfExport, IsAProfilesGeometry) {
  const std::string file = std::string(CORBOT_PROFILES) + "/scara_cobra600.toml";
  const Profile before = load_profile(file);
  std::string text = read_profile_text(file);
  const auto cut = [&text](const std::string& from, const std::string& to) {
    const auto begin = text.find(from);
    ASSERT_NE(begin, std::string::npos) << from;
    text.erase(begin, text.find(to, begin) - begin);
  };
  cut("dh = \"standard\"", "[[joint]]");
  for (int i = 0; i < 4; ++i) cut("dh = {", "range_");  // the row, and a home
  cut("kind = \"sliding\"", "range_");
  text.insert(text.find("[[joint]]"), "urdf = '''" +
                                          config::write_urdf(before.arm, before.name, before.joint_names) +
                                          "'''\nbase_link = \"base_link\"\ntip_link = \"tool0\"\n");
  const Profile after = parse_profile(text, "arm.toml");
  EXPECT_EQ(after.arm.kind, ArmKind::kScara);
  const Joints q{0.1, 0.2, 0.03, 0.4};
  EXPECT_LT(norm(after.arm.kinematics.forward(q).position_m - before.arm.kinematics.forward(q).position_m),
            1e-15);
}

}  // namespace
}  // namespace corbot::urdf_export_test
