// SPDX-License-Identifier: Apache-2.0
#include "panel/corba_port.h"

#include <utility>

#include "client/client.h"
#include "client/json_view.h"
#include "client/local_stop.h"
#include "panel/own_reference.h"

namespace corbot::panel {

namespace {

using client::printable;
using nlohmann::json;

constexpr double kPollTimeout_s = 2.0;
/// The port reads the alarms and uses the connection for Stops once in this number of polls.
constexpr unsigned kSlowPolls = 10;
/// The port reads the loop's statistics once in this number of polls.
constexpr unsigned kLoopPolls = 50;
/// Holder of exclusive control, for people.
constexpr const char* kHolder = "panel";
/// A real-time task that is not frozen confirms a Stop within this time.
constexpr double kLocalStop_s = 3.0;

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

/// The page's user has no command line with --robot and --timeout.
client::Address find_robot(const std::string& robot) {
  client::Address address = client::find_robot(robot, kNaming);
  address.if_late = "watch the robot before you try again";
  return address;
}

Corbot::Arm_var own_arm(CORBA::ORB_ptr orb, const client::Address& address, CORBA::ULong group) {
  const CORBA::Object_var shared = client::find_object(orb, address);
  return client::call(address,
                      [&] { return Corbot::Arm_var(own_reference<Corbot::Arm>(shared.in(), group)); });
}

class CorbaPerformer : public Performer {
 public:
  CorbaPerformer(const client::Address& address, CORBA::ORB_ptr orb, Corbot::Arm_ptr arm)
      : client_(address, orb, arm) {}
  std::string perform(const client::Request& request, const client::ProgressReport& report) override {
    return client_.perform(request, report);
  }
  void begin_cancel() noexcept override { client_.begin_cancel(); }

 private:
  client::Client client_;
};

}  // namespace

CORBA::ORB_var start_panel_orb() {
  omniConnectionMgmt::init();
  return client::start_orb(kPollTimeout_s);
}

CorbaPort::CorbaPort(CORBA::ORB_ptr orb, std::string robot)
    : orb_(CORBA::ORB::_duplicate(orb)), robot_(std::move(robot)) {}

json CorbaPort::connect() {
  address_ = find_robot(robot_);
  stop_connection_ = own_arm(orb_.in(), address_, kStopConnections);
  const Way stop_way = new_way(orb_.in(), address_, kStopConnections);
  const Way call_way = new_way(orb_.in(), address_, kCallConnections);
  {
    const std::lock_guard lock(mutex_);
    stop_way_ = stop_way;
    call_way_ = call_way;
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
    if (polls_ % kLoopPolls == 0) {
      const Corbot::LoopInfo_var loop = arm_->Diagnostics();
      loop_ = client::loop_data(loop.in());
    }
    if (polls_++ % kSlowPolls == 0) {
      const Corbot::AlarmList_var alarms = arm_->Alarms();
      alarms_ = active_alarms(alarms.in());
      (void)stop_connection_->CycleAge();  // opens the connection for Stops, and keeps it open
    }
    const Corbot::ArmState_var now = arm_->State();
    json state = state_data(now.in());
    state["alarms"] = alarms_;
    state["loop"] = loop_;
    return state;
  });
}

CorbaPort::Way CorbaPort::new_way(CORBA::ORB_ptr orb, const client::Address& address, CORBA::ULong group) {
  Way way{address, own_arm(orb, address, group)};
  omniORB::setClientCallTimeout(way.arm.in(), kRestTimeout_ms);
  return way;
}

CorbaPort::Way CorbaPort::stop_way() const {
  const std::lock_guard lock(mutex_);
  return stop_way_;
}

CorbaPort::Way CorbaPort::call_way() const {
  const std::lock_guard lock(mutex_);
  return call_way_;
}

void CorbaPort::stop() {
  Way way = stop_way();
  client::stop_here_or(way.address.local, kLocalStop_s, [&] {
    if (CORBA::is_nil(way.arm)) way = new_way(orb_.in(), find_robot(robot_), kStopConnections);
    client::call(way.address, [&] { way.arm->Stop(); });
  });
}

void CorbaPort::check_connection(const Way& way) {
  client::call(way.address, [&] {
    try {
      (void)way.arm->CycleAge();
    } catch (const CORBA::COMM_FAILURE&) {
      (void)way.arm->CycleAge();  // of a servant that has started again
    }
  });
}

json CorbaPort::call(const Order& order) {
  const auto& request = std::get<client::Request>(order);
  Way way = call_way();
  if (CORBA::is_nil(way.arm)) way = new_way(orb_.in(), find_robot(robot_), kCallConnections);
  check_connection(way);
  json reply{{"done", true}};
  if (request.verb == client::Verb::kAcquire) {
    const auto acquired = client::call(
        way.address, [&] { return Corbot::Arm_var(way.arm->Acquire(kHolder, request.lease_s)); });
    set_control(acquired.in());
    return reply;
  }
  if (request.verb != client::Verb::kClear && forget_ended_control(way)) {
    throw client::Failure(client::ExitCode::kRefused,
                          "the panel's control has ended: take control again, or try again without");
  }
  const Corbot::Arm_var arm = request.verb == client::Verb::kClear
                                  ? way.arm  // needs no control, which may have ended
                                  : with_control(way.arm.in(), kCallConnections);
  client::Client robot(way.address, orb_.in(), arm.in());
  if (request.verb == client::Verb::kRelease) {
    if (CORBA::is_nil(control().in()))
      throw client::Failure(client::ExitCode::kRefused, "this panel has no control to give up");
    set_control(Corbot::Arm::_nil());
  }
  try {
    if (const auto ticket = robot.send(request)) reply["ticket"] = *ticket;
  } catch (const client::Failure&) {
    try {
      (void)forget_ended_control(way);
    } catch (const client::Failure&) {
      // the first failure counts
    }
    throw;
  }
  return reply;
}

std::unique_ptr<Performer> CorbaPort::performer() {
  const Way way = new_way(orb_.in(), find_robot(robot_), kProgramConnections);
  check_connection(way);
  if (forget_ended_control(way)) {
    throw client::Failure(
        client::ExitCode::kRefused,
        "the panel's control has ended: take control again, or start the program again without");
  }
  const Corbot::Arm_var arm = with_control(way.arm.in(), kProgramConnections);
  return std::make_unique<CorbaPerformer>(way.address, orb_.in(), arm.in());
}

Corbot::Arm_var CorbaPort::control() const {
  const std::lock_guard lock(mutex_);
  return control_;
}

void CorbaPort::set_control(Corbot::Arm_ptr control) {
  const std::lock_guard lock(mutex_);
  control_ = Corbot::Arm::_duplicate(control);
}

Corbot::Arm_var CorbaPort::with_control(Corbot::Arm_ptr arm, CORBA::ULong group) const {
  const Corbot::Arm_var held = control();
  if (CORBA::is_nil(held.in())) return Corbot::Arm::_duplicate(arm);
  Corbot::Arm_var own = own_reference<Corbot::Arm>(held.in(), group);
  omniORB::setClientCallTimeout(own.in(), kRestTimeout_ms);
  return own;
}

bool CorbaPort::forget_ended_control(const Way& way) {
  if (CORBA::is_nil(control().in())) return false;
  return client::call(way.address, [&] {
    const Corbot::ControlInfo_var control = way.arm->Control();
    if (kHolder == std::string_view(control->holder.in())) return false;
    set_control(Corbot::Arm::_nil());
    return true;
  });
}

}  // namespace corbot::panel
