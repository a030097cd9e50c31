// SPDX-License-Identifier: Apache-2.0
#include "cell/store/store_servant.h"

#include <spdlog/spdlog.h>

namespace corbot::cell {
namespace {

/// Translates a DatabaseError to NotReady. The database's text contains paths, so it goes to the log only.
template <class Call>
auto or_not_ready(Call call) {
  try {
    return call();
  } catch (const DatabaseError& error) {
    spdlog::error("{}", error.what());
    throw Corbot::NotReady(error.is_full()
                               ? "the ledger's database failed, nothing was changed: its disk is full"
                               : "the ledger's database failed, nothing was changed: the cause is in the log "
                                 "of corbot-store");
  }
}

template <class Call>
auto or_transient(Call call) {
  try {
    return call();
  } catch (const DatabaseError& error) {
    spdlog::error("{}", error.what());
    throw CORBA::TRANSIENT(0, CORBA::COMPLETED_NO);
  }
}

}  // namespace

Corbot::ClaimToken StoreServant::Claim(const char* robot, const char* who, Corbot::ClaimToken replaces) {
  return or_not_ready([&] { return ledger_.claim(robot, who, replaces); });
}

void StoreServant::Release(Corbot::ClaimToken token) {
  or_not_ready([&] { ledger_.release(token); });
}

Corbot::TransferInfo* StoreServant::Reserve(Corbot::ClaimToken token, const char* from, const char* to,
                                            const Corbot::Sightings& seen, CORBA::Double timeout) {
  return or_not_ready(
      [&] { return new Corbot::TransferInfo(ledger_.reserve(token, from, to, seen, timeout)); });
}

void StoreServant::Advance(Corbot::ClaimToken token, Corbot::PieceNumber piece, Corbot::TransferStep step,
                           const char* note) {
  or_not_ready([&] { ledger_.advance(token, piece, step, note); });
}

void StoreServant::Enter(Corbot::ClaimToken token, const char* place, CORBA::Double timeout) {
  or_not_ready([&] { ledger_.enter(token, place, timeout); });
}

void StoreServant::Leave(Corbot::ClaimToken token, const char* place) {
  or_not_ready([&] { ledger_.leave(token, place); });
}

void StoreServant::Resolve(Corbot::PieceNumber piece, const char* place, CORBA::Long slot, const char* who) {
  or_not_ready([&] { ledger_.resolve(piece, place, slot, who); });
}

void StoreServant::Exchange(const char* place, const char* who) {
  or_not_ready([&] { ledger_.exchange(place, who); });
}

Corbot::PlaceInfos* StoreServant::Places() {
  return or_transient([&] { return new Corbot::PlaceInfos(ledger_.places()); });
}

Corbot::TransferInfos* StoreServant::Transfers() {
  return or_transient([&] { return new Corbot::TransferInfos(ledger_.transfers()); });
}

Corbot::PieceEvents* StoreServant::Unclear() {
  return or_transient([&] { return new Corbot::PieceEvents(ledger_.unclear()); });
}

Corbot::PieceEvents* StoreServant::History(Corbot::PieceNumber piece, CORBA::ULongLong after) {
  return or_not_ready([&] { return new Corbot::PieceEvents(ledger_.history(piece, after)); });
}

}  // namespace corbot::cell
