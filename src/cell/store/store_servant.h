// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cell.hh"
#include "cell/store/ledger.h"

namespace corbot::cell {

/// Implements Corbot::Store over the ledger. If the database fails, calls throw NotReady, and reads of
/// attributes throw TRANSIENT. The log has the cause.
class StoreServant : public POA_Corbot::Store {
 public:
  /// `ledger` must outlive the servant.
  explicit StoreServant(Ledger& ledger) : ledger_(ledger) {}

  Corbot::ClaimToken Claim(const char* robot, const char* who, Corbot::ClaimToken replaces) override;
  void Release(Corbot::ClaimToken token) override;
  Corbot::TransferInfo* Reserve(Corbot::ClaimToken token, const char* from, const char* to,
                                const Corbot::Sightings& seen, CORBA::Double timeout) override;
  void Advance(Corbot::ClaimToken token, Corbot::PieceNumber piece, Corbot::TransferStep step,
               const char* note) override;
  void Enter(Corbot::ClaimToken token, const char* place, CORBA::Double timeout) override;
  void Leave(Corbot::ClaimToken token, const char* place) override;
  void Resolve(Corbot::PieceNumber piece, const char* place, CORBA::Long slot, const char* who) override;
  void Exchange(const char* place, const char* who) override;
  Corbot::PlaceInfos* Places() override;
  Corbot::TransferInfos* Transfers() override;
  Corbot::PieceEvents* Unclear() override;
  Corbot::PieceEvents* History(Corbot::PieceNumber piece, CORBA::ULongLong after) override;

 private:
  Ledger& ledger_;
};

}  // namespace corbot::cell
