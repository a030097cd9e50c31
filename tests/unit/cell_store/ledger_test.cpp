// SPDX-License-Identifier: Apache-2.0
// The rules of the ledger: steps, claims, zones, what is reserved, and calls that wait.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <future>
#include <limits>
#include <set>
#include <thread>

#include "ledger_fixture.h"
#include "support/process.h"

namespace corbot::cell {
namespace {

using namespace Corbot;
using test::wait_until;
using test::within;

constexpr Step kSteps[] = {StepReserved, StepPicking,   StepHeld,    StepPlacing,
                           StepPlaced,   StepWithdrawn, StepUnclear, StepGone};

struct StepRow {
  std::vector<Step> path;  ///< how a transfer gets to the present step, from reserved on
  std::vector<Step> allowed;
};

/// As idl/cell.idl has it; the step that is there already is allowed too.
const StepRow kTable[] = {
    {{}, {StepReserved, StepPicking, StepWithdrawn}},
    {{StepPicking}, {StepPicking, StepHeld, StepWithdrawn, StepUnclear}},
    {{StepPicking, StepHeld}, {StepHeld, StepPlacing, StepUnclear}},
    {{StepPicking, StepHeld, StepPlacing}, {StepPlacing, StepPlaced, StepHeld, StepUnclear}},
    {{StepPicking, StepHeld, StepPlacing, StepPlaced}, {StepPlaced}},
    {{StepPicking, StepWithdrawn}, {StepWithdrawn}},
    {{StepPicking, StepHeld, StepUnclear}, {StepUnclear}},
};

using LedgerSteps = LedgerFixture;

TEST_F(LedgerSteps, OnlyTheAllowedOnesAreWritten) {
  int tried = 0;
  for (const StepRow& row : kTable) {
    for (const Step wanted : kSteps) {
      CellConfig cell = cell_;
      cell.ledger = directory_ / fmt::format("{}.db", tried++);
      Ledger ledger(cell, ZoneCheck::kOff);
      const ClaimToken token = ledger.claim("robot1", "test", 0);
      const PieceNumber piece = ledger.reserve(token, "pallet1", "store1", seen_, 0).piece;
      for (const Step step : row.path) ledger.advance(token, piece, step, "");
      const Step present = row.path.empty() ? StepReserved : row.path.back();
      const auto events = ledger.history(0, 0).length();
      SCOPED_TRACE(fmt::format("{} > {}", int{present}, int{wanted}));
      const bool is_allowed = std::count(row.allowed.begin(), row.allowed.end(), wanted) > 0;
      try {
        ledger.advance(token, piece, wanted, "");
        EXPECT_TRUE(is_allowed);
        EXPECT_EQ(ledger.history(0, 0).length(), events + (wanted == present ? 0 : 1));
      } catch (const WrongStep& wrong) {
        EXPECT_FALSE(is_allowed);
        EXPECT_EQ(wrong.present, present >= StepPlaced ? StepPlaced : present);
        EXPECT_EQ(wrong.wanted, wanted);
        EXPECT_EQ(ledger.history(0, 0).length(), events);
      }
    }
  }
  EXPECT_EQ(tried, 56);
}

TEST_F(LedgerSteps, LeaveThePieceWhereItIs) {
  carry("robot1", "pallet1", "store1", kToPlaced);
  EXPECT_EQ(place(1).pieces, 1U);
  const auto moved = ledger_.reserve(tokens_["robot2"], "store1", "pallet2", {}, 0);
  EXPECT_EQ(moved.source.slot, 0) << "robot1 puts the first one into the farthest slot, of two the lower";
  EXPECT_EQ(place(2).reserved, 1U);
  EXPECT_EQ(place(1).pieces, 1U) << "it stands until it is held";
  const auto taken = carry("robot1", "pallet1", "store1", {StepPicking, StepUnclear});
  EXPECT_THROW((void)ledger_.advance(tokens_["robot1"], taken, StepHeld, ""), WrongStep);
  EXPECT_EQ(place(0).pieces, 0U) << "an unclear piece stands nowhere";
  EXPECT_EQ(ledger_.reserve(tokens_["robot1"], "pallet1", "store1", seen_, 0).source.position.x, 0.10)
      << "and its spot is not given";
}

TEST_F(LedgerSteps, APieceWithdrawnFromAnAreaIsSeenAgainWithANewNumber) {
  const auto first = carry("robot1", "pallet1", "store1", {StepPicking, StepWithdrawn});
  EXPECT_EQ(place(0).pieces, 0U);
  const auto again = ledger_.reserve(tokens_["robot1"], "pallet1", "store1", seen_, 0);
  EXPECT_EQ(again.source.position.x, 0.05);
  EXPECT_GT(again.piece, first);
}

TEST_F(LedgerSteps, PickAndPlaceNeedTheZone) {
  const auto piece = carry("robot1", "pallet1", "store1", {StepPicking, StepHeld});
  const auto place_it = [&] { ledger_.advance(tokens_["robot1"], piece, StepPlacing, ""); };
  const auto occupied_by = [&]() -> std::string {
    try {
      place_it();
    } catch (const Occupied& occupied) {
      return std::string("by ") + occupied.robot.in();
    }
    return "placing";
  };
  EXPECT_EQ(occupied_by(), "by ");
  ledger_.enter(tokens_["robot2"], "store1", 0);
  EXPECT_EQ(occupied_by(), "by robot2");
  ledger_.leave(tokens_["robot2"], "store1");
  ledger_.enter(tokens_["robot1"], "store1", 0);
  EXPECT_EQ(occupied_by(), "placing");
}

using LedgerClaims = LedgerFixture;

TEST_F(LedgerClaims, AreReplacedByTheirTokenAlone) {
  const ClaimToken old = tokens_["robot1"];
  try {
    ledger_.claim("robot1", "other", old + 100);
    FAIL();
  } catch (const Claimed& claimed) {
    EXPECT_STREQ(claimed.robot.in(), "robot1");
    EXPECT_STREQ(claimed.who.in(), "test");
    EXPECT_EQ(claimed.token, old);
    EXPECT_GT(claimed.since, 1e9);
  }
  const ClaimToken fresh = ledger_.claim("robot1", "other", old);
  EXPECT_GT(fresh, tokens_["robot3"]);
  EXPECT_THROW(ledger_.claim("robot1", "other", old), Claimed) << "repeated";
  for (const auto& call : std::initializer_list<std::function<void()>>{
           [&] { (void)ledger_.reserve(old, "pallet1", "store1", seen_, 0); },
           [&] { ledger_.advance(old, 1, StepPicking, ""); }, [&] { ledger_.enter(old, "store1", 0); },
           [&] { ledger_.leave(old, "store1"); }, [&] { ledger_.release(old); }}) {
    try {
      call();
      ADD_FAILURE() << "a claim that has ended is no right";
    } catch (const Superseded& superseded) {
      EXPECT_EQ(superseded.token, old);
      EXPECT_EQ(superseded.present, fresh);
    }
  }
  ledger_.release(fresh);
  ledger_.release(fresh);  // repeated
  EXPECT_THROW(ledger_.enter(fresh, "store1", 0), Superseded);
  EXPECT_THROW(ledger_.release(12345), Superseded);
  EXPECT_THROW(ledger_.release(std::numeric_limits<ClaimToken>::max()), Superseded);
  EXPECT_GT(ledger_.claim("robot1", "third", 0), fresh);
}

using LedgerReserve = LedgerFixture;

TEST_F(LedgerReserve, TakesWhatIsSeenKnownAndFree) {
  Sightings seen =
      sightings({{0.3, 0.3, 0}, {0.05, 0.22, 0}, {0.05, 0.22, 0}, {0.055, 0.222, 0}, {0.1, 0.22, 0}});
  seen[1].kind = "green";
  const auto first = ledger_.reserve(tokens_["robot1"], "pallet1", "store1", seen, 0);
  EXPECT_EQ(first.source.position.y, 0.22);
  EXPECT_EQ(first.source.slot, -1);
  EXPECT_STREQ(first.kind.in(), "red");
  const auto repeated = ledger_.reserve(tokens_["robot1"], "pallet1", "store1", seen, 0);
  EXPECT_EQ(repeated.piece, first.piece);
  EXPECT_THROW((void)ledger_.reserve(tokens_["robot1"], "pallet1", "pallet2", seen, 0), WrongStep);
  const auto other = ledger_.reserve(tokens_["robot3"], "pallet1", "store1", seen, 0);
  EXPECT_EQ(other.source.position.x, 0.1) << "5 mm beside a reserved piece is that piece";
  EXPECT_NE(other.target.slot, first.target.slot);
}

TEST_F(LedgerReserve, TheSourceHasTheYawThatWasSeen) {
  Sightings seen = sightings({{0.05, 0.22, 0}});
  seen[0].yaw = -31.5;
  const auto first = ledger_.reserve(tokens_["robot1"], "pallet1", "store1", seen, 0);
  EXPECT_EQ(first.source.yaw, -31.5);
  EXPECT_EQ(first.target.yaw, 0) << "no picture has shown the piece there";
  EXPECT_EQ(ledger_.transfers()[0].source.yaw, -31.5);
}

TEST_F(LedgerReserve, TheNearestPieceGoesToTheFarthestSlotAndEmptyComesBeforeFull) {
  const auto none = [&](const std::string& robot, const std::string& from, const Sightings& seen) {
    return [=, this] { (void)ledger_.reserve(tokens_[robot], from, "store1", seen, 0); };
  };
  std::vector<int> slots;
  for (int i = 0; i < 4; ++i) {
    const auto moved = ledger_.reserve(tokens_["robot1"], "pallet1", "store1", seen_, 0);
    slots.push_back(moved.target.slot);
    ledger_.enter(tokens_["robot1"], "store1", 0);
    for (const Step step : kToPlaced) ledger_.advance(tokens_["robot1"], moved.piece, step, "");
  }
  EXPECT_THAT(slots, ::testing::ElementsAre(0, 1, 2, 3)) << "251 and 241 mm are as far within 20 mm";
  EXPECT_THROW(none("robot1", "pallet1", {})(), Empty);
  try {
    none("robot1", "pallet1", seen_)();
    ADD_FAILURE();
  } catch (const Full& full) {
    EXPECT_EQ(full.capacity, 4U);
  }
  EXPECT_EQ(ledger_.reserve(tokens_["robot2"], "store1", "pallet2", {}, 0).source.slot, 0) << "the oldest";
}

TEST_F(LedgerReserve, EachKindGoesToItsRowAndAFullRowHoldsUpNoOtherKind) {
  CellConfig cell = cell_;
  cell.ledger = directory_ / "kinds.db";
  cell.kinds.push_back(cell.kinds[0]);
  cell.kinds[1].name = "blue";
  cell.places[2].slots = SlotGrid{1, 2, {0.045, 0.042}};
  cell.places[2].row_kinds = {"blue", "red"};
  Ledger ledger(cell, ZoneCheck::kOff);
  for (const char* robot : {"robot1", "robot2"}) tokens_[robot] = ledger.claim(robot, "test", 0);
  const auto bring = [&](const std::string& robot, const char* to, const Sightings& seen) {
    const auto moved = ledger.reserve(tokens_[robot], robot == "robot1" ? "pallet1" : "store1", to, seen, 0);
    for (const Step step : kToPlaced) ledger.advance(tokens_[robot], moved.piece, step, "");
    return fmt::format("{} {}", moved.kind.in(), moved.target.slot);
  };
  const auto kinds_of = [&](PieceNumber piece) {
    std::set<std::string> kinds;
    const PieceEvents events = ledger.history(piece, 0);
    for (CORBA::ULong i = 0; i < events.length(); ++i) kinds.insert(events[i].kind.in());
    return kinds;
  };
  for (const char* kind : {"red", "red", "blue"})
    (void)bring("robot1", "store1", sightings({seen_[0].position}, kind));
  EXPECT_EQ(bring("robot2", "pallet2", {}), "red 1");
  EXPECT_EQ(bring("robot2", "pallet2", {}), "blue 0") << "the red piece is older, but its row is full";
  EXPECT_THROW((void)bring("robot2", "pallet2", {}), Full);
  ledger.exchange("pallet2", "test");
  EXPECT_EQ(bring("robot2", "pallet2", {}), "red 1");
  EXPECT_THROW((void)bring("robot2", "pallet2", {}), Empty);
  Sightings both = seen_;
  both[1].kind = "blue";
  EXPECT_THAT(kinds_of(2), ::testing::ElementsAre("red")) << "each event names the kind";
  EXPECT_THAT(kinds_of(3), ::testing::ElementsAre("blue"));
  EXPECT_EQ(bring("robot1", "pallet2", both), "blue 0") << "from an area, past the red piece";
  EXPECT_THROW((void)bring("robot1", "pallet2", seen_), Full);
}

TEST_F(LedgerReserve, AKindThatNoRowOfTheTargetTakesStays) {
  CellConfig cell = cell_;
  cell.ledger = directory_ / "kinds.db";
  cell.kinds.push_back(cell.kinds[0]);
  cell.kinds[1].name = "blue";
  cell.places[1].row_kinds = {"red", "red", "red", "red"};
  Ledger ledger(cell, ZoneCheck::kOff);
  const ClaimToken token = ledger.claim("robot1", "test", 0);
  const Sightings blue = sightings({seen_[0].position}, "blue");
  EXPECT_THROW((void)ledger.reserve(token, "pallet1", "store1", blue, 0), Empty);
  EXPECT_STREQ(ledger.reserve(token, "pallet1", "pallet2", blue, 0).kind.in(), "blue");
}

TEST(LedgerSelection, DistancesWithin20mmAreEqual) {
  const auto chosen = [](double second_m) {
    return nearest_piece({{1, "red", 0, {0.1, 0, 0}, 0, 7}, {2, "red", 1, {second_m, 0, 0}, 0, 3}}, {0, 0, 0})
        ->number;
  };
  EXPECT_EQ(chosen(0.119), 2);
  EXPECT_EQ(chosen(0.121), 1);
  const Place row{"row", {}, {}, SlotGrid{4, 1, {0.05, 0.05}}, false};
  EXPECT_EQ(farthest_slot(row, {}, "red", {-1, 0, 0}), 3);
  EXPECT_EQ(farthest_slot(row, {3}, "red", {-1, 0, 0}), 2);
  EXPECT_EQ(farthest_slot(row, {0, 1, 2, 3}, "red", {-1, 0, 0}), std::nullopt);
}

using LedgerZones = LedgerFixture;

TEST_F(LedgerZones, AreGivenInTurn) {
  ledger_.enter(tokens_["robot1"], "store1", 0);
  ledger_.enter(tokens_["robot1"], "store1", 0);  // repeated
  std::vector<std::string> order;                 // the zone guards it
  std::promise<void> go;
  const std::shared_future<void> gone = go.get_future().share();
  const auto work = [&, gone](const std::string& robot) {
    ledger_.enter(tokens_.at(robot), "store1", 30);
    gone.wait();
    order.push_back(robot);
    ledger_.leave(tokens_.at(robot), "store1");
  };
  std::thread second(work, "robot3");
  EXPECT_TRUE(wait_until(within(20), [&] { return ledger_.waiting() == 1; }));
  std::thread third(work, "robot2");
  EXPECT_TRUE(wait_until(within(20), [&] { return ledger_.waiting() == 2; }));
  ledger_.leave(tokens_["robot2"], "store1");  // another robot's zone: no effect
  EXPECT_STREQ(place(1).robot.in(), "robot1");
  Ledger(cell_).leave(tokens_["robot1"], "store1");  // from elsewhere: it does not wake the waiting threads
  try {
    ledger_.enter(tokens_["robot1"], "store1", 0);
    ledger_.leave(tokens_["robot1"], "store1");
    ADD_FAILURE() << "before a robot that waited already";
  } catch (const Occupied& occupied) {
    EXPECT_STREQ(occupied.robot.in(), "robot3") << "in the zone, or the next there";
  }
  go.set_value();
  second.join();
  third.join();
  EXPECT_THAT(order, ::testing::ElementsAre("robot3", "robot2"));
}

TEST_F(LedgerZones, OutliveTheClaim) {
  ledger_.enter(tokens_["robot1"], "store1", 0);
  ledger_.release(tokens_["robot1"]);
  EXPECT_STREQ(place(1).robot.in(), "robot1");
  EXPECT_THROW(ledger_.enter(tokens_["robot2"], "store1", 0), Occupied);
  ledger_.leave(ledger_.claim("robot1", "next", 0), "store1");
  EXPECT_STREQ(place(1).robot.in(), "");
}

using LedgerWaits = LedgerFixture;

TEST_F(LedgerWaits, EndWithAChangeWithTheTimeoutOrWithTheClaim) {
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_THROW((void)ledger_.reserve(tokens_["robot2"], "store1", "pallet2", {}, 0.3), Empty);
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(300));

  Ledger other(cell_);  // as another process: the change comes from there
  std::thread producer([&] {
    const auto piece = other.reserve(tokens_.at("robot1"), "pallet1", "store1", seen_, 0).piece;
    other.enter(tokens_.at("robot1"), "store1", 0);
    for (const Step step : kToPlaced) other.advance(tokens_.at("robot1"), piece, step, "");
  });
  EXPECT_EQ(ledger_.reserve(tokens_["robot2"], "store1", "pallet2", {}, 30).piece, 1U);
  producer.join();

  std::thread waiter([&] { EXPECT_THROW(ledger_.enter(tokens_.at("robot2"), "store1", 30), Superseded); });
  EXPECT_TRUE(wait_until(within(20), [&] { return ledger_.waiting() == 1; }));
  const ClaimToken fresh = ledger_.claim("robot2", "next", tokens_["robot2"]);
  waiter.join();
  std::thread last([&] { EXPECT_THROW(ledger_.enter(fresh, "store1", 30), Occupied); });
  EXPECT_TRUE(wait_until(within(20), [&] { return ledger_.waiting() == 1; }));
  ledger_.end_waiting();
  last.join();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(25))
      << "no time-out was waited for";
}

using LedgerInput = LedgerFixture;

TEST_F(LedgerInput, ASightingCountsAsFarOverTheAreasEdgeAsTheWorkerOffersIt) {
  const double edge_m = 0.085 + 0.165 / 2;
  const std::pair<Point, bool> cases[] = {
      {{edge_m + 0.005, 0.239, 0}, true},   {{edge_m + 0.0149, 0.239, 0}, true},
      {{edge_m + 0.0151, 0.239, 0}, false}, {{0.05, 0.22, 0.0149}, true},
      {{0.05, 0.22, -0.0149}, true},        {{0.05, 0.22, 0.0151}, false},
      {{0.05, 0.22, -0.0151}, false},       {{0.05, 0.22, 5}, false},
  };
  for (const auto& [point, is_taken] : cases) {
    SCOPED_TRACE(fmt::format("{} {} {}", point.x, point.y, point.z));
    try {
      const auto piece = ledger_.reserve(tokens_["robot1"], "pallet1", "store1", sightings({point}), 0).piece;
      ledger_.advance(tokens_["robot1"], piece, StepWithdrawn, "");
      EXPECT_TRUE(is_taken);
    } catch (const Empty&) {
      EXPECT_FALSE(is_taken);
    }
  }
}

/// A piece that robot1 has lost on its way to slot 0 of the store.
class LedgerWord : public LedgerFixture {
 protected:
  [[nodiscard]] std::string fault_of(const std::function<void()>& call) const {
    try {
      call();
    } catch (const BadParameter& bad) {
      return bad.parameter.in();
    } catch (const Full& full) {
      return std::string("full ") + full.place.in();
    } catch (const Occupied& occupied) {
      return std::string("occupied ") + occupied.robot.in();
    }
    return "";
  }
  const PieceNumber piece_{carry("robot1", "pallet1", "store1", {StepPicking, StepHeld, StepUnclear})};
};

TEST_F(LedgerWord, PutsAnUnclearPieceWhereItStands) {
  ASSERT_EQ(ledger_.unclear().length(), 1U);
  EXPECT_EQ(ledger_.unclear()[0].piece, piece_);
  EXPECT_STREQ(ledger_.unclear()[0].robot.in(), "robot1");
  for (int i = 0; i < 2; ++i) ledger_.resolve(piece_, "pallet2", 3, "anna");  // repeated: no further effect
  EXPECT_EQ(ledger_.unclear().length(), 0U);
  EXPECT_EQ(place(2).pieces, 1U);
  const PieceEvents events = ledger_.history(piece_, 4);
  ASSERT_EQ(events.length(), 1U);
  EXPECT_EQ(events[0].step, StepPlaced);
  EXPECT_EQ(events[0].where.slot, 3);
  EXPECT_STREQ(events[0].note.in(), "by anna");
  EXPECT_EQ(fault_of([&] { ledger_.resolve(piece_, "pallet2", 4, "anna"); }), "piece") << "it is clear now";
}

TEST_F(LedgerWord, LeavesItInTheSlotThatItBlocks) {
  ledger_.resolve(piece_, "store1", 0, "anna");
  EXPECT_EQ(place(1).pieces, 1U);
  EXPECT_EQ(ledger_.reserve(tokens_["robot2"], "store1", "pallet2", {}, 0).piece, piece_);
}

TEST_F(LedgerWord, TakesItAway) {
  for (int i = 0; i < 2; ++i) ledger_.resolve(piece_, "", -1, "anna");
  EXPECT_EQ(ledger_.unclear().length(), 0U);
  EXPECT_EQ(place(1).pieces, 0U);
  EXPECT_EQ(ledger_.history(piece_, 4)[0].step, StepGone);
  EXPECT_EQ(ledger_.reserve(tokens_["robot1"], "pallet1", "store1", seen_, 0).target.slot, 0)
      << "the slot is free";
}

TEST_F(LedgerWord, LaysItBackIntoAnArea) {
  ledger_.resolve(piece_, "pallet1", -1, "anna");
  EXPECT_EQ(ledger_.unclear().length(), 0U);
  EXPECT_EQ(place(0).pieces, 0U) << "a picture is the truth there";
}

TEST_F(LedgerWord, IsRefusedWhereItCannotBe) {
  carry("robot1", "pallet1", "store1", kToPlaced);                          // into slot 1
  (void)ledger_.reserve(tokens_["robot1"], "pallet1", "store1", seen_, 0);  // slot 2
  EXPECT_EQ(fault_of([&] { ledger_.resolve(piece_, "store1", 1, "anna"); }), "full store1");
  EXPECT_EQ(fault_of([&] { ledger_.resolve(piece_, "store1", 2, "anna"); }), "full store1");
  EXPECT_EQ(fault_of([&] { ledger_.resolve(piece_, "store1", 4, "anna"); }), "slot");
  EXPECT_EQ(fault_of([&] { ledger_.resolve(piece_, "pallet1", 0, "anna"); }), "slot");
  EXPECT_EQ(fault_of([&] { ledger_.resolve(piece_, "nowhere", 0, "anna"); }), "place");
  EXPECT_EQ(fault_of([&] { ledger_.resolve(piece_, "", -1, ""); }), "who");
  EXPECT_EQ(fault_of([&] { ledger_.resolve(99, "", -1, "anna"); }), "piece");
  EXPECT_EQ(ledger_.unclear().length(), 1U);
}

TEST_F(LedgerWord, EmptiesAPlaceThatNoRobotUses) {
  ledger_.resolve(piece_, "store1", 0, "anna");
  for (int i = 0; i < 2; ++i) ledger_.exchange("store1", "anna");
  EXPECT_EQ(place(1).pieces, 0U);
  EXPECT_EQ(ledger_.history(piece_, 5)[0].step, StepGone);
  EXPECT_STREQ(ledger_.history(piece_, 5)[0].note.in(), "exchanged by anna");
}

TEST_F(LedgerWord, DoesNotEmptyAPlaceInUse) {
  EXPECT_EQ(fault_of([&] { ledger_.exchange("store1", "anna"); }), "place") << "a piece there is unclear";
  ledger_.resolve(piece_, "store1", 0, "anna");
  ledger_.enter(tokens_["robot2"], "store1", 0);
  EXPECT_EQ(fault_of([&] { ledger_.exchange("store1", "anna"); }), "occupied robot2");
  ledger_.leave(tokens_["robot2"], "store1");
  const PieceNumber taken = ledger_.reserve(tokens_["robot2"], "store1", "pallet2", {}, 0).piece;
  EXPECT_EQ(fault_of([&] { ledger_.exchange("store1", "anna"); }), "occupied robot2")
      << "it takes from there";
  ledger_.enter(tokens_["robot2"], "store1", 0);
  for (const Step step : {StepPicking, StepHeld}) ledger_.advance(tokens_["robot2"], taken, step, "");
  ledger_.leave(tokens_["robot2"], "store1");
  ledger_.exchange("store1", "anna");
  EXPECT_EQ(fault_of([&] { ledger_.exchange("pallet2", "anna"); }), "occupied robot2") << "it goes there";
}

TEST_F(LedgerInput, IsCheckedBeforeAnythingIsWritten) {
  const ClaimToken token = tokens_["robot1"];
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::string unprintable = "a\nb";
  const std::map<std::string, std::vector<std::function<void()>>> faults{
      {"robot",
       {[&] { ledger_.claim("robot9", "test", 0); }, [&] { ledger_.claim(unprintable, "test", 0); }}},
      {"who",
       {[&] { ledger_.claim("robot1", "", 0); }, [&] { ledger_.claim("robot1", std::string(65, 'w'), 0); },
        [&] { ledger_.claim("robot1", unprintable, 0); }}},
      {"from", {[&] { (void)ledger_.reserve(token, "nowhere", "store1", seen_, 0); }}},
      {"to",
       {[&] { (void)ledger_.reserve(token, "store1", "pallet1", seen_, 0); },
        [&] { (void)ledger_.reserve(token, "store1", "store1", seen_, 0); }}},
      {"seen",
       {[&] {
          (void)ledger_.reserve(token, "pallet1", "store1", sightings({{0.05, 0.22, nan}}), 0);
        },
        [&] {
          Corbot::Sightings seen = seen_;
          seen[2].confidence = nan;
          (void)ledger_.reserve(token, "pallet1", "store1", seen, 0);
        },
        [&] {
          Corbot::Sightings seen = seen_;
          seen[0].confidence = 1.1;
          (void)ledger_.reserve(token, "pallet1", "store1", seen, 0);
        }}},
      {"timeout",
       {[&] { (void)ledger_.reserve(token, "pallet1", "store1", seen_, nan); },
        [&] { ledger_.enter(token, "store1", -0.1); }, [&] { ledger_.enter(token, "store1", 30.1); }}},
      {"place", {[&] { ledger_.enter(token, "pallet1", 0); }, [&] { ledger_.leave(token, ""); }}},
      {"note", {[&] { ledger_.advance(token, 1, StepPicking, std::string(201, 'n')); }}},
  };
  for (const auto& [parameter, calls] : faults) {
    for (const auto& call : calls) {
      try {
        call();
        ADD_FAILURE() << parameter << " was accepted";
      } catch (const BadParameter& bad) {
        EXPECT_EQ(bad.parameter.in(), parameter);
        EXPECT_EQ(std::string(bad.reason.in()).find('\n'), std::string::npos) << bad.reason.in();
      }
    }
  }
  EXPECT_EQ(ledger_.history(0, 0).length(), 0U);
  (void)ledger_.reserve(token, "pallet1", "store1", seen_, 0);
  EXPECT_THROW(ledger_.advance(token, 77, StepPicking, ""), BadParameter);
}

}  // namespace
}  // namespace corbot::cell
