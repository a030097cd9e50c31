// SPDX-License-Identifier: Apache-2.0
#include "orb/omniorb/lanes.h"

#include <fmt/format.h>
#include <omniORB4/omniInterceptors.h>
#include <unistd.h>

#include <algorithm>
#include <thread>

#include <arm.hh>

namespace corbot::omni {
namespace {

using namespace std::chrono_literals;

/// Longer than a forward takes to a client on this machine or on its local network.
constexpr auto kForwardDelivery = 1s;
/// Longer than a reply takes from the end of its call to the socket.
constexpr auto kReplyWritten = 5ms;

/// The peer of the request that this thread carries out.
thread_local std::string peer;

CORBA::Boolean note_peer(::omni::omniInterceptors::serverReceiveRequest_T::info_T& info) {
  const char* address = info.peeraddress();
  peer.assign(address != nullptr ? address : "");
  // All peers on Unix sockets have the same address. They are omniORB's: one call a connection,
  // one thread here.
  if (peer.starts_with("giop:unix:")) peer += fmt::format("{}", ::gettid());
  return true;
}

}  // namespace

Lanes::Lanes(std::size_t count) : lanes_(count) {
  ::omniORB::getInterceptors()->serverReceiveRequest.add(note_peer);
}

void Lanes::set_reference(std::size_t lane, CORBA::Object_ptr reference) {
  lanes_.at(lane).reference = CORBA::Object::_duplicate(reference);
}

bool Lanes::idle() const {
  const std::lock_guard lock(mutex_);
  return waiting_ == 0;
}

int Lanes::Lane::held() const {
  return static_cast<int>(std::count_if(connections.begin(), connections.end(),
                                        [](const auto& entry) { return entry.second.waiting > 0; }));
}

Lanes::Call Lanes::start(std::size_t lane) {
  const std::lock_guard lock(mutex_);
  forget_old(lanes_.at(lane));
  Connection& connection = lanes_[lane].connections[peer];
  check_forwarded(connection);
  ++connection.calls;
  return {*this, lane, peer, false};
}

Lanes::Call Lanes::wait(std::size_t lane) {
  std::unique_lock lock(mutex_);
  forget_old(lanes_.at(lane));
  const auto full = [&] { return lanes_[lane].held() >= kConnectionsPerLane; };
  // A reply that overtook another one's would find that other call unanswered.
  if (full() && Clock::now() - lanes_[lane].connections[peer].last_end < kReplyWritten) {
    lock.unlock();
    std::this_thread::sleep_for(kReplyWritten);
    lock.lock();
  }
  Connection& connection = lanes_[lane].connections[peer];
  check_forwarded(connection);
  if (waiting_ >= static_cast<int>(lanes_.size()) * kConnectionsPerLane) refuse();
  if (connection.calls == 0 && full()) forward(connection, lane);
  ++connection.calls;
  ++connection.waiting;
  ++waiting_;
  return {*this, lane, peer, true};
}

void Lanes::leave(std::size_t lane, const std::string& of, bool waits) {
  const std::lock_guard lock(mutex_);
  Connection& connection = lanes_[lane].connections[of];
  --connection.calls;
  connection.last_end = Clock::now();
  if (!waits) return;
  --connection.waiting;
  --waiting_;
}

void Lanes::check_forwarded(const Connection& connection) const {
  if (connection.forwarded == Clock::time_point{}) return;
  if (Clock::now() - connection.forwarded > kForwardDelivery) return;
  throw omniORB::LOCATION_FORWARD(CORBA::Object::_duplicate(lanes_[connection.forwarded_to].reference));
}

void Lanes::forward(Connection& connection, std::size_t lane) {
  for (std::size_t i = 1; i < lanes_.size(); ++i) {
    const std::size_t other = (lane + i) % lanes_.size();
    if (lanes_[other].held() >= kConnectionsPerLane || CORBA::is_nil(lanes_[other].reference)) continue;
    connection.forwarded = Clock::now();
    connection.forwarded_to = other;
    check_forwarded(connection);
  }
  refuse();
}

void Lanes::refuse() const {
  throw Corbot::QueueFull(static_cast<CORBA::Long>(lanes_.size()) * kConnectionsPerLane);
}

/// Connections come and go; what is remembered of one expires after a second.
void Lanes::forget_old(Lane& lane) {
  const auto now = Clock::now();
  std::erase_if(lane.connections, [&](const auto& entry) {
    const Connection& connection = entry.second;
    return connection.calls == 0 && now - connection.last_end > kForwardDelivery &&
           now - connection.forwarded > kForwardDelivery;
  });
}

}  // namespace corbot::omni
