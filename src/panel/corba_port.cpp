// SPDX-License-Identifier: Apache-2.0
#include "panel/corba_port.h"

#include <omniORB4/omniConnectionMgmt.h>

#include <utility>

#include "client/client.h"
#include "client/json_view.h"

namespace corbot::panel {

namespace {

using client::printable;
using nlohmann::json;

constexpr double kPollTimeout_s = 2.0;
/// A Stop returns when the arm is at rest, so a slow arm needs more time than a poll.
constexpr CORBA::ULong kStopTimeout_ms = 10'000;
/// The port reads the alarms and uses the connection for Stops once in this number of polls.
constexpr unsigned kSlowPolls = 10;
constexpr CORBA::ULong kStopConnections = 1;  // identifies the group of connections for Stops
constexpr CORBA::ULong kMostStopConnections = 4;

template <class List>
json numbers(const List& list) {
  json numbers = json::array();
  for (CORBA::ULong i = 0; i < list.length(); ++i) numbers.push_back(list[i]);
  return numbers;
}

json pose_data(const Corbot::Pose& pose) {
  return {
      {"position_m", {pose.position.x, pose.position.y, pose.position.z}},
      {"orientation_wxyz", {pose.orientation.w, pose.orientation.x, pose.orientation.y, pose.orientation.z}}};
}

json motion_data(const Corbot::MotionInfo& motion) {
  if (motion.id == 0) return {};
  return {{"ticket", motion.id}, {"progress", motion.progress}, {"duration_s", motion.duration}};
}

json active_alarms(const Corbot::AlarmList& alarms) {
  json active = json::array();
  for (CORBA::ULong i = 0; i < alarms.length(); ++i) {
    if (!alarms[i].active) continue;
    active.push_back(
        {{"time_s", alarms[i].time}, {"code", alarms[i].code}, {"text", printable(alarms[i].text.in())}});
  }
  return active;
}

json state_data(const Corbot::ArmState& now) {
  return {{"cycle", now.cycle},
          {"time_s", now.time},
          {"age_s", now.age},
          {"state", client::to_string(now.status)},
          {"paused", static_cast<bool>(now.paused)},
          {"override_percent", now.overridePercent},
          {"joints", numbers(now.measured ? now.measuredJoints : now.commanded)},
          {"commanded", numbers(now.commanded)},
          {"speeds", numbers(now.speeds)},
          {"tool", pose_data(now.tool)},
          {"motion", motion_data(now.motion)},
          {"queued", now.queued},
          {"gripper", client::gripper_data(now.gripper)},
          {"device", client::device_data(now.device)},
          {"control",
           {{"holder", printable(now.control.holder.in())},
            {"left_s", now.control.left},
            {"held", static_cast<bool>(now.control.held)}}}};
}

json joints_data(const Corbot::JointList& joints) {
  json list = json::array();
  for (CORBA::ULong i = 0; i < joints.length(); ++i) {
    const Corbot::JointInfo& joint = joints[i];
    list.push_back({{"name", printable(joint.name.in())},
                    {"unit", joint.kind == Corbot::JointSlides ? "m" : "deg"},
                    {"range", {joint.range.lower, joint.range.upper}},
                    {"speed", joint.speed}});
  }
  return list;
}

/// Returns a reference for Stops. Only references from this function use its connections.
Corbot::Arm_var stop_reference(CORBA::ORB_ptr orb, const client::Address& address) {
  const CORBA::Object_var shared = client::find_object(orb, address);
  return client::call(address, [&] {
    const CORBA::Object_var own = omniConnectionMgmt::makeRestrictedReference(
        shared.in(), kStopConnections, kMostStopConnections, 1, false, false, false);
    return Corbot::Arm_var(Corbot::Arm::_unchecked_narrow(own.in()));
  });
}

}  // namespace

CORBA::ORB_var start_panel_orb() {
  omniConnectionMgmt::init();
  return client::start_orb(kPollTimeout_s);
}

CorbaPort::CorbaPort(CORBA::ORB_ptr orb, std::string robot)
    : orb_(CORBA::ORB::_duplicate(orb)), robot_(std::move(robot)) {}

json CorbaPort::connect() {
  address_ = client::find_robot(robot_);
  stop_connection_ = stop_reference(orb_.in(), address_);
  const StopWay way = new_stop_way(orb_.in(), address_);
  {
    const std::lock_guard lock(mutex_);
    stop_way_ = way;
  }
  arm_ = client::find_arm(orb_.in(), address_);
  polls_ = 0;
  return client::call(address_, [&] {
    const Corbot::JointList_var joints = arm_->Joints();
    const CORBA::String_var urdf = arm_->Description();
    const Corbot::ServantInfo_var servant = arm_->Servant();
    return json{{"name", printable(address_.name)},
                {"address", printable(address_.where)},
                {"joints", joints_data(joints.in())},
                {"urdf", urdf.in()},
                {"servant",
                 {{"version", printable(servant->version.in())},
                  {"profile", printable(servant->profile.in())},
                  {"started_s", servant->started}}}};
  });
}

json CorbaPort::state() {
  return client::call(address_, [&] {
    if (polls_++ % kSlowPolls == 0) {
      const Corbot::AlarmList_var alarms = arm_->Alarms();
      alarms_ = active_alarms(alarms.in());
      (void)stop_connection_->CycleAge();  // opens the connection for Stops, and keeps it open
    }
    const Corbot::ArmState_var now = arm_->State();
    json state = state_data(now.in());
    state["alarms"] = alarms_;
    return state;
  });
}

CorbaPort::StopWay CorbaPort::new_stop_way(CORBA::ORB_ptr orb, const client::Address& address) {
  StopWay way{address, stop_reference(orb, address)};
  omniORB::setClientCallTimeout(way.arm.in(), kStopTimeout_ms);
  return way;
}

CorbaPort::StopWay CorbaPort::stop_way() const {
  const std::lock_guard lock(mutex_);
  return stop_way_;
}

void CorbaPort::stop() {
  StopWay way = stop_way();
  if (CORBA::is_nil(way.arm)) way = new_stop_way(orb_.in(), client::find_robot(robot_));
  client::call(way.address, [&] { way.arm->Stop(); });
}

}  // namespace corbot::panel
