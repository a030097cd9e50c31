// SPDX-License-Identifier: Apache-2.0
#include "cell/store/ledger_tables.h"
#include "cell/wall_clock.h"

#include <algorithm>
#include <array>
#include <chrono>

namespace corbot::cell {
namespace {

using Corbot::TransferStep;
using Eigen::Vector3d;

/// The steps' names in the ledger, in the order of the IDL.
constexpr std::array<std::string_view, 8> kStepNames{"reserved", "picking",   "held",    "placing",
                                                     "placed",   "withdrawn", "unclear", "gone"};

/// The columns of events_in().
const std::string kSelectEvents =
    "SELECT e.number, time, e.piece, COALESCE(kind, ''), e.robot, step, note, e.place, e.slot, e.x, e.y,"
    " e.z, e.yaw FROM event e LEFT JOIN piece p ON p.cell = e.cell AND p.number = e.piece";

TransferStep step_named(const std::string& name) {
  const auto found = std::find(kStepNames.begin(), kStepNames.end(), name);
  if (found == kStepNames.end()) throw DatabaseError("the ledger has an unknown step '" + name + "'");
  return static_cast<TransferStep>(found - kStepNames.begin());
}

std::optional<int> slot_in(const Statement& row, int column) {
  return row.is_null(column) ? std::nullopt : std::optional(static_cast<int>(row.integer(column)));
}

/// Reads a position from three columns.
Vector3d position_in(const Statement& row, int column) {
  return {row.number(column), row.number(column + 1), row.number(column + 2)};
}

Corbot::Spot spot_at(const std::string& place, std::optional<int> slot, const Vector3d& position,
                     double yaw_deg) {
  Corbot::Spot spot;
  spot.place = place.c_str();
  spot.slot = slot.value_or(-1);
  spot.position = {position.x(), position.y(), position.z()};
  spot.yaw = yaw_deg;
  return spot;
}

/// Reads a spot from six columns: place, slot, x, y, z, yaw.
Corbot::Spot spot_in(const Statement& row, int column) {
  return spot_at(row.text(column), slot_in(row, column + 1), position_in(row, column + 2),
                 row.number(column + 5));
}

std::optional<int> slot_of(const Corbot::Spot& spot) {
  return spot.slot < 0 ? std::nullopt : std::optional<int>(spot.slot);
}

/// Appends an element to a sequence and returns it.
template <class Sequence>
auto& append(Sequence& sequence) {
  sequence.length(sequence.length() + 1);
  return sequence[sequence.length() - 1];
}

}  // namespace

const Corbot::Spot& spot_of(const Corbot::TransferInfo& transfer, TransferStep step) {
  const bool is_at_target = step == Corbot::StepPlacing || step == Corbot::StepPlaced ||
                            (step == Corbot::StepUnclear && transfer.step != Corbot::StepPicking);
  return is_at_target ? transfer.target : transfer.source;
}

void LedgerTables::lock() {
  execute(database_, "UPDATE cell SET revision = revision + 1 WHERE name = $1", cell_.name);
}

std::int64_t LedgerTables::next_number(const char* sql) {
  Statement row(database_, sql, cell_.name);
  if (!row.next()) throw DatabaseError("the ledger has no row of its cell");
  return row.integer(0);
}

std::optional<TokenRow> LedgerTables::token(std::int64_t token) {
  Statement row(
      database_,
      "SELECT c.robot, COALESCE(p.token, 0) FROM claim c LEFT JOIN claim p"
      " ON p.cell = c.cell AND p.robot = c.robot AND p.ended = 0 WHERE c.cell = $1 AND c.token = $2",
      cell_.name, token);
  if (!row.next()) return std::nullopt;
  return TokenRow{row.text(0), row.integer(1)};
}

std::optional<ClaimRow> LedgerTables::claim_of(const std::string& robot) {
  Statement row(database_, "SELECT token, who, since FROM claim WHERE cell = $1 AND robot = $2 AND ended = 0",
                cell_.name, robot);
  if (!row.next()) return std::nullopt;
  return ClaimRow{row.integer(0), row.text(1), row.number(2)};
}

void LedgerTables::end_claim_of(const std::string& robot) {
  execute(database_, "UPDATE claim SET ended = 1 WHERE cell = $1 AND robot = $2 AND ended = 0", cell_.name,
          robot);
}

std::int64_t LedgerTables::insert_claim(const std::string& robot, const std::string& who) {
  const auto token = next_number("UPDATE cell SET tokens = tokens + 1 WHERE name = $1 RETURNING tokens");
  execute(database_, "INSERT INTO claim VALUES ($1, $2, $3, $4, $5, 0)", cell_.name, token, robot, who,
          now_s());
  return token;
}

std::optional<ZoneRow> LedgerTables::zone(const std::string& place) {
  Statement row(database_, "SELECT robot, since FROM zone WHERE cell = $1 AND place = $2", cell_.name, place);
  if (!row.next()) return std::nullopt;
  return ZoneRow{row.text(0), row.number(1)};
}

void LedgerTables::insert_zone(const std::string& place, const std::string& robot) {
  execute(database_, "INSERT INTO zone VALUES ($1, $2, $3, $4)", cell_.name, place, robot, now_s());
}

void LedgerTables::delete_zone(const std::string& place, const std::string& robot) {
  execute(database_, "DELETE FROM zone WHERE cell = $1 AND place = $2 AND robot = $3", cell_.name, place,
          robot);
}

Corbot::TransferInfos LedgerTables::transfers(const std::string& robot) {
  Statement row(database_,
                "SELECT t.piece, p.kind, t.robot, t.step, t.since, t.to_place, t.to_slot, t.from_place,"
                " t.from_slot, p.x, p.y, p.z, p.yaw FROM transfer t"
                " JOIN piece p ON p.cell = t.cell AND p.number = t.piece"
                " WHERE t.cell = $1 AND ($2 = '' OR t.robot = $2) ORDER BY t.robot",
                cell_.name, robot);
  Corbot::TransferInfos all;
  while (row.next()) {
    Corbot::TransferInfo& info = append(all);
    info.piece = static_cast<Corbot::PieceNumber>(row.integer(0));
    info.kind = row.text(1).c_str();
    info.robot = row.text(2).c_str();
    info.step = step_named(row.text(3));
    info.since = row.number(4);
    const std::string to = row.text(5);
    const int slot = static_cast<int>(row.integer(6));
    info.target = spot_at(to, slot, cell_.place(to)->slot_position(slot), 0);
    info.source = spot_in(row, 7);
  }
  return all;
}

std::vector<Candidate> LedgerTables::pieces_at(const std::string& place) {
  Statement row(database_,
                "SELECT number, kind, slot, x, y, z, yaw, arrived FROM piece p"
                " WHERE cell = $1 AND place = $2 AND state = 'stands'"
                " AND NOT EXISTS (SELECT 1 FROM transfer t WHERE t.cell = p.cell AND t.piece = p.number)",
                cell_.name, place);
  std::vector<Candidate> all;
  while (row.next())
    all.push_back(
        {row.integer(0), row.text(1), slot_in(row, 2), position_in(row, 3), row.number(6), row.integer(7)});
  return all;
}

std::vector<Vector3d> LedgerTables::spots_in(const std::string& area) {
  Statement row(
      database_,
      "SELECT x, y, z FROM piece p WHERE cell = $1 AND (place = $2 OR EXISTS"
      " (SELECT 1 FROM transfer t WHERE t.cell = p.cell AND t.piece = p.number AND t.from_place = $2))",
      cell_.name, area);
  std::vector<Vector3d> all;
  while (row.next()) all.push_back(position_in(row, 0));
  return all;
}

std::set<int> LedgerTables::slots_taken(const std::string& place) {
  Statement row(database_,
                "SELECT slot FROM piece WHERE cell = $1 AND place = $2"
                " UNION SELECT to_slot FROM transfer WHERE cell = $1 AND to_place = $2",
                cell_.name, place);
  std::set<int> all;
  while (row.next()) all.insert(static_cast<int>(row.integer(0)));
  return all;
}

void LedgerTables::insert_transfer(const std::string& robot, Candidate piece, const std::string& from,
                                   const std::string& to, int to_slot) {
  if (piece.number == 0) {
    piece.number = next_number("UPDATE cell SET pieces = pieces + 1 WHERE name = $1 RETURNING pieces");
    const Vector3d& p = piece.position_m;
    execute(database_,
            "INSERT INTO piece VALUES ($1, $2, $3, 'stands', NULL, $4, NULL, $5, $6, $7, $8,"
            " (SELECT events + 1 FROM cell WHERE name = $1))",
            cell_.name, piece.number, piece.kind, from, p.x(), p.y(), p.z(), piece.yaw_deg);
  }
  execute(database_, "INSERT INTO transfer VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9)", cell_.name, robot,
          piece.number, kStepNames[Corbot::StepReserved], from, piece.slot, to, to_slot, now_s());
  write_event(transfers(robot)[0], Corbot::StepReserved, "");
}

bool LedgerTables::is_last_event(std::int64_t piece, const std::string& robot, TransferStep step) {
  Statement last(database_,
                 "SELECT robot, step FROM event WHERE cell = $1 AND piece = $2 ORDER BY number DESC LIMIT 1",
                 cell_.name, piece);
  return last.next() && last.text(0) == robot && last.text(1) == kStepNames.at(step);
}

std::int64_t LedgerTables::write_event(const Corbot::TransferInfo& transfer, TransferStep step,
                                       const std::string& note) {
  const auto number = next_number("UPDATE cell SET events = events + 1 WHERE name = $1 RETURNING events");
  const Corbot::Spot& spot = spot_of(transfer, step);
  const Corbot::Point& p = spot.position;
  execute(database_, "INSERT INTO event VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13)",
          cell_.name, number, now_s(), static_cast<std::int64_t>(transfer.piece), transfer.robot.in(),
          kStepNames.at(step), spot.place.in(), slot_of(spot), p.x, p.y, p.z, spot.yaw, note);
  return number;
}

void LedgerTables::put_piece(std::int64_t piece, std::string_view state, const Corbot::Spot& spot,
                             std::int64_t event) {
  const Corbot::Point& p = spot.position;
  execute(
      database_,
      "UPDATE piece SET state = $3, robot = NULL, place = $4, slot = $5, x = $6, y = $7, z = $8, yaw = $9,"
      " arrived = $10 WHERE cell = $1 AND number = $2",
      cell_.name, piece, state, spot.place.in(), slot_of(spot), p.x, p.y, p.z, spot.yaw, event);
}

void LedgerTables::write_step(const Corbot::TransferInfo& transfer, TransferStep step,
                              const std::string& note) {
  const auto piece = static_cast<std::int64_t>(transfer.piece);
  const std::string robot = transfer.robot.in();
  const std::int64_t event = write_event(transfer, step, note);
  if (step == Corbot::StepPlaced || step == Corbot::StepWithdrawn || step == Corbot::StepUnclear) {
    execute(database_, "DELETE FROM transfer WHERE cell = $1 AND robot = $2", cell_.name, robot);
  } else {
    execute(database_, "UPDATE transfer SET step = $3, since = $4 WHERE cell = $1 AND robot = $2", cell_.name,
            robot, kStepNames.at(step), now_s());
  }
  if (step == Corbot::StepHeld) {
    execute(database_,
            "UPDATE piece SET state = 'held', robot = $3, place = NULL, slot = NULL"
            " WHERE cell = $1 AND number = $2",
            cell_.name, piece, robot);
  } else if (step == Corbot::StepPlaced) {
    put_piece(piece, "stands", transfer.target, event);
  } else if (step == Corbot::StepUnclear) {
    put_piece(piece, "unclear", spot_of(transfer, step), event);
  } else if (step == Corbot::StepWithdrawn && transfer.source.slot < 0) {
    delete_piece(piece);
  }
}

/// Deletes a piece that stays in an area. The camera finds it there again, and the next transfer gives it a
/// new number.
void LedgerTables::delete_piece(std::int64_t piece) {
  execute(database_, "DELETE FROM piece WHERE cell = $1 AND number = $2", cell_.name, piece);
}

std::string LedgerTables::state_of(std::int64_t piece) {
  Statement row(database_, "SELECT state FROM piece WHERE cell = $1 AND number = $2", cell_.name, piece);
  return row.next() ? row.text(0) : std::string();
}

std::vector<std::int64_t> LedgerTables::numbers_at(const std::string& place, std::string_view state) {
  Statement row(database_, "SELECT number FROM piece WHERE cell = $1 AND place = $2 AND state = $3",
                cell_.name, place, state);
  std::vector<std::int64_t> all;
  while (row.next()) all.push_back(row.integer(0));
  return all;
}

void LedgerTables::write_word(std::int64_t piece, TransferStep step, const Corbot::Spot& spot,
                              const std::string& note) {
  Corbot::TransferInfo word;
  word.piece = static_cast<Corbot::PieceNumber>(piece);
  word.source = word.target = spot;
  const std::int64_t event = write_event(word, step, note);
  if (step == Corbot::StepGone) {
    execute(database_,
            "UPDATE piece SET state = 'gone', place = NULL, slot = NULL WHERE cell = $1 AND number = $2",
            cell_.name, piece);
  } else if (step == Corbot::StepPlaced) {
    put_piece(piece, "stands", spot, event);
  } else {
    delete_piece(piece);
  }
}

Corbot::Spot LedgerTables::spot_of_piece(std::int64_t piece) {
  Statement row(database_, "SELECT place, slot, x, y, z, yaw FROM piece WHERE cell = $1 AND number = $2",
                cell_.name, piece);
  if (!row.next()) throw DatabaseError("the ledger has no such piece");
  return spot_in(row, 0);
}

std::map<std::string, CORBA::ULong> LedgerTables::counts(const char* sql) {
  Statement row(database_, sql, cell_.name);
  std::map<std::string, CORBA::ULong> all;
  while (row.next()) all[row.text(0)] = static_cast<CORBA::ULong>(row.integer(1));
  return all;
}

std::map<std::string, CORBA::ULong> LedgerTables::standing() {
  return counts("SELECT place, COUNT(*) FROM piece WHERE cell = $1 AND state = 'stands' GROUP BY place");
}

std::map<std::string, CORBA::ULong> LedgerTables::reserved() {
  return counts("SELECT to_place, COUNT(*) FROM transfer WHERE cell = $1 GROUP BY to_place");
}

Corbot::PieceEvents LedgerTables::events(std::int64_t piece, std::int64_t after, int most) {
  Statement row(database_,
                (kSelectEvents + " WHERE e.cell = $1 AND e.number > $2 AND ($3 = 0 OR e.piece = $3)"
                                 " ORDER BY e.number LIMIT $4")
                    .c_str(),
                cell_.name, after, piece, most);
  return events_in(row);
}

Corbot::PieceEvents LedgerTables::unclear(int most) {
  Statement row(database_,
                (kSelectEvents + " WHERE e.cell = $1 AND e.number = p.arrived AND p.state = 'unclear'"
                                 " ORDER BY e.number LIMIT $2")
                    .c_str(),
                cell_.name, most);
  return events_in(row);
}

Corbot::PieceEvents LedgerTables::events_in(Statement& row) {
  Corbot::PieceEvents all;
  while (row.next()) {
    Corbot::PieceEvent& event = append(all);
    event.number = static_cast<CORBA::ULongLong>(row.integer(0));
    event.time = row.number(1);
    event.piece = static_cast<Corbot::PieceNumber>(row.integer(2));
    event.kind = row.text(3).c_str();
    event.robot = row.text(4).c_str();
    event.step = step_named(row.text(5));
    event.note = row.text(6).c_str();
    event.where = spot_in(row, 7);
  }
  return all;
}

}  // namespace corbot::cell
