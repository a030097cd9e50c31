// SPDX-License-Identifier: Apache-2.0
#include "cell/coordinator/remote_services.h"

#include <algorithm>
#include <utility>

namespace corbot::cell {

namespace {
constexpr double kServiceReply_s = 5;  // in addition to the time of a look
constexpr double kReplyAtStop_s = 1;   // short, since the supervisor soon kills the process
}  // namespace

RemoteCamera::RemoteCamera(CORBA::ORB_ptr orb, const std::string& uri, double look_s, std::stop_token stop)
    : camera_(orb, uri, look_s + kServiceReply_s), stop_(std::move(stop)) {}

Corbot::Frame RemoteCamera::look(double timeout_s) {
  const Corbot::Frame_var frame =
      call_patiently(camera_.uri(), kPatience_s, stop_, [&] { return camera_.get()->Look(timeout_s); });
  return frame.in();
}

RemoteStore::RemoteStore(CORBA::ORB_ptr orb, const std::string& uri, std::stop_token stop, double patience_s,
                         double reply_s)
    : store_(orb, uri, reply_s),
      store_at_stop_(orb, uri, std::min(reply_s, kReplyAtStop_s)),
      stop_(std::move(stop)),
      patience_s_(patience_s) {}

template <class F>
auto RemoteStore::call(F&& f) {
  return call_patiently(store_.uri(), patience_s_, stop_,
                        [&] { return f((stop_.stop_requested() ? store_at_stop_ : store_).get()); });
}

Corbot::ClaimToken RemoteStore::claim(const std::string& robot, const std::string& who,
                                      Corbot::ClaimToken replaces) {
  return call([&](const auto& store) { return store->Claim(robot.c_str(), who.c_str(), replaces); });
}

void RemoteStore::release(Corbot::ClaimToken token) {
  call([&](const auto& store) { store->Release(token); });
}

Corbot::TransferInfo RemoteStore::reserve(Corbot::ClaimToken token, const std::string& from,
                                          const std::string& to, const Corbot::Sightings& seen,
                                          double timeout_s) {
  const Corbot::TransferInfo_var transfer = call(
      [&](const auto& store) { return store->Reserve(token, from.c_str(), to.c_str(), seen, timeout_s); });
  return transfer.in();
}

void RemoteStore::advance(Corbot::ClaimToken token, Corbot::PieceNumber piece, Corbot::TransferStep step,
                          const std::string& note) {
  call([&](const auto& store) { store->Advance(token, piece, step, note.c_str()); });
}

void RemoteStore::enter(Corbot::ClaimToken token, const std::string& place, double timeout_s) {
  call([&](const auto& store) { store->Enter(token, place.c_str(), timeout_s); });
}

void RemoteStore::leave(Corbot::ClaimToken token, const std::string& place) {
  call([&](const auto& store) { store->Leave(token, place.c_str()); });
}

Corbot::PlaceInfos RemoteStore::places() {
  const Corbot::PlaceInfos_var places = call([](const auto& store) { return store->Places(); });
  return places.in();
}

Corbot::PieceEvents RemoteStore::unclear() {
  const Corbot::PieceEvents_var events = call([](const auto& store) { return store->Unclear(); });
  return events.in();
}

Corbot::TransferInfos RemoteStore::transfers() {
  const Corbot::TransferInfos_var transfers = call([](const auto& store) { return store->Transfers(); });
  return transfers.in();
}

}  // namespace corbot::cell
