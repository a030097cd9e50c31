// SPDX-License-Identifier: Apache-2.0
// Further planes and boxes on disk: read back to the last bit, accepted only if they are sound.
#include <gmock/gmock.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <random>

#include "config/load_profile.h"
#include "corbot/channel/fingerprint.h"
#include "state/further_shapes_store.h"
#include "support/paths.h"

namespace corbot {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class FurtherShapesFile : public ::testing::Test {
 protected:
  FurtherShapesFile() : arm_(load_profile(fs::path(CORBOT_PROFILES) / "lynx5.toml").arm) {
    std::string path = CORBOT_SCRATCH_DIR "/shapes-XXXXXX";
    directory_ = ::mkdtemp(path.data());
    const double third = 1.0 / 3.0;
    add("slope", plane_shape({{0.6 / std::sqrt(0.36 + 0.64), 0.0, 0.8}, -third}, 3));
    add("post", box_shape(ShapeKind::kOutside, {0.0, -0.1, 0.0}, {0.1, third, 0.3}, 7));
    add("cage", box_shape(ShapeKind::kInside, {-0.4, -0.4, 0.0}, {0.4, 0.4, 0.5}, 1));
  }
  ~FurtherShapesFile() override { fs::remove_all(directory_); }

  void add(const std::string& name, WorkspaceShape shape) {
    name.copy(shape.name.data(), WorkspaceShape::kLongestName);
    sample_.shapes[sample_.count++] = shape;
  }
  [[nodiscard]] FurtherShapesStore store() const { return {directory_, "lynx5", "ssc32"}; }
  [[nodiscard]] std::string text() const { return FurtherShapesText::write(placed_, owner_, arm_); }
  [[nodiscard]] std::string refusal(const std::string& text) const {
    try {
      (void)FurtherShapesText::read(text, owner_, arm_);
    } catch (const SettingError& error) {
      return error.what();
    }
    return "";
  }
  [[nodiscard]] std::string changed(const std::string& from, const std::string& to) const {
    std::string all = text();
    const std::size_t at = all.find(from);
    EXPECT_NE(at, std::string::npos) << from << " in " << all;
    return all.replace(at, from.size(), to);
  }

  const SettingOwner owner_{"lynx5", "ssc32"};
  ArmModel arm_;
  fs::path directory_;
  PlacedShapes placed_{{}, {{0.1, -1.0 / 3.0, 2.0}, {std::cos(0.3), 0.0, 0.0, std::sin(0.3)}}};
  FurtherShapes& sample_ = placed_.further;
};

TEST_F(FurtherShapesFile, AreReadToTheLastBitUntilTheyAreRemoved) {
  EXPECT_FALSE(store().load(arm_).has_value()) << "no file, no shapes";
  store().save(placed_, arm_);
  const auto read = store().load(arm_);
  ASSERT_TRUE(read);
  EXPECT_EQ(number_of(read->further), number_of(sample_));
  EXPECT_EQ(read->further, sample_);
  EXPECT_EQ(read->world_T_base.position_m, placed_.world_T_base.position_m);
  EXPECT_EQ(read->world_T_base.orientation.z, placed_.world_T_base.orientation.z);
  store().save(std::nullopt, arm_);
  EXPECT_FALSE(store().load(arm_).has_value());
}

TEST_F(FurtherShapesFile, ThatNoServantWritesAreRejected) {
  EXPECT_EQ(refusal(text()), "");
  EXPECT_THAT(refusal(changed("robot = \"lynx5\"", "robot = \"lynx6\"")), HasSubstr("another robot"));
  EXPECT_THAT(refusal(changed("0.6, 0, 0.8", "0.7, 0, 0.8")), HasSubstr("no unit vector"));
  EXPECT_THAT(refusal(changed("0.6, 0, 0.8", "nan, 0, 0.8")), HasSubstr("not a number"));
  EXPECT_THAT(refusal(changed("0.6, 0, 0.8, ", "0.6, 0, 0.8, 3, ")), HasSubstr("must be 4 numbers"));
  EXPECT_THAT(refusal(changed("[0, -0.1, 0, 0.1,", "[0, -0.1, 0, 0,")), HasSubstr("not a box"));
  EXPECT_THAT(refusal(changed("base = [0.1", "base = [100.1")), HasSubstr("base: not a number"));
  EXPECT_THAT(refusal(changed("base = [0.1", "base = [0.1, 0.1")), HasSubstr("base: must be 7"));
  EXPECT_THAT(refusal(changed(", 2, 0.9", ", 2, 0.8")), HasSubstr("base: not a frame"));
  EXPECT_THAT(refusal(changed("base = ", "place = ")), HasSubstr("base: must be 7"));
  EXPECT_THAT(refusal(changed("format = 2", "format = 1")), HasSubstr("does not know the format"));
  EXPECT_THAT(refusal(changed("\"slope\"", "\"a b\"")), HasSubstr("name"));
  EXPECT_THAT(refusal(changed("parts = 7", "parts = 64")), HasSubstr("64, allowed 1 to 63"));
  EXPECT_THAT(refusal(changed("parts = 7", "parts = 39")),
              HasSubstr("tool, wrist, elbow, hand: none of this arm, or a link"));
  EXPECT_THAT(refusal(changed("\"cage\"", "\"post\"")), HasSubstr("'post' is the name of another"));
  EXPECT_EQ(arm_.workspace.count, 1u);
  EXPECT_EQ(refusal(changed("\"cage\"", "\"floor\"")),
            "'floor' is also the name of a plane or box of the profile's [workspace]");
  EXPECT_THAT(refusal(changed("kind = \"in\"", "kind = \"on\"")), HasSubstr("kind"));
  std::string line = text();
  line = line.substr(line.find("  { name = \"cage\""));
  line = line.substr(0, line.find('\n') + 1);
  std::string many;
  for (int i = 0; i < 7; ++i) many += line;
  EXPECT_THAT(refusal(changed(line, many)), HasSubstr("at most 8"));
}

TEST_F(FurtherShapesFile, HoldForLinksOfAKnownRadius) {
  arm_.workspace.link_radius_m = {0.02, 0.02, 0.01};
  sample_.shapes[0].parts = kAllParts;
  EXPECT_EQ(FurtherShapesText::read(text(), owner_, arm_).further, sample_);
  const std::string whole = text();
  arm_.workspace.link_radius_m[2] = 0.0;
  EXPECT_THAT(refusal(whole), HasSubstr("a link without link_radius_m"));
}

TEST_F(FurtherShapesFile, WithAnyByteChangedAreRejectedOrSound) {
  const auto seed = std::random_device{}();
  RecordProperty("seed", static_cast<int>(seed));
  std::mt19937 random(seed);
  const std::string whole = text();
  for (int i = 0; i < 20'000; ++i) {
    std::string damaged = whole;
    damaged[random() % damaged.size()] = static_cast<char>(random());
    try {
      ASSERT_TRUE(are_sound(FurtherShapesText::read(damaged, owner_, arm_).further)) << damaged;
    } catch (const SettingError&) {
      continue;
    }
  }
}

}  // namespace
}  // namespace corbot
