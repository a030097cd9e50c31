// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arm.hh>
#include <functional>
#include <utility>
#include <vector>

namespace corbot::test {

using Operation = std::pair<const char*, std::function<void(Corbot::Arm_ptr)>>;

inline Corbot::JointCoord some_joints() {
  Corbot::JointCoord target;
  target.length(4);
  for (CORBA::ULong i = 0; i < 4; ++i) target[i] = 1.0;
  return target;
}

/// In the plane of the base's angle 0; as an offset, without a turn.
inline Corbot::Pose level(double x_m, double z_m) { return {{x_m, 0.0, z_m}, {1.0, 0.0, 0.0, 0.0}}; }

/// All that needs control and can say NotReady.
inline std::vector<Operation> guarded_operations() {
  // The limits first: not while motions are under way.
  return {{"SetSoftLimits",
           [](auto arm) {
             const Corbot::JointRanges_var all = arm->MovRange();
             arm->SetSoftLimits(all.in());
           }},
          {"SetWorkspace", [](auto arm) { arm->SetWorkspace(Corbot::WorkspaceShapes()); }},
          {"ResetWorkspace", [](auto arm) { arm->ResetWorkspace(); }},
          {"SetToolFrame", [](auto arm) { arm->SetToolFrame(arm->ToolFrame()); }},
          {"SetBaseFrame", [](auto arm) { arm->SetBaseFrame(arm->BaseFrame()); }},
          {"ResetFrames", [](auto arm) { arm->ResetFrames(); }},
          {"ResetSoftLimits", [](auto arm) { arm->ResetSoftLimits(); }},
          {"Move", [](auto arm) { arm->Move(0.2, 0, 0.1, 0, 0); }},
          {"MoveS", [](auto arm) { arm->MoveS(0.2, 0, 0.11, 0, 0); }},
          {"MoveC",
           [](auto arm) {
             arm->MoveC({0.2, -0.03, 0.1}, {0.22, 0, 0.1}, {0.2, 0.03, 0.1});
           }},
          {"MovePose", [](auto arm) { arm->MovePose(level(0.2, 0.1), 0); }},
          {"MovePoseS", [](auto arm) { arm->MovePoseS(level(0.2, 0.11), 0); }},
          {"MoveRelative", [](auto arm) { arm->MoveRelative(level(0.0, -0.01), Corbot::OffsetInTool, 0); }},
          {"MoveRelativeS", [](auto arm) { arm->MoveRelativeS(level(0.0, 0.01), Corbot::OffsetInBase, 0); }},
          {"Drive", [](auto arm) { arm->Drive(0, 1, 20); }},
          {"Ready", [](auto arm) { arm->Ready(); }},
          {"Delay", [](auto arm) { arm->Delay(0); }},
          {"Open", [](auto arm) { arm->Open(); }},
          {"Close", [](auto arm) { arm->Close(); }},
          {"MoveJoints", [](auto arm) { arm->MoveJoints(some_joints(), 0); }},
          {"StartMove", [](auto arm) { arm->StartMove(0.2, 0, 0.1, 0, 0); }},
          {"StartMoveS", [](auto arm) { arm->StartMoveS(0.2, 0, 0.11, 0, 0); }},
          {"StartMoveC",
           [](auto arm) {
             arm->StartMoveC({0.2, -0.03, 0.1}, {0.22, 0, 0.1}, {0.2, 0.03, 0.1});
           }},
          {"StartMovePose", [](auto arm) { arm->StartMovePose(level(0.2, 0.1), 0); }},
          {"StartMovePoseS", [](auto arm) { arm->StartMovePoseS(level(0.2, 0.11), 0); }},
          {"StartMoveRelative",
           [](auto arm) { arm->StartMoveRelative(level(0.0, -0.01), Corbot::OffsetInTool, 0); }},
          {"StartMoveRelativeS",
           [](auto arm) { arm->StartMoveRelativeS(level(0.0, 0.01), Corbot::OffsetInBase, 0); }},
          {"StartDrive", [](auto arm) { arm->StartDrive(0, 1, 20); }},
          {"StartMoveJoints", [](auto arm) { arm->StartMoveJoints(some_joints(), 0); }},
          {"StartReady", [](auto arm) { arm->StartReady(); }},
          {"StartDelay", [](auto arm) { arm->StartDelay(0); }},
          {"StartOpen", [](auto arm) { arm->StartOpen(); }},
          {"StartClose", [](auto arm) { arm->StartClose(); }},
          {"SetGripper", [](auto arm) { arm->SetGripper(50); }},
          {"StartSetGripper", [](auto arm) { arm->StartSetGripper(50); }},
          {"Cancel", [](auto arm) { arm->Cancel(1); }},
          {"Pause", [](auto arm) { arm->Pause(); }},
          {"Resume", [](auto arm) { arm->Resume(); }},
          {"Override", [](auto arm) { arm->Override(90); }}};
}

/// The same that cannot.
inline std::vector<Operation> settings() {
  return {{"Speed", [](auto arm) { arm->Speed(50); }},
          {"ArtSpeed", [](auto arm) { arm->ArtSpeed(0, 50); }},
          {"AllSpeed", [](auto arm) { arm->AllSpeed(50); }},
          {"SetToolPitch", [](auto arm) { arm->SetToolPitch(-1); }},
          {"ResetToolOrientation", [](auto arm) { arm->ResetToolOrientation(); }}};
}

}  // namespace corbot::test
