// SPDX-License-Identifier: Apache-2.0
#include "orb/omniorb/arm_servant.h"

#include <array>
#include <utility>

#include "orb/omniorb/convert.h"
#include "orb/omniorb/raise.h"

namespace corbot::omni {
namespace {

int32_t to_robot(Corbot::OffsetFrame frame) {
  return frame == Corbot::OffsetInTool ? CORBOT_OFFSET_IN_TOOL : CORBOT_OFFSET_IN_BASE;
}

std::array<double, 3> array_of(const Corbot::Point& p) { return {p.x, p.y, p.z}; }

}  // namespace

ArmServant::ArmServant(corbot_robot& robot, const ControlReferences& references, Object object)
    : references_(references), object_(object), robot_(robot) {
  corbot_robot_describe(&robot, &description_);
}

std::string ArmServant::key_of_call() const {
  return object_ == Object::kControl ? references_.key_of_call() : std::string();
}

template <class Function, class... Arguments>
void ArmServant::set(Function function, Arguments&&... arguments) {
  const Caller caller(key_of_call());
  corbot_error error{};
  const corbot_status status = function(&robot_, caller.get(), std::forward<Arguments>(arguments)..., &error);
  if (status == CORBOT_NOT_READY) {
    throw CORBA::NO_PERMISSION(
        caller.is_public() ? Corbot::NoPermissionNoControl : Corbot::NoPermissionControlEnded,
        CORBA::COMPLETED_NO);
  }
  if (status != CORBOT_OK) raise(error);
}

template <class Function, class... Arguments>
void ArmServant::start_and_finish(Function function, Arguments&&... arguments) {
  const Place place(CORBOT_PLACE_TO_WAIT);
  const Caller caller(key_of_call(), &place);
  const Corbot::Ticket ticket = begin(caller, function, std::forward<Arguments>(arguments)...);
  call(corbot_robot_finish, &robot_, ticket, caller.get());
}

template <class Function, class... Arguments>
Corbot::Ticket ArmServant::start(Function function, Arguments&&... arguments) {
  const Place place(CORBOT_PLACE_TO_START);
  const Caller caller(key_of_call(), &place);
  return begin(caller, function, std::forward<Arguments>(arguments)...);
}

template <class Function, class... Arguments>
Corbot::Ticket ArmServant::begin(const Caller& caller, Function function, Arguments&&... arguments) {
  corbot_ticket ticket = 0;
  call(function, &robot_, caller.get(), std::forward<Arguments>(arguments)..., &ticket);
  return ticket;
}

Corbot::JointCoord* ArmServant::ArtiCoord() {
  double joints[CORBOT_MAX_JOINTS];
  call(corbot_robot_joints, &robot_, joints);
  return new Corbot::JointCoord(to_corba(joints, static_cast<CORBA::ULong>(description_.dof)));
}

Corbot::CartesianCoord ArmServant::CartCoord() {
  corbot_pose pose{};
  call(corbot_robot_pose, &robot_, &pose);
  return {pose.x_m, pose.y_m, pose.z_m, pose.a_deg, pose.b_deg, pose.c_deg};
}

Corbot::GripperState ArmServant::GripperStatus() {
  return corbot_robot_gripper(&robot_) == CORBOT_GRIPPER_OPEN ? Corbot::Open : Corbot::Close;
}

Corbot::RobotState ArmServant::Status() { return to_corba(corbot_robot_state(&robot_)); }
Corbot::RobotKind ArmServant::RobotType() { return static_cast<Corbot::RobotKind>(description_.kind); }
CORBA::Long ArmServant::DoF() { return description_.dof; }
CORBA::Double ArmServant::Reach() { return description_.reach_m; }

Corbot::JointRanges* ArmServant::MovRange() {
  return new Corbot::JointRanges(
      to_corba(description_.lower, description_.upper, static_cast<CORBA::ULong>(description_.dof)));
}

void ArmServant::Move(CORBA::Double px, CORBA::Double py, CORBA::Double pz, CORBA::Double d,
                      CORBA::Double t) {
  start_and_finish(corbot_robot_move, std::array{px, py, pz}.data(), d, t);
}
void ArmServant::MoveS(CORBA::Double px, CORBA::Double py, CORBA::Double pz, CORBA::Double d,
                       CORBA::Double t) {
  start_and_finish(corbot_robot_move_s, std::array{px, py, pz}.data(), d, t);
}
void ArmServant::MoveC(const Corbot::Point& p1, const Corbot::Point& p2, const Corbot::Point& p3) {
  start_and_finish(corbot_robot_move_c, array_of(p1).data(), array_of(p2).data(), array_of(p3).data());
}
void ArmServant::Drive(CORBA::Long articulation, CORBA::Double increment, CORBA::Double speed) {
  start_and_finish(corbot_robot_drive, articulation, increment, speed);
}
void ArmServant::Ready() { start_and_finish(corbot_robot_ready); }
void ArmServant::Delay(CORBA::Double t) { start_and_finish(corbot_robot_delay, t); }
void ArmServant::Open() { start_and_finish(corbot_robot_open_gripper); }
void ArmServant::Close() { start_and_finish(corbot_robot_close_gripper); }
void ArmServant::MoveJoints(const Corbot::JointCoord& target, CORBA::Double t) {
  start_and_finish(corbot_robot_move_joints, target.get_buffer(), std::size_t{target.length()}, t);
}

void ArmServant::Speed(CORBA::Double percent) { set(corbot_robot_speed, percent); }
void ArmServant::ArtSpeed(CORBA::Long articulation, CORBA::Double percent) {
  set(corbot_robot_art_speed, articulation, percent);
}
void ArmServant::AllSpeed(CORBA::Double percent) { set(corbot_robot_all_speed, percent); }

template <class Function, class... Arguments>
void ArmServant::change(corbot_place_kind kind, Function function, Arguments&&... arguments) {
  const Place place(kind);
  const Caller caller(key_of_call(), &place);
  call(function, &robot_, caller.get(), std::forward<Arguments>(arguments)...);
}

void ArmServant::Stop() { change(CORBOT_PLACE_TO_STOP, corbot_robot_stop); }
void ArmServant::StopAndHold() { change(CORBOT_PLACE_TO_STOP, corbot_robot_stop_and_hold); }
void ArmServant::Cancel(Corbot::Ticket id) {
  change(CORBOT_PLACE_TO_CHANGE, corbot_robot_cancel, corbot_ticket{id});
}
void ArmServant::Pause() { change(CORBOT_PLACE_TO_CHANGE, corbot_robot_pause); }
void ArmServant::Resume() { change(CORBOT_PLACE_TO_CHANGE, corbot_robot_resume); }
CORBA::Boolean ArmServant::Paused() { return corbot_robot_paused(&robot_) != 0; }
void ArmServant::Override(CORBA::Double percent) {
  change(CORBOT_PLACE_TO_CHANGE, corbot_robot_set_override, percent);
}
CORBA::Double ArmServant::OverridePercent() { return corbot_robot_override(&robot_); }
void ArmServant::Clear() { change(CORBOT_PLACE_TO_CHANGE, corbot_robot_clear); }

Corbot::Ticket ArmServant::StartMove(CORBA::Double px, CORBA::Double py, CORBA::Double pz, CORBA::Double d,
                                     CORBA::Double t) {
  return start(corbot_robot_move, std::array{px, py, pz}.data(), d, t);
}
Corbot::Ticket ArmServant::StartMoveS(CORBA::Double px, CORBA::Double py, CORBA::Double pz, CORBA::Double d,
                                      CORBA::Double t) {
  return start(corbot_robot_move_s, std::array{px, py, pz}.data(), d, t);
}
Corbot::Ticket ArmServant::StartMoveC(const Corbot::Point& p1, const Corbot::Point& p2,
                                      const Corbot::Point& p3) {
  return start(corbot_robot_move_c, array_of(p1).data(), array_of(p2).data(), array_of(p3).data());
}
Corbot::Ticket ArmServant::StartDrive(CORBA::Long articulation, CORBA::Double increment,
                                      CORBA::Double speed) {
  return start(corbot_robot_drive, articulation, increment, speed);
}
Corbot::Ticket ArmServant::StartMoveJoints(const Corbot::JointCoord& target, CORBA::Double t) {
  return start(corbot_robot_move_joints, target.get_buffer(), std::size_t{target.length()}, t);
}
Corbot::Ticket ArmServant::StartReady() { return start(corbot_robot_ready); }
Corbot::Ticket ArmServant::StartDelay(CORBA::Double t) { return start(corbot_robot_delay, t); }
Corbot::Ticket ArmServant::StartOpen() { return start(corbot_robot_open_gripper); }
Corbot::Ticket ArmServant::StartClose() { return start(corbot_robot_close_gripper); }

void ArmServant::SetGripper(CORBA::Double percent) { start_and_finish(corbot_robot_set_gripper, percent); }
Corbot::Ticket ArmServant::StartSetGripper(CORBA::Double percent) {
  return start(corbot_robot_set_gripper, percent);
}

Corbot::GripperInfo ArmServant::Gripper() {
  corbot_arm_state state{};
  call(corbot_robot_arm_state, &robot_, &state);
  return to_corba(state.gripper);
}

Corbot::MotionInfo* ArmServant::info(Corbot::Ticket id, double timeout_s, const Caller& caller) {
  corbot_motion_info info{};
  call(corbot_robot_wait, &robot_, id, timeout_s, caller.get(), &info);
  Corbot::MotionInfo_var result = new Corbot::MotionInfo;
  fill(info, result.inout());
  return result._retn();
}

Corbot::MotionInfo* ArmServant::Wait(Corbot::Ticket id, CORBA::Double timeout) {
  if (!(timeout >= 0.0)) throw Corbot::BadParameter("timeout", timeout, "the time-out must not be negative");
  const Place place(CORBOT_PLACE_TO_WAIT);
  return info(id, timeout, Caller(key_of_call(), &place));
}
Corbot::MotionInfo* ArmServant::Progress(Corbot::Ticket id) { return info(id, 0.0, Caller(key_of_call())); }

void ArmServant::SetToolPitch(CORBA::Double degrees) { set(corbot_robot_set_tool_pitch, degrees); }
CORBA::Double ArmServant::ToolPitch() { return corbot_robot_tool_pitch(&robot_); }

void ArmServant::MovePose(const Corbot::Pose& target, CORBA::Double t) {
  const corbot_tool_pose pose = from_corba(target);
  start_and_finish(corbot_robot_move_pose, &pose, t);
}
void ArmServant::MovePoseS(const Corbot::Pose& target, CORBA::Double t) {
  const corbot_tool_pose pose = from_corba(target);
  start_and_finish(corbot_robot_move_pose_s, &pose, t);
}
Corbot::Ticket ArmServant::StartMovePose(const Corbot::Pose& target, CORBA::Double t) {
  const corbot_tool_pose pose = from_corba(target);
  return start(corbot_robot_move_pose, &pose, t);
}
Corbot::Ticket ArmServant::StartMovePoseS(const Corbot::Pose& target, CORBA::Double t) {
  const corbot_tool_pose pose = from_corba(target);
  return start(corbot_robot_move_pose_s, &pose, t);
}
void ArmServant::MoveRelative(const Corbot::Pose& offset, Corbot::OffsetFrame frame, CORBA::Double t) {
  const corbot_tool_pose pose = from_corba(offset);
  start_and_finish(corbot_robot_move_relative, &pose, to_robot(frame), t);
}
void ArmServant::MoveRelativeS(const Corbot::Pose& offset, Corbot::OffsetFrame frame, CORBA::Double t) {
  const corbot_tool_pose pose = from_corba(offset);
  start_and_finish(corbot_robot_move_relative_s, &pose, to_robot(frame), t);
}
Corbot::Ticket ArmServant::StartMoveRelative(const Corbot::Pose& offset, Corbot::OffsetFrame frame,
                                             CORBA::Double t) {
  const corbot_tool_pose pose = from_corba(offset);
  return start(corbot_robot_move_relative, &pose, to_robot(frame), t);
}
Corbot::Ticket ArmServant::StartMoveRelativeS(const Corbot::Pose& offset, Corbot::OffsetFrame frame,
                                              CORBA::Double t) {
  const corbot_tool_pose pose = from_corba(offset);
  return start(corbot_robot_move_relative_s, &pose, to_robot(frame), t);
}

void ArmServant::SetToolOrientation(const Corbot::Quaternion& orientation) {
  const double wxyz[] = {orientation.w, orientation.x, orientation.y, orientation.z};
  set(corbot_robot_set_tool_orientation, &wxyz[0]);
}
void ArmServant::ResetToolOrientation() { set(corbot_robot_reset_tool_orientation); }
Corbot::ToolOrientationInfo ArmServant::ToolOrientation() {
  double q[4];
  const bool is_set = corbot_robot_tool_orientation(&robot_, q) != 0;
  return {is_set, {q[0], q[1], q[2], q[3]}};
}

Corbot::SpeedSettings* ArmServant::Speeds() {
  Corbot::SpeedSettings_var speeds = new Corbot::SpeedSettings;
  double joints[CORBOT_MAX_JOINTS];
  corbot_robot_speeds(&robot_, &speeds->tool, &joints[0]);
  speeds->joints.length(static_cast<CORBA::ULong>(description_.dof));
  for (CORBA::ULong i = 0; i < speeds->joints.length(); ++i) speeds->joints[i] = joints[i];
  return speeds._retn();
}

template <class Function, class... Arguments>
void ArmServant::set_at_once(Function function, Arguments&&... arguments) {
  const Caller caller(key_of_call());
  call(function, &robot_, caller.get(), std::forward<Arguments>(arguments)...);
}

void ArmServant::SetToolFrame(const Corbot::Pose& flange_T_tool) {
  const corbot_tool_pose wanted = from_corba(flange_T_tool);
  set_at_once(corbot_robot_set_tool_frame, &wanted);
}
void ArmServant::SetBaseFrame(const Corbot::Pose& world_T_base) {
  const corbot_tool_pose wanted = from_corba(world_T_base);
  set_at_once(corbot_robot_set_base_frame, &wanted);
}
void ArmServant::ResetFrames() { set_at_once(corbot_robot_reset_frames); }

Corbot::Pose ArmServant::ToolFrame() {
  corbot_tool_pose tool{}, base{};
  corbot_robot_frames(&robot_, &tool, &base);
  return to_corba(tool);
}
Corbot::Pose ArmServant::BaseFrame() {
  corbot_tool_pose tool{}, base{};
  corbot_robot_frames(&robot_, &tool, &base);
  return to_corba(base);
}

Corbot::PoseSolutions* ArmServant::Solutions(const Corbot::Pose& target) {
  const corbot_tool_pose wanted = from_corba(target);
  corbot_pose_solution found[CORBOT_MAX_SOLUTIONS];
  std::size_t count = 0;
  call(corbot_robot_solutions, &robot_, &wanted, found, &count);
  Corbot::PoseSolutions_var result = new Corbot::PoseSolutions;
  result->length(static_cast<CORBA::ULong>(count));
  for (CORBA::ULong i = 0; i < result->length(); ++i) {
    result[i].number = found[i].number;
    result[i].joints = to_corba(found[i].joints, static_cast<CORBA::ULong>(description_.dof));
    result[i].withinLimits = found[i].in_range != 0;
    result[i].orientationError = found[i].orientation_error_deg;
  }
  return result._retn();
}

CORBA::Long ArmServant::Solution() {
  int32_t number = -1;
  call(corbot_robot_solution, &robot_, &number);
  return number;
}

template <class Function, class... Arguments>
Corbot::PlanInfo* ArmServant::plan(Function function, Arguments&&... arguments) {
  corbot_plan found{};
  Caller caller(key_of_call());
  caller.plan_only(found);
  (void)begin(caller, function, std::forward<Arguments>(arguments)...);
  Corbot::PlanInfo_var result = new Corbot::PlanInfo;
  fill(found, static_cast<CORBA::ULong>(description_.dof), result.inout());
  return result._retn();
}

Corbot::PlanInfo* ArmServant::PlanMove(CORBA::Double px, CORBA::Double py, CORBA::Double pz, CORBA::Double d,
                                       CORBA::Double t) {
  return plan(corbot_robot_move, std::array{px, py, pz}.data(), d, t);
}
Corbot::PlanInfo* ArmServant::PlanMoveS(CORBA::Double px, CORBA::Double py, CORBA::Double pz, CORBA::Double d,
                                        CORBA::Double t) {
  return plan(corbot_robot_move_s, std::array{px, py, pz}.data(), d, t);
}
Corbot::PlanInfo* ArmServant::PlanMoveC(const Corbot::Point& p1, const Corbot::Point& p2,
                                        const Corbot::Point& p3) {
  return plan(corbot_robot_move_c, array_of(p1).data(), array_of(p2).data(), array_of(p3).data());
}
Corbot::PlanInfo* ArmServant::PlanDrive(CORBA::Long articulation, CORBA::Double increment,
                                        CORBA::Double speed) {
  return plan(corbot_robot_drive, articulation, increment, speed);
}
Corbot::PlanInfo* ArmServant::PlanMoveJoints(const Corbot::JointCoord& target, CORBA::Double t) {
  return plan(corbot_robot_move_joints, target.get_buffer(), std::size_t{target.length()}, t);
}
Corbot::PlanInfo* ArmServant::PlanReady() { return plan(corbot_robot_ready); }
Corbot::PlanInfo* ArmServant::PlanMovePose(const Corbot::Pose& target, CORBA::Double t) {
  const corbot_tool_pose pose = from_corba(target);
  return plan(corbot_robot_move_pose, &pose, t);
}
Corbot::PlanInfo* ArmServant::PlanMovePoseS(const Corbot::Pose& target, CORBA::Double t) {
  const corbot_tool_pose pose = from_corba(target);
  return plan(corbot_robot_move_pose_s, &pose, t);
}
Corbot::PlanInfo* ArmServant::PlanMoveRelative(const Corbot::Pose& offset, Corbot::OffsetFrame frame,
                                               CORBA::Double t) {
  const corbot_tool_pose pose = from_corba(offset);
  return plan(corbot_robot_move_relative, &pose, to_robot(frame), t);
}
Corbot::PlanInfo* ArmServant::PlanMoveRelativeS(const Corbot::Pose& offset, Corbot::OffsetFrame frame,
                                                CORBA::Double t) {
  const corbot_tool_pose pose = from_corba(offset);
  return plan(corbot_robot_move_relative_s, &pose, to_robot(frame), t);
}

void ArmServant::SetSoftLimits(const Corbot::JointRanges& limits) {
  corbot_joint_ranges wanted{};
  for (CORBA::ULong i = 0; i < limits.length() && i < CORBOT_MAX_JOINTS; ++i) {
    wanted.lower[i] = limits[i].lower;
    wanted.upper[i] = limits[i].upper;
  }
  change(CORBOT_PLACE_TO_CHANGE, corbot_robot_set_soft_limits, &wanted, std::size_t{limits.length()});
}
void ArmServant::ResetSoftLimits() { change(CORBOT_PLACE_TO_CHANGE, corbot_robot_reset_soft_limits); }

Corbot::JointRanges* ArmServant::SoftLimits() {
  corbot_joint_ranges limits{};
  const bool is_known = corbot_robot_soft_limits(&robot_, &limits) != 0;
  const auto count = static_cast<CORBA::ULong>(is_known ? description_.dof : 0);
  return new Corbot::JointRanges(to_corba(limits.lower, limits.upper, count));
}

void ArmServant::SetWorkspace(const Corbot::WorkspaceShapes& further) {
  corbot_shape wanted[CORBOT_MAX_FURTHER_SHAPES];
  for (CORBA::ULong i = 0; i < further.length() && i < CORBOT_MAX_FURTHER_SHAPES; ++i)
    wanted[i] = to_shape(further[i]);
  const corbot_shape* const first = wanted;
  change(CORBOT_PLACE_TO_CHANGE, corbot_robot_set_workspace, first, std::size_t{further.length()});
}
void ArmServant::ResetWorkspace() { change(CORBOT_PLACE_TO_CHANGE, corbot_robot_reset_workspace); }

Corbot::WorkspaceInfo* ArmServant::Workspace() {
  corbot_workspace now;
  corbot_robot_workspace(&robot_, &now);
  Corbot::WorkspaceInfo_var result = new Corbot::WorkspaceInfo;
  to_corba(now.shapes, now.profile_count, result->profile);
  to_corba(now.shapes + now.profile_count, now.further_count, result->further);
  result->known = now.known != 0;
  return result._retn();
}

Corbot::AlarmList* ArmServant::Alarms() {
  corbot_alarm alarms[CORBOT_MAX_ALARMS];
  const std::size_t count = corbot_robot_alarms(&robot_, alarms);
  Corbot::AlarmList_var result = new Corbot::AlarmList;
  result->length(static_cast<CORBA::ULong>(count));
  for (CORBA::ULong i = 0; i < count; ++i) {
    result[i].time = alarms[i].time_s;
    result[i].code = alarms[i].code;
    result[i].active = alarms[i].active != 0;
    result[i].text = CORBA::string_dup(alarms[i].text);
  }
  return result._retn();
}

Corbot::LoopInfo* ArmServant::Diagnostics() {
  corbot_loop_info loop{};
  call(corbot_robot_loop_info, &robot_, &loop);
  Corbot::LoopInfo_var result = new Corbot::LoopInfo;
  result->period = loop.period_s;
  result->since = loop.since_s;
  result->cycles = loop.cycles;
  result->overruns = loop.overruns;
  result->latencyMean = loop.latency_mean_s;
  result->latencyMax = loop.latency_max_s;
  result->workMax = loop.work_max_s;
  result->realTime = loop.realtime != 0;
  result->counts.length(CORBOT_LATENCY_BUCKETS);
  result->edges.length(CORBOT_LATENCY_BUCKETS);
  for (CORBA::ULong i = 0; i < CORBOT_LATENCY_BUCKETS; ++i) {
    result->counts[i] = loop.counts[i];
    result->edges[i] = loop.edges_s[i];
  }
  return result._retn();
}

Corbot::DeviceInfo* ArmServant::Device() {
  corbot_device_info device{};
  call(corbot_robot_device_info, &robot_, &device);
  Corbot::DeviceInfo_var result = new Corbot::DeviceInfo;
  fill(device, result.inout());
  return result._retn();
}

Corbot::ArmState* ArmServant::State() {
  corbot_arm_state state{};
  call(corbot_robot_arm_state, &robot_, &state);
  Corbot::ArmState_var result = new Corbot::ArmState;
  fill(state, static_cast<CORBA::ULong>(description_.dof), result.inout());
  return result._retn();
}

char* ArmServant::Description() { return CORBA::string_dup(corbot_robot_urdf(&robot_)); }
Corbot::JointList* ArmServant::Joints() { return new Corbot::JointList(joints_of(description_)); }

Corbot::ServantInfo* ArmServant::Servant() {
  Corbot::ServantInfo_var result = new Corbot::ServantInfo;
  result->version = CORBA::string_dup(description_.version);
  result->profile = CORBA::string_dup(description_.fingerprint);
  result->started = description_.started_s;
  return result._retn();
}

CORBA::Double ArmServant::CycleAge() {
  double age_s = 0;
  call(corbot_robot_cycle_age, &robot_, &age_s);
  return age_s;
}

Corbot::Arm_ptr ArmServant::Acquire(const char* who, CORBA::Double lease) {
  const Place place(CORBOT_PLACE_TO_CHANGE);
  const Caller caller(key_of_call(), &place);
  char key[CORBOT_KEY];
  call(corbot_robot_acquire, &robot_, caller.get(), who, lease, key);
  return references_.make(key);
}

void ArmServant::Renew() {
  const Caller caller(key_of_call());
  call(corbot_robot_renew, &robot_, caller.get());
}
void ArmServant::Release() { change(CORBOT_PLACE_TO_CHANGE, corbot_robot_release); }

Corbot::ControlInfo* ArmServant::Control() {
  corbot_holder holder{};
  corbot_robot_holder(&robot_, &holder);
  Corbot::ControlInfo_var result = new Corbot::ControlInfo;
  result->holder = CORBA::string_dup(holder.who);
  result->left = holder.left_s;
  result->held = corbot_robot_held(&robot_) != 0;
  return result._retn();
}

}  // namespace corbot::omni
