// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/run_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "unit/cell/made_history.h"

namespace corbot::test {
namespace {

using cell::Activity;
using cli::WorkHistory;
using testing::ElementsAre;
using testing::IsEmpty;

TEST(WorkHistory, LastsFromTheFirstReservedToTheLastPlaced) {
  const auto period = cli::period_of(made_history());
  ASSERT_TRUE(period);
  EXPECT_DOUBLE_EQ(period->begin_s, 1700000000);
  EXPECT_DOUBLE_EQ(period->duration_s(), 112);
  EXPECT_FALSE(cli::period_of(WorkHistory{}));
}

TEST(WorkHistory, SpansAreCutAtTheEndsOfThePeriod) {
  const WorkHistory history = made_history();
  const auto spans = cli::spans_of(history, "robot2", *cli::period_of(history));
  ASSERT_EQ(spans.size(), 4U);
  EXPECT_EQ(spans[0].activity, Activity::kWaitingForPiece);
  EXPECT_DOUBLE_EQ(spans[0].period.begin_s, 1700000000);
  EXPECT_DOUBLE_EQ(spans[0].period.end_s, 1700000050);
  EXPECT_EQ(spans[1].activity, Activity::kWaitingForZone);
  EXPECT_EQ(spans[2].zone, "store1");
  EXPECT_DOUBLE_EQ(spans[3].period.end_s, 1700000112);
}

TEST(WorkHistory, AZoneHasTheShareOfTimeOfEachRobot) {
  const WorkHistory history = made_history();
  const auto shares = cli::zone_shares(history, *cli::period_of(history));
  ASSERT_EQ(shares.size(), 1U);
  EXPECT_DOUBLE_EQ(shares.at("store1").at("robot1"), 0.25);
  EXPECT_DOUBLE_EQ(shares.at("store1").at("robot2"), 0.125);
}

TEST(RunTable, HasEachFigureThatIsKnown) {
  const cli::RunFigures figures{0.434, 55.2, {{"robot1", 0}, {"robot2", 3}, {"scene", 2}}};
  EXPECT_THAT(cli::run_table(made_history(), figures),
              ElementsAre("  pieces            1, 112.0 s a piece, in 112.0 s",
                          "  both arms moved   43 % of the time",
                          "  zone of store1    robot1 25 %, robot2 12 %, free 62 %",
                          "  least distance    55 mm between the arms",
                          "  overruns          robot1 0, robot2 3, scene 2"));
}

TEST(RunTable, LeavesOutWhatACellDoesNotMeasure) {
  WorkHistory foreign = made_history();
  foreign.activities.clear();
  EXPECT_THAT(cli::run_table(foreign, {}), ElementsAre("  pieces            1, 112.0 s a piece, in 112.0 s"));
  EXPECT_THAT(cli::run_table({}, {}), IsEmpty());
}

}  // namespace
}  // namespace corbot::test
