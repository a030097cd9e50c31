// SPDX-License-Identifier: Apache-2.0
// Tests which source corbot-rt takes the arm's position from, by the rank of the sources.
#include "rt/start_position.h"
#include "config/load_profile.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cstdlib>
#include <fstream>

#include "corbot/units.h"
#include "rt/cycle/servo_map.h"
#include "rt/rig.h"
#include "support/paths.h"

namespace corbot::test::start_position_test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const Joints kSaved{0.1, 0.2, 0.3, 0.4};

class StartPositionTest : public ::testing::Test {
 protected:
  StartPositionTest() {
    profile = load_profile(fs::path(CORBOT_PROFILES) / "lynx5.toml");
    profile.backend.kind = "ssc32";
    profile.backend.position_known_at_start = false;
    std::string path = CORBOT_SCRATCH_DIR "/start-XXXXXX";
    directory = ::mkdtemp(path.data());
  }
  ~StartPositionTest() override { fs::remove_all(directory); }

  /// Publishes the last state of a task with the profile as it is now.
  void publish(const Joints& at, double opening = 0.0) {
    Snapshot last{};
    last.position_q = at;
    last.gripper = opening;
    last.position_fingerprint = position_fingerprint(profile.arm);
    ServoFrame frame;
    rt::map_to_pulses(profile.arm, at, opening, frame);
    last.pulse_us = frame.pulse_us;
    segment->snapshot.store(last);
  }
  void save() {
    publish(kSaved, 0.5);
    rt::StartPosition(profile, "arm", directory).save(*segment);
    segment = std::make_unique<TaskSegment>();
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
  std::unique_ptr<TaskSegment> segment = std::make_unique<TaskSegment>();
};

TEST_F(StartPositionTest, WithoutAnySourceIsAngleZeroAndIsReportedLoudly) {
  const rt::CycleStart start = find();
  EXPECT_EQ(start.position_q, Joints{});
  EXPECT_TRUE(start.unverified);
  EXPECT_THAT(text, HasSubstr("UNKNOWN; the arm is taken to be"));
  profile.backend.position_known_at_start = true;
  EXPECT_FALSE(find().unverified);
  EXPECT_EQ(text, "0 in all joints");
}

TEST_F(StartPositionTest, TheFileIsUsed) {
  save();
  const rt::CycleStart start = find();
  EXPECT_NEAR(start.position_q[3], 0.4, 1e-12);
  EXPECT_EQ(start.opening, 0.5);
  EXPECT_TRUE(start.unverified);
  EXPECT_THAT(text, HasSubstr("5.7 11.5 17.2 22.9 degrees, where corbot left it at 20"));
  EXPECT_THAT(text, HasSubstr("10 %"));
  EXPECT_THAT(text, Not(HasSubstr("before this machine")));
  EXPECT_EQ(find({}, true).position_q, Joints{}) << "unless it is to be forgotten";
  std::ofstream(directory + "/arm.position") << "nonsense";
  EXPECT_EQ(find().position_q, Joints{});
  EXPECT_THAT(text, HasSubstr("UNKNOWN; the arm is taken to be"));
}

TEST_F(StartPositionTest, WhatTheSimulatorLeftIsNotUsedForADeviceNorTheOtherWayRound) {
  for (const char* const left_by : {"loopback", "ssc32"}) {
    profile.backend.kind = left_by;
    publish(kSaved, 0.5);
    Snapshot last{};
    ASSERT_TRUE(last_snapshot(*segment, last));
    last.flags |= kSnapshotHeld;
    last.state = RtState::kError;
    segment->snapshot.store(last);
    rt::StartPosition(profile, "arm", directory).save(*segment);
    segment = std::make_unique<TaskSegment>();
    EXPECT_TRUE(find().held);
    profile.backend.kind = profile.backend.kind == "ssc32" ? "loopback" : "ssc32";
    const rt::CycleStart start = find();
    EXPECT_EQ(start.position_q, Joints{}) << text;
    EXPECT_TRUE(start.unverified);
    EXPECT_FALSE(start.held || start.in_error);
    fs::remove_all(directory);
  }
}

TEST_F(StartPositionTest, AHoldIsInTheFile) {
  save();
  EXPECT_FALSE(find().held);
  publish(kSaved, 0.5);
  Snapshot last{};
  ASSERT_TRUE(last_snapshot(*segment, last));
  last.flags |= kSnapshotHeld;
  segment->snapshot.store(last);
  rt::StartPosition(profile, "arm", directory).save(*segment);
  segment = std::make_unique<TaskSegment>();
  EXPECT_TRUE(find().held);
  EXPECT_TRUE(find(device(DevicePosition::Kind::kMeasured, kSaved)).held) << "wherever the device is";
  EXPECT_FALSE(find({}, true).held) << "unless it is to be forgotten";
}

TEST_F(StartPositionTest, AnErrorIsInTheFile) {
  save();
  EXPECT_FALSE(find().in_error);
  publish(kSaved, 0.5);
  Snapshot last{};
  ASSERT_TRUE(last_snapshot(*segment, last));
  last.state = RtState::kError;
  segment->snapshot.store(last);
  rt::StartPosition(profile, "arm", directory).save(*segment);
  segment = std::make_unique<TaskSegment>();
  EXPECT_TRUE(find().in_error);
  EXPECT_FALSE(find().held);
  EXPECT_TRUE(find(device(DevicePosition::Kind::kMeasured, kSaved)).in_error) << "wherever the device is";
  EXPECT_FALSE(find({}, true).in_error) << "unless it is to be forgotten";
  profile.arm.servos[0].zero_us += 10.0;
  EXPECT_TRUE(find().in_error) << "whatever the position means by now";
}

TEST_F(StartPositionTest, AFileThatProvesNothingIsAnError) {
  save();
  std::ofstream(directory + "/arm.position") << "nonsense";
  for (const auto& at : {DevicePosition{}, device(DevicePosition::Kind::kMeasured, kSaved)}) {
    EXPECT_TRUE(find(at).in_error);
    EXPECT_THAT(text, HasSubstr("in Error until Clear: " + directory + "/arm.position: line 1: "));
    EXPECT_FALSE(find(at, true).in_error) << "unless it is to be forgotten";
    EXPECT_THAT(text, Not(HasSubstr("Error")));
  }
  publish(kSaved, 0.5);
  EXPECT_FALSE(find().in_error) << "the segment ranks higher";
  segment = std::make_unique<TaskSegment>();
  fs::remove(directory + "/arm.position");
  EXPECT_FALSE(find().in_error);
}

TEST_F(StartPositionTest, ADeviceThatMeasuresKnowsBetter) {
  save();
  const rt::CycleStart start = find(device(DevicePosition::Kind::kMeasured, {0.1, 0.2, 0.3, 0.39}));
  EXPECT_EQ(start.position_q[3], 0.39);
  EXPECT_EQ(start.opening, 0.5) << "which it does not measure";
  EXPECT_FALSE(start.unverified);
  EXPECT_THAT(text, HasSubstr("measured"));
  EXPECT_EQ(find(device(DevicePosition::Kind::kMeasured, kSaved, 0.8)).opening, 0.8) << "a gripper's drive";
  EXPECT_EQ(find(device(DevicePosition::Kind::kMeasured, kSaved, 0.8), true).opening, 0.8);
}

TEST_F(StartPositionTest, AJointMeasuredOutOfItsRangePreventsTheStart) {
  for (const bool has_segment : {false, true}) {
    if (has_segment) publish(kSaved);
    try {
      (void)find(device(DevicePosition::Kind::kMeasured, {0.0, 9.0, 0.0, 0.0}));
      ADD_FAILURE() << "from there, every start is a motion";
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(),
                  HasSubstr("joint " + profile.joint_names[1] + " is measured at 515.7 degrees"));
      EXPECT_THAT(error.what(), HasSubstr("-30.0 to 130.0"));
      EXPECT_THAT(error.what(), HasSubstr("zero_count"));
    }
    EXPECT_THROW((void)find(device(DevicePosition::Kind::kMeasured, {NAN, 0.0, 0.0, 0.0})),
                 std::runtime_error);
  }
  segment = std::make_unique<TaskSegment>();
  const double just_beyond = profile.arm.joints[0].upper_q + 0.01;
  const rt::CycleStart start = find(device(DevicePosition::Kind::kMeasured, {just_beyond, 0.0, 0.0, 0.0}));
  EXPECT_FALSE(start.unverified);
  EXPECT_EQ(start.position_q[0], profile.arm.joints[0].upper_q);
}

TEST_F(StartPositionTest, APulseOutOfItsJointsRangePreventsTheStart) {
  for (const bool has_segment : {false, true}) {
    save();
    if (has_segment) publish(kSaved);
    for (const bool forget : {false, true}) {
      try {
        (void)find(device(DevicePosition::Kind::kCommanded, {0.0, to_radians(150.0), 0.0, 0.0}, 0.5), forget);
        ADD_FAILURE() << "the servo is there, and every other start is a motion";
      } catch (const std::runtime_error& error) {
        const ServoMap& servo = profile.arm.servos[1];
        const double pulse_us = servo.zero_us + servo.direction * servo.us_per_q * to_radians(150.0);
        EXPECT_THAT(error.what(), HasSubstr("joint " + profile.joint_names[1] + " is at 150.0 degrees"));
        EXPECT_THAT(error.what(), HasSubstr(fmt::format("a pulse of {:.0f} us", pulse_us)));
        EXPECT_THAT(error.what(), HasSubstr("-30.0 to 130.0"));
        EXPECT_THAT(error.what(), HasSubstr("corbot calibrate"));
      }
    }
  }
  segment = std::make_unique<TaskSegment>();
  const double rounded = profile.arm.joints[0].upper_q + to_radians(1.0);
  const rt::CycleStart start = find(device(DevicePosition::Kind::kCommanded, {rounded, 0.0, 0.0, 0.0}, 0.5));
  EXPECT_EQ(start.position_q[0], profile.arm.joints[0].upper_q);
}

TEST_F(StartPositionTest, WhatAControllerWasCommandedIsTheFileUnrounded) {
  save();
  rt::CycleStart start = find(device(DevicePosition::Kind::kCommanded, {0.11, 0.19, 0.3, 0.4}, 0.52));
  EXPECT_NEAR(start.position_q[0], 0.1, 1e-12);
  EXPECT_EQ(start.opening, 0.5);
  EXPECT_FALSE(start.unverified);
  start = find(device(DevicePosition::Kind::kCommanded, {0.2, 0.19, 0.3, 0.4}, 0.52));
  EXPECT_EQ(start.position_q[0], 0.2) << "another program has moved it";
  EXPECT_EQ(start.opening, 0.52);
}

/// A drive that carries a load stands a little behind its set-point: from there the arm would sink at every
/// restart.
TEST_F(StartPositionTest, TheSegmentKnowsBestWhileTheJointsAreWhereItSays) {
  save();
  const Joints left{0.5, 0.5, 0.5, 0.5};
  publish(left, 0.25);
  const double lag_q = to_radians(1.9);
  for (const DevicePosition& at :
       {DevicePosition{}, device(DevicePosition::Kind::kMeasured, {0.5, 0.5 - lag_q, 0.5 + lag_q, 0.5}, 0.6),
        device(DevicePosition::Kind::kCommanded, {0.1, 0.1, 0.1, 0.1}, 0.6)}) {
    const rt::CycleStart start = find(at);
    EXPECT_EQ(start.position_q, left);
    EXPECT_EQ(start.opening, 0.25) << "what it grips, it goes on gripping";
    EXPECT_FALSE(start.unverified);
    EXPECT_FALSE(start.outranks_segment);
    EXPECT_EQ(start.position_fingerprint, position_fingerprint(profile.arm));
    EXPECT_EQ(text, "where the last real-time task left it");
  }
}

/// Drives whose task was killed may have lost their energy, and the arm sagged or was turned: no start drives
/// it back.
TEST_F(StartPositionTest, JointsThatAreNotWhereTheLastTaskLeftThemStayWhereTheyAreMeasured) {
  save();
  publish({0.5, 0.5, 0.5, 0.5}, 0.25);
  const Joints sagged{0.5, 0.5 - to_radians(30.0), 0.51, 0.5};
  rt::CycleStart start = find(device(DevicePosition::Kind::kMeasured, sagged));
  EXPECT_EQ(start.position_q, sagged) << "nor is the joint that is near driven back";
  EXPECT_EQ(start.opening, 0.25) << "which it does not measure";
  EXPECT_TRUE(start.outranks_segment);
  EXPECT_FALSE(start.unverified);
  EXPECT_TRUE(start.was_moved) << "somebody, or its own weight, has moved it";
  EXPECT_THAT(text,
              HasSubstr(fmt::format("measured by the device, 30.0 degrees from where the last real-time "
                                    "task left joint {}; in Error until Clear",
                                    profile.joint_names[1])));
  start = find(device(DevicePosition::Kind::kMeasured, sagged, 0.6));
  EXPECT_EQ(start.opening, 0.6) << "nor is the gripper";
  EXPECT_EQ(find(device(DevicePosition::Kind::kMeasured, sagged, NAN)).opening, 0.25);
  const double beyond_q = to_radians(2.1);
  start = find(device(DevicePosition::Kind::kMeasured, {0.5, 0.5, 0.5, 0.5 + beyond_q}));
  EXPECT_EQ(start.position_q[3], 0.5 + beyond_q);
}

/// Only a person clears, wherever the joints have gone meanwhile.
TEST_F(StartPositionTest, AnErrorAndAHoldOutliveATaskWhoseJointsWereTurned) {
  const DevicePosition turned = device(DevicePosition::Kind::kMeasured, {0.1, 0.1, 0.1, 0.1});
  const auto restart = [&](Rig& rig) {
    rt::StartPosition position(profile, "arm", directory);
    const rt::CycleStart start = position.find(*rig.task, turned, false);
    EXPECT_TRUE(start.outranks_segment);
    rig.restart(start);
    rig.step();
    EXPECT_EQ(rig.snapshot.position_q, turned.position_q);
  };
  const auto left_by = [&](Rig& rig) {
    rig.restart({.position_q = {0.5, 0.5, 0.5, 0.5},
                 .position_known = true,
                 .position_fingerprint = position_fingerprint(profile.arm)});
    rig.step();
  };
  Rig free;
  left_by(free);
  restart(free);
  EXPECT_EQ(free.snapshot.state, RtState::kError) << "it was turned";

  Rig in_error;
  left_by(in_error);
  in_error.emergency_stop->set(StopSource::kGpio, true);
  in_error.step();
  in_error.emergency_stop->set(StopSource::kGpio, false);
  in_error.step();
  ASSERT_EQ(in_error.snapshot.state, RtState::kError);
  restart(in_error);
  EXPECT_EQ(in_error.snapshot.state, RtState::kError);
  EXPECT_TRUE(in_error.cycle->frame().needs_clear) << "no energy before it";

  Rig stop_seen;
  left_by(stop_seen);
  stop_seen.task->stop_seen.store(1);  // by the task's thread, and it was killed before its cycle answered
  restart(stop_seen);
  EXPECT_EQ(stop_seen.snapshot.state, RtState::kError);

  Rig held;
  left_by(held);
  held.servant->control.hold_count.fetch_add(1);
  held.step(2);
  ASSERT_NE(held.snapshot.flags & kSnapshotHeld, 0u);
  held.servant = std::make_unique<ServantSegment>();  // nor does the servant know of it
  restart(held);
  held.step();
  EXPECT_NE(held.snapshot.flags & kSnapshotHeld, 0u);
  EXPECT_EQ(held.snapshot.state, RtState::kError);
}

TEST_F(StartPositionTest, ASegmentOfAnotherServoMapGivesPulsesOnly) {
  publish({0.5, 0.25, 0.5, 0.5}, 0.25);
  Snapshot last{};
  ASSERT_TRUE(segment->snapshot.load(last));
  profile.arm.servos[0].direction = -profile.arm.servos[0].direction;
  for (const bool known : {false, true}) {
    profile.backend.position_known_at_start = known;
    const rt::CycleStart start = find();
    EXPECT_TRUE(start.unverified);
    EXPECT_TRUE(start.outranks_segment);
    EXPECT_NEAR(start.position_q[0], -0.5, 1e-9);
    EXPECT_NEAR(start.position_q[1], 0.25, 1e-9);
    EXPECT_THAT(text, HasSubstr("THE SERVO MAP HAS CHANGED"));
    ServoFrame frame;
    rt::map_to_pulses(profile.arm, start.position_q, start.opening, frame);
    for (std::size_t i = 0; i <= profile.arm.dof; ++i) {
      EXPECT_NEAR(frame.pulse_us[i], last.pulse_us[i], 1e-6) << "nothing moves";
    }
  }
  const rt::CycleStart commanded = find(device(DevicePosition::Kind::kCommanded, {0.1, 0.2, 0.3, 0.4}, 0.5));
  EXPECT_EQ(commanded.position_q[0], 0.1) << "the device ranks higher";
  EXPECT_FALSE(commanded.unverified);
  EXPECT_TRUE(commanded.outranks_segment);
  EXPECT_EQ(find(device(DevicePosition::Kind::kMeasured, {0.1, 0.2, 0.3, 0.4})).position_q[0], 0.1);
}

TEST_F(StartPositionTest, APulseThatAnotherServoMapHasOutOfRangePreventsTheStart) {
  const double upper_q = profile.arm.joints[0].upper_q;
  publish({upper_q, 0.0, 0.0, 0.0});
  profile.arm.servos[0].us_per_q /= 2.0;  // so the servo is at twice that angle
  try {
    (void)find();
    ADD_FAILURE() << "every start is a jump";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("joint " + profile.joint_names[0] + " is at 180.0 degrees"));
    EXPECT_THAT(error.what(), HasSubstr("-90.0 to 90.0"));
    EXPECT_THAT(error.what(), HasSubstr("--fresh"));
  }
  EXPECT_NO_THROW((void)find(device(DevicePosition::Kind::kMeasured, kSaved))) << "the device knows better";
  profile.backend.common.relax_at_end = true;
  EXPECT_NO_THROW((void)find()) << "without pulses since, it may be anywhere";
}

TEST_F(StartPositionTest, ServosWithoutPowerHaveNotKeptTheirPosition) {
  publish(kSaved, 0.5);
  EXPECT_FALSE(find().unverified);
  const auto expect_unverified = [&] {
    const rt::CycleStart start = find();
    EXPECT_TRUE(start.unverified);
    EXPECT_TRUE(start.outranks_segment) << "which calls it known";
    EXPECT_EQ(start.position_q, kSaved);
    EXPECT_THAT(text, HasSubstr("with the servos unpowered"));
  };
  profile.backend.kind = "gpiod";  // its pulses end with the task
  expect_unverified();
  profile.backend.position_known_at_start = true;
  EXPECT_FALSE(find().unverified) << "as the operator declares";
  profile.backend.position_known_at_start = false;
  profile.backend.kind = "ssc32";
  EXPECT_FALSE(find().unverified);
  profile.backend.common.relax_at_end = true;
  expect_unverified();
  profile.backend.common.relax_at_end = false;
  profile.power_enable.chip = "/dev/gpiochip0";
  expect_unverified();
  EXPECT_FALSE(find(device(DevicePosition::Kind::kMeasured, {})).unverified) << "encoders";
}

TEST_F(StartPositionTest, PulsesToServosWithoutPowerProveNothing) {
  save();
  profile.power_enable.chip = "/dev/gpiochip0";
  rt::CycleStart start = find(device(DevicePosition::Kind::kCommanded, {0.11, 0.19, 0.3, 0.4}, 0.52));
  EXPECT_TRUE(start.unverified);
  EXPECT_NEAR(start.position_q[0], 0.1, 1e-12) << "but that is where they will go";
  EXPECT_THAT(text, HasSubstr("10 %"));
  EXPECT_FALSE(start.position_known);
  profile.backend.position_known_at_start = true;
  EXPECT_TRUE(find().position_known);
}

TEST_F(StartPositionTest, ADirectoryThatCannotBeWrittenIsNoReasonToFail) {
  fs::remove(directory);
  std::ofstream(directory) << "a file in its place";
  EXPECT_NO_THROW(save());
  EXPECT_TRUE(find().unverified);
}

}  // namespace
}  // namespace corbot::test::start_position_test
