// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <omniORB4/CORBA.h>

#include <string>

namespace corbot::test {

/// An exception of CORBA in words: a system exception with its minor code and completion, one of idl/ with
/// its fields. Every program that links corbot_escapes prints this where such an exception escapes a test or
/// one of its threads.
std::string described(const CORBA::Exception& exception);

}  // namespace corbot::test
