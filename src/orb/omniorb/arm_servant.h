// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arm.hh>

#include "orb/omniorb/caller.h"
#include "orb/omniorb/control_references.h"
#include "orb/omniorb/place.h"
#include "robot/corbot_robot.h"

namespace corbot::omni {

/// Implements Corbot::Arm with the C++ mapping: converts and calls corbot_robot.h, nothing else.
class ArmServant final : public POA_Corbot::Arm {
 public:
  enum class Object {
    kPublic,  ///< the robot's object, for all clients
    kControl  ///< the objects that Acquire returns
  };
  ArmServant(corbot_robot& robot, const ControlReferences& references, Object object);

  // Robot
  Corbot::JointCoord* ArtiCoord() override;
  Corbot::CartesianCoord CartCoord() override;
  Corbot::GripperState GripperStatus() override;
  Corbot::RobotState Status() override;
  Corbot::RobotKind RobotType() override;
  CORBA::Long DoF() override;
  Corbot::JointRanges* MovRange() override;
  CORBA::Double Reach() override;
  void Move(CORBA::Double px, CORBA::Double py, CORBA::Double pz, CORBA::Double d, CORBA::Double t) override;
  void MoveS(CORBA::Double px, CORBA::Double py, CORBA::Double pz, CORBA::Double d, CORBA::Double t) override;
  void MoveC(const Corbot::Point& p1, const Corbot::Point& p2, const Corbot::Point& p3) override;
  void Drive(CORBA::Long articulation, CORBA::Double increment, CORBA::Double speed) override;
  void Ready() override;
  void Delay(CORBA::Double t) override;
  void Open() override;
  void Close() override;
  void Speed(CORBA::Double percent) override;
  void ArtSpeed(CORBA::Long articulation, CORBA::Double percent) override;
  void AllSpeed(CORBA::Double percent) override;

  // Arm
  void Stop() override;
  void Cancel(Corbot::Ticket id) override;
  void Pause() override;
  void Resume() override;
  CORBA::Boolean Paused() override;
  void Override(CORBA::Double percent) override;
  CORBA::Double OverridePercent() override;
  void StopAndHold() override;
  void Clear() override;
  Corbot::Ticket StartMove(CORBA::Double px, CORBA::Double py, CORBA::Double pz, CORBA::Double d,
                           CORBA::Double t) override;
  Corbot::Ticket StartMoveS(CORBA::Double px, CORBA::Double py, CORBA::Double pz, CORBA::Double d,
                            CORBA::Double t) override;
  Corbot::Ticket StartMoveC(const Corbot::Point& p1, const Corbot::Point& p2,
                            const Corbot::Point& p3) override;
  Corbot::Ticket StartDrive(CORBA::Long articulation, CORBA::Double increment, CORBA::Double speed) override;
  Corbot::Ticket StartMoveJoints(const Corbot::JointCoord& target, CORBA::Double t) override;
  Corbot::Ticket StartReady() override;
  Corbot::Ticket StartDelay(CORBA::Double t) override;
  Corbot::Ticket StartOpen() override;
  Corbot::Ticket StartClose() override;
  void SetGripper(CORBA::Double percent) override;
  Corbot::Ticket StartSetGripper(CORBA::Double percent) override;
  Corbot::GripperInfo Gripper() override;
  Corbot::MotionInfo* Wait(Corbot::Ticket id, CORBA::Double timeout) override;
  Corbot::MotionInfo* Progress(Corbot::Ticket id) override;
  void MoveJoints(const Corbot::JointCoord& target, CORBA::Double t) override;
  void SetToolPitch(CORBA::Double degrees) override;
  CORBA::Double ToolPitch() override;
  void MovePose(const Corbot::Pose& target, CORBA::Double t) override;
  void MovePoseS(const Corbot::Pose& target, CORBA::Double t) override;
  Corbot::Ticket StartMovePose(const Corbot::Pose& target, CORBA::Double t) override;
  Corbot::Ticket StartMovePoseS(const Corbot::Pose& target, CORBA::Double t) override;
  void MoveRelative(const Corbot::Pose& offset, Corbot::OffsetFrame frame, CORBA::Double t) override;
  void MoveRelativeS(const Corbot::Pose& offset, Corbot::OffsetFrame frame, CORBA::Double t) override;
  Corbot::Ticket StartMoveRelative(const Corbot::Pose& offset, Corbot::OffsetFrame frame,
                                   CORBA::Double t) override;
  Corbot::Ticket StartMoveRelativeS(const Corbot::Pose& offset, Corbot::OffsetFrame frame,
                                    CORBA::Double t) override;
  void SetToolOrientation(const Corbot::Quaternion& orientation) override;
  void ResetToolOrientation() override;
  Corbot::ToolOrientationInfo ToolOrientation() override;
  Corbot::SpeedSettings* Speeds() override;
  void SetToolFrame(const Corbot::Pose& flange_T_tool) override;
  void SetBaseFrame(const Corbot::Pose& world_T_base) override;
  void ResetFrames() override;
  Corbot::Pose ToolFrame() override;
  Corbot::Pose BaseFrame() override;
  Corbot::PoseSolutions* Solutions(const Corbot::Pose& target) override;
  CORBA::Long Solution() override;
  Corbot::PlanInfo* PlanMove(CORBA::Double px, CORBA::Double py, CORBA::Double pz, CORBA::Double d,
                             CORBA::Double t) override;
  Corbot::PlanInfo* PlanMoveS(CORBA::Double px, CORBA::Double py, CORBA::Double pz, CORBA::Double d,
                              CORBA::Double t) override;
  Corbot::PlanInfo* PlanMoveC(const Corbot::Point& p1, const Corbot::Point& p2,
                              const Corbot::Point& p3) override;
  Corbot::PlanInfo* PlanDrive(CORBA::Long articulation, CORBA::Double increment,
                              CORBA::Double speed) override;
  Corbot::PlanInfo* PlanMoveJoints(const Corbot::JointCoord& target, CORBA::Double t) override;
  Corbot::PlanInfo* PlanReady() override;
  Corbot::PlanInfo* PlanMovePose(const Corbot::Pose& target, CORBA::Double t) override;
  Corbot::PlanInfo* PlanMovePoseS(const Corbot::Pose& target, CORBA::Double t) override;
  Corbot::PlanInfo* PlanMoveRelative(const Corbot::Pose& offset, Corbot::OffsetFrame frame,
                                     CORBA::Double t) override;
  Corbot::PlanInfo* PlanMoveRelativeS(const Corbot::Pose& offset, Corbot::OffsetFrame frame,
                                      CORBA::Double t) override;
  void SetSoftLimits(const Corbot::JointRanges& limits) override;
  void ResetSoftLimits() override;
  Corbot::JointRanges* SoftLimits() override;
  void SetWorkspace(const Corbot::WorkspaceShapes& further) override;
  void ResetWorkspace() override;
  Corbot::WorkspaceInfo* Workspace() override;
  Corbot::JointList* Joints() override;
  char* Description() override;
  Corbot::ArmState* State() override;
  Corbot::AlarmList* Alarms() override;
  Corbot::LoopInfo* Diagnostics() override;
  Corbot::DeviceInfo* Device() override;
  Corbot::ServantInfo* Servant() override;
  CORBA::Double CycleAge() override;
  Corbot::Arm_ptr Acquire(const char* who, CORBA::Double lease) override;
  void Renew() override;
  void Release() override;
  Corbot::ControlInfo* Control() override;

 private:
  [[nodiscard]] std::string key_of_call() const;
  /// Calls a function of corbot_robot.h for an operation that does not raise NotReady.
  template <class Function, class... Arguments>
  void set(Function function, Arguments&&... arguments);
  /// Does the same for an operation that raises NotReady and never waits.
  template <class Function, class... Arguments>
  void set_at_once(Function function, Arguments&&... arguments);
  /// Takes a slot, starts the motion and waits for its end.
  template <class Function, class... Arguments>
  void start_and_finish(Function function, Arguments&&... arguments);
  /// Takes a slot and starts the motion.
  template <class Function, class... Arguments>
  Corbot::Ticket start(Function function, Arguments&&... arguments);
  /// Calls a function of corbot_robot.h that starts a motion.
  template <class Function, class... Arguments>
  Corbot::Ticket begin(const Caller& caller, Function function, Arguments&&... arguments);
  /// Does the same, but only plans the motion.
  template <class Function, class... Arguments>
  Corbot::PlanInfo* plan(Function function, Arguments&&... arguments);
  /// Takes a slot and calls a function of corbot_robot.h that changes how the arm moves.
  template <class Function, class... Arguments>
  void change(corbot_place_kind kind, Function function, Arguments&&... arguments);
  Corbot::MotionInfo* info(Corbot::Ticket id, double timeout_s, const Caller& caller);

  const ControlReferences& references_;
  const Object object_;
  corbot_robot& robot_;
  corbot_description description_{};
};

}  // namespace corbot::omni
