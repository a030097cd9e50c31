// SPDX-License-Identifier: Apache-2.0
// A person's word at the panel, with the ledger's own program.
#include "panel/cell_port.h"

#include <gmock/gmock.h>
#include <signal.h>
#include <stdlib.h>

#include <filesystem>
#include <string>

#include "cell.hh"
#include "cell/orb_server.h"
#include "client/failure.h"
#include "panel/corba_port.h"
#include "support/paths.h"
#include "support/ports.h"
#include "support/process.h"

namespace corbot::panel {
namespace {

using test::within;
using testing::HasSubstr;

class PanelCell : public testing::Test {
 protected:
  PanelCell() {
    std::string path = CORBOT_SCRATCH_DIR "/panel-cell-XXXXXX";
    directory_ = ::mkdtemp(path.data());
    start_store();
    cell::CellOverrides overrides;
    overrides.ports = ports_;
    overrides.state_directory = directory_;
    const cell::CellConfig config = cell::load_cell(CORBOT_CELL "/cell.toml", overrides);
    store_ = cell::reference_to<Corbot::Store>(orb_.in(), config.store_uri());
    port_ = std::make_unique<CellPort>(orb_.in(), config);
  }
  ~PanelCell() override {
    port_.reset();
    program_.reset();
    std::filesystem::remove_all(directory_);
  }
  void start_store() {
    program_.emplace(std::vector<std::string>{CORBOT_BIN_DIR "/corbot-store", CORBOT_CELL "/cell.toml",
                                              "--ports", std::to_string(ports_), "--state-dir",
                                              directory_.string()});
    EXPECT_TRUE(program_->wait_line("ready ", within(30))) << program_->errors();
  }
  /// Makes robot 1 lose a piece.
  Corbot::PieceNumber lose_piece() {
    const Corbot::ClaimToken token = store_->Claim("robot1", "test", 0);
    Corbot::Sightings seen;
    seen.length(1);
    seen[0].kind = "red";
    seen[0].position = {0.085, 0.239, 0};
    seen[0].yaw = 0;
    seen[0].confidence = 1;
    const Corbot::TransferInfo_var transfer = store_->Reserve(token, "pallet1", "store1", seen, 0);
    store_->Advance(token, transfer->piece, Corbot::StepPicking, "");
    store_->Advance(token, transfer->piece, Corbot::StepUnclear, "the gripper is empty");
    return transfer->piece;
  }
  std::string refusal(CellRequest request) {
    try {
      (void)port_->call(request);
      return "none";
    } catch (const client::Failure& failure) {
      return failure.what();
    }
  }

  const CORBA::ORB_var orb_ = start_panel_orb();
  const int ports_{test::free_ports(5)};
  std::filesystem::path directory_;
  std::optional<test::Process> program_;
  Corbot::Store_var store_;
  std::unique_ptr<CellPort> port_;
};

TEST_F(PanelCell, RecordsWhereAPieceIsAndWhatWasEmptied) {
  const Corbot::PieceNumber piece = lose_piece();
  EXPECT_EQ(refusal({CellAction::kResolve, piece, "pallet2"}), "give a SLOT: it must be 0 to 11 at pallet2");
  EXPECT_EQ(refusal({CellAction::kResolve, piece, "pallet2", 12}), "slot 12: must be 0 to 11 at pallet2");
  EXPECT_EQ(refusal({CellAction::kResolve, piece, "pallet9", 0}), "'pallet9' is no place of cell 'demo'");
  EXPECT_EQ(refusal({CellAction::kResolve, piece + 1}), "piece 2: is not in the ledger");
  EXPECT_EQ(refusal({CellAction::kResolve, piece, "pallet2", 3}), "none");
  EXPECT_THAT(refusal({CellAction::kResolve, piece}), HasSubstr("piece 1: is not unclear"));
  const Corbot::PieceEvents_var none = store_->Unclear();
  EXPECT_EQ(none->length(), 0U);

  EXPECT_EQ(refusal({CellAction::kExchange, 0, "pallet9"}), "'pallet9' is no place of cell 'demo'");
  EXPECT_EQ(refusal({CellAction::kExchange, 0, "pallet2"}), "none");
  const Corbot::PieceEvents_var events = store_->History(piece, 0);
  const Corbot::PieceEvent& last = events.in()[events->length() - 1];
  EXPECT_EQ(last.step, Corbot::StepGone);
  EXPECT_STREQ(last.note, "exchanged by panel");
}

TEST_F(PanelCell, RefusesAnExchangeWhereARobotWorks) {
  store_->Enter(store_->Claim("robot1", "test", 0), "store1", 0);
  EXPECT_EQ(refusal({CellAction::kExchange, 0, "store1"}),
            "robot1 uses store1: wait until it has ended its piece");
}

TEST_F(PanelCell, RecordsAWordInAStoreThatHasStartedAgain) {
  EXPECT_EQ(refusal({CellAction::kExchange, 0, "pallet2"}), "none");
  program_->signal(SIGKILL);
  ASSERT_TRUE(program_->wait(within(30)));
  start_store();
  EXPECT_EQ(refusal({CellAction::kExchange, 0, "pallet2"}), "none");
}

TEST_F(PanelCell, NamesAStoreThatDoesNotReply) {
  program_.reset();
  EXPECT_THAT(refusal({CellAction::kExchange, 0, "pallet2"}), HasSubstr("the store at corbaloc"));
}

}  // namespace
}  // namespace corbot::panel
