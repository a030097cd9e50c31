// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>

#include "cell.hh"

// The calls by which a worker uses its robot, the camera and the store. The remote ones are in remote_robot.h and
// remote_services.h. Every call may raise what the interface allows, and client::Failure where there is no
// reply, or none that can be used.

namespace corbot::cell {

/// What the gripper was last told, and what a device knows that measures the opening.
enum class Grip { kOpen, kClosed, kClosedOnNothing, kClosedOnPiece };

/// The blocking calls of robot.idl that the work uses. Points: metres, in the frame of the robot's Move.
class RobotPort {
 public:
  virtual ~RobotPort() = default;

  /// Takes control where the robot is an Arm. True: nothing else can move the robot from now on. One attempt.
  virtual bool acquire() = 0;
  /// Gives control back. An arm that moves is stopped.
  virtual void release() = 0;
  /// Percent of the profile's maximum.
  virtual void speed(double percent) = 0;
  /// Free motion to the point `above_m` over `point`.
  virtual void move(const Eigen::Vector3d& point, double above_m) = 0;
  /// The same on a straight line, in `duration_s`.
  virtual void move_s(const Eigen::Vector3d& point, double above_m, double duration_s) = 0;
  virtual void delay(double duration_s) = 0;
  virtual void open() = 0;
  virtual void close() = 0;
  /// Waits until the robot is at rest, and returns where its tool is.
  virtual Eigen::Vector3d rest_position() = 0;
  [[nodiscard]] virtual Grip grip() = 0;
  /// Whether the robot is not in Error. Needs no control. Failure: no reply.
  [[nodiscard]] virtual bool is_able() = 0;
  /// Whether the cell is stopped: every command raises Stopped.
  [[nodiscard]] virtual bool is_halted() = 0;
  /// From another thread: ends the motion under way where the robot is an Arm, also one whose reply was lost.
  /// No motion begins after that. Returns after about 3 s at the latest.
  virtual void stop() = 0;
};

class CameraPort {
 public:
  virtual ~CameraPort() = default;
  /// A picture whose exposure begins after the call. Failure: no picture for `kPatience_s`.
  virtual Corbot::Frame look(double timeout_s) = 0;
};

/// Corbot::Store. Failure: no reply, or NotReady, for `kPatience_s`. A call is repeated until then, which
/// has no further effect.
class StorePort {
 public:
  virtual ~StorePort() = default;
  virtual Corbot::ClaimToken claim(const std::string& robot, const std::string& who,
                                   Corbot::ClaimToken replaces) = 0;
  virtual void release(Corbot::ClaimToken token) = 0;
  virtual Corbot::TransferInfo reserve(Corbot::ClaimToken token, const std::string& from,
                                       const std::string& to, const Corbot::Sightings& seen,
                                       double timeout_s) = 0;
  virtual void advance(Corbot::ClaimToken token, Corbot::PieceNumber piece, Corbot::TransferStep step,
                       const std::string& note) = 0;
  virtual void enter(Corbot::ClaimToken token, const std::string& place, double timeout_s) = 0;
  virtual void leave(Corbot::ClaimToken token, const std::string& place) = 0;
  virtual Corbot::PlaceInfos places() = 0;
  virtual Corbot::TransferInfos transfers() = 0;
  virtual Corbot::PieceEvents unclear() = 0;
};

/// What one worker uses.
struct WorkerPorts {
  RobotPort& robot;
  CameraPort& camera;
  StorePort& store;
};

/// A camera or a store that cannot be used for so long interrupts the work.
inline constexpr double kPatience_s = 10;

}  // namespace corbot::cell
