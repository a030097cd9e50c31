// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cell.hh"
#include "cell/cell_config.h"
#include "cell/store/database.h"
#include "cell/store/selection.h"

namespace corbot::cell {

/// A robot in a zone.
struct ZoneRow {
  std::string robot;
  double since{};
};
/// A claim that has not ended.
struct ClaimRow {
  std::int64_t token{};
  std::string who;
  double since{};
};
/// The robot of a claim, and the robot's present claim: 0 where there is none.
struct TokenRow {
  std::string robot;
  std::int64_t present{};
};

/// The rows of one cell's ledger, without the rules. Metres, degrees, seconds since the Unix epoch. Throws
/// DatabaseError.
class LedgerTables {
 public:
  /// `database` and `cell` must outlive it.
  LedgerTables(Database& database, const CellConfig& cell) : database_(database), cell_(cell) {}

  /// Waits for other processes' transactions, and keeps theirs out until this one ends.
  void lock();

  [[nodiscard]] std::optional<TokenRow> token(std::int64_t token);
  [[nodiscard]] std::optional<ClaimRow> claim_of(const std::string& robot);
  void end_claim_of(const std::string& robot);
  /// Returns the new claim's token.
  std::int64_t insert_claim(const std::string& robot, const std::string& who);

  [[nodiscard]] std::optional<ZoneRow> zone(const std::string& place);
  void insert_zone(const std::string& place, const std::string& robot);
  void delete_zone(const std::string& place, const std::string& robot);

  /// Transfers in the order of the robots' names; an empty `robot` means all.
  [[nodiscard]] Corbot::TransferInfos transfers(const std::string& robot);
  /// Pieces that stand at a place and that no transfer takes.
  [[nodiscard]] std::vector<Candidate> pieces_at(const std::string& place);
  /// Where pieces of the ledger stand in an area, or stood that a transfer has taken from there.
  [[nodiscard]] std::vector<Eigen::Vector3d> spots_in(const std::string& area);
  /// Slots with a piece, and slots to which a transfer goes.
  [[nodiscard]] std::set<int> slots_taken(const std::string& place);

  /// Gives a number to a piece that has none, and writes transfer and event.
  void insert_transfer(const std::string& robot, Candidate piece, const std::string& from,
                       const std::string& to, int to_slot);
  /// Whether the last event of a piece is this step by this robot.
  [[nodiscard]] bool is_last_event(std::int64_t piece, const std::string& robot, Corbot::TransferStep step);
  /// Writes the transfer's next step, the piece's place after it, and the event.
  void write_step(const Corbot::TransferInfo& transfer, Corbot::TransferStep step, const std::string& note);

  /// "stands", "held", "unclear" or "gone"; empty: the ledger does not have the piece.
  [[nodiscard]] std::string state_of(std::int64_t piece);
  [[nodiscard]] Corbot::Spot spot_of_piece(std::int64_t piece);
  [[nodiscard]] std::vector<std::int64_t> numbers_at(const std::string& place, std::string_view state);
  /// Writes a person's word: StepPlaced, the piece stands at that spot; StepWithdrawn, it lies in that area; StepGone.
  void write_word(std::int64_t piece, Corbot::TransferStep step, const Corbot::Spot& spot,
                  const std::string& note);

  /// Pieces that stand, by place; transfers, by target.
  [[nodiscard]] std::map<std::string, CORBA::ULong> standing();
  [[nodiscard]] std::map<std::string, CORBA::ULong> reserved();
  [[nodiscard]] Corbot::PieceEvents events(std::int64_t piece, std::int64_t after, int most);
  /// The event that made each piece unclear which still is.
  [[nodiscard]] Corbot::PieceEvents unclear(int most);

 private:
  std::int64_t next_number(const char* sql);
  [[nodiscard]] static Corbot::PieceEvents events_in(Statement& row);
  void delete_piece(std::int64_t piece);
  [[nodiscard]] std::map<std::string, CORBA::ULong> counts(const char* sql);
  std::int64_t write_event(const Corbot::TransferInfo& transfer, Corbot::TransferStep step,
                           const std::string& note);
  void put_piece(std::int64_t piece, std::string_view state, const Corbot::Spot& spot, std::int64_t event);

  Database& database_;
  const CellConfig& cell_;
};

/// Where a step of a transfer takes place: at the target from placing on, at the source before.
[[nodiscard]] const Corbot::Spot& spot_of(const Corbot::TransferInfo& transfer, Corbot::TransferStep step);

}  // namespace corbot::cell
