// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cell/coordinator/remote_call.h"

namespace corbot::cell {

/// Corbot::Camera over CORBA.
class RemoteCamera : public CameraPort {
 public:
  /// `look_s`: the longest time that a look is given.
  RemoteCamera(CORBA::ORB_ptr orb, const std::string& uri, double look_s, std::stop_token stop);
  Corbot::Frame look(double timeout_s) override;

 private:
  LazyReference<Corbot::Camera> camera_;
  const std::stop_token stop_;
};

/// Corbot::Store over CORBA. Several threads may use one.
class RemoteStore : public StorePort {
 public:
  RemoteStore(CORBA::ORB_ptr orb, const std::string& uri, std::stop_token stop,
              double patience_s = kPatience_s);
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

 private:
  template <class F>
  auto call(F&& f);

  LazyReference<Corbot::Store> store_;
  const std::stop_token stop_;
  const double patience_s_;
};

}  // namespace corbot::cell
