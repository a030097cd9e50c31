// SPDX-License-Identifier: Apache-2.0
// Tests the recipe of a worker in a simulated world: motions, entries of the ledger, and rules of the work.
#include "cell/coordinator/worker.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "cell/coordinator/process_name.h"
#include "unit/cell_worker/fake_cell.h"

namespace corbot::test {
namespace {

using Eigen::Vector3d;
using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::ElementsAreArray;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr const char* kDownTooEarly = "the way down begins before its intent is in the ledger";

/// A faulty worker whose descent does not wait for the intent.
class HastyWorker : public cell::Worker {
 public:
  using Worker::Worker;

 protected:
  void await_intent(std::future<void>& /*intent*/) override {}
};

/// Runs a worker until it waits for a person, and returns its status then. With `on_person`, calls the
/// function for each such wait, and returns the status at the end of the work.
template <class WorkerType = cell::Worker>
Corbot::RobotWork run(const cell::CellConfig& config, FakeCell& world, const std::string& robot,
                      const std::function<void(cell::Worker&)>& on_person = {}) {
  std::optional<Corbot::RobotWork> last;
  cell::Worker* running = nullptr;
  const auto report = [&](const std::string& text) {
    world.report(text);
    const Corbot::RobotWork work = running->status();
    if (work.state != Corbot::WorkAttention && work.state != Corbot::WorkStopped) return;
    if (on_person) return on_person(*running);
    if (!last) last = work;
    world.stop_source.request_stop();
  };
  WorkerType worker(config, *config.robot(robot), {world, world, world}, "test", report,
                    world.stop_source.get_token(),
                    [&](const cell::ActivityChange& change) { world.activities.push_back(change); });
  running = &worker;
  worker.run();
  if (!last) last = worker.status();
  worker.finish();
  return *last;
}

class WorkerTest : public ::testing::TestWithParam<const char*> {
 protected:
  /// Adds a piece to robot1's area, or to a slot for robot2.
  void add_piece(FakeCell& world, int number) const {
    if (is_area()) {
      world.add_to_area(0.14 - 0.03 * number, 0.24);  // the last piece is the nearest
    } else {
      world.add_to_slot("store1", number);
    }
  }
  [[nodiscard]] bool is_area() const { return GetParam() == std::string("robot1"); }
  [[nodiscard]] std::string from() const { return is_area() ? "pallet1" : "store1"; }
  [[nodiscard]] std::string to() const { return is_area() ? "store1" : "pallet2"; }
  Corbot::RobotWork run_one(FakeCell& world) const { return run(config_, world, GetParam()); }
  /// Returns a world with two pieces and an interrupted call.
  [[nodiscard]] std::unique_ptr<FakeCell> made(Interruption interruption, Moment moment, int call) const {
    auto world = std::make_unique<FakeCell>(config_, GetParam());
    for (int i = 0; i < 2; ++i) add_piece(*world, i);
    world->last_placed = 2;
    world->interruption = interruption;
    world->moment = moment;
    world->interrupted_call = call;
    return world;
  }
  void expect_all_placed(FakeCell& world, const std::string& where) const {
    EXPECT_THAT(world.violations, IsEmpty()) << where;
    EXPECT_EQ(world.count(from()), 0U) << where;
    EXPECT_EQ(world.count(to()), 2U) << where;
    EXPECT_EQ(world.written[Corbot::StepPlaced], 2) << where;
    EXPECT_EQ(world.written[Corbot::StepUnclear], 0) << where;
  }

  void move_on_arcs() {
    for (cell::CellRobot& robot : config_.robots) robot.transit = "arc";
  }
  /// Kills the worker at each of its calls in turn.
  void expect_kills_lose_nothing() const;

  cell::CellConfig config_ = demo_cell();
};

INSTANTIATE_TEST_SUITE_P(Both, WorkerTest, ::testing::Values("robot1", "robot2"),
                         [](const auto& robot) { return std::string(robot.param); });

TEST_P(WorkerTest, OneTransferIsInTheOrderOfTheRecipe) {
  FakeCell world(config_, GetParam());
  add_piece(world, 0);
  run_one(world);
  std::vector<std::string> order{"acquire", "claim", "speed", "open", "move"};
  const auto add = [&](const std::vector<std::string>& more) {
    order.insert(order.end(), more.begin(), more.end());
  };
  if (is_area()) add({"look"});
  add({"reserve"});
  if (!is_area()) add({"enter store1"});
  add({"look", "move", "down", "delay", "close", "up", "move", "look", "held"});
  add({is_area() ? "enter store1" : "leave store1"});
  add({"look", "move", "down", "delay", "open", "up", "move", "look", "placed"});
  if (is_area()) add({"leave store1", "look"});
  add({"reserve", "release"});
  EXPECT_THAT(world.record, ElementsAreArray(order));
  EXPECT_THAT(world.violations, IsEmpty());
  EXPECT_EQ(world.count(to()), 1U);
}

TEST_P(WorkerTest, ArcsLeadBetweenWaitPoseAndAPlaceWithoutAZone) {
  move_on_arcs();
  FakeCell world(config_, GetParam());
  add_piece(world, 0);
  run_one(world);
  std::vector<std::string> order{"acquire", "claim", "speed", "open", "move"};
  const auto add = [&](const std::vector<std::string>& more) {
    order.insert(order.end(), more.begin(), more.end());
  };
  if (is_area()) {
    add({"look", "reserve", "look", "arc", "down", "delay", "close", "up", "arc", "look", "held"});
    add({"enter store1", "look", "move", "down", "delay", "open", "up", "move", "look", "placed"});
    add({"leave store1", "look"});
  } else {
    add({"reserve", "enter store1", "look", "move", "down", "delay", "close", "up", "move", "look", "held"});
    add({"leave store1", "look", "arc", "down", "delay", "open", "up", "arc", "look", "placed"});
  }
  add({"reserve", "release"});
  EXPECT_THAT(world.record, ElementsAreArray(order));
  EXPECT_THAT(world.violations, IsEmpty());
  EXPECT_EQ(world.count(to()), 1U);
}

TEST_P(WorkerTest, ARefusedArcIsReplacedByAFreeMotion) {
  move_on_arcs();
  const std::vector<std::function<void()>> refusals{
      [] { throw Corbot::Unreachable({}, "too far"); },
      [] { throw Corbot::LimitExceeded("speed", 0, 2, 0, 1); },
      [] { throw Corbot::BadParameter("MoveC", 0, "not implemented"); }};
  for (const auto& refuse : refusals) {
    FakeCell world(config_, GetParam());
    add_piece(world, 0);
    world.on_arc = refuse;
    run_one(world);
    EXPECT_THAT(world.violations, IsEmpty());
    EXPECT_EQ(world.count(to()), 1U);
    EXPECT_EQ(std::count(world.record.begin(), world.record.end(), "arc"), 2);
    EXPECT_EQ(world.count_reports("moves freely, since the arc was refused: on the arc to "), 2);
    EXPECT_EQ(world.count_reports("attention"), 0);
  }
}

TEST_P(WorkerTest, ManyPiecesArriveAndNoRuleIsBroken) {
  FakeCell world(config_, GetParam());
  for (int i = 0; i < 4; ++i) add_piece(world, i);
  world.last_placed = 4;
  run_one(world);
  EXPECT_THAT(world.violations, IsEmpty());
  EXPECT_EQ(world.count(from()), 0U);
  EXPECT_EQ(world.count(to()), 4U);
}

/// Returns a robot's activities in order: "look 1 store1", with the piece 1 and the zone store1.
std::vector<std::string> described(const std::vector<cell::ActivityChange>& changes) {
  constexpr const char* kNames[] = {"idle", "move", "zone?", "look", "piece?"};
  std::vector<std::string> texts;
  for (const cell::ActivityChange& change : changes)
    texts.push_back(fmt::format("{} {} {}", kNames[static_cast<std::size_t>(change.activity)], change.piece,
                                change.zone));
  return texts;
}

TEST_P(WorkerTest, EachActivityIsRecordedWithItsPieceAndZone) {
  FakeCell world(config_, GetParam());
  add_piece(world, 0);
  world.occupied = 1;
  run_one(world);
  const std::vector<std::string> area{
      "move 0 ",       "look 0 ",       "move 0 ",       "move 1 ",        "look 1 ",       "move 1 ",
      "look 1 ",       "move 1 ",       "zone? 1 ",      "zone? 1 store1", "move 1 store1", "look 1 store1",
      "move 1 store1", "look 1 store1", "move 1 store1", "move 0 store1",  "move 0 ",       "look 0 ",
      "move 0 ",       "piece? 0 ",     "idle 0 "};
  const std::vector<std::string> slots{
      "move 0 ",       "piece? 0 ",     "piece? 1 ",     "zone? 1 ",      "zone? 1 store1", "move 1 store1",
      "look 1 store1", "move 1 store1", "look 1 store1", "move 1 store1", "move 1 ",        "look 1 ",
      "move 1 ",       "look 1 ",       "move 1 ",       "move 0 ",       "piece? 0 ",      "idle 0 "};
  EXPECT_THAT(described(world.activities), ElementsAreArray(is_area() ? area : slots));
  for (std::size_t i = 1; i < world.activities.size(); ++i)
    EXPECT_GE(world.activities[i].time_s, world.activities[i - 1].time_s);
}

TEST_P(WorkerTest, TheWayDownWaitsForALateIntent) {
  FakeCell world(config_, GetParam());
  add_piece(world, 0);
  world.late_s = 2;
  run_one(world);
  EXPECT_THAT(world.violations, IsEmpty());
  EXPECT_EQ(world.count(to()), 1U);
}

TEST_P(WorkerTest, AWorkerThatDoesNotWaitIsFound) {
  FakeCell world(config_, GetParam());
  add_piece(world, 0);
  world.late_s = 2;  // ends with the way down
  run<HastyWorker>(config_, world, GetParam());
  EXPECT_THAT(world.violations, Contains(kDownTooEarly));
}

TEST_P(WorkerTest, AFailedGraspIsWithdrawnAndTriedAgain) {
  FakeCell world(config_, GetParam());
  add_piece(world, 0);
  world.failing_grasps = config_.timing.attempts - 1;
  run_one(world);
  EXPECT_THAT(world.violations, IsEmpty());
  EXPECT_EQ(world.written[Corbot::StepWithdrawn], config_.timing.attempts - 1);
  EXPECT_EQ(world.count(to()), 1U);
}

TEST_P(WorkerTest, TooManyFailedGraspsInARowNeedAPerson) {
  FakeCell world(config_, GetParam());
  add_piece(world, 0);
  world.failing_grasps = 100;
  const Corbot::RobotWork work = run_one(world);
  EXPECT_EQ(work.state, Corbot::WorkAttention);
  EXPECT_THAT(work.text.in(), AllOf(HasSubstr("pick: 3 failed picks in a row"), HasSubstr(from())));
  EXPECT_EQ(std::string(work.text.in()).find("use 'corbot cell exchange CELL store1'") == std::string::npos,
            is_area())
      << "the ledger keeps the piece in its slot";
  EXPECT_EQ(world.written[Corbot::StepWithdrawn], config_.timing.attempts);
  EXPECT_THAT(world.violations, IsEmpty());
}

TEST_P(WorkerTest, FailedGraspsCountAnewAfterAPersonsAnswer) {
  FakeCell world(config_, GetParam());
  add_piece(world, 0);
  world.failing_grasps = config_.timing.attempts + 1;
  int asked = 0;
  run(config_, world, GetParam(), [&](cell::Worker& worker) {
    ++asked;
    worker.go_on();
  });
  EXPECT_EQ(asked, 1);
  EXPECT_EQ(world.count(to()), 1U);
  EXPECT_THAT(world.violations, IsEmpty());
}

TEST_P(WorkerTest, AGripperIsNotOpenedOverAPieceThatIsNotInTheLedger) {
  FakeCell world(config_, GetParam());
  world.add_to_gripper();
  add_piece(world, 0);
  int asked = 0;
  run(config_, world, GetParam(), [&](cell::Worker& worker) {
    ++asked;
    EXPECT_THAT(worker.status().text.in(),
                HasSubstr("closed on a piece that is not in the ledger: hold the"));
    EXPECT_THAT(world.record, Not(Contains("move")));
    world.pieces[0] = {{9, 9, 9}};  // a person takes it out
    worker.go_on();
  });
  EXPECT_EQ(asked, 1);
  EXPECT_EQ(world.written[Corbot::StepPlaced], 1);
  EXPECT_THAT(world.violations, IsEmpty());
}

TEST_P(WorkerTest, NorOverAPieceThatItGrippedWhereTheLedgerIsLost) {
  FakeCell world(config_, GetParam());
  add_piece(world, 0);
  world.goes_on = true;
  world.command_stopped_by_other = 8;  // the last one of the pick
  std::vector<std::string> asked;
  run(config_, world, GetParam(), [&](cell::Worker& worker) {
    asked.emplace_back(worker.status().text.in());
    if (asked.size() == 1) {
      EXPECT_TRUE(world.pieces[0].is_held);
      world.end_transfer();
    } else {
      EXPECT_TRUE(world.pieces[0].is_held);
      world.pieces[0] = {{9, 9, 9}};  // a person takes it out
      world.open();
      world.on_reserve = [&](int) { world.stop_source.request_stop(); };
    }
    worker.go_on();
  });
  ASSERT_EQ(asked.size(), 2U);
  EXPECT_THAT(asked[1], HasSubstr("closed on a piece that is not in the ledger: hold the"));
  EXPECT_THAT(world.violations, IsEmpty());
}

TEST_P(WorkerTest, AGripperIsNotOpenedOverAPieceWhileAnotherStandsAtTheSource) {
  FakeCell world(config_, GetParam());
  add_piece(world, 0);
  world.measures_grip = true;
  world.on_close = [&, is_first = true]() mutable {
    if (std::exchange(is_first, false)) world.pieces.push_back({world.pieces[0].foot + Vector3d(0, 0.01, 0)});
  };
  int asked = 0;
  run(config_, world, GetParam(), [&](cell::Worker& worker) {
    ++asked;
    EXPECT_THAT(worker.status().text.in(), HasSubstr("and a piece stands at "));
    EXPECT_THAT(world.record, Not(Contains("withdrawn")));
    if (asked == 2) world.pieces.pop_back();  // the piece still stands there after the first Start
    worker.go_on();
  });
  EXPECT_EQ(asked, 2);
  EXPECT_EQ(world.written[Corbot::StepPlaced], 1);
  EXPECT_THAT(world.violations, IsEmpty());
}

TEST_P(WorkerTest, AStoreThatRefusesTheClaimOfAWaitingHolderEndsNoThread) {
  FakeCell world(config_, GetParam());
  add_piece(world, 0);
  world.command_stopped_by_other = 3;
  world.on_reserve = [&](int) { world.is_claimed = true; };
  world.on_claimed = [] { throw Corbot::BadParameter("robot", 6, "is no robot of cell 'other'"); };
  EXPECT_EQ(run_one(world).state, Corbot::WorkStopped);
  EXPECT_EQ(world.count_reports("control is kept"), 1);
}

TEST_P(WorkerTest, AStoreOfAnotherCellIsNamedAsTheCause) {
  FakeCell world(config_, GetParam());
  world.is_claimed = true;
  world.on_claimed = [&] {
    world.stop_source.request_stop();
    throw Corbot::BadParameter("robot", 6, "is no robot of cell 'other'");
  };
  run_one(world);
  EXPECT_EQ(world.count_reports("is no robot of cell 'other'"), 1);
}

TEST_P(WorkerTest, ARobotInErrorNeedsNoPersonAtOnce) {
  FakeCell world(config_, GetParam());
  world.is_in_error = true;
  std::jthread end([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    world.stop_source.request_stop();
  });
  run_one(world);
  EXPECT_EQ(world.count_reports(std::string(GetParam()) + " is in Error"), 1);
  EXPECT_EQ(world.count_reports("corbot clear"), 0) << "no person is asked yet";
}

TEST_P(WorkerTest, AnErrorOfARobotThatWaitsForAPieceIsReported) {
  FakeCell world(config_, GetParam());
  world.on_reserve = [&](int calls) { world.is_in_error = calls == 2; };  // as after a StopAndHold
  cell::Worker worker(
      config_, *config_.robot(GetParam()), {world, world, world}, "test",
      [&](const std::string& text) {
        world.report(text);
        if (text.find(" is in Error") == std::string::npos) return;
        world.is_in_error = false;
        add_piece(world, 0);
      },
      world.stop_source.get_token());
  worker.run();
  EXPECT_EQ(world.count_reports(std::string(GetParam()) + " is in Error"), 1);
  EXPECT_EQ(world.written[Corbot::StepPlaced], 1) << "it goes on without a Start";
}

TEST_P(WorkerTest, APieceThatIsLostOnTheWayIsUnclear) {
  FakeCell world(config_, GetParam());
  add_piece(world, 0);
  world.loses_pieces = true;
  const Corbot::RobotWork work = run_one(world);
  EXPECT_EQ(work.state, Corbot::WorkAttention);
  EXPECT_THAT(work.text.in(), HasSubstr("find the piece"));
  EXPECT_EQ(world.written[Corbot::StepUnclear], 1);
  EXPECT_THAT(world.violations, IsEmpty());
}

TEST_P(WorkerTest, TheNoteOfAnUnclearPieceSaysThatNoneIsSeen) {
  FakeCell world(config_, GetParam());
  add_piece(world, 0);
  world.loses_pieces = true;
  world.goes_on = true;
  world.command_stopped_by_other = 13;  // the gripper has opened over the target
  run(config_, world, GetParam(), [&](cell::Worker& worker) {
    if (worker.status().state != Corbot::WorkStopped) return (void)world.stop_source.request_stop();
    world.pieces[0].foot = {0.085, 0.239, 0};  // on pallet1
    worker.go_on();
  });
  EXPECT_EQ(world.last_note, "the gripper is open; no piece is seen outside of places");
}

TEST_P(WorkerTest, APointThatTheRobotRefusesNamesStepFramesAndKey) {
  struct Case {
    std::string place;
    std::string step;
    std::string key;
  };
  const std::string robot = is_area() ? "0" : "1";
  std::vector<Case> cases{{to(), "place", is_area() ? "place[1].position_m" : "place[2].position_m"},
                          {"", "begin", "robot[" + robot + "].wait_m"}};
  if (!is_area()) cases.push_back({"store1", "pick", "place[1].position_m"});
  for (const Case& c : cases) {
    FakeCell world(config_, GetParam());
    add_piece(world, 0);
    const Vector3d wait = config_.robot(GetParam())->wait_m;
    world.is_unreachable = [&](const Vector3d& tool) {
      return c.place.empty() ? (tool - wait).norm() < 0.001 : config_.place(c.place)->covers(tool);
    };
    const Corbot::RobotWork work = run_one(world);
    EXPECT_EQ(work.state, Corbot::WorkAttention);
    EXPECT_EQ(work.piece, c.step == "place" ? 1U : 0U);
    EXPECT_THAT(
        work.text.in(),
        AllOf(HasSubstr(c.step + ": on the way to " + c.key.substr(0, c.key.find(".position_m")) + ", ("),
              HasSubstr("; check " + c.key + " in cell.toml"), HasSubstr("in the frame of robot")));
    EXPECT_THAT(world.violations, IsEmpty());
  }
}

TEST_P(WorkerTest, WaitsAreReportedOnceAndEnd) {
  FakeCell world(config_, GetParam());
  for (int i = 0; i < 4; ++i) world.add_to_slot("store1", i);
  for (int i = 0; i < 12 && !is_area(); ++i) world.add_to_slot("pallet2", i);
  if (is_area()) add_piece(world, 0);
  world.occupied = 2;
  world.on_reserve = [&](int number) {
    const auto take_away = [&](const std::string& place) {
      for (FakeCell::Piece& piece : world.pieces) {
        if (config_.place(place)->covers(piece.foot)) return void(piece.foot = {8, 8, 8});
      }
    };
    if (number == 3) take_away(to());
  };
  run_one(world);
  EXPECT_EQ(world.count_reports("waits: " + to() + " is full"), 1);
  EXPECT_EQ(world.count_reports("waits: another is in the zone of store1"), 1);
  EXPECT_EQ(world.written[Corbot::StepPlaced], 1);
  EXPECT_THAT(world.violations, IsEmpty());
}

TEST_P(WorkerTest, AWaitForARowSaysThatThePlaceIsFullForTheseKinds) {
  cell::CellConfig config = config_;
  for (cell::Place& place : config.places)
    if (place.slots) place.row_kinds.assign(static_cast<std::size_t>(place.slots->rows), "red");
  FakeCell world(config, GetParam());
  add_piece(world, 0);
  for (int i = 0; i < config.place(to())->slots->count(); ++i) world.add_to_slot(to(), i);
  world.on_reserve = [&](int number) {
    if (number == 2) world.pieces[1].foot = {8, 8, 8};
  };
  run(config, world, GetParam());
  EXPECT_EQ(world.count_reports("waits: " + to() + " is full for the kinds of the pieces at " + from()), 1);
  EXPECT_EQ(world.written[Corbot::StepPlaced], 1);
  EXPECT_THAT(world.violations, IsEmpty());
}

TEST_P(WorkerTest, NothingMovesAfterAStopAtAnyCommand) {
  for (const bool is_arm : {true, false}) {
    int commands = 0;
    for (bool is_stopped = true; is_stopped; ++commands) {
      FakeCell world(config_, GetParam());
      add_piece(world, 0);
      world.is_exclusive = is_arm;
      world.stopped_command = commands;
      const Corbot::RobotWork work = run_one(world);
      is_stopped = world.written[Corbot::StepPlaced] == 0;
      EXPECT_EQ(work.state, Corbot::WorkIdle) << commands;
      EXPECT_THAT(world.violations, IsEmpty()) << commands;
      EXPECT_THAT(world.record, Contains("release")) << commands;
      EXPECT_EQ(world.count_reports("attention"), 0) << commands;
      ASSERT_LT(commands, 100);
    }
    EXPECT_EQ(commands, 16);  // three to begin, twelve for one transfer, and one that never comes
  }
}

TEST_P(WorkerTest, AStopOfAnotherClientEndsTheWorkAndSaysWhere) {
  int command = 0;
  for (bool is_stopped = true; is_stopped; ++command) {
    FakeCell world(config_, GetParam());
    add_piece(world, 0);
    world.command_stopped_by_other = command;
    const Corbot::RobotWork work = run_one(world);
    is_stopped = work.state == Corbot::WorkStopped;
    if (is_stopped) {
      EXPECT_THAT(work.text.in(), AllOf(HasSubstr("in the frame of robot"), Not(HasSubstr("cell.toml"))));
      EXPECT_THAT(work.text.in(), AnyOf(HasSubstr(": on the way to "), HasSubstr(": at ")));
      EXPECT_THAT(work.text.in(), EndsWith("; 'corbot cell start CELL' goes on"));
    }
    EXPECT_THAT(world.violations, IsEmpty());
  }
  EXPECT_EQ(command, 16);
}

TEST_P(WorkerTest, ARobotThatIsHeldNeedsClearAndStart) {
  FakeCell world(config_, GetParam());
  add_piece(world, 0);
  world.command_stopped_by_other = 3;
  world.is_held_by_other = true;
  EXPECT_THAT(run_one(world).text.in(),
              EndsWith(std::string("; ") + GetParam() +
                       " is in Error: look at 'corbot status', put the cause right, then use 'corbot clear'"
                       "; 'corbot cell start CELL' goes on"));
}

TEST_P(WorkerTest, APieceThatTheLedgerDoesNotKnowIsTakenAwayBeforeStart) {
  FakeCell world(config_, GetParam());
  add_piece(world, 0);
  const cell::Place& target = *config_.place(to());
  for (int slot = 0; slot < target.slots->count(); ++slot)  // beside the spot, which is free for the ledger
    world.pieces.push_back({target.slot_position(slot) + Vector3d(0.012, 0, 0)});
  EXPECT_THAT(run_one(world).text.in(),
              AllOf(HasSubstr("and a piece that is not in the ledger stands at " + to()),
                    EndsWith(": take that away; 'corbot cell start CELL' goes on")));
}

TEST_P(WorkerTest, AReservationThatNothingTouchedIsTakenBackAtTheEnd) {
  FakeCell world(config_, GetParam());
  add_piece(world, 0);
  world.on_reserve = [&](int) { world.stop_source.request_stop(); };
  run_one(world);
  EXPECT_EQ(world.written[Corbot::StepWithdrawn], 1);
  EXPECT_THAT(world.violations, IsEmpty());
}

TEST_P(WorkerTest, ALostClaimEndsAllAtAnyCallOfTheStore) {
  int calls = 0;
  for (bool is_lost = true; is_lost; ++calls) {
    FakeCell world(config_, GetParam());
    add_piece(world, 0);
    world.superseded_call = calls;
    const Corbot::RobotWork work = run_one(world);
    is_lost = world.count_reports("superseded: claim 8") == 1;
    EXPECT_EQ(work.state, Corbot::WorkIdle) << calls;
    EXPECT_THAT(world.violations, IsEmpty()) << calls;
    ASSERT_LT(calls, 100);
  }
  EXPECT_GT(calls, 8);
}

constexpr const char* kMoments[] = {"before", "in the middle of", "after"};

void WorkerTest::expect_kills_lose_nothing() const {
  for (const Moment moment : {Moment::kBefore, Moment::kMiddle, Moment::kAfter}) {
    for (int call = 0;; ++call) {
      ASSERT_LT(call, 200);
      const auto world = made(Interruption::kKill, moment, call);
      EXPECT_NO_THROW(try { run_one(*world); } catch (const Killed&){});
      if (!world->was_interrupted) break;
      world->revive();
      run_one(*world);
      const std::string where = fmt::format("{} call {}", kMoments[static_cast<int>(moment)], call);
      expect_all_placed(*world, where);
      EXPECT_EQ(world->count_reports("attention"), 0) << where << world->reports.back();
    }
  }
}

TEST_P(WorkerTest, AKillAtAnyCallLosesAndDoublesNothing) { expect_kills_lose_nothing(); }

TEST_P(WorkerTest, AKillAtAnyCallOnArcsLosesAndDoublesNothing) {
  move_on_arcs();
  expect_kills_lose_nothing();
}

TEST_P(WorkerTest, AFaultAtAnyCallIsOvercomeByTheWorkerItself) {
  for (const Moment moment : {Moment::kBefore, Moment::kMiddle, Moment::kAfter}) {
    for (int call = static_cast<int>(moment);; call += 3) {  // a pause follows each call
      ASSERT_LT(call, 200);
      const auto world = made(Interruption::kFault, moment, call);
      run(config_, *world, GetParam(), [](cell::Worker&) {});
      if (!world->was_interrupted) break;
      const std::string where = fmt::format("{} call {}", kMoments[static_cast<int>(moment)], call);
      if (world->stop_source.stop_requested() && world->written[Corbot::StepPlaced] == 2)
        expect_all_placed(*world, where);
      else
        ADD_FAILURE() << "the work ended early: " << where;
    }
  }
}

TEST_P(WorkerTest, AMotionThatFailsAgainAndAgainNeedsAPerson) {
  FakeCell world(config_, GetParam());
  add_piece(world, 0);
  world.fails_over = to();
  const Corbot::RobotWork work = run_one(world);
  EXPECT_EQ(work.state, Corbot::WorkAttention);
  EXPECT_THAT(work.text.in(), AllOf(HasSubstr("place: 3 times in a row: on the way to place["),
                                    EndsWith("; 'corbot cell start CELL' goes on")));
  EXPECT_THAT(world.violations, IsEmpty());
}

TEST_P(WorkerTest, EqualFaultsCountAnewAfterAPersonsAnswer) {
  for (const int command : {10, 13}) {  // after the first fault, and after the second
    FakeCell world(config_, GetParam());
    add_piece(world, 0);
    world.fails_over = to();
    world.goes_on = true;
    world.command_stopped_by_other = command;
    std::optional<int> before;
    run(config_, world, GetParam(), [&](cell::Worker& worker) {
      if (worker.status().state == Corbot::WorkAttention) return world.stop_source.request_stop(), void();
      if (before) return;
      before = world.failures;
      worker.go_on();
    });
    ASSERT_TRUE(before);
    EXPECT_EQ(world.failures - *before, config_.timing.attempts) << "command " << command;
  }
}

TEST_P(WorkerTest, AStoppedRobotGoesOnWhenAPersonSaysSo) {
  for (int command = 0; command < 15; ++command) {
    const auto world = made(Interruption::kFault, Moment::kBefore, -1);
    world->goes_on = true;
    world->command_stopped_by_other = command;
    run(config_, *world, GetParam(), [](cell::Worker& worker) { worker.go_on(); });
    expect_all_placed(*world, fmt::format("command {}", command));
  }
}

TEST_P(WorkerTest, AnUnclearPieceKeepsTheRobotFromWorkUntilItIsResolved) {
  const auto world = made(Interruption::kFault, Moment::kBefore, -1);
  world->loses_pieces = true;
  world->last_placed = 1;
  std::size_t commands = 0;
  run(config_, *world, GetParam(), [&](cell::Worker& worker) {
    commands = world->record.size();
    worker.go_on();  // no effect: the piece is still unclear
    if (world->count_reports("attention: begin: piece") == 0) return;
    EXPECT_EQ(std::count(world->record.begin() + static_cast<std::ptrdiff_t>(commands), world->record.end(),
                         "reserve"),
              0);
    world->loses_pieces = false;
    world->resolve();
  });
  EXPECT_EQ(world->written[Corbot::StepUnclear], 1);
  EXPECT_EQ(world->written[Corbot::StepPlaced], 1);
  EXPECT_EQ(world->count_reports("corbot cell resolve"), 2);
  EXPECT_THAT(world->violations, IsEmpty());
}

TEST_P(WorkerTest, OnlyControlOfTheArmReplacesAClaim) {
  for (const bool is_exclusive : {true, false}) {
    FakeCell world(config_, GetParam());
    add_piece(world, 0);
    world.is_claimed = true;
    world.is_exclusive = is_exclusive;
    const Corbot::RobotWork work = run_one(world);
    EXPECT_EQ(world.written[Corbot::StepPlaced], is_exclusive ? 1 : 0);
    EXPECT_EQ(world.count_reports("stand-by: 'another' works with "), is_exclusive ? 0 : 1);
    EXPECT_EQ(work.state, Corbot::WorkIdle);
  }
}

TEST_P(WorkerTest, AStandByTakesNoRobotWhoseHolderWaitsForAPerson) {
  FakeCell world(config_, GetParam());
  add_piece(world, 0);
  world.is_claimed = true;
  world.holder = cell::waiting_name("another");
  const Corbot::RobotWork work = run_one(world);
  EXPECT_EQ(work.state, Corbot::WorkAttention) << "whose stand-by calls for the person, too";
  EXPECT_EQ(world.written[Corbot::StepPlaced], 0);
  EXPECT_EQ(world.count_reports("stand-by: 'another/waits' waits for a person, with "), 1);
  EXPECT_THAT(world.holders_at_release, Contains("another/waits")) << "the person may need control";
}

TEST_P(WorkerTest, AClaimWhoseHolderEndedWhileItWaitedPassesOnByAStartSinceThen) {
  FakeCell world(config_, GetParam());
  add_piece(world, 0);
  cell::Worker worker(
      config_, *config_.robot(GetParam()), {world, world, world}, "test",
      [&](const std::string& text) {
        world.report(text);
        if (text.find("' has ended while ") != std::string::npos) worker.go_on();
      },
      world.stop_source.get_token());
  world.is_claimed = true;
  world.holder = cell::waiting_name("another");
  int attempts = 0;
  world.on_claimed = [&] {
    ++attempts;
    if (attempts == 2) world.holder = cell::waiting_name(cell::process_name() + "1");  // it has ended
    if (attempts == 4) world.stop_source.request_stop();
  };
  // After the Start, a second stand-by asks for control just before this one.
  world.on_acquire = [&, is_refused = false]() mutable {
    if (attempts == 2 && !std::exchange(is_refused, true)) throw Corbot::NotReady("'other' has control");
  };
  worker.go_on();  // before the holder has ended
  worker.run();
  EXPECT_EQ(attempts, 3);
  EXPECT_EQ(world.written[Corbot::StepPlaced], 1);
  EXPECT_EQ(world.count_reports("1/waits' has ended while " + std::string(GetParam()) +
                                " waited for a person: look at " + GetParam() +
                                ", then use 'corbot cell start CELL'"),
            1);
  EXPECT_THAT(world.violations, IsEmpty());
}

// A stand-by has control for an instant each second, to look. A coordinator that works has control for long.
TEST_P(WorkerTest, AStartCountsThoughAStandByHasControlAtThatInstantButNotWhileARobotWorks) {
  for (const int refusals : {1, 4}) {
    SCOPED_TRACE(refusals);
    FakeCell world(config_, GetParam());
    add_piece(world, 0);
    world.is_claimed = true;
    world.holder = cell::waiting_name(cell::process_name() + "1");  // it has ended
    world.on_acquire = [&, count = 0]() mutable {
      if (count++ < refusals) throw Corbot::NotReady("'other' has control");
    };
    world.on_claimed = [&, looks = 0]() mutable {
      if (++looks == 3) world.stop_source.request_stop();
    };
    cell::Worker worker(
        config_, *config_.robot(GetParam()), {world, world, world}, "test",
        [&](const std::string& text) {
          world.report(text);
          if (text.find("has ended while") != std::string::npos) world.stop_source.request_stop();
        },
        world.stop_source.get_token());
    worker.go_on();
    worker.run();
    EXPECT_EQ(world.written[Corbot::StepPlaced], refusals == 1 ? 1 : 0);
    EXPECT_EQ(world.count_reports("has ended while"), refusals == 1 ? 0 : 1);
    EXPECT_THAT(world.violations, IsEmpty());
  }
}

TEST_P(WorkerTest, AStopOfTheCellReachesARobotThatWaitsForAPiece) {
  FakeCell world(config_, GetParam());
  world.on_reserve = [&](int number) { world.is_cell_stopped = number == 2; };
  run(config_, world, GetParam(), [&](cell::Worker& worker) {
    EXPECT_EQ(worker.status().state, Corbot::WorkStopped);
    EXPECT_THAT(worker.status().text.in(),
                HasSubstr("the cell was stopped; 'corbot cell start CELL' goes on"));
    world.is_cell_stopped = false;
    add_piece(world, 0);
    worker.go_on();
  });
  EXPECT_THAT(world.holders_at_release, Contains("test/waits"));
  EXPECT_EQ(world.written[Corbot::StepPlaced], 1);
  EXPECT_THAT(world.violations, IsEmpty());
}

TEST_P(WorkerTest, TheClaimOfAStoppedRobotIsNotGivenBackAtTheEnd) {
  FakeCell world(config_, GetParam());
  world.on_reserve = [&](int) { world.is_cell_stopped = true; };
  EXPECT_EQ(run_one(world).state, Corbot::WorkStopped);
  EXPECT_THAT(world.record, Not(Contains("release")));
  EXPECT_EQ(world.holder, "test/waits");
}

TEST_P(WorkerTest, TheClaimSaysThatAPersonIsNeededBeforeControlIsGivenBack) {
  const auto world = made(Interruption::kFault, Moment::kBefore, -1);
  world->goes_on = true;
  world->command_stopped_by_other = 5;
  run(config_, *world, GetParam(), [](cell::Worker& worker) { worker.go_on(); });
  expect_all_placed(*world, "after go_on");
  ASSERT_EQ(world->holders_at_release.size(), 2U);
  EXPECT_EQ(world->holders_at_release[0], "test/waits");
  EXPECT_EQ(world->holders_at_release[1], "test") << "the work goes on: a stand-by may take over";
}

TEST_P(WorkerTest, AClaimThatAPersonReleasedIsToldAsSuch) {
  FakeCell world(config_, GetParam());
  add_piece(world, 0);
  world.superseded_call = 2;
  world.superseded_by = 0;
  run_one(world);
  EXPECT_EQ(world.count_reports("superseded: the claim was released"), 1);
}

TEST_P(WorkerTest, APieceWhoseTransferEndedElsewhereIsNoLongerShown) {
  const auto world = made(Interruption::kFault, Moment::kBefore, -1);
  world->goes_on = true;
  world->command_stopped_by_other = 4;
  Corbot::PieceNumber before = 0;
  Corbot::PieceNumber after = 0;
  run(config_, *world, GetParam(), [&](cell::Worker& worker) {
    before = worker.status().piece;
    world->end_transfer();
    world->on_reserve = [&](int) {
      after = worker.status().piece;
      world->stop_source.request_stop();
    };
    worker.go_on();
  });
  EXPECT_NE(before, 0U);
  EXPECT_EQ(after, 0U);
}

TEST(Worker, PiecesThatItCannotReachAreLeftOut) {
  const cell::CellConfig config = demo_cell();
  FakeCell world(config, "robot1");
  for (const double x : {0.05, 0.09, 0.13}) world.add_to_area(x, 0.24);
  world.is_unreachable = [](const Vector3d& tool) { return tool.y() > 0.2 && tool.x() < 0.07; };
  world.last_placed = 3;
  world.on_reserve = [&](int number) {
    if (number == 5) world.stop_source.request_stop();
  };
  run(config, world, "robot1");
  EXPECT_EQ(world.count("store1"), 2U);
  EXPECT_EQ(world.count_reports("leaves out"), 1);
  EXPECT_EQ(world.count_reports("pallet1 has no piece within reach"), 1);
  EXPECT_EQ(world.count_reports("attention"), 0);
  EXPECT_THAT(world.violations, IsEmpty());
}

TEST(Worker, PiecesThatWereLeftOutAreTriedAgainAfterAPersonsAnswer) {
  const cell::CellConfig config = demo_cell();
  FakeCell world(config, "robot1");
  for (const double x : {0.05, 0.09}) world.add_to_area(x, 0.24);
  world.is_unreachable = [](const Vector3d& tool) { return tool.y() > 0.2 && tool.x() < 0.07; };
  world.failing_grasps = config.timing.attempts;
  world.last_placed = 2;
  world.on_reserve = [&](int number) {
    if (number == 10) world.stop_source.request_stop();
  };
  run(config, world, "robot1", [&](cell::Worker& worker) {
    world.is_unreachable = {};
    worker.go_on();
  });
  EXPECT_EQ(world.count_reports("leaves out"), 1);
  EXPECT_EQ(world.count("store1"), 2U);
  EXPECT_THAT(world.violations, IsEmpty());
}

}  // namespace
}  // namespace corbot::test
