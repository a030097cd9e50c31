// SPDX-License-Identifier: Apache-2.0
// Random calls of three robots over two connections. After each, a model that is replayed from the history
// agrees with the ledger.
#include <fmt/format.h>

#include <random>

#include "ledger_fixture.h"
#include "support/cases.h"

namespace corbot::cell {
namespace {

using namespace Corbot;

std::string slot_name(const Spot& spot) { return fmt::format("{}[{}]", spot.place.in(), int{spot.slot}); }

/// The pieces by the history alone. Its faults are texts, the first is kept.
class Model {
 public:
  /// `zone` is the robot in the zone of store1.
  void replay(const PieceEvents& events, const std::string& zone) {
    for (CORBA::ULong i = 0; i < events.length(); ++i) {
      const PieceEvent& event = events[i];
      require(event.number == last_ + 1, fmt::format("event {} follows {}", event.number, last_));
      last_ = event.number;
      const bool is_intent = event.step == StepPicking || event.step == StepPlacing;
      require(!is_intent || event.where.place.in() != std::string("store1") || zone == event.robot.in(),
              fmt::format("{} works at store1, and '{}' is in its zone", event.robot.in(), zone));
      move(event);
    }
  }

  void compare(const PlaceInfos& places, const TransferInfos& transfers) {
    std::map<std::string, std::uint64_t> standing;
    std::set<std::string> taken;
    std::set<std::string> robots;
    for (const auto& [piece, where] : spots_) {
      if (where.slot >= 0)
        require(taken.insert(slot_name(where)).second, "two pieces at " + slot_name(where));
      if (unclear_.count(piece) == 0) ++standing[where.place.in()];
    }
    for (const auto& [robot, pieces] : held_) require(pieces.size() < 2, robot + " holds two pieces");
    for (CORBA::ULong i = 0; i < transfers.length(); ++i) {
      require(robots.insert(transfers[i].robot.in()).second, "a robot has two transfers");
      require(taken.insert(slot_name(transfers[i].target)).second, "a target is taken");
    }
    for (CORBA::ULong i = 0; i < places.length(); ++i)
      require(places[i].pieces == standing[places[i].name.in()],
              fmt::format("{} has {} pieces, by the history {}", places[i].name.in(), places[i].pieces,
                          standing[places[i].name.in()]));
  }

  [[nodiscard]] const std::string& fault() const { return fault_; }
  [[nodiscard]] std::uint64_t last() const { return last_; }

 private:
  void require(bool holds, const std::string& fault) {
    if (!holds && fault_.empty()) fault_ = fault;
  }

  void move(const PieceEvent& event) {
    const bool is_new = event.piece > most_;
    most_ = std::max(most_, event.piece);
    auto& hand = held_[event.robot.in()];
    switch (event.step) {
      case StepReserved:
        require(is_new || spots_.count(event.piece) > 0, "a piece without a spot is reserved");
        spots_[event.piece] = event.where;
        break;
      case StepHeld:
        spots_.erase(event.piece);
        hand.insert(event.piece);
        break;
      case StepPlaced:
      case StepUnclear:
        if (event.step == StepUnclear) unclear_.insert(event.piece);
        hand.erase(event.piece);
        spots_[event.piece] = event.where;
        break;
      case StepWithdrawn:
        if (event.where.slot < 0) spots_.erase(event.piece);
        break;
      default:
        break;
    }
  }

  std::map<PieceNumber, Spot> spots_;
  std::map<std::string, std::set<PieceNumber>> held_;
  std::set<PieceNumber> unclear_;
  PieceNumber most_{0};
  std::uint64_t last_{0};
  std::string fault_;
};

/// One call that a robot may make, and many that it may not. Refusals are a part of the property.
class Caller {
 public:
  Caller(std::mt19937_64& random, std::map<std::string, ClaimToken>& tokens)
      : random_(random), tokens_(tokens) {}

  void call(Ledger& ledger) {
    const std::string robot = fmt::format("robot{}", pick(3) + 1);
    ClaimToken& token = tokens_.at(robot);
    try {
      switch (pick(12)) {
        case 0:
          if (pick(4) == 0) token = ledger.claim(robot, "again", token);
          break;
        case 1:
        case 2:
          reserve(ledger, robot, token);
          break;
        case 3:
          ledger.enter(token, "store1", 0);
          break;
        case 4:
        case 5:
          ledger.leave(token, "store1");
          break;
        default:
          advance(ledger, robot, token);
      }
    } catch (const CORBA::UserException&) {
      ++refused;
    }
  }
  int refused{0};

 private:
  int pick(int count) { return std::uniform_int_distribution<int>(0, count - 1)(random_); }

  void reserve(Ledger& ledger, const std::string& robot, ClaimToken token) {
    const auto seen =
        sightings({{0.01 + 0.02 * pick(8), 0.19 + 0.02 * pick(6), 0}, {0.01 + 0.02 * pick(8), 0.24, 0}});
    const bool is_second = robot == "robot2";
    (void)ledger.reserve(token, is_second ? "store1" : "pallet1", is_second ? "pallet2" : "store1", seen, 0);
  }

  /// Mostly a step ahead, else any. Few are unclear: their slots are blocked for good.
  void advance(Ledger& ledger, const std::string& robot, ClaimToken token) {
    const TransferInfos transfers = ledger.transfers();
    for (CORBA::ULong i = 0; i < transfers.length(); ++i) {
      if (robot != transfers[i].robot.in()) continue;
      int step = pick(8) == 0 ? pick(6) : transfers[i].step + 1;
      if (pick(150) == 0) step = StepUnclear;
      ledger.advance(token, transfers[i].piece, static_cast<Step>(step), "");
    }
  }

  std::mt19937_64& random_;
  std::map<std::string, ClaimToken>& tokens_;
};

class LedgerProperty : public LedgerFixture {
 protected:
  /// The first fault of the model in so many random calls.
  std::string first_fault(int calls, ZoneCheck zone_check) {
    std::mt19937_64 random(test::drawn_seed());
    Ledger first(cell_, zone_check);
    Ledger second(cell_, zone_check);
    Model model;
    Caller caller(random, tokens_);
    for (int i = 0; i < calls && model.fault().empty(); ++i) {
      caller.call(random() % 2 == 0 ? first : second);
      model.replay(ledger_.history(0, model.last()), place(1).robot.in());
      model.compare(ledger_.places(), ledger_.transfers());
    }
    refused_ = caller.refused;
    return model.fault();
  }
  int refused_{};
};

TEST_F(LedgerProperty, EachPieceIsInOnePlace) {
  EXPECT_EQ(first_fault(600, ZoneCheck::kOn), "");
  EXPECT_GT(ledger_.history(0, 0).length(), 10U);
  EXPECT_GT(refused_, 40);
}

/// The model itself: it finds a ledger that does not check the zone.
TEST_F(LedgerProperty, ALedgerWithoutZonesIsFound) {
  EXPECT_NE(first_fault(600, ZoneCheck::kOff).find("works at store1"), std::string::npos);
}

}  // namespace
}  // namespace corbot::cell
