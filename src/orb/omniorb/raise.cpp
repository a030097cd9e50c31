// SPDX-License-Identifier: Apache-2.0
#include "orb/omniorb/raise.h"

#include <arm.hh>

namespace corbot::omni {

void raise(const corbot_error& error) {
  switch (error.status) {
    case CORBOT_BAD_PARAMETER:
      throw Corbot::BadParameter(error.parameter, error.value, error.text);
    case CORBOT_UNREACHABLE:
      throw Corbot::Unreachable(Corbot::Point{error.target_m[0], error.target_m[1], error.target_m[2]},
                                error.text);
    case CORBOT_LIMIT_EXCEEDED:
      throw Corbot::LimitExceeded(error.parameter, error.joint, error.value, error.lower, error.upper);
    case CORBOT_NOT_READY:
      throw Corbot::NotReady(error.text);
    case CORBOT_STOPPED:
      throw Corbot::Stopped(error.text);
    case CORBOT_QUEUE_FULL:
      throw Corbot::QueueFull(error.capacity);
    case CORBOT_NO_DATA:
      throw CORBA::TRANSIENT(0, CORBA::COMPLETED_NO);
    case CORBOT_OK:
    case CORBOT_INTERNAL:
      break;
  }
  throw CORBA::INTERNAL(0, CORBA::COMPLETED_MAYBE);
}

}  // namespace corbot::omni
