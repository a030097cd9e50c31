// SPDX-License-Identifier: Apache-2.0
#include "cell/counted_calls.h"

#include <omniORB4/CORBA.h>
#include <omniORB4/omniInterceptors.h>

// The ORB's headers need this order.
#include <omniORB4/internal/giopStream.h>

#include <omniORB4/internal/giopStrand.h>

#include <omniORB4/internal/GIOP_S.h>
#include <omniORB4/tcpConnection.h>

#include <utility>

#include "net/connections.h"

namespace corbot::cell {
namespace {

constexpr corbot_connection kNone{-1, 0};
/// The connection of the call that this thread carries out.
thread_local corbot_connection connection = kNone;

void end_call() { corbot_connection_end_call(std::exchange(connection, kNone)); }

CORBA::Boolean begin(omni::omniInterceptors::serverReceiveRequest_T::info_T& info) {
  end_call();
  const auto* const tcp = dynamic_cast<const omni::tcpConnection*>(info.giop_s.strand().connection);
  if (tcp == nullptr) return true;
  const corbot_connection used = corbot_connection_used(tcp->handle());
  // The server has closed this connection for calls, and the client knows it.
  if (!corbot_connection_begin_call(used)) throw CORBA::TRANSIENT(0, CORBA::COMPLETED_NO);
  connection = used;
  return true;
}

CORBA::Boolean reply(omni::omniInterceptors::serverSendReply_T::info_T& /*info*/) {
  end_call();
  return true;
}

CORBA::Boolean raise(omni::omniInterceptors::serverSendException_T::info_T& /*info*/) {
  end_call();
  return true;
}

}  // namespace

void count_calls() {
  omni::omniInterceptors* const interceptors = omniORB::getInterceptors();
  interceptors->serverReceiveRequest.add(begin);
  interceptors->serverSendReply.add(reply);
  interceptors->serverSendException.add(raise);
}

}  // namespace corbot::cell
