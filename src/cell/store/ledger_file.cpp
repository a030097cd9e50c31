// SPDX-License-Identifier: Apache-2.0
#include "cell/store/ledger_file.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <cstdint>
#include <utility>

#include "cell/wall_clock.h"
#include "client/failure.h"

namespace corbot::cell {
namespace {

using client::ExitCode;
using client::Failure;

constexpr int kSchema = 2;
constexpr int kOldestSchema = 1;

// SQLite and PostgreSQL both accept these statements. An ended claim keeps its row, so that its token still
// identifies the robot. A piece is in exactly one place. x, y, z and yaw of a held or gone piece keep its
// last spot. `arrived` is the number of the event that brought the piece there. A NULL slot means an area.
constexpr const char* kPieceColumns =
    R"sql((cell TEXT NOT NULL REFERENCES cell, number BIGINT NOT NULL, kind TEXT NOT NULL,
  state TEXT NOT NULL CHECK (state IN ('stands','held','unclear','gone')), robot TEXT,
  place TEXT, slot INTEGER,
  x DOUBLE PRECISION NOT NULL, y DOUBLE PRECISION NOT NULL, z DOUBLE PRECISION NOT NULL,
  yaw DOUBLE PRECISION NOT NULL, arrived BIGINT NOT NULL, PRIMARY KEY (cell, number),
  UNIQUE (cell, place, slot), UNIQUE (cell, robot),
  CHECK ((state = 'held') = (robot IS NOT NULL)),
  CHECK ((state IN ('stands','unclear')) = (place IS NOT NULL))))sql";
constexpr const char* kTables = R"sql(
CREATE TABLE cell (name TEXT PRIMARY KEY, schema INTEGER NOT NULL, revision BIGINT NOT NULL,
  pieces BIGINT NOT NULL, events BIGINT NOT NULL, tokens BIGINT NOT NULL);
CREATE TABLE claim (cell TEXT NOT NULL REFERENCES cell, token BIGINT NOT NULL, robot TEXT NOT NULL,
  who TEXT NOT NULL, since DOUBLE PRECISION NOT NULL, ended INTEGER NOT NULL, PRIMARY KEY (cell, token));
CREATE UNIQUE INDEX present_claim ON claim (cell, robot) WHERE ended = 0;
CREATE TABLE zone (cell TEXT NOT NULL REFERENCES cell, place TEXT NOT NULL, robot TEXT NOT NULL,
  since DOUBLE PRECISION NOT NULL, PRIMARY KEY (cell, place));
CREATE TABLE transfer (cell TEXT NOT NULL REFERENCES cell, robot TEXT NOT NULL, piece BIGINT NOT NULL,
  step TEXT NOT NULL CHECK (step IN ('reserved','picking','held','placing')),
  from_place TEXT NOT NULL, from_slot INTEGER, to_place TEXT NOT NULL, to_slot INTEGER NOT NULL,
  since DOUBLE PRECISION NOT NULL, PRIMARY KEY (cell, robot), UNIQUE (cell, piece),
  UNIQUE (cell, to_place, to_slot), FOREIGN KEY (cell, piece) REFERENCES piece);
CREATE TABLE event (cell TEXT NOT NULL REFERENCES cell, number BIGINT NOT NULL,
  time DOUBLE PRECISION NOT NULL,
  piece BIGINT NOT NULL, robot TEXT NOT NULL, step TEXT NOT NULL, place TEXT NOT NULL, slot INTEGER,
  x DOUBLE PRECISION NOT NULL, y DOUBLE PRECISION NOT NULL, z DOUBLE PRECISION NOT NULL,
  yaw DOUBLE PRECISION NOT NULL, note TEXT NOT NULL, PRIMARY KEY (cell, number));
CREATE INDEX event_of_piece ON event (cell, piece, number);
)sql";

/// Migrates schema 1, which had no state 'gone'. Copies the rows to a table with the new rule and the old
/// name.
void migrate_to_2(Database& database) {
  database.run(
      fmt::format("CREATE TABLE piece_2 {}; INSERT INTO piece_2 SELECT * FROM piece; DROP TABLE piece;"
                  "ALTER TABLE piece_2 RENAME TO piece; UPDATE cell SET schema = 2",
                  kPieceColumns)
          .c_str());
}

Failure refusal(const CellConfig& cell, const std::string& text) {
  return {ExitCode::kUsage,
          fmt::format("{}: {}: name another file in store.ledger, or the state directory of this cell",
                      cell.ledger.string(), text)};
}

/// Returns two integers of a query. The statement ends here, since an open statement would lock its table.
std::pair<std::int64_t, std::int64_t> pair_of(Database& database, const char* sql) {
  Statement row(database, sql);
  row.next();
  return {row.integer(0), row.integer(1)};
}

std::string name_in(Database& database) {
  Statement row(database, "SELECT name FROM cell");
  return row.next() ? row.text(0) : std::string();
}

void make_or_check_tables(Database& database, const CellConfig& cell) {
  const auto [tables, ledgers] =
      pair_of(database, "SELECT COUNT(*), COALESCE(SUM(name = 'cell'), 0) FROM sqlite_master");
  if (tables == 0) {
    database.run(fmt::format("CREATE TABLE piece {}", kPieceColumns).c_str());
    database.run(kTables);
    // A worker may outlive a removed ledger. Tokens start at the time, so that no old token is valid in this
    // one.
    execute(database, "INSERT INTO cell VALUES ($1, $2, 0, 0, 0, $3)", cell.name, kSchema,
            static_cast<std::int64_t>(1e6 * now_s()));
    spdlog::info("{}: a ledger without pieces begins", cell.ledger.string());
    return;
  }
  if (ledgers == 0) throw refusal(cell, "is a database, but no ledger");
  if (const std::string name = name_in(database); name != cell.name)
    throw refusal(cell, fmt::format("is the ledger of cell '{}', not of '{}'", name, cell.name));
  const std::int64_t schema = pair_of(database, "SELECT schema, 0 FROM cell").first;
  if (schema > kSchema || schema < kOldestSchema)
    throw refusal(cell, fmt::format("has schema {}; this program reads schemas {} to {}", schema,
                                    kOldestSchema, kSchema));
  if (schema == 1) migrate_to_2(database);
}

/// Tells if the cell has a spot. A slot of -1 means the whole place.
bool has_spot(const CellConfig& cell, const std::string& name, std::optional<std::int64_t> slot) {
  const Place* place = cell.place(name);
  if (place == nullptr || !slot) return place != nullptr && !place->slots;
  return *slot == -1 || (place->slots && *slot >= 0 && *slot < place->slots->count());
}

/// Throws if the ledger uses places, slots or robots that a changed cell.toml does not have any more.
void check_names(Database& database, const CellConfig& cell) {
  Statement spots(database,
                  "SELECT place, slot FROM piece WHERE cell = $1 AND place IS NOT NULL"
                  " UNION SELECT from_place, from_slot FROM transfer WHERE cell = $1"
                  " UNION SELECT to_place, to_slot FROM transfer WHERE cell = $1"
                  " UNION SELECT place, -1 FROM zone WHERE cell = $1",
                  cell.name);
  while (spots.next()) {
    const auto slot = spots.is_null(1) ? std::nullopt : std::optional(spots.integer(1));
    if (has_spot(cell, spots.text(0), slot)) continue;
    const std::string which = slot && *slot >= 0 ? fmt::format("slot {} of", *slot) : std::string("place");
    throw refusal(cell, fmt::format("uses {} '{}', which the cell does not have", which, spots.text(0)));
  }
  Statement robots(database,
                   "SELECT robot FROM transfer WHERE cell = $1 UNION SELECT robot FROM zone WHERE cell = $1",
                   cell.name);
  while (robots.next()) {
    if (cell.robot(robots.text(0)) == nullptr)
      throw refusal(cell, fmt::format("uses robot '{}', which the cell does not have", robots.text(0)));
  }
}

}  // namespace

Database open_ledger(const CellConfig& cell) {
  Database database(cell.ledger);
  // A migration drops a table to which rows of other tables refer.
  database.run("PRAGMA foreign_keys = OFF");
  database.run("BEGIN IMMEDIATE");  // two processes may create the same ledger
  make_or_check_tables(database, cell);
  check_names(database, cell);
  if (Statement(database, "PRAGMA foreign_key_check").next())
    throw refusal(cell, "has rows that refer to missing rows");
  database.run("COMMIT; PRAGMA foreign_keys = ON");
  return database;
}

}  // namespace corbot::cell
