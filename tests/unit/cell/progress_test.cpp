// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/progress.h"

#include <gtest/gtest.h>

namespace corbot::cli {
namespace {

const WorkProgress kProgress{3, 12, {"robot1 moves piece 5", "robot2 waits: store1 is empty"}};

TEST(Progress, HasPiecesSecondsAndWhatEachRobotDoes) {
  EXPECT_EQ(placed_line(kProgress, 24.3), "3 of 12 pieces placed, 24 s");
  EXPECT_EQ(progress_line(kProgress, 24.3, 200),
            "3 of 12 pieces placed, 24 s; robot1 moves piece 5; robot2 waits: store1 is empty");
}

TEST(Progress, IsCutAtTheEdgeOfTheTerminal) {
  EXPECT_EQ(progress_line(kProgress, 24.3, 30), "3 of 12 pieces placed, 24 s; r");
}

TEST(Progress, NamesNoTotalThatIsNotKnown) {
  EXPECT_EQ(placed_line({3, std::nullopt, {}}, 24.3), "3 pieces placed, 24 s");
}

}  // namespace
}  // namespace corbot::cli
