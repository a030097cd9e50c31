// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "client/explain.h"

namespace corbot::cli {

/// Makes the calls of robot.idl, moves the arm, and prints which checks hold. `is_agreed`: skips the question
/// to the user. Throws Failure: kRefused if a check that the cell needs does not hold, kStopped after Ctrl-C.
void conform(const client::Address& address, double timeout_s, bool is_agreed);

}  // namespace corbot::cli
