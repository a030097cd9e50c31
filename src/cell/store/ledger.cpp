// SPDX-License-Identifier: Apache-2.0
#include "cell/store/ledger.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "cell/store/ledger_file.h"
#include "cell/wall_clock.h"

namespace corbot::cell {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using Corbot::TransferStep;

constexpr double kLongestWait_s = 30;
constexpr auto kRetryPeriod = 200ms;
constexpr std::size_t kLongestWho = 64;
constexpr std::size_t kLongestNote = 200;
constexpr int kMostEvents = 500;

bool is_allowed(TransferStep from, TransferStep to) {
  switch (from) {
    case Corbot::StepReserved:
      return to == Corbot::StepPicking || to == Corbot::StepWithdrawn;
    case Corbot::StepPicking:
      return to == Corbot::StepHeld || to == Corbot::StepWithdrawn || to == Corbot::StepUnclear;
    case Corbot::StepHeld:
      return to == Corbot::StepPlacing || to == Corbot::StepUnclear;
    case Corbot::StepPlacing:
      return to == Corbot::StepPlaced || to == Corbot::StepHeld || to == Corbot::StepUnclear;
    default:
      return false;
  }
}

/// Converts an IDL number to the database's type. A number that does not fit becomes the largest one, which
/// no row of the ledger has.
std::int64_t stored(unsigned long long number) {
  constexpr auto kMost = std::numeric_limits<std::int64_t>::max();
  return number > static_cast<unsigned long long>(kMost) ? kMost : static_cast<std::int64_t>(number);
}

/// Returns a BadParameter. The value is the argument's number, or the length of a text argument.
Corbot::BadParameter bad(const char* argument, double value, const std::string& reason) {
  return {argument, value, reason.c_str()};
}

Corbot::BadParameter unknown(const char* argument, const std::string& name, const std::string& cell) {
  const std::string shown =
      is_name(name) ? "'" + name + "'" : "a text that is no name";  // no unprintable text in the reply
  return bad(argument, static_cast<double>(name.size()),
             fmt::format("{} is no {} of cell '{}'", shown,
                         std::string_view(argument) == "robot" ? "robot" : "place", cell));
}

void check_text(const char* argument, const std::string& text, std::size_t least, std::size_t most) {
  const bool is_printable =
      std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; });
  if (!is_printable || text.size() < least || text.size() > most)
    throw bad(argument, static_cast<double>(text.size()),
              fmt::format("must be {} to {} printable ASCII characters", least, most));
}

void check_timeout(double timeout_s) {
  if (!(timeout_s >= 0 && timeout_s <= kLongestWait_s))
    throw bad("timeout", timeout_s, fmt::format("must be from 0 to {} s", kLongestWait_s));
}

void check_sightings(const Corbot::Sightings& seen) {
  for (CORBA::ULong i = 0; i < seen.length(); ++i) {
    for (const double value : {seen[i].position.x, seen[i].position.y, seen[i].position.z, seen[i].yaw})
      if (!std::isfinite(value)) throw bad("seen", value, fmt::format("sighting {} is no position", i));
    if (!(seen[i].confidence >= 0 && seen[i].confidence <= 1))
      throw bad("seen", seen[i].confidence,
                fmt::format("the confidence of sighting {} must be from 0 to 1", i));
  }
}

}  // namespace

/// A position in the queue for a zone.
class Ledger::Turn {
 public:
  Turn(Ledger& ledger, Corbot::ClaimToken token, const std::string& place) : ledger_(ledger) {
    const std::lock_guard lock(ledger_.mutex_);
    waiter_ = ledger_.waiters_.insert(ledger_.waiters_.end(), {place, ledger_.robot_of(token)});
  }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;
  ~Turn() {
    const std::lock_guard lock(ledger_.mutex_);
    ledger_.waiters_.erase(waiter_);
    ledger_.changed_.notify_all();
  }

 private:
  Ledger& ledger_;
  std::list<Waiter>::iterator waiter_;
};

Ledger::Ledger(CellConfig cell, ZoneCheck zone_check)
    : cell_(std::move(cell)),
      zone_check_(zone_check),
      database_(open_ledger(cell_)),
      tables_(database_, cell_) {}

std::size_t Ledger::waiting() {
  const std::lock_guard lock(mutex_);
  return waiters_.size();
}

void Ledger::end_waiting() {
  const std::lock_guard lock(mutex_);
  is_ending_ = true;
  changed_.notify_all();
}

/// Carries out `body` in one transaction, which locks the cell first. Repeats it until the time-out while it
/// throws Empty, Full or Occupied.
void Ledger::transact(double timeout_s, const std::function<void()>& body) {
  const auto deadline =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(timeout_s));
  std::unique_lock lock(mutex_);
  for (;;) {
    const bool is_last = is_ending_ || Clock::now() >= deadline;
    try {
      Transaction transaction(database_);
      tables_.lock();
      body();
      transaction.commit();
      changed_.notify_all();
      return;
    } catch (const Corbot::Empty&) {
      if (is_last) throw;
    } catch (const Corbot::Full&) {
      if (is_last) throw;
    } catch (const Corbot::Occupied&) {
      if (is_last) throw;
    }
    changed_.wait_until(lock, std::min(deadline, Clock::now() + kRetryPeriod));
  }
}

const Place& Ledger::known_place(const char* argument, const std::string& name) const {
  const Place* place = cell_.place(name);
  if (place == nullptr) throw unknown(argument, name, cell_.name);
  return *place;
}

const Place& Ledger::shared_place(const std::string& name) const {
  const Place& place = known_place("place", name);
  if (!place.is_shared) throw bad("place", static_cast<double>(name.size()), "has no zone: it is not shared");
  return place;
}

std::string Ledger::robot_of(Corbot::ClaimToken token) {
  const auto row = tables_.token(stored(token));
  if (!row || cell_.robot(row->robot) == nullptr) throw Corbot::Superseded(token, 0);
  const auto present = static_cast<Corbot::ClaimToken>(row->present);
  if (present != token) throw Corbot::Superseded(token, present);
  return row->robot;
}

std::optional<Corbot::TransferInfo> Ledger::transfer_of(const std::string& robot) {
  const Corbot::TransferInfos found = tables_.transfers(robot);
  return found.length() == 0 ? std::nullopt : std::optional<Corbot::TransferInfo>(found[0]);
}

Corbot::ClaimToken Ledger::claim(const std::string& robot, const std::string& who,
                                 Corbot::ClaimToken replaces) {
  if (cell_.robot(robot) == nullptr) throw unknown("robot", robot, cell_.name);
  check_text("who", who, 1, kLongestWho);
  std::int64_t token = 0;
  transact(0, [&] {
    const auto present = tables_.claim_of(robot);
    if (present && present->token != stored(replaces))
      throw Corbot::Claimed(robot.c_str(), present->who.c_str(),
                            static_cast<Corbot::ClaimToken>(present->token), present->since);
    tables_.end_claim_of(robot);
    token = tables_.insert_claim(robot, who);
  });
  return static_cast<Corbot::ClaimToken>(token);
}

void Ledger::release(Corbot::ClaimToken token) {
  transact(0, [&] {
    const auto row = tables_.token(stored(token));
    if (row && row->present == 0) return;  // repeated call
    tables_.end_claim_of(robot_of(token));
  });
}

Corbot::TransferInfo Ledger::reserve(Corbot::ClaimToken token, const std::string& from, const std::string& to,
                                     const Corbot::Sightings& seen, double timeout_s) {
  const Place& source = known_place("from", from);
  const Place& target = known_place("to", to);
  if (!target.slots || from == to)
    throw bad("to", static_cast<double>(to.size()), "must be a place with slots, and another one than from");
  check_sightings(seen);
  check_timeout(timeout_s);
  std::optional<Corbot::TransferInfo> transfer;
  transact(timeout_s, [&] {
    const std::string robot = robot_of(token);
    transfer = transfer_of(robot);
    if (!transfer) {
      begin_transfer(robot, source, target, seen);
      transfer = transfer_of(robot);
    } else if (transfer->step != Corbot::StepReserved || from != transfer->source.place.in() ||
               to != transfer->target.place.in()) {
      throw Corbot::WrongStep(transfer->step, Corbot::StepReserved);
    }
  });
  return *transfer;
}

void Ledger::begin_transfer(const std::string& robot, const Place& from, const Place& to,
                            const Corbot::Sightings& seen) {
  const Eigen::Vector3d base = cell_.robot(robot)->frame.position_m;
  const std::set<int> taken = tables_.slots_taken(to.name);
  std::vector<Candidate> pieces =
      from.slots ? tables_.pieces_at(from.name) : untaken(cell_, from, seen, tables_.spots_in(from.name));
  std::erase_if(pieces, [&](const Candidate& piece) { return !to.takes(piece.kind); });
  if (pieces.empty()) throw Corbot::Empty(from.name.c_str());
  std::erase_if(pieces, [&](const Candidate& piece) { return !farthest_slot(to, taken, piece.kind, base); });
  if (pieces.empty()) throw Corbot::Full(to.name.c_str(), static_cast<CORBA::ULong>(to.slots->count()));
  const Candidate piece = from.slots ? *nearest_piece(pieces, base) : pieces.front();
  tables_.insert_transfer(robot, piece, from.name, to.name, *farthest_slot(to, taken, piece.kind, base));
}

void Ledger::advance(Corbot::ClaimToken token, Corbot::PieceNumber piece, TransferStep step,
                     const std::string& note) {
  check_text("note", note, 0, kLongestNote);
  transact(0, [&] {
    const std::string robot = robot_of(token);
    if (tables_.is_last_event(stored(piece), robot, step)) return;  // repeated call
    const auto transfer = transfer_of(robot);
    if (!transfer) throw Corbot::WrongStep(Corbot::StepPlaced, step);
    if (transfer->piece != piece)
      throw bad("piece", static_cast<double>(piece),
                fmt::format("the transfer of the robot is of piece {}", transfer->piece));
    if (!is_allowed(transfer->step, step)) throw Corbot::WrongStep(transfer->step, step);
    if (step == Corbot::StepPicking || step == Corbot::StepPlacing)
      check_zone(robot, spot_of(*transfer, step).place.in());
    tables_.write_step(*transfer, step, note);
  });
}

void Ledger::check_zone(const std::string& robot, const std::string& place) {
  if (zone_check_ == ZoneCheck::kOff || !cell_.place(place)->is_shared) return;
  const auto zone = tables_.zone(place);
  if (!zone) throw Corbot::Occupied(place.c_str(), "", 0);
  if (zone->robot != robot) throw Corbot::Occupied(place.c_str(), zone->robot.c_str(), zone->since);
}

void Ledger::enter(Corbot::ClaimToken token, const std::string& place, double timeout_s) {
  (void)shared_place(place);
  check_timeout(timeout_s);
  const Turn turn(*this, token, place);
  transact(timeout_s, [&] {
    const std::string robot = robot_of(token);
    const auto zone = tables_.zone(place);
    if (zone_check_ == ZoneCheck::kOff || (zone && zone->robot == robot)) return;  // a repeated call
    if (zone) throw Corbot::Occupied(place.c_str(), zone->robot.c_str(), zone->since);
    const auto first = std::find_if(waiters_.begin(), waiters_.end(),
                                    [&](const Waiter& waiter) { return waiter.place == place; });
    if (first->robot != robot) throw Corbot::Occupied(place.c_str(), first->robot.c_str(), now_s());
    tables_.insert_zone(place, robot);
  });
}

void Ledger::leave(Corbot::ClaimToken token, const std::string& place) {
  (void)shared_place(place);
  transact(0, [&] { tables_.delete_zone(place, robot_of(token)); });
}

/// Returns the spot of a free slot, or of an area.
Corbot::Spot Ledger::spot_in(const Place& place, int slot) {
  Corbot::Spot spot;
  spot.place = place.name.c_str();
  spot.slot = slot;
  spot.yaw = 0;
  Eigen::Vector3d position = place.frame.position_m;
  if (place.slots) {
    const int count = place.slots->count();
    if (slot < 0 || slot >= count)
      throw bad("slot", slot, fmt::format("must be 0 to {} at {}", count - 1, place.name));
    if (tables_.slots_taken(place.name).count(slot) > 0)
      throw Corbot::Full(place.name.c_str(), static_cast<CORBA::ULong>(count));
    position = place.slot_position(slot);
  } else if (slot != -1) {
    throw bad("slot", slot, fmt::format("{} is an area, which has no slots", place.name));
  }
  spot.position = {position.x(), position.y(), position.z()};
  return spot;
}

void Ledger::resolve(Corbot::PieceNumber piece, const std::string& place, int slot, const std::string& who) {
  const Place* const to = place.empty() ? nullptr : &known_place("place", place);
  check_text("who", who, 1, kLongestWho);
  const std::int64_t number = stored(piece);
  transact(0, [&] {
    const std::string state = tables_.state_of(number);
    if (state == "gone" && to == nullptr) return;  // repeated call
    if (state == "stands" && to != nullptr && to->slots) {
      const Corbot::Spot spot = tables_.spot_of_piece(number);
      if (place == spot.place.in() && slot == spot.slot) return;  // repeated call
    }
    if (state != "unclear")
      throw bad("piece", static_cast<double>(piece),
                state.empty() ? "is not in the ledger" : fmt::format("is not unclear: it is '{}'", state));
    const Corbot::Spot was = tables_.spot_of_piece(number);
    const std::string note = "by " + who;
    if (to == nullptr) return tables_.write_word(number, Corbot::StepGone, was, note);
    if (place == was.place.in() && slot == was.slot && to->slots)  // the piece itself blocks this slot
      return tables_.write_word(number, Corbot::StepPlaced, was, note);
    tables_.write_word(number, to->slots ? Corbot::StepPlaced : Corbot::StepWithdrawn, spot_in(*to, slot),
                       note);
  });
}

void Ledger::check_unused(const std::string& place) {
  if (const auto zone = tables_.zone(place))
    throw Corbot::Occupied(place.c_str(), zone->robot.c_str(), zone->since);
  const Corbot::TransferInfos all = tables_.transfers("");
  for (CORBA::ULong i = 0; i < all.length(); ++i) {
    const bool takes = all[i].step == Corbot::StepReserved || all[i].step == Corbot::StepPicking;
    if ((takes && place == all[i].source.place.in()) || place == all[i].target.place.in())
      throw Corbot::Occupied(place.c_str(), all[i].robot.in(), all[i].since);
  }
  if (const auto unclear = tables_.numbers_at(place, "unclear"); !unclear.empty())
    throw bad("place", static_cast<double>(unclear[0]),
              fmt::format("piece {} is unclear: say by Resolve, or 'corbot cell resolve', where it is",
                          unclear[0]));
}

void Ledger::exchange(const std::string& place, const std::string& who) {
  (void)known_place("place", place);
  check_text("who", who, 1, kLongestWho);
  transact(0, [&] {
    check_unused(place);
    for (const std::int64_t piece : tables_.numbers_at(place, "stands"))
      tables_.write_word(piece, Corbot::StepGone, tables_.spot_of_piece(piece), "exchanged by " + who);
  });
}

Corbot::PlaceInfos Ledger::places() {
  const std::lock_guard lock(mutex_);
  const Transaction reads(database_);
  auto standing = tables_.standing();
  auto reserved = tables_.reserved();
  Corbot::PlaceInfos all;
  all.length(static_cast<CORBA::ULong>(cell_.places.size()));
  for (CORBA::ULong i = 0; i < all.length(); ++i) {
    const Place& place = cell_.places[i];
    const ZoneRow zone = tables_.zone(place.name).value_or(ZoneRow{});
    all[i].name = place.name.c_str();
    all[i].capacity = static_cast<CORBA::ULong>(place.slots ? place.slots->count() : 0);
    all[i].pieces = standing[place.name];
    all[i].reserved = reserved[place.name];
    all[i].shared = place.is_shared;
    all[i].robot = zone.robot.c_str();
    all[i].since = zone.since;
  }
  return all;
}

Corbot::TransferInfos Ledger::transfers() {
  const std::lock_guard lock(mutex_);
  return tables_.transfers("");
}

Corbot::PieceEvents Ledger::history(Corbot::PieceNumber piece, unsigned long long after) {
  const std::lock_guard lock(mutex_);
  return tables_.events(stored(piece), stored(after), kMostEvents);
}

Corbot::PieceEvents Ledger::unclear() {
  const std::lock_guard lock(mutex_);
  return tables_.unclear(kMostEvents);
}

}  // namespace corbot::cell
