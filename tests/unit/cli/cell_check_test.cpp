// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/cell_check.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <numbers>

#include "client/failure.h"
#include "support/paths.h"

namespace corbot::cli {
namespace {

using Eigen::Vector3d;
using testing::AllOf;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

/// The shipped cell; places: an area pallet1, slots store1, slots pallet2.
cell::CellConfig demo() {
  cell::CellOverrides overrides;
  overrides.state_directory = "/tmp/cell-state";
  return cell::load_cell(CORBOT_CELL "/cell.toml", overrides);
}

auto refused(const std::string& key, const std::string& motion, const std::string& why) {
  return AllOf(Field(&RefusedPoint::key, key), Field(&RefusedPoint::motion, motion),
               Field(&RefusedPoint::why, HasSubstr(why)));
}

TEST(CellCheck, BothRobotsReachAllPointsOfTheShippedCell) {
  const cell::CellConfig cell = demo();
  const ReachCheck robot1 = check_reach(cell, cell.robots[0]);
  EXPECT_THAT(robot1.refused, IsEmpty());
  EXPECT_EQ(robot1.points, 1 + 2 * (9 + 4));
  const ReachCheck robot2 = check_reach(cell, cell.robots[1]);
  EXPECT_THAT(robot2.refused, IsEmpty());
  EXPECT_EQ(robot2.points, 1 + 2 * (4 + 12));
}

TEST(CellCheck, TheArcsOfTheShippedCellAreInReach) {
  cell::CellConfig cell = demo();
  for (cell::CellRobot& robot : cell.robots) robot.transit = "arc";
  const ReachCheck robot1 = check_reach(cell, cell.robots[0]);
  EXPECT_THAT(robot1.refused, IsEmpty());
  EXPECT_EQ(robot1.points, 1 + 3 * 9 + 2 * 4) << "no arc leads to the store";
  const ReachCheck robot2 = check_reach(cell, cell.robots[1]);
  EXPECT_THAT(robot2.refused, IsEmpty());
  EXPECT_EQ(robot2.points, 1 + 2 * 4 + 3 * 12);
}

TEST(CellCheck, AnArcAboveACeilingIsNamed) {
  const std::string profile = testing::TempDir() + fmt::format("corbot-low-{}.toml", ::getpid());
  std::ofstream(profile) << std::ifstream(CORBOT_CELL "/arm.toml").rdbuf()
                         << "\n[[workspace.plane]]\nname = \"ceiling\"\nnormal = [0, 0, -1]\n"
                            "offset_m = -0.095\nparts = [\"tool\"]\n";
  cell::CellConfig cell = demo();
  cell.robots[1].profile = profile;
  const std::size_t without_arcs = check_reach(cell, cell.robots[1]).refused.size();
  cell.robots[1].transit = "arc";
  const ReachCheck check = check_reach(cell, cell.robots[1]);
  std::filesystem::remove(profile);
  EXPECT_THAT(check.refused, SizeIs(without_arcs + 12)) << "the arc to each slot of pallet2";
  EXPECT_THAT(check.refused, testing::Contains(refused("place[2] pallet2, slot 0, red",
                                                       "the arc above the grasp", "ceiling")));
}

TEST(CellCheck, TheScaraReachesAllPointsOfRobot2) {
  cell::CellConfig cell = demo();
  cell.robots[1].profile = CORBOT_CELL "/scara.toml";
  cell.robots[1].frame.yaw_rad = std::numbers::pi;
  const ReachCheck check = check_reach(cell, cell.robots[1]);
  EXPECT_THAT(check.refused, IsEmpty());
  EXPECT_EQ(check.points, 1 + 2 * (4 + 12));
}

TEST(CellCheck, ASlotOutOfReachIsNamedWithItsPointInTheRobotsFrame) {
  cell::CellConfig cell = demo();
  cell.places[1].slots->pitch_m.y() = 0.2;  // the outer two of four slots are 0.3 m from the middle
  const ReachCheck check = check_reach(cell, cell.robots[0]);
  ASSERT_THAT(check.refused,
              ElementsAre(refused("place[1] store1, slot 0, red", "the motion above the grasp", "too far"),
                          refused("place[1] store1, slot 3, red", "the motion above the grasp", "too far")));
  const Vector3d above = cell.places[1].slot_position(0) + Vector3d(0, 0, 0.030 + 0.060);
  EXPECT_LT((check.refused[0].point_m - cell.robots[0].frame.to_local(above)).norm(), 1e-9);
}

TEST(CellCheck, AGraspBelowAnApproachInReachIsNamedWithTheLine) {
  cell::CellConfig cell = demo();
  cell.places[1].frame.position_m.z() = -0.25;
  cell.robots[0].above_m = 0.3;
  const ReachCheck check = check_reach(cell, cell.robots[0]);
  ASSERT_THAT(check.refused,
              testing::Contains(refused("place[1] store1, slot 1, red", "the line to the grasp", "")));
}

TEST(CellCheck, AWaitPoseOutOfReachIsNamedByItsKey) {
  cell::CellConfig cell = demo();
  cell.robots[1].wait_m = {-0.3, 0, 0.09};
  const ReachCheck check = check_reach(cell, cell.robots[1]);
  ASSERT_THAT(check.refused, ElementsAre(refused("robot[1].wait_m", "the motion", "too far")));
  const Vector3d wait = cell.robots[1].frame.to_local(cell.robots[1].wait_m);
  EXPECT_LT((check.refused[0].point_m - wait).norm(), 1e-9);
}

TEST(CellCheck, EachKindHasItsOwnGrasp) {
  cell::CellConfig cell = demo();
  cell.kinds.push_back(cell.kinds[0]);
  cell.kinds[1].name = "tall";
  cell.kinds[1].grasp_m = 0.3;
  const ReachCheck check = check_reach(cell, cell.robots[1]);
  EXPECT_THAT(check.refused, SizeIs(4 + 12));
  EXPECT_THAT(check.refused, testing::Each(Field(&RefusedPoint::key, testing::EndsWith(", tall"))));
}

TEST(CellCheck, TheCornerOfAnAreaIsWhereAPieceStandsOnItWhole) {
  cell::CellConfig cell = demo();
  cell.kinds[0].width_m = 0;
  const ReachCheck check = check_reach(cell, cell.robots[0]);
  EXPECT_THAT(check.refused, ElementsAre(refused("place[0] pallet1, at (0.168, 0.294), red",
                                                 "the line to the grasp", "too far")));
}

TEST(CellCheck, ASquareStandsOnAnAreaWholeAtEveryYaw) {
  cell::CellConfig cell = demo();
  cell.kinds[0].is_square = true;
  cell.kinds[0].grasp_m = 0.3;  // every spot is refused
  const ReachCheck check = check_reach(cell, cell.robots[0]);
  EXPECT_THAT(check.refused,
              testing::Contains(Field(&RefusedPoint::key, "place[0] pallet1, at (0.153, 0.280), red")));
}

TEST(CellCheck, ARobotElsewhereThatDoesNotReplyIsNamed) {
  cell::CellConfig cell = demo();
  cell.robots[1].profile.clear();
  cell.robots[1].reference = "corbaloc::127.0.0.1:9/robot2";
  EXPECT_THROW((void)check_reach(cell, cell.robots[1]), client::Failure);
}

}  // namespace
}  // namespace corbot::cli
