// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <omniORB4/CORBA.h>
#include <omniORB4/omniConnectionMgmt.h>

namespace corbot::panel {

// Groups of connections. A connection carries one call at a time, so a poll that hangs delays no Stop.
inline constexpr CORBA::ULong kStopConnections = 1;
inline constexpr CORBA::ULong kCallConnections = 2;
inline constexpr CORBA::ULong kCameraConnections = 3;
inline constexpr CORBA::ULong kProgramConnections = 4;
inline constexpr CORBA::ULong kMostConnections = 4;

/// A call that returns when arms are at rest needs more time than a poll.
inline constexpr CORBA::ULong kRestTimeout_ms = 10'000;

/// Returns a reference to the object `shared`. Only references of the same group use its connections.
template <class Interface>
typename Interface::_ptr_type own_reference(CORBA::Object_ptr shared, CORBA::ULong group) {
  const CORBA::Object_var own =
      omniConnectionMgmt::makeRestrictedReference(shared, group, kMostConnections, 1, false, false, false);
  return Interface::_unchecked_narrow(own.in());
}

}  // namespace corbot::panel
