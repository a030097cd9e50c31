// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cell/coordinator/remote_call.h"

namespace corbot::cell {

/// Time-out of a call of the store; the store may block for 2 s.
inline constexpr double kStoreReply_s = 7;

/// Calls Corbot::Camera over CORBA.
class RemoteCamera : public CameraPort {
 public:
  /// `look_s` is the longest time-out of a look.
  RemoteCamera(CORBA::ORB_ptr orb, const std::string& uri, double look_s, std::stop_token stop);
  Corbot::Frame look(double timeout_s) override;

 private:
  LazyReference<Corbot::Camera> camera_;
  const std::stop_token stop_;
};

/// Calls Corbot::Store over CORBA. Several threads may share an instance. `reply_s` is the time-out of one
/// attempt, which is at most 1 s once a stop is requested.
class RemoteStore : public StorePort {
 public:
  RemoteStore(CORBA::ORB_ptr orb, const std::string& uri, std::stop_token stop,
              double patience_s = kPatience_s, double reply_s = kStoreReply_s);
  Corbot::ClaimToken claim(const std::string& robot, const std::string& who,
                           Corbot::ClaimToken replaces) override;
  void release(Corbot::ClaimToken token) override;
  Corbot::TransferInfo reserve(Corbot::ClaimToken token, const std::string& from, const std::string& to,
                               const Corbot::Sightings& seen, double timeout_s) override;
  void advance(Corbot::ClaimToken token, Corbot::PieceNumber piece, Corbot::TransferStep step,
               const std::string& note) override;
  void enter(Corbot::ClaimToken token, const std::string& place, double timeout_s) override;
  void leave(Corbot::ClaimToken token, const std::string& place) override;
  Corbot::PlaceInfos places() override;
  Corbot::TransferInfos transfers() override;
  Corbot::PieceEvents unclear() override;

 private:
  template <class F>
  auto call(F&& f);

  LazyReference<Corbot::Store> store_;
  LazyReference<Corbot::Store> store_at_stop_;  ///< for calls after a stop was requested
  const std::stop_token stop_;
  const double patience_s_;
};

}  // namespace corbot::cell
