// SPDX-License-Identifier: Apache-2.0
// Tests the pace of a made record. Robot2 ends a piece each 10 s, with a look of 1 s and motions of 6 s in
// the zone. Robot1 moves there for 2 s.
#include "soak/cell_pace.h"

#include <gmock/gmock.h>

namespace corbot::soak {
namespace {

using cell::Activity;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr int kPieces = 4;
constexpr double kPiece_s = 10;

std::vector<cell::ActivityChange> made_record() {
  std::vector<cell::ActivityChange> changes;
  for (int i = 0; i <= kPieces; ++i) {
    const double at_s = 1000 + kPiece_s * i;
    const auto piece = static_cast<std::uint64_t>(i + 1);
    changes.push_back({at_s, "robot2", Activity::kLooking, piece, "store1"});
    changes.push_back({at_s + 1, "robot2", Activity::kMoving, piece, "store1"});
    changes.push_back({at_s + 7, "robot2", Activity::kMoving, piece, ""});
    changes.push_back({at_s + 7, "robot1", Activity::kMoving, piece + 1, "store1"});
    changes.push_back({at_s + 9, "robot1", Activity::kIdle, 0, ""});
  }
  return changes;
}

PlannedMotions made_motions() {
  PlannedMotions motions;
  for (int i = 0; i <= kPieces; ++i) {
    const double at_s = 1000 + kPiece_s * i;
    motions["robot2"].push_back({at_s + 2, 5.5});
    motions["robot2"].push_back({at_s + 8, 100});  // outside of the zone
    motions["robot1"].push_back({at_s + 5, 100});  // likewise
    motions["robot1"].push_back({at_s + 7.5, 1.5});
  }
  return motions;
}

TEST(CellPace, AddsWhatIsPlannedAndWhatIsCarriedOutInTheZone) {
  const Pace pace = pace_of(made_record(), made_motions());
  EXPECT_DOUBLE_EQ(pace.median_s, kPiece_s);
  EXPECT_DOUBLE_EQ(pace.seconds, kPieces * kPiece_s);
  EXPECT_DOUBLE_EQ(pace.carried_out_s, 9);
  EXPECT_DOUBLE_EQ(pace.planned_s, 8);
  EXPECT_NEAR(pace.zone_share, 45.0 / 49, 1e-9);
}

TEST(CellPace, OfOnePieceThereIsNone) {
  auto changes = made_record();
  changes.resize(8);
  EXPECT_EQ(pace_of(changes, made_motions()).seconds, 0);
  EXPECT_EQ(pace_of({}, {}).seconds, 0);
}

TEST(CellPace, EachMissedBoundIsNamed) {
  EXPECT_THAT(missed_bounds({100, 0.8, 1.15, 1, 1}), IsEmpty());
  EXPECT_THAT(missed_bounds({100, 0.8, 1.16, 1, 1.16}),
              AllOf(HasSubstr("more than 1.15 of"), HasSubstr("idle machine"), Not(HasSubstr("in use"))));
  EXPECT_THAT(missed_bounds({100, 0.79, 1.15, 1, 1}),
              AllOf(HasSubstr("in use less than 80 %"), Not(HasSubstr("median"))));
}

}  // namespace
}  // namespace corbot::soak
