// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace corbot::cell {

/// The work ends because that was asked for.
struct WorkEnded {};

/// The work ends, and a person is needed. The text says what went wrong and what to look at.
class Attention : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A Stop of another client ended a motion.
class RobotStopped : public Attention {
  using Attention::Attention;
};

/// The robot refused a point: nothing moved.
class PointRefused : public Attention {
  using Attention::Attention;
};

}  // namespace corbot::cell
