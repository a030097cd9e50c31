// SPDX-License-Identifier: Apache-2.0
// The file of the ledger: what outlives the process, what is refused, and a full disk.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include <fstream>
#include <set>
#include <thread>

#include "client/failure.h"
#include "ledger_fixture.h"
#include "support/full_disk.h"

namespace corbot::cell {
namespace {

using namespace Corbot;
using ::testing::HasSubstr;

using LedgerFile = LedgerFixture;

TEST_F(LedgerFile, HoldsEverythingAcrossARestart) {
  carry("robot1", "pallet1", "store1", kToPlaced);
  const auto piece = carry("robot1", "pallet1", "store1", {StepPicking, StepHeld});
  ledger_.enter(tokens_["robot1"], "store1", 0);
  Ledger again(cell_);
  ASSERT_EQ(again.transfers().length(), 1U);
  const TransferInfo transfer = again.transfers()[0];
  EXPECT_EQ(transfer.piece, piece);
  EXPECT_EQ(transfer.step, StepHeld);
  EXPECT_EQ(transfer.source.position.x, 0.05);
  EXPECT_EQ(transfer.target.slot, 1);
  EXPECT_STREQ(again.places()[1].robot.in(), "robot1");
  EXPECT_EQ(again.places()[1].pieces, 1U);
  EXPECT_EQ(again.places()[1].reserved, 1U);
  const PieceEvents events = again.history(piece, 0);
  ASSERT_EQ(events.length(), 3U);
  EXPECT_EQ(events[2].number, 8U);
  EXPECT_EQ(events[2].step, StepHeld);
  EXPECT_EQ(again.history(0, 7).length(), 1U);
  again.advance(tokens_["robot1"], piece, StepPlacing, "the token still counts");
  EXPECT_STREQ(ledger_.history(piece, 8)[0].note.in(), "the token still counts");
}

/// Workers outlive a ledger that is removed: what they say with its tokens must not count for another robot.
TEST_F(LedgerFile, ANewOneKnowsNoTokenOfTheOneBefore) {
  CellConfig cell = cell_;
  cell.ledger = directory_ / "next.db";
  Ledger next(cell);
  for (const char* robot : {"robot3", "robot2", "robot1"}) {
    const ClaimToken token = next.claim(robot, "test", 0);
    for (const auto& [other, old] : tokens_) {
      EXPECT_GT(token, old);
      EXPECT_THROW(next.enter(old, "store1", 0), Superseded) << other << " after the claim of " << robot;
    }
  }
}

TEST_F(LedgerFile, OneInMemoryIsForItselfAndLeavesNoFile) {
  CellConfig cell = cell_;
  cell.ledger = kInMemory;
  Ledger first(cell);
  const ClaimToken token = first.claim("robot1", "test", 0);
  EXPECT_EQ(first.reserve(token, "pallet1", "store1", seen_, 0).piece, 1U);
  Ledger second(cell);
  EXPECT_EQ(first.transfers().length(), 1U);
  EXPECT_EQ(second.transfers().length(), 0U);
  EXPECT_FALSE(std::filesystem::exists(kInMemory));
}

TEST_F(LedgerFile, IsPrivate) {
  for (const char* name : {"ledger.db", "ledger.db-wal"}) {
    struct stat status {};
    ASSERT_EQ(::stat((directory_ / name).c_str(), &status), 0) << name;
    EXPECT_EQ(status.st_mode & 0777, 0600U) << name;
  }
}

TEST_F(LedgerFile, OfAnotherCellIsRefused) {
  const auto why = [](const CellConfig& cell) -> std::string {
    try {
      const Ledger ledger(cell);
    } catch (const client::Failure& failure) {
      return failure.what();
    } catch (const DatabaseError& error) {
      return error.what();
    }
    return "";
  };
  carry("robot1", "pallet1", "store1", kToPlaced);
  ledger_.enter(tokens_["robot3"], "store1", 0);
  CellConfig cell = cell_;
  cell.name = "other";
  EXPECT_THAT(why(cell), HasSubstr("is the ledger of cell 'demo', not of 'other'"));
  cell = cell_;
  cell.robots.pop_back();
  EXPECT_THAT(why(cell), HasSubstr("uses robot 'robot3'"));
  cell = cell_;
  cell.places[1].slots.reset();
  EXPECT_THAT(why(cell), HasSubstr("uses slot 0 of 'store1'"));
  cell = cell_;
  cell.places.erase(cell.places.begin() + 1);
  EXPECT_THAT(why(cell), HasSubstr("'store1', which the cell does not have"));
  Database database(cell_.ledger);
  for (const char* schema : {"0", "3"}) {
    execute(database, "UPDATE cell SET schema = $1", schema);
    EXPECT_THAT(why(cell_),
                HasSubstr(std::string("has schema ") + schema + "; this program reads schemas 1 to 2"));
  }
  database.run("ALTER TABLE cell RENAME TO other");
  EXPECT_THAT(why(cell_), HasSubstr("is a database, but no ledger"));
  cell.ledger = directory_ / "text";
  std::ofstream(cell.ledger) << std::string(4096, 'x');
  EXPECT_THAT(why(cell), HasSubstr("file is not a database"));
  cell.ledger = directory_ / "missing" / "ledger.db";
  EXPECT_THAT(why(cell), HasSubstr("No such file or directory"));
}

/// Gives the ledger the table of pieces that schema 1 had.
void make_schema_1(Database& database) {
  database.run(R"sql(
PRAGMA foreign_keys = OFF;
ALTER TABLE piece RENAME TO new;
CREATE TABLE piece (cell TEXT NOT NULL REFERENCES cell, number BIGINT NOT NULL, kind TEXT NOT NULL,
  state TEXT NOT NULL CHECK (state IN ('stands','held','unclear')), robot TEXT, place TEXT, slot INTEGER,
  x DOUBLE PRECISION NOT NULL, y DOUBLE PRECISION NOT NULL, z DOUBLE PRECISION NOT NULL,
  yaw DOUBLE PRECISION NOT NULL, arrived BIGINT NOT NULL, PRIMARY KEY (cell, number),
  UNIQUE (cell, place, slot), UNIQUE (cell, robot),
  CHECK ((state = 'held') = (robot IS NOT NULL)), CHECK ((state = 'held') = (place IS NULL)));
INSERT INTO piece SELECT * FROM new;
DROP TABLE transfer;
CREATE TABLE transfer (cell TEXT NOT NULL REFERENCES cell, robot TEXT NOT NULL, piece BIGINT NOT NULL,
  step TEXT NOT NULL CHECK (step IN ('reserved','picking','held','placing')),
  from_place TEXT NOT NULL, from_slot INTEGER, to_place TEXT NOT NULL, to_slot INTEGER NOT NULL,
  since DOUBLE PRECISION NOT NULL, PRIMARY KEY (cell, robot), UNIQUE (cell, piece),
  UNIQUE (cell, to_place, to_slot), FOREIGN KEY (cell, piece) REFERENCES piece);
DROP TABLE new;
UPDATE cell SET schema = 1;
)sql");
}

/// The ledger has a piece that stands and one in a gripper.
class OldLedger : public LedgerFixture {
 protected:
  OldLedger() {
    carry("robot1", "pallet1", "store1", kToPlaced);
    piece_ = carry("robot1", "pallet1", "store1", {StepPicking, StepHeld});
    Database database(cell_.ledger);
    make_schema_1(database);
    database.run("PRAGMA foreign_keys = OFF");
    execute(database,
            "INSERT INTO transfer VALUES ('demo', 'robot1', $1, 'held', 'pallet1', NULL, 'store1', 1, 5)",
            static_cast<std::int64_t>(piece_));
  }
  Corbot::PieceNumber piece_{};
};

TEST_F(OldLedger, IsMigratedWithItsRows) {
  Ledger again(cell_);
  Database database(cell_.ledger);
  Statement schema(database, "SELECT schema FROM cell");
  ASSERT_TRUE(schema.next());
  EXPECT_EQ(schema.integer(0), 2);
  EXPECT_EQ(again.places()[1].pieces, 1U);
  ASSERT_EQ(again.transfers().length(), 1U);
  EXPECT_EQ(again.transfers()[0].piece, piece_);
  again.advance(tokens_["robot1"], piece_, StepUnclear, "dropped");
  again.resolve(piece_, "", -1, "test");
  EXPECT_EQ(again.unclear().length(), 0U);
  EXPECT_THROW(database.run("INSERT INTO transfer VALUES ('demo', 'robot2', 99, 'held', 'a', 1, 'b', 1, 0)"),
               DatabaseError)
      << "a transfer still needs its piece";
}

TEST_F(OldLedger, ThatCannotBeMigratedStaysAsItWas) {
  Database database(cell_.ledger);
  database.run("PRAGMA foreign_keys = OFF");
  execute(database, "UPDATE piece SET number = 77 WHERE state = 'held'");  // the transfer's row leads nowhere
  EXPECT_THROW(Ledger{cell_}, client::Failure);
  Statement schema(database, "SELECT schema FROM cell");
  ASSERT_TRUE(schema.next());
  EXPECT_EQ(schema.integer(0), 1);
  EXPECT_THROW(database.run("UPDATE piece SET state = 'gone', robot = NULL, place = NULL"), DatabaseError);
}

TEST_F(LedgerFile, OnAFullDiskChangesNothing) {
  const auto piece = carry("robot1", "pallet1", "store1", {StepPicking, StepHeld});
  ledger_.enter(tokens_["robot1"], "store1", 0);
  const auto events = ledger_.history(0, 0).length();
  {
    const test::FullDisk full(std::filesystem::file_size(directory_ / "ledger.db-wal"));
    EXPECT_THROW(ledger_.advance(tokens_["robot1"], piece, StepPlacing, ""), DatabaseError);
    EXPECT_THROW(ledger_.leave(tokens_["robot1"], "store1"), DatabaseError);
    EXPECT_THROW(ledger_.claim("robot1", "next", tokens_["robot1"]), DatabaseError);
    EXPECT_EQ(ledger_.transfers()[0].step, StepHeld);
  }
  EXPECT_EQ(ledger_.history(0, 0).length(), events);
  EXPECT_STREQ(place(1).robot.in(), "robot1");
  ledger_.advance(tokens_["robot1"], piece, StepPlacing, "");
  EXPECT_EQ(ledger_.history(0, events)[0].number, events + 1) << "no number was lost";
}

TEST(FullDatabase, IsToldFromOtherFaults) {
  Database database(kInMemory);
  database.run("PRAGMA max_page_count = 2; CREATE TABLE t (x)");
  const auto is_full = [&](const char* sql) {
    try {
      database.run(sql);
    } catch (const DatabaseError& error) {
      return error.is_full();
    }
    ADD_FAILURE() << sql;
    return false;
  };
  EXPECT_TRUE(is_full("INSERT INTO t VALUES (zeroblob(100000))"));
  EXPECT_FALSE(is_full("INSERT INTO other VALUES (1)"));
}

/// Two processes share one file only after a mistake, and even then no piece is lost.
TEST_F(LedgerFile, IsSharedByTwoConnectionsWithoutLoss) {
  const auto work = [&](const std::string& robot, double y_m) {
    Ledger ledger(cell_);
    for (int i = 0; i < 6; ++i) {
      const auto seen = sightings({{0.02 + 0.025 * i, y_m, 0}});
      const auto piece = ledger.reserve(tokens_.at(robot), "pallet1", "pallet2", seen, 30).piece;
      for (const Step step : kToPlaced) ledger.advance(tokens_.at(robot), piece, step, "");
    }
  };
  std::thread one(work, "robot1", 0.21);
  std::thread three(work, "robot3", 0.26);
  one.join();
  three.join();
  EXPECT_EQ(place(2).pieces, 12U);
  const PieceEvents events = ledger_.history(0, 0);
  ASSERT_EQ(events.length(), 60U);
  std::set<int> slots;
  for (CORBA::ULong i = 0; i < events.length(); ++i) {
    EXPECT_EQ(events[i].number, i + 1);
    if (events[i].step == StepPlaced) slots.insert(events[i].where.slot);
  }
  EXPECT_EQ(slots.size(), 12U);
}

}  // namespace
}  // namespace corbot::cell
