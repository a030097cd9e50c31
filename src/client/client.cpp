// SPDX-License-Identifier: Apache-2.0
#include "client/client.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <optional>
#include <string>
#include <thread>

#include "corbot/interface_words.h"
#include "corbot/kinematics/arm_parts.h"
#include "corbot/kinematics/pose.h"
#include "corbot/units.h"

namespace corbot::client {

namespace {

/// Short enough for a progress bar, and well below any sensible --timeout.
constexpr double kPollInterval_s = 0.1;
/// Time within which a restarted servant or a briefly interrupted network is back.
constexpr std::chrono::seconds kReconnect{2};

Corbot::Point point(const Request& request, std::size_t first) {
  return {request.numbers[first], request.numbers[first + 1], request.numbers[first + 2]};
}

/// Returns a point and, if given, the numbers of an orientation.
Corbot::Pose pose(const Request& request) {
  return {point(request, 0), orientation_of(std::span(request.numbers).subspan(3))};
}

Corbot::Ticket start_pose(Corbot::_objref_Arm& arm, const Request& request) {
  return request.line ? arm.StartMovePoseS(pose(request), request.time_s)
                      : arm.StartMovePose(pose(request), request.time_s);
}

Corbot::Ticket start_relative(Corbot::_objref_Arm& arm, const Request& request) {
  const Corbot::OffsetFrame frame = request.tool ? Corbot::OffsetInTool : Corbot::OffsetInBase;
  return request.line ? arm.StartMoveRelativeS(pose(request), frame, request.time_s)
                      : arm.StartMoveRelative(pose(request), frame, request.time_s);
}

Corbot::PlanInfo* plan_pose(Corbot::_objref_Arm& arm, const Request& request) {
  return request.line ? arm.PlanMovePoseS(pose(request), request.time_s)
                      : arm.PlanMovePose(pose(request), request.time_s);
}

Corbot::PlanInfo* plan_relative(Corbot::_objref_Arm& arm, const Request& request) {
  const Corbot::OffsetFrame frame = request.tool ? Corbot::OffsetInTool : Corbot::OffsetInBase;
  return request.line ? arm.PlanMoveRelativeS(pose(request), frame, request.time_s)
                      : arm.PlanMoveRelative(pose(request), frame, request.time_s);
}

Corbot::JointCoord joints(const Request& request) {
  Corbot::JointCoord target;
  target.length(static_cast<CORBA::ULong>(request.numbers.size()));
  for (CORBA::ULong i = 0; i < target.length(); ++i) target[i] = request.numbers[i];
  return target;
}

/// Sets the limits of one joint; the other joints keep theirs.
void set_limit(Corbot::_objref_Arm& arm, const std::vector<double>& numbers) {
  Corbot::JointRanges_var limits = arm.SoftLimits();
  if (limits->length() == 0) limits = arm.MovRange();  // the saved limits are not known
  const auto joint = static_cast<CORBA::ULong>(numbers[0]);
  if (joint >= limits->length()) {
    throw Failure(ExitCode::kUsage,
                  fmt::format("JOINT {}: the arm has only joints 0 to {}", joint, limits->length() - 1));
  }
  limits[joint] = {numbers[1], numbers[2]};
  arm.SetSoftLimits(limits.in());
}

Corbot::WorkspaceShape shape_of(const Request& request) {
  constexpr std::uint32_t kAllPoints = bit_of(kFirstLink) - 1;
  const auto& n = request.numbers;
  Corbot::WorkspaceShape shape{};
  shape.name = request.shape->c_str();
  shape.parts = request.parts.value_or(kAllPoints);
  if (n.size() == 4) {
    shape.kind = Corbot::ShapePlane;
    shape.normal = point(request, 0);
    shape.offset = n[3];
    return shape;
  }
  shape.kind = request.within ? Corbot::ShapeInside : Corbot::ShapeOutside;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = std::array{&Corbot::Point::x, &Corbot::Point::y, &Corbot::Point::z}[i];
    shape.least.*axis = std::min(n[i], n[i + 3]);
    shape.greatest.*axis = std::max(n[i], n[i + 3]);
  }
  return shape;
}

/// Sets, replaces or removes one of the planes and boxes that clients have set; the others stay.
void change_shape(Corbot::_objref_Arm& arm, const Request& request) {
  const Corbot::WorkspaceInfo_var now = arm.Workspace();
  if (!now->known)
    throw Failure(
        ExitCode::kRefused,
        "the planes and boxes that were set are not known, or hold for another base frame: set that "
        "frame, or remove them by 'corbot workspace --reset'");
  Corbot::WorkspaceShapes shapes;
  bool was_there = false;
  const auto add = [&shapes](const Corbot::WorkspaceShape& shape) {
    shapes.length(shapes.length() + 1);
    shapes[shapes.length() - 1] = shape;
  };
  for (CORBA::ULong k = 0; k < now->further.length(); ++k) {
    const bool is_same = *request.shape == now->further[k].name.in();
    was_there = was_there || is_same;
    if (!is_same) add(now->further[k]);
    if (is_same && !request.remove) add(shape_of(request));
  }
  if (request.remove && !was_there)
    throw Failure(ExitCode::kRefused, fmt::format("clients have set no plane or box '{}'; 'corbot workspace' "
                                                  "shows those that are set",
                                                  printable(*request.shape)));
  if (!request.remove && !was_there) add(shape_of(request));
  arm.SetWorkspace(shapes);
}

/// Returns X Y Z, and an orientation if one is given.
Corbot::Pose frame(const std::vector<double>& n) {
  const Corbot::Quaternion turned =
      n.size() > 3 ? Corbot::Quaternion{n[3], n[4], n[5], n[6]} : Corbot::Quaternion{1.0, 0.0, 0.0, 0.0};
  return {{n[0], n[1], n[2]}, turned};
}

/// Adds GIOP version 1.2 to a corbaloc without a version, which would mean 1.0. A servant on ORBit2 that does
/// not know the object replies to 1.0 in another version, and the connection breaks.
std::string with_giop_version(const std::string& reference) {
  for (const char* scheme : {"corbaloc::", "corbaloc:iiop:"}) {
    const std::size_t length = std::char_traits<char>::length(scheme);
    if (!reference.starts_with(scheme)) continue;
    const std::size_t at = reference.find('@');
    if (at != std::string::npos && at < reference.find('/')) return reference;
    return reference.substr(0, length) + "1.2@" + reference.substr(length);
  }
  return reference;
}

/// Renews or releases control.
template <class Arm>
void use_control(Arm& arm, Verb verb) {
  try {
    verb == Verb::kRenew ? arm.Renew() : arm.Release();
  } catch (const Corbot::NotReady& error) {
    throw explain_control(error);
  }
}

}  // namespace

Corbot::Quaternion orientation_of(std::span<const double> numbers) {
  if (numbers.empty()) return {1.0, 0.0, 0.0, 0.0};
  if (numbers.size() > 3) return {numbers[0], numbers[1], numbers[2], numbers[3]};
  // The pitch counts upward, against the y axis.
  const Quaternion q = about({0, 0, 1}, to_radians(numbers[0])) * about({0, 1, 0}, -to_radians(numbers[1])) *
                       about({1, 0, 0}, to_radians(numbers[2]));
  return {q.w, q.x, q.y, q.z};
}

CORBA::ORB_var start_orb(double timeout_s) {
  // Trace level 0: this file reports lost connections, not the ORB.
  const char* options[][2] = {{"traceLevel", "0"}, {"maxGIOPConnectionPerServer", "20"}, {nullptr, nullptr}};
  int argc = 0;
  try {
    CORBA::ORB_var orb = CORBA::ORB_init(argc, nullptr, "omniORB4", options);
    const auto milliseconds = static_cast<CORBA::ULong>(std::clamp(timeout_s, 0.01, 86400.0) * 1000);
    omniORB::setClientCallTimeout(milliseconds);
    omniORB::setClientConnectTimeout(milliseconds);
    return orb;
  } catch (const CORBA::Exception& e) {
    throw Failure(
        ExitCode::kInternal,
        fmt::format("the ORB cannot be initialised ({}): check /etc/omniORB.cfg and $OMNIORB_CONFIG",
                    e._name()));
  }
}

CORBA::Object_var find_object(CORBA::ORB_ptr orb, const Address& address) {
  try {
    return orb->string_to_object(with_giop_version(address.uri).c_str());
  } catch (const CORBA::MARSHAL&) {
    throw explain(CORBA::INV_OBJREF(), address);  // the request was not sent
  } catch (const CORBA::SystemException& e) {
    throw explain(e, address);
  }
}

Corbot::Arm_var find_arm(CORBA::ORB_ptr orb, const Address& address) {
  const CORBA::Object_var object = find_object(orb, address);
  Corbot::Arm_var arm = client::call(address, [&] { return Corbot::Arm_var(Corbot::Arm::_narrow(object)); });
  if (CORBA::is_nil(arm)) {
    throw Failure(ExitCode::kUnreachable,
                  fmt::format("the object '{}' at {} is not a corbot arm", address.name, address.where));
  }
  return arm;
}

Client::Client(const Address& address, double timeout_s)
    : address_(address),
      orb_(start_orb(timeout_s)),
      has_own_orb_(true),
      arm_(find_arm(orb_.in(), address_)) {}

Client::Client(const Address& address, CORBA::ORB_ptr orb, Corbot::Arm_ptr arm)
    : address_(address),
      orb_(CORBA::ORB::_duplicate(orb)),
      has_own_orb_(false),
      arm_(Corbot::Arm::_duplicate(arm)) {}

Client::~Client() {
  if (!has_own_orb_) return;
  try {
    arm_ = Corbot::Arm::_nil();
    orb_->destroy();
  } catch (const CORBA::Exception&) {
    // the program ends; nothing can be done about it
  }
}

void Client::stop() {
  call([](auto& arm) { arm.Stop(); });
}

std::string Client::acquire(const std::string& who, double lease_s) {
  return call([&](auto& arm) {
    const Corbot::Arm_var control = arm.Acquire(who.c_str(), lease_s);
    const CORBA::String_var text = orb_->object_to_string(control);
    return std::string(text.in());
  });
}

void Client::cancel() {
  begin_cancel();
  stop();
}

Request with_joint_number(const Request& request, std::span<const std::string> names) {
  if (request.joint_name.empty()) return request;
  const int joint = number_of_joint(names, request.joint_name);
  Request numbered = request;
  numbered.joint_name.clear();
  if (request.joint >= 0) {
    numbered.joint = joint;
  } else {
    numbered.numbers[0] = joint;
  }
  return numbered;
}

Request Client::with_joint_number(const Request& request) {
  if (request.joint_name.empty()) return request;
  const Corbot::JointList_var joints = call([](auto& arm) { return arm.Joints(); });
  std::vector<std::string> names;
  for (CORBA::ULong i = 0; i < joints->length(); ++i) names.push_back(printable(joints.in()[i].name.in()));
  return client::with_joint_number(request, names);
}

std::string lengthening(double wanted_s, double planned_s) {
  constexpr double kTolerance_s = 1e-6;
  if (wanted_s == 0.0 || planned_s <= wanted_s + kTolerance_s) return {};
  return fmt::format(
      "--time {:g}: the limits of the arm do not allow so short a time; the robot has planned {:.3g} s",
      wanted_s, planned_s);
}

bool is_planned(Verb verb) noexcept {
  return spec_of(verb).motion && verb != Verb::kDelay && verb != Verb::kOpen && verb != Verb::kClose &&
         verb != Verb::kGripper;
}

std::string Client::perform(const Request& given, const ProgressReport& report) {
  if (cancelled_) throw explain(Corbot::Stopped("interrupted"));
  const std::optional<Corbot::Ticket> ticket = send(given);
  if (!ticket) return {};
  // The flag is set before the arm is stopped. Either the Stop came after this motion was accepted, or this
  // line sees the flag.
  if (cancelled_) stop();
  return lengthening(given.time_s, wait(*ticket, report));
}

std::optional<Corbot::Ticket> Client::send(const Request& given) {
  const Request request = with_joint_number(given);
  if (spec_of(request.verb).motion) return start(request);
  set(request);
  return std::nullopt;
}

Corbot::Ticket Client::start(const Request& request) {
  try {
    return begin(request);
  } catch (const CORBA::SystemException& e) {
    if (is_certainly_not_executed(e)) throw explain(e, address_);
    throw unknown_start(explain(e, address_));
  }
}

Corbot::Ticket Client::begin(const Request& request) {
  const auto& n = request.numbers;
  auto& arm = *arm_.in();
  const auto start = [&]() -> Corbot::Ticket {
    switch (request.verb) {
      case Verb::kMove:
        return arm.StartMove(n[0], n[1], n[2], request.above_m, request.time_s);
      case Verb::kMoveS:
        return arm.StartMoveS(n[0], n[1], n[2], request.above_m, request.time_s);
      case Verb::kMoveC:
        return arm.StartMoveC(point(request, 0), point(request, 3), point(request, 6));
      case Verb::kDrive:
        return arm.StartDrive(static_cast<CORBA::Long>(n[0]), n[1], n[2]);
      case Verb::kJoints:
        return arm.StartMoveJoints(joints(request), request.time_s);
      case Verb::kReady:
        return arm.StartReady();
      case Verb::kDelay:
        return arm.StartDelay(n[0]);
      case Verb::kOpen:
        return arm.StartOpen();
      case Verb::kClose:
        return arm.StartClose();
      case Verb::kGripper:
        return arm.StartSetGripper(n[0]);
      case Verb::kMovePose:
        return start_pose(arm, request);
      case Verb::kMoveRelative:
        return start_relative(arm, request);
      default:
        throw Failure(ExitCode::kInternal, "not a motion: " + to_string(request));
    }
  };
  return call_user([&] { return with_units(request.verb, start); });
}

Corbot::PlanInfo_var Client::plan(const Request& given) {
  const Request request = with_joint_number(given);
  const auto& n = request.numbers;
  return call([&](auto& arm) {
    return with_units(request.verb, [&]() -> Corbot::PlanInfo* {
      switch (request.verb) {
        case Verb::kMove:
          return arm.PlanMove(n[0], n[1], n[2], request.above_m, request.time_s);
        case Verb::kMoveS:
          return arm.PlanMoveS(n[0], n[1], n[2], request.above_m, request.time_s);
        case Verb::kMoveC:
          return arm.PlanMoveC(point(request, 0), point(request, 3), point(request, 6));
        case Verb::kDrive:
          return arm.PlanDrive(static_cast<CORBA::Long>(n[0]), n[1], n[2]);
        case Verb::kJoints:
          return arm.PlanMoveJoints(joints(request), request.time_s);
        case Verb::kReady:
          return arm.PlanReady();
        case Verb::kMovePose:
          return plan_pose(arm, request);
        case Verb::kMoveRelative:
          return plan_relative(arm, request);
        default:
          throw Failure(
              ExitCode::kInternal,
              "internal error: the client cannot send this command as a motion: " + to_string(request));
      }
    });
  });
}

void Client::set(const Request& request) {
  const auto& n = request.numbers;
  call([&](auto& arm) {
    switch (request.verb) {
      case Verb::kSpeed:
        if (request.joint >= 0) return arm.ArtSpeed(request.joint, n[0]);
        return request.all ? arm.AllSpeed(n[0]) : arm.Speed(n[0]);
      case Verb::kPitch:
        return arm.SetToolPitch(n[0]);
      case Verb::kOrientation:
        return request.reset ? arm.ResetToolOrientation() : arm.SetToolOrientation(orientation_of(n));
      case Verb::kLimit:
        return request.reset ? arm.ResetSoftLimits() : with_units(request.verb, [&] { set_limit(arm, n); });
      case Verb::kTool:
        return arm.SetToolFrame(frame(n));
      case Verb::kBase:
        return arm.SetBaseFrame(frame(n));
      case Verb::kFrames:
        if (!request.reset)
          throw Failure(
              ExitCode::kUsage,
              "frames: a program cannot show frames; write 'frames --reset' for the profile's frames");
        return arm.ResetFrames();
      case Verb::kWorkspace:
        return request.reset ? arm.ResetWorkspace() : change_shape(arm, request);
      case Verb::kOverride:
        return arm.Override(n[0]);
      case Verb::kStop:
        return arm.Stop();
      case Verb::kCancel:
        return arm.Cancel(static_cast<Corbot::Ticket>(n[0]));
      case Verb::kPause:
        return arm.Pause();
      case Verb::kResume:
        return arm.Resume();
      case Verb::kHold:
        return arm.StopAndHold();
      case Verb::kClear:
        return arm.Clear();
      case Verb::kRenew:
      case Verb::kRelease:
        return use_control(arm, request.verb);
      default:
        throw Failure(ExitCode::kInternal, "not a setting: " + to_string(request));
    }
  });
}

std::optional<Corbot::JointInfo> Client::info_of(CORBA::Long joint) const {
  if (joint < 0) return std::nullopt;
  try {
    const Corbot::JointList_var joints = arm_->Joints();
    const auto index = static_cast<CORBA::ULong>(joint);
    return index < joints->length() ? std::optional(joints.in()[index]) : std::nullopt;
  } catch (const CORBA::Exception&) {
    return std::nullopt;  // an older servant, or no connection: the refusal itself matters
  }
}

std::string Client::pitch_clause(Verb verb) const {
  if (verb != Verb::kMove && verb != Verb::kMoveS && verb != Verb::kMoveC) return {};
  try {
    const double pitch_deg = arm_->ToolPitch();
    if (pitch_deg == 0.0 && !has_default_pitch(arm_->RobotType(), static_cast<std::size_t>(arm_->DoF())))
      return {};  // none is set, or the arm has none, or 0 is set
    return fmt::format("; the tool pitch is {} degrees ('corbot pitch' sets another)", plain(pitch_deg));
  } catch (const CORBA::Exception&) {
    return {};  // as for info_of()
  }
}

std::string Client::pitch_clause(Verb verb, const Corbot::LimitExceeded& e) const {
  const bool is_heading = e.articulation == 0;  // the same at every pitch
  return is_heading || std::string_view(e.quantity.in()) != kJointRangeWord ? "" : pitch_clause(verb);
}

std::string Client::frames_clause() const {
  const auto clause = [](const char* name, const Corbot::Pose& frame) {
    const Corbot::Point& p = frame.position;
    return fmt::format("; the {} frame has its origin at ({}, {}, {}) m ('corbot frames')", name, plain(p.x),
                       plain(p.y), plain(p.z));
  };
  try {
    const Corbot::Pose tool = arm_->ToolFrame(), base = arm_->BaseFrame();
    return (has_offset(tool) ? clause("tool", tool) : "") +
           (has_offset(base) || is_turned(base) ? clause("base", base) : "");
  } catch (const CORBA::Exception&) {
    return {};  // as for info_of()
  }
}

Corbot::MotionInfo_var Client::follow(Corbot::Ticket ticket) {
  try {
    return arm_->Wait(ticket, kPollInterval_s);
  } catch (const Corbot::QueueFull&) {
    // Other calls occupy all slots for waiting; the motion is not affected.
    std::this_thread::sleep_for(std::chrono::duration<double>(kPollInterval_s));
    return arm_->Progress(ticket);
  }
}

double Client::wait(Corbot::Ticket ticket, const ProgressReport& report) {
  std::optional<std::chrono::steady_clock::time_point> lost;
  for (;;) {
    Corbot::MotionInfo_var info;
    try {
      info = follow(ticket);
      lost.reset();
    } catch (const Corbot::BadParameter&) {
      throw unknown_end(ticket, "the servant was restarted meanwhile and has no record of the motion", false);
    } catch (const CORBA::SystemException& e) {
      // A servant issued the ticket: the motion is accepted, even if the connection is lost.
      const auto now = std::chrono::steady_clock::now();
      if (!lost) lost = now;
      if (is_call_timeout(e) || now - *lost > kReconnect)
        throw unknown_end(ticket,
                          is_call_timeout(e)
                              ? fmt::format("no answer from {} in time", address_.where)
                              : fmt::format("the servant at {} closed the connection", address_.where));
      std::this_thread::sleep_for(std::chrono::duration<double>(kPollInterval_s));
      continue;
    }
    switch (info->state) {
      case Corbot::MotionDone:
        if (report) report(1.0);
        return info->duration;
      case Corbot::MotionStopped:
        throw explain(Corbot::Stopped(info->reason));
      case Corbot::MotionFailed:
        throw Failure(ExitCode::kRefused, fmt::format("the motion failed: {} (see 'corbot alarms')",
                                                      printable(info->reason.in())));
      default:
        if (report) report(info->progress);
    }
  }
}

}  // namespace corbot::client
