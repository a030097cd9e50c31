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

/// kOff: zones keep no robot out, and a robot may pick and place outside of them. No program uses it, tests do.
enum class ZoneCheck { kOn, kOff };

/// The rules of the interface Store over one ledger; idl/cell.idl describes each call. Metres, degrees,
/// seconds since the Unix epoch; time-outs in seconds. Throws the exceptions of the IDL, and DatabaseError,
/// after which nothing is changed. For any number of threads. A call that waits tries again after each change
/// here, and each 200 ms for changes by other processes.
///
/// A repeated call: Claim raises Claimed with the caller's own `who` and the token that the first call took.
/// Release, Enter and Leave return. Reserve returns the transfer while that is StepReserved. Advance returns
/// where the piece's last event is that step of that robot, the ends included. Resolve returns where the piece is
/// as it says already. Every call first needs a token
/// that is the present one of its robot, except a repeated Release while nothing else has claimed the robot.
class Ledger {
 public:
  /// Throws as open_ledger does.
  explicit Ledger(CellConfig cell, ZoneCheck zone_check = ZoneCheck::kOn);

  Corbot::ClaimToken claim(const std::string& robot, const std::string& who, Corbot::ClaimToken replaces);
  void release(Corbot::ClaimToken token);
  Corbot::TransferInfo reserve(Corbot::ClaimToken token, const std::string& from, const std::string& to,
                               const Corbot::Sightings& seen, double timeout_s);
  /// Picking and placing need the zone. An outcome does not: it has happened, and is always written.
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

  /// Calls of enter() that have not returned.
  [[nodiscard]] std::size_t waiting();
  /// From now on no call waits: the program ends.
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

  // For the holder of the mutex.
  [[nodiscard]] std::string robot_of(Corbot::ClaimToken token);
  [[nodiscard]] std::optional<Corbot::TransferInfo> transfer_of(const std::string& robot);
  void begin_transfer(const std::string& robot, const Place& from, const Place& to,
                      const Corbot::Sightings& seen);
  void check_zone(const std::string& robot, const std::string& place);
  [[nodiscard]] Corbot::Spot spot_in(const Place& place, int slot);
  void check_unused(const std::string& place);

  const CellConfig cell_;
  const ZoneCheck zone_check_;
  std::mutex mutex_;  ///< of all below
  std::condition_variable changed_;
  Database database_;
  LedgerTables tables_;
  std::list<Waiter> waiters_;  ///< for zones, first come first served
  bool is_ending_{false};
};

}  // namespace corbot::cell
