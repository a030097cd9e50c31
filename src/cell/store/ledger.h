// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <functional>
#include <list>
#include <mutex>
#include <optional>
#include <string>

#include "cell.hh"
#include "cell/cell_config.h"
#include "cell/store/database.h"
#include "cell/store/ledger_tables.h"

namespace corbot::cell {

/// Selects the check of zones. With kOff zones keep no robot out, and a robot may pick and place without a
/// zone. Only tests use kOff.
enum class ZoneCheck { kOn, kOff };

/// Implements the rules of the interface Store over one ledger; idl/cell.idl describes each call. Units are
/// metres, degrees, and seconds since the Unix epoch; time-outs are in seconds. Throws the exceptions of the
/// IDL, and DatabaseError; a failed call changes nothing. Any number of threads may use it. A waiting call
/// retries after each change in this process, and every 200 ms for changes by other processes.
///
/// Repeated calls: Claim throws Claimed with the caller's own `who` and the token of the first call. Release,
/// Enter and Leave return. Reserve returns the transfer while its step is StepReserved. Advance returns if
/// the piece's last event is that step of that robot; the steps that end a transfer are included. Resolve
/// returns if the piece is already as the call states. Every call with a token needs the robot's current
/// token. The exception is a repeated Release while no other claim of the robot exists.
class Ledger {
 public:
  /// Opens the cell's ledger. Throws as open_ledger() does.
  explicit Ledger(CellConfig cell, ZoneCheck zone_check = ZoneCheck::kOn);

  Corbot::ClaimToken claim(const std::string& robot, const std::string& who, Corbot::ClaimToken replaces);
  void release(Corbot::ClaimToken token);
  Corbot::TransferInfo reserve(Corbot::ClaimToken token, const std::string& from, const std::string& to,
                               const Corbot::Sightings& seen, double timeout_s);
  /// Writes a step. StepPicking and StepPlacing need the zone. Outcomes need no zone, since they are facts.
  void advance(Corbot::ClaimToken token, Corbot::PieceNumber piece, Corbot::TransferStep step,
               const std::string& note);
  void enter(Corbot::ClaimToken token, const std::string& place, double timeout_s);
  void leave(Corbot::ClaimToken token, const std::string& place);

  void resolve(Corbot::PieceNumber piece, const std::string& place, int slot, const std::string& who);
  void exchange(const std::string& place, const std::string& who);

  [[nodiscard]] Corbot::PlaceInfos places();
  [[nodiscard]] Corbot::TransferInfos transfers();
  [[nodiscard]] Corbot::PieceEvents history(Corbot::PieceNumber piece, unsigned long long after);
  [[nodiscard]] Corbot::PieceEvents unclear();

  /// Returns the number of waiting calls of enter().
  [[nodiscard]] std::size_t waiting();
  /// Ends all waits for the end of the program. No call waits afterwards.
  void end_waiting();

 private:
  class Turn;
  struct Waiter {
    std::string place;
    std::string robot;
  };

  void transact(double timeout_s, const std::function<void()>& body);
  [[nodiscard]] const Place& known_place(const char* argument, const std::string& name) const;
  [[nodiscard]] const Place& shared_place(const std::string& name) const;

  // The functions require a locked mutex_.
  [[nodiscard]] std::string robot_of(Corbot::ClaimToken token);
  [[nodiscard]] std::optional<Corbot::TransferInfo> transfer_of(const std::string& robot);
  void begin_transfer(const std::string& robot, const Place& from, const Place& to,
                      const Corbot::Sightings& seen);
  void check_zone(const std::string& robot, const std::string& place);
  [[nodiscard]] Corbot::Spot spot_in(const Place& place, int slot);
  void check_unused(const std::string& place);

  const CellConfig cell_;
  const ZoneCheck zone_check_;
  std::mutex mutex_;  ///< guards the following members
  std::condition_variable changed_;
  Database database_;
  LedgerTables tables_;
  std::list<Waiter> waiters_;  ///< for zones, first come first served
  bool is_ending_{false};
};

}  // namespace corbot::cell
