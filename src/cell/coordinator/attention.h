// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace corbot::cell {

/// The work ends because that was asked for.
struct WorkEnded {};

/// A call got no usable reply. The worker finds out anew where robot and piece are, and goes on.
class Fault : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The same of a robot's command. Several equal ones in a row need a person.
class MotionFault : public Fault {
  using Fault::Fault;
};

/// The work waits for a person. The text says what went wrong and what to look at.
class Attention : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The work waits until a person has said by Resolve where the piece is.
class PieceUnclear : public Attention {
  using Attention::Attention;
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
