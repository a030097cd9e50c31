// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>

namespace corbot::cell {

/// The work ends because of a requested stop.
struct WorkEnded {};

/// The robot is in Error, or does not answer, while no command of the worker is in progress.
struct RobotUnable {};

/// A call got no usable reply. The worker determines the state of robot and piece anew, and continues.
class Fault : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A robot's command failed. After several equal faults in a row the worker waits for a person.
class MotionFault : public Fault {
  using Fault::Fault;
};

/// The work waits for a person. The text names the cause and what to check.
class Attention : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The work waits until a person reports by Resolve where the piece is.
class PieceUnclear : public Attention {
  using Attention::Attention;
};

/// A Stop of another client ended a motion, or the cell is stopped.
class RobotStopped : public Attention {
  using Attention::Attention;
};

/// The robot refused a point, and did not move.
class PointRefused : public Attention {
  using Attention::Attention;
};

}  // namespace corbot::cell
