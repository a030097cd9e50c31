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
/// The robot of a claim, and the robot's current claim; 0: none.
struct TokenRow {
  std::string robot;
  std::int64_t present{};
};

/// Reads and writes the rows of one cell's ledger, without the rules. Units are metres, degrees, and seconds
/// since the Unix epoch. Throws DatabaseError.
class LedgerTables {
 public:
  /// `database` and `cell` must outlive the instance.
  LedgerTables(Database& database, const CellConfig& cell) : database_(database), cell_(cell) {}

  /// Waits for other processes' transactions, and blocks new ones until this transaction ends.
  void lock();

  [[nodiscard]] std::optional<TokenRow> token(std::int64_t token);
  [[nodiscard]] std::optional<ClaimRow> claim_of(const std::string& robot);
  void end_claim_of(const std::string& robot);
  /// Writes a new claim and returns its token.
  std::int64_t insert_claim(const std::string& robot, const std::string& who);

  [[nodiscard]] std::optional<ZoneRow> zone(const std::string& place);
  void insert_zone(const std::string& place, const std::string& robot);
  void delete_zone(const std::string& place, const std::string& robot);

  /// Returns transfers in the order of the robots' names; an empty `robot` means all.
  [[nodiscard]] Corbot::TransferInfos transfers(const std::string& robot);
  /// Returns the pieces that stand at a place and belong to no transfer.
  [[nodiscard]] std::vector<Candidate> pieces_at(const std::string& place);
  /// Returns the spots of the ledger's pieces in an area, including pieces that a transfer has taken from it.
  [[nodiscard]] std::vector<Eigen::Vector3d> spots_in(const std::string& area);
  /// Returns the slots with a piece or as a transfer's target.
  [[nodiscard]] std::set<int> slots_taken(const std::string& place);

  /// Writes a transfer and its event. Gives a number to a piece without one.
  void insert_transfer(const std::string& robot, Candidate piece, const std::string& from,
                       const std::string& to, int to_slot);
  /// Tells if the last event of a piece is this step by this robot.
  [[nodiscard]] bool is_last_event(std::int64_t piece, const std::string& robot, Corbot::TransferStep step);
  /// Writes the transfer's next step, the piece's new place, and the event.
  void write_step(const Corbot::TransferInfo& transfer, Corbot::TransferStep step, const std::string& note);

  /// Returns "stands", "held", "unclear" or "gone"; empty: the ledger does not have the piece.
  [[nodiscard]] std::string state_of(std::int64_t piece);
  [[nodiscard]] Corbot::Spot spot_of_piece(std::int64_t piece);
  [[nodiscard]] std::vector<std::int64_t> numbers_at(const std::string& place, std::string_view state);
  /// Writes a person's report of a piece: StepPlaced for a slot, StepWithdrawn for an area, StepGone for a
  /// removed piece.
  void write_word(std::int64_t piece, Corbot::TransferStep step, const Corbot::Spot& spot,
                  const std::string& note);

  /// Return the number of standing pieces by place, and the number of transfers by target.
  [[nodiscard]] std::map<std::string, CORBA::ULong> standing();
  [[nodiscard]] std::map<std::string, CORBA::ULong> reserved();
  [[nodiscard]] Corbot::PieceEvents events(std::int64_t piece, std::int64_t after, int most);
  /// Returns, for each unclear piece, the event that made it unclear.
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

/// Returns the spot of a transfer's step: the target from StepPlacing on, otherwise the source.
[[nodiscard]] const Corbot::Spot& spot_of(const Corbot::TransferInfo& transfer, Corbot::TransferStep step);

}  // namespace corbot::cell
