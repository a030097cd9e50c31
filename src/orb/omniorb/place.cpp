// SPDX-License-Identifier: Apache-2.0
#include "orb/omniorb/place.h"

#include <omniORB4/CORBA.h>
#include <omniORB4/omniInterceptors.h>

// These headers need each other in this order.
#include <omniORB4/internal/giopStream.h>

#include <omniORB4/internal/giopStrand.h>

#include <omniORB4/internal/GIOP_S.h>
#include <omniORB4/tcpConnection.h>
#include <omniORB4/unixConnection.h>

#include <arm.hh>
#include <string_view>
#include <utility>

#include "net/arrivals.h"

namespace corbot::omni {
namespace {

/// The request that this thread carries out.
thread_local corbot_connection connection{-1, 0};
thread_local std::uint32_t request = 0;
thread_local corbot_counted_stop counted{};

/// The robot whose stops are counted on arrival. This does not change while the ORB serves.
struct Served {
  corbot_robot* robot{nullptr};
  std::string name;
  std::string control;  ///< prefix of the object keys of exclusive control
};
Served& served() {
  static Served instance;
  return instance;
}

int descriptor_of(::omni::giopConnection* of) {
  if (const auto* tcp = dynamic_cast<const ::omni::tcpConnection*>(of)) return tcp->handle();
  if (const auto* local = dynamic_cast<const ::omni::unixConnection*>(of)) return local->handle();
  return -1;
}

/// Reads the number of the request in its message, which the ORB offers only to its own streams.
struct RequestNumber : ::omni::giopStream {
  static CORBA::ULong of(const ::omni::giopStream& stream) {
    constexpr CORBA::ULong (::omni::giopStream::*kNumber)() const = &RequestNumber::requestId;
    return (stream.*kNumber)();
  }
};

bool is_served(const ::omni::GIOP_S& giop) {
  // the client has sent a whole reference instead; the call itself counts its stop
  if (giop.keysize() <= 0) return false;
  const std::string_view key(reinterpret_cast<const char*>(giop.key()),
                             static_cast<std::size_t>(giop.keysize()));
  return key == served().name || key.starts_with(served().control);
}

/// Counts a Stop. Takes no lock, no memory and no system call.
corbot_counted_stop count_stop(const ::omni::GIOP_S& giop) {
  bool hold = false;
  const char* const operation = giop.operation();
  if (operation == nullptr || !corbot_is_stop(operation, &hold) || !is_served(giop)) return {};
  return corbot_robot_count_stop(served().robot, hold ? 1 : 0);
}

CORBA::Boolean note(::omni::omniInterceptors::serverReceiveRequest_T::info_T& info) {
  counted = count_stop(info.giop_s);  // before the servant's first lock
  connection = corbot_connection_used(descriptor_of(info.giop_s.strand().connection));
  request = RequestNumber::of(info.giop_s);
  return true;
}

int take(corbot_place_kind kind) {
  int capacity = 0;
  const int place = corbot_place_take(kind, connection, &capacity);
  if (place >= 0 || kind == CORBOT_PLACE_TO_STOP) return place;
  if (kind == CORBOT_PLACE_TO_CHANGE) throw Corbot::NotReady(kChangesRefused);
  throw Corbot::QueueFull(capacity);
}

}  // namespace

Place::Place(corbot_place_kind kind) : place_(take(kind)) {}

Place::~Place() {
  if (place_ >= 0) corbot_place_free(place_);
}

corbot_presence Place::presence() const {
  if (place_ < 0) return CORBOT_CALLER_PRESENT;
  if (!corbot_place_wanted(place_)) return CORBOT_CALLER_GONE;
  return corbot_place_may_stay(place_) ? CORBOT_CALLER_PRESENT : CORBOT_CALLER_CROWDED;
}

corbot_connection connection_of_call() noexcept { return connection; }

std::uint64_t arrival_of_call() noexcept {
  // Messages of GIOP before 1.2 are not interleaved: this thread has read the last bytes.
  const std::uint64_t stops = corbot_arrival_of(connection.fd, request);
  return stops != 0 ? stops : corbot_arrival();
}

corbot_counted_stop counted_stop_of_call() noexcept { return counted; }

void note_requests(corbot_robot& robot, std::string name, std::string control) {
  served() = {&robot, std::move(name), std::move(control)};
  ::omniORB::getInterceptors()->serverReceiveRequest.add(note);
}

}  // namespace corbot::omni
