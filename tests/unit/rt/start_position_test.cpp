// SPDX-License-Identifier: Apache-2.0
// What corbot-rt takes for the arm's position, by rank of who says so.
#include "rt/start_position.h"

#include <gmock/gmock.h>

#include <cstdlib>
#include <fstream>

#include "rt/rig.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const Joints kKept{0.1, 0.2, 0.3, 0.4};

class StartPositionTest : public ::testing::Test {
 protected:
  StartPositionTest() {
    profile = load_profile(fs::path(CORBOT_PROFILES) / "lynx5.toml");
    profile.backend.position_known_at_start = false;
    std::string path = CORBOT_SCRATCH_DIR "/start-XXXXXX";
    directory = ::mkdtemp(path.data());
  }
  ~StartPositionTest() override { fs::remove_all(directory); }

  void keep() {
    Snapshot last{};
    last.position_rad = kKept;
    last.gripper = 0.5;
    segment->snapshot.store(last);
    rt::StartPosition(profile, "arm", directory).keep(*segment);
    segment = std::make_unique<SegmentLayout>();
  }
  rt::CycleStart find(const DevicePosition& device = {}, bool forget = false) {
    rt::StartPosition position(profile, "arm", directory);
    const rt::CycleStart start = position.find(*segment, device, forget);
    text = position.text();
    return start;
  }
  static DevicePosition device(DevicePosition::Kind kind, const Joints& at, double opening = -1.0) {
    return {kind, at, opening};
  }

  Profile profile;
  std::string directory;
  std::string text;
  std::unique_ptr<SegmentLayout> segment = std::make_unique<SegmentLayout>();
};

TEST_F(StartPositionTest, WithoutAnyWordIsAngleZeroAndLoudlySaidSo) {
  const rt::CycleStart start = find();
  EXPECT_EQ(start.position_rad, Joints{});
  EXPECT_TRUE(start.uncertain);
  EXPECT_THAT(text, HasSubstr("NOBODY KNOWS"));
  profile.backend.position_known_at_start = true;
  EXPECT_FALSE(find().uncertain);
  EXPECT_EQ(text, "0 degrees");
}

TEST_F(StartPositionTest, TheFileIsBelieved) {
  keep();
  const rt::CycleStart start = find();
  EXPECT_NEAR(start.position_rad[3], 0.4, 1e-12);
  EXPECT_EQ(start.opening, 0.5);
  EXPECT_TRUE(start.uncertain);
  EXPECT_THAT(text, HasSubstr("5.7 11.5 17.2 22.9 degrees, where corbot left it at 20"));
  EXPECT_THAT(text, HasSubstr("10 %"));
  EXPECT_THAT(text, Not(HasSubstr("before this machine")));
  EXPECT_EQ(find({}, true).position_rad, Joints{}) << "unless it is to be forgotten";
  std::ofstream(directory + "/arm.position") << "nonsense";
  EXPECT_EQ(find().position_rad, Joints{});
  EXPECT_THAT(text, HasSubstr("NOBODY KNOWS"));
}

TEST_F(StartPositionTest, ADeviceThatMeasuresKnowsBetter) {
  keep();
  const rt::CycleStart start = find(device(DevicePosition::Kind::kMeasured, {0.1, 0.2, 0.3, 0.39}));
  EXPECT_EQ(start.position_rad[3], 0.39);
  EXPECT_EQ(start.opening, 0.5) << "which it does not measure";
  EXPECT_FALSE(start.uncertain);
  EXPECT_THAT(text, HasSubstr("measured"));
}

TEST_F(StartPositionTest, AMeasuredPositionOutOfRangeIsNotBelieved) {
  EXPECT_TRUE(find(device(DevicePosition::Kind::kMeasured, {9.0, 0.0, 0.0, 0.0})).uncertain);
  EXPECT_TRUE(find(device(DevicePosition::Kind::kMeasured, {NAN, 0.0, 0.0, 0.0})).uncertain);
  const double just_beyond = profile.arm.joints[0].upper_rad + 0.01;
  const rt::CycleStart start = find(device(DevicePosition::Kind::kMeasured, {just_beyond, 0.0, 0.0, 0.0}));
  EXPECT_FALSE(start.uncertain);
  EXPECT_EQ(start.position_rad[0], profile.arm.joints[0].upper_rad);
}

TEST_F(StartPositionTest, WhatAControllerHasBeenToldIsTheFileUnrounded) {
  keep();
  rt::CycleStart start = find(device(DevicePosition::Kind::kTold, {0.11, 0.19, 0.3, 0.4}, 0.52));
  EXPECT_NEAR(start.position_rad[0], 0.1, 1e-12);
  EXPECT_EQ(start.opening, 0.5);
  EXPECT_FALSE(start.uncertain);
  start = find(device(DevicePosition::Kind::kTold, {0.2, 0.19, 0.3, 0.4}, 0.52));
  EXPECT_EQ(start.position_rad[0], 0.2) << "somebody else has moved it";
  EXPECT_EQ(start.opening, 0.52);
}

TEST_F(StartPositionTest, TheSegmentKnowsBest) {
  keep();
  Snapshot last{};
  last.position_rad = {0.5, 0.5, 0.5, 0.5};
  segment->snapshot.store(last);
  const rt::CycleStart start = find(device(DevicePosition::Kind::kMeasured, {}));
  EXPECT_EQ(start.position_rad[0], 0.5);
  EXPECT_FALSE(start.uncertain);
}

TEST_F(StartPositionTest, ADirectoryThatCannotBeWrittenIsNoReasonToFail) {
  fs::remove(directory);
  std::ofstream(directory) << "a file in its place";
  EXPECT_NO_THROW(keep());
  EXPECT_TRUE(find().uncertain);
}

}  // namespace
}  // namespace corbot::test
