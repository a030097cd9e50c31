// SPDX-License-Identifier: Apache-2.0
#include "panel/cell_port.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "cell.hh"
#include "cell/wall_clock.h"
#include "client/failure.h"
#include "panel/corba_port.h"
#include "support/paths.h"
#include "support/ports.h"

namespace corbot::panel {
namespace {

class FakeCoordinator : public POA_Corbot::Coordinator {
 public:
  char* Name() override { return CORBA::string_dup("demo"); }
  void Start() override { ++starts; }
  void Pause() override {}
  void Resume() override {}
  void Stop() override {}
  CORBA::Boolean Paused() override {
    if (failures > 0 && failures-- > 0) throw CORBA::COMM_FAILURE();
    return false;
  }
  Corbot::CoordinatorState* State() override { return new Corbot::CoordinatorState{}; }

  int starts = 0;
  int failures = 0;  // of the next reads
};

/// A store of which a test sets the ledger. It counts the events that it has sent.
class FakeStore : public POA_Corbot::Store {
 public:
  void add(Corbot::PieceNumber piece, Corbot::TransferStep step) {
    Corbot::PieceEvent event{};
    event.number = ledger.size() + 1;
    event.time = cell::now_s();
    event.piece = piece;
    event.step = step;
    ledger.push_back(event);
  }

  Corbot::ClaimToken Claim(const char*, const char*, Corbot::ClaimToken) override { return 1; }
  void Release(Corbot::ClaimToken) override {}
  Corbot::TransferInfo* Reserve(Corbot::ClaimToken, const char* from, const char*, const Corbot::Sightings&,
                                double) override {
    throw Corbot::Empty(from);
  }
  void Advance(Corbot::ClaimToken, Corbot::PieceNumber, Corbot::TransferStep, const char*) override {}
  void Enter(Corbot::ClaimToken, const char*, double) override {}
  void Leave(Corbot::ClaimToken, const char*) override {}
  void Resolve(Corbot::PieceNumber, const char*, CORBA::Long, const char*) override {}
  void Exchange(const char*, const char*) override {}
  Corbot::PieceEvents* Unclear() override {
    if (fails) throw CORBA::TRANSIENT();
    return new Corbot::PieceEvents;
  }
  Corbot::PlaceInfos* Places() override { return new Corbot::PlaceInfos; }
  Corbot::TransferInfos* Transfers() override { return new Corbot::TransferInfos; }
  Corbot::PieceEvents* History(Corbot::PieceNumber, CORBA::ULongLong after) override {
    Corbot::PieceEvents_var events = new Corbot::PieceEvents;
    for (auto i = static_cast<std::size_t>(after); i < ledger.size(); ++i) {
      events->length(events->length() + 1);
      events[events->length() - 1] = ledger[i];
    }
    sent += events->length();
    return events._retn();
  }

  std::vector<Corbot::PieceEvent> ledger;
  std::size_t sent = 0;
  bool fails = false;
};

class PanelCellPort : public testing::Test {
 protected:
  PanelCellPort() {
    const CORBA::Object_var object = orb_->resolve_initial_references("RootPOA");
    const PortableServer::POA_var poa = PortableServer::POA::_narrow(object.in());
    const PortableServer::POAManager_var manager = poa->the_POAManager();
    manager->activate();
    const auto reference_of = [&](PortableServer::Servant servant) -> std::string {
      const PortableServer::ObjectId_var id = poa->activate_object(servant);
      const CORBA::Object_var reference = poa->id_to_reference(id.in());
      const CORBA::String_var text = orb_->object_to_string(reference.in());
      return text.in();
    };
    cell::CellOverrides overrides;
    overrides.ports = test::free_ports(5);
    cell::CellConfig config = cell::load_cell(CORBOT_CELL "/cell.toml", overrides);
    config.coordinator_reference = reference_of(&coordinator_);
    config.store_reference = reference_of(&store_);
    port_ = std::make_unique<CellPort>(orb_.in(), config);
  }
  ~PanelCellPort() override {
    port_.reset();
    orb_->destroy();
  }
  /// Returns the numbers of the pieces in the state.
  std::vector<int> pieces() {
    std::vector<int> numbers;
    const nlohmann::json state = port_->state();
    EXPECT_EQ(state["store"] == "", !store_.fails);
    for (const nlohmann::json& piece : state["pieces"]) numbers.push_back(piece["number"]);
    return numbers;
  }
  std::vector<int> pieces_after_connect() {
    (void)port_->connect();
    return pieces();
  }

  const CORBA::ORB_var orb_ = start_panel_orb();
  FakeCoordinator coordinator_;
  FakeStore store_;
  std::unique_ptr<CellPort> port_;
};

using Numbers = std::vector<int>;

TEST_F(PanelCellPort, ReadsOnlyNewEventsWhenItConnectsAgain) {
  for (int event = 0; event < 20; ++event) store_.add(1 + event % 3, Corbot::StepPlaced);
  EXPECT_EQ(pieces_after_connect(), (Numbers{1, 2, 3}));
  EXPECT_EQ(std::exchange(store_.sent, 0), 20U);
  store_.add(4, Corbot::StepPlaced);
  store_.add(2, Corbot::StepGone);
  EXPECT_EQ(pieces_after_connect(), (Numbers{1, 3, 4}));
  EXPECT_LE(store_.sent, 5U);  // the last known event, and the two new ones twice
}

TEST_F(PanelCellPort, ForgetsALedgerThatWasReplaced) {
  for (const int piece : {1, 2}) store_.add(piece, Corbot::StepPlaced);
  EXPECT_EQ(pieces_after_connect(), (Numbers{1, 2}));
  store_.ledger.clear();
  EXPECT_EQ(pieces_after_connect(), Numbers{});
  for (const int piece : {1, 2}) store_.add(piece, Corbot::StepPlaced);
  EXPECT_EQ(pieces(), (Numbers{1, 2}));
  store_.fails = true;
  EXPECT_EQ(pieces(), (Numbers{1, 2}));
  store_.fails = false;
  store_.ledger.clear();
  for (const int piece : {5, 6, 7}) store_.add(piece, Corbot::StepPlaced);
  EXPECT_EQ(pieces(), (Numbers{5, 6, 7}));
}

// An order to a coordinator that is frozen could reach it late.
TEST_F(PanelCellPort, StartsNoCellThatDoesNotAnswer) {
  coordinator_.failures = 2;
  EXPECT_THROW((void)port_->call(CellRequest{CellAction::kStart}), client::Failure);
  EXPECT_EQ(coordinator_.starts, 0);
}

// The first call to a coordinator that has started again finds that its connection is closed.
TEST_F(PanelCellPort, StartsACellWhoseCoordinatorHasStartedAgain) {
  coordinator_.failures = 1;
  EXPECT_EQ(port_->call(CellRequest{CellAction::kStart})["done"], true);
  EXPECT_EQ(coordinator_.starts, 1);
  EXPECT_EQ(coordinator_.failures, 0);
}

}  // namespace
}  // namespace corbot::panel
