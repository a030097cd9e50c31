// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/cell_status.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace corbot::test {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

Corbot::RobotWork work(const char* robot, Corbot::WorkState state, Corbot::PieceNumber piece,
                       const char* text) {
  Corbot::RobotWork made;
  made.robot = robot;
  made.state = state;
  made.piece = piece;
  made.step = Corbot::StepPlacing;
  made.since = 88;
  made.text = text;
  return made;
}

cli::CellView works() {
  cli::CellView view;
  view.name = "demo";
  view.last_places = {"pallet2"};
  view.state.mode = Corbot::CellRunning;
  view.state.placed = 5;
  view.state.robots.length(2);
  view.state.robots[0] = work("robot1", Corbot::WorkMoving, 7, "");
  view.state.robots[1] = work("robot2", Corbot::WorkWaiting, 0, "robot1 is in the zone of store1");
  view.places.length(2);
  for (CORBA::ULong i = 0; i < 2; ++i)
    view.places[i] = Corbot::PlaceInfo();  // the mapping initialises no number
  view.places[0].name = "pallet1";
  view.places[1].name = "store1";
  view.places[1].capacity = 4;
  view.places[1].pieces = 2;
  view.places[1].reserved = 1;
  view.places[1].shared = true;
  view.places[1].robot = "robot1";
  view.places[1].since = 97;
  view.now_s = 100;
  return view;
}

TEST(CellStatus, ShowsRobotsPlacesAndZones) {
  EXPECT_EQ(cli::status_text(works()),
            "demo works; 5 pieces on pallet2\n"
            "robot1       moves        12 s  piece 7 placing\n"
            "robot2       waits        12 s  robot1 is in the zone of store1\n"
            "pallet1      area\n"
            "store1       2 of 4 slots have a piece, 1 reserved; robot1 is in its zone, for 3 s\n"
            "no person is needed\n");
}

TEST(CellStatus, ShowsTheRobotsAlsoWithoutTheStore) {
  cli::CellView view = works();
  view.places.length(0);
  view.store_fault = "the store does not reply: the cause is in /d/store.log";
  EXPECT_THAT(
      cli::status_text(view),
      testing::AllOf(
          HasSubstr("robot1       moves"),
          EndsWith("a person is needed:\n  the store does not reply: the cause is in /d/store.log\n")));
}

TEST(CellStatus, AFullPlaceFromWhichNoRobotTakesNeedsAPerson) {
  cli::CellView view = works();
  view.places[1].pieces = 4;
  EXPECT_THAT(cli::status_text(view), EndsWith("no person is needed\n"));
  view.last_places = {"store1"};
  EXPECT_THAT(cli::status_text(view),
              EndsWith("a person is needed:\n  store1 is full: empty it, then use 'corbot cell exchange CELL "
                       "store1'\n"));
}

TEST(CellStatus, SaysWhatHoldsTheWork) {
  cli::CellView view = works();
  view.is_paused = true;
  EXPECT_THAT(cli::status_text(view), StartsWith("demo paused; 'corbot cell start' goes on;"));
  EXPECT_THAT(cli::status_text(view), HasSubstr("\nrobot1       paused             piece 7 placing\n"));
  EXPECT_THAT(cli::status_text(view), HasSubstr("\nrobot2       waits        12 s  robot1 is in"));
  view.state.mode = Corbot::CellStopped;
  EXPECT_THAT(cli::status_text(view), StartsWith("demo stopped; 'corbot cell start' begins or goes on;"));
}

TEST(CellStatus, SaysWhatAPersonIsToDo) {
  cli::CellView view = works();
  view.state.robots[0] = work("robot1", Corbot::WorkAttention, 7, "robot1 is in Error\x1b[2J");
  view.unclear.length(1);
  view.unclear[0].piece = 7;
  view.unclear[0].robot = "robot1";
  view.unclear[0].where.place = "store1";
  view.unclear[0].where.slot = 2;
  view.unclear[0].where.position = {0.24, 0.025, 0};
  view.unclear[0].note = "the gripper is open";
  const std::string text = cli::status_text(view);
  EXPECT_THAT(text, HasSubstr("robot1       attention    12 s  piece 7 placing\n"));
  EXPECT_THAT(text, HasSubstr("a person is needed:\n  robot1: robot1 is in Error"));
  EXPECT_THAT(
      text,
      EndsWith("piece 7 is unclear: robot1 left it at store1 slot 2, (0.240, 0.025) m (the gripper is open). "
               "Find it, then use 'corbot cell resolve CELL 7 PLACE SLOT', or '--gone' instead of PLACE\n"));
  EXPECT_EQ(text.find('\x1b'), std::string::npos) << "a robot's words drive no terminal";
}

}  // namespace
}  // namespace corbot::test
