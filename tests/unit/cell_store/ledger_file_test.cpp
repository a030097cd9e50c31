// SPDX-License-Identifier: Apache-2.0
// The file of the ledger: what outlives the process, what is refused, and a full disk.
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <fstream>
#include <set>
#include <thread>

#include "client/failure.h"
#include "ledger_fixture.h"

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
  database.run("UPDATE cell SET schema = 2");
  EXPECT_THAT(why(cell_), HasSubstr("has schema 2; this program reads schema 1"));
  database.run("ALTER TABLE cell RENAME TO other");
  EXPECT_THAT(why(cell_), HasSubstr("is a database, but no ledger"));
  cell.ledger = directory_ / "text";
  std::ofstream(cell.ledger) << std::string(4096, 'x');
  EXPECT_THAT(why(cell), HasSubstr("file is not a database"));
  cell.ledger = directory_ / "missing" / "ledger.db";
  EXPECT_THAT(why(cell), HasSubstr("No such file or directory"));
}

/// No file of this process grows beyond `bytes` meanwhile: a full disk.
class FullDisk {
 public:
  explicit FullDisk(std::uintmax_t bytes) : handler_(::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    rlimit limit = before_;
    limit.rlim_cur = bytes;
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    ::signal(SIGXFSZ, handler_);
  }

 private:
  sighandler_t handler_;
  rlimit before_{};
};

TEST_F(LedgerFile, OnAFullDiskChangesNothing) {
  const auto piece = carry("robot1", "pallet1", "store1", {StepPicking, StepHeld});
  ledger_.enter(tokens_["robot1"], "store1", 0);
  const auto events = ledger_.history(0, 0).length();
  {
    const FullDisk full(std::filesystem::file_size(directory_ / "ledger.db-wal"));
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
