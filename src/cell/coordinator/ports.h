// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>

#include "cell.hh"

// The interfaces by which a worker uses its robot, the camera and the store. remote_robot.h and
// remote_services.h implement them over CORBA. Every call may throw the exceptions of the IDL. Every call
// throws client::Failure if there is no usable reply.

namespace corbot::cell {

/// The gripper's last command. A device that measures the opening also tells if the gripper holds a piece.
enum class Grip { kOpen, kClosed, kClosedOnNothing, kClosedOnPiece };

/// The blocking calls of robot.idl for the work. Points are in metres, in the frame of the robot's Move.
class RobotPort {
 public:
  virtual ~RobotPort() = default;

  /// Acquires control if the robot is an Arm, in one attempt. Returns true if no other client can move the
  /// robot from now on.
  virtual bool acquire() = 0;
  /// Releases control, which stops a moving arm.
  virtual void release() = 0;
  /// Sets the speed in percent of the profile's maximum.
  virtual void speed(double percent) = 0;
  /// Moves freely to the point `above_m` over `point`.
  virtual void move(const Eigen::Vector3d& point, double above_m) = 0;
  /// Moves to this point on a straight line, in `duration_s`.
  virtual void move_s(const Eigen::Vector3d& point, double above_m, double duration_s) = 0;
  /// Moves on the arc from `begin` through `middle` to `end`. Throws BadParameter also if the robot has no
  /// arcs.
  virtual void move_c(const Eigen::Vector3d& begin, const Eigen::Vector3d& middle,
                      const Eigen::Vector3d& end) = 0;
  virtual void delay(double duration_s) = 0;
  virtual void open() = 0;
  virtual void close() = 0;
  /// Waits until the robot is at rest, and returns the tool's position.
  virtual Eigen::Vector3d rest_position() = 0;
  [[nodiscard]] virtual Grip grip() = 0;
  /// Tells if the robot is not in Error. Needs no control. Throws Failure if there is no reply.
  [[nodiscard]] virtual bool is_able() = 0;
  /// Tells if the cell is stopped. Every command then throws Stopped.
  [[nodiscard]] virtual bool is_halted() = 0;
  /// Stops the current motion of an Arm, even if the motion's reply was lost. No motion begins afterwards.
  /// Any thread may call it. Returns after at most about 3 s.
  virtual void stop() = 0;
};

class CameraPort {
 public:
  virtual ~CameraPort() = default;
  /// Returns a picture exposed after the call. Throws Failure if there is no picture for `kPatience_s`.
  virtual Corbot::Frame look(double timeout_s) = 0;
};

/// The calls of Corbot::Store. A call without a reply, or with NotReady, is repeated; a repetition has no
/// further effect. Throws Failure after `kPatience_s` without success.
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

/// The ports of one worker.
struct WorkerPorts {
  RobotPort& robot;
  CameraPort& camera;
  StorePort& store;
};

/// An outage of camera or store that lasts so long interrupts the work.
inline constexpr double kPatience_s = 10;

}  // namespace corbot::cell
