// SPDX-License-Identifier: Apache-2.0
#include "cell/coordinator/remote_robot.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

namespace corbot::cell {

using Clock = std::chrono::steady_clock;
using Eigen::Vector3d;

namespace {

constexpr double kReply_s = 5;  // time-out of a call without a motion
constexpr double kLease_s = 5;  // lease of control
constexpr double kRenew_s = 1;  // period of renewals, and time-out of a renewal
constexpr double kQueueFull_s = 0.1;
constexpr double kAgain_s = 0.1;  // time for one more read after a servant's restart
constexpr double kArrived_m = 0.005;
constexpr int kRepeats = 2;          // repetitions of a command whose reply was lost
constexpr double kStopFor_s = 2;     // time for which Stop is repeated
constexpr double kQuickReply_s = 1;  // time-out of Stop and reads, which are repeated
constexpr double kRestAtStop_s = 2;  // a stopped robot comes to rest within this time

Clock::time_point after(double duration_s) {
  return Clock::now() +
         std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(duration_s));
}

}  // namespace

/// Marks a command between its call and its reply. The constructor throws Stopped once a stop is requested.
class RemoteRobot::UnderWay {
 public:
  explicit UnderWay(RemoteRobot& robot) : robot_(robot) {
    const std::lock_guard lock(robot_.mutex_);
    if (robot_.is_stopping_ || robot_.stop_.stop_requested()) throw Corbot::Stopped("the work was stopped");
    robot_.is_under_way_ = true;
  }
  UnderWay(const UnderWay&) = delete;
  UnderWay& operator=(const UnderWay&) = delete;
  ~UnderWay() {
    const std::lock_guard lock(robot_.mutex_);
    robot_.is_under_way_ = false;
    robot_.ended_.notify_all();
  }

 private:
  RemoteRobot& robot_;
};

RemoteRobot::RemoteRobot(CORBA::ORB_ptr orb, std::string uri, std::string who, double motion_s,
                         std::stop_token stop, WorkGate& gate, std::function<void(bool)> on_pause)
    : orb_(CORBA::ORB::_duplicate(orb)),
      uri_(std::move(uri)),
      who_(std::move(who)),
      motion_s_(motion_s),
      stop_(std::move(stop)),
      gate_(gate),
      on_pause_(std::move(on_pause)) {
  use(uri_);
}

// --- Control ---

void RemoteRobot::use(const std::string& uri) {
  motions_.emplace(orb_.in(), uri, motion_s_);
  others_.emplace(orb_.in(), uri, kReply_s);
  reads_.emplace(orb_.in(), uri, kQuickReply_s);
}

/// Tells if control is still valid: a restart of the servant ends control without notice.
bool RemoteRobot::has_control() {
  if (!keeper_.joinable()) return false;
  try {
    control_->Renew();
    const std::lock_guard lock(mutex_);
    if (!CORBA::is_nil(arm_.in())) return true;
  } catch (const CORBA::Exception&) {  // NOLINT(bugprone-empty-catch): acquire() acquires control again
  }
  keeper_.request_stop();
  keeper_.join();
  control_has_ended();
  return false;
}

bool RemoteRobot::acquire() {
  if (has_control()) return true;
  use(uri_);
  try {
    const Corbot::Robot_var robot = others_->get();
    if (!robot->_is_a(Corbot::Arm::_PD_repoId)) return false;
    const Corbot::Arm_var arm = Corbot::Arm::_unchecked_narrow(robot);
    omniORB::setClientCallTimeout(arm.in(), static_cast<CORBA::ULong>(1e3 * kReply_s));
    control_ = arm->Acquire(who_.c_str(), kLease_s);
    omniORB::setClientCallTimeout(control_.in(), static_cast<CORBA::ULong>(1e3 * kReply_s));
    const CORBA::String_var reference = orb_->object_to_string(control_.in());
    use(reference.in());
    omniORB::setClientCallTimeout(arm.in(), static_cast<CORBA::ULong>(1e3 * kQuickReply_s));
    const std::lock_guard lock(mutex_);
    arm_ = arm;
    keep_control(reference.in());
  } catch (const CORBA::SystemException& e) {
    throw explain_call(e, uri_);
  }
  return true;
}

void RemoteRobot::keep_control(const std::string& control) {
  const Corbot::Arm_var held = reference_to<Corbot::Arm>(orb_.in(), control);
  omniORB::setClientCallTimeout(held.in(), static_cast<CORBA::ULong>(1e3 * kRenew_s));
  keeper_ = std::jthread([this, held](const std::stop_token& end) {
    while (true) {
      pause(kRenew_s, end);
      if (end.stop_requested()) return;
      try {
        held->Renew();
      } catch (const Corbot::NotReady&) {
        return control_has_ended();  // the next command throws NotReady
      } catch (
          const CORBA::SystemException&) {  // NOLINT(bugprone-empty-catch): the lease covers several renewals
      }
    }
  });
}

/// Forgets the arm, which another client may control now: send_stop() then sends nothing.
void RemoteRobot::control_has_ended() {
  const std::lock_guard lock(mutex_);
  arm_ = Corbot::Arm::_nil();
}

void RemoteRobot::release() {
  if (!keeper_.joinable()) return;
  keeper_.request_stop();
  keeper_.join();
  const Corbot::Arm_var control = std::exchange(control_, Corbot::Arm_var());
  use(uri_);  // for reads without control
  try {
    control->Release();
    control_has_ended();
  } catch (const Corbot::NotReady& e) {
    control_has_ended();
    throw client::explain(e);
  } catch (const CORBA::SystemException& e) {
    throw explain_call(e, uri_);
  }
}

void RemoteRobot::stop() {
  std::unique_lock lock(mutex_);
  is_stopping_ = true;
  send_stop(lock);
}

void RemoteRobot::halt() {
  std::unique_lock lock(mutex_);
  send_stop(lock);
}

void RemoteRobot::send_stop(std::unique_lock<std::mutex>& lock) {
  const Corbot::Arm_var arm = arm_;
  if (CORBA::is_nil(arm.in())) return;
  const auto gives_up = after(kStopFor_s);
  // Stop is sent without a waiting call too, since a motion may outlast its call. Stop is repeated while a
  // command is in progress, because the command may arrive after the first Stop.
  bool is_stopped = false;
  do {
    lock.unlock();
    try {
      arm->Stop();
      is_stopped = true;
    } catch (const CORBA::Exception&) {  // NOLINT(bugprone-empty-catch): Stop is repeated, and the lease ends
    }
    lock.lock();
    ended_.wait_for(lock, std::chrono::milliseconds(200), [&] { return is_stopped && !is_under_way_; });
  } while ((!is_stopped || is_under_way_) && Clock::now() < gives_up);
}

// --- Commands ---

void RemoteRobot::pass_gate() {
  const bool waits = on_pause_ && gate_.is_paused();
  if (waits) on_pause_(true);
  gate_.pass(stop_);
  if (waits) on_pause_(false);
}

/// Carries out `f`. May repeat `f`, since every command of the work is absolute.
template <class F>
void RemoteRobot::command(LazyReference<Corbot::Robot>& robot, const Target& target, F&& f) {
  auto gives_up = after(kPatience_s);
  auto queue_gives_up = after(motion_s_);
  for (int lost = 0;;) {
    const auto closed = Clock::now();
    pass_gate();
    gives_up += Clock::now() - closed;  // a pause does not count as an outage
    queue_gives_up += Clock::now() - closed;
    if (gate_.is_stopped()) throw Corbot::Stopped("the cell was stopped");
    try {
      const UnderWay mark(*this);
      if (!gate_.is_open()) continue;  // a halt closed the gate meanwhile
      return f(robot.get());
    } catch (const Corbot::QueueFull&) {
      if (Clock::now() > queue_gives_up) throw;
      pause(kQueueFull_s, stop_);
    } catch (const CORBA::SystemException& e) {
      const bool is_lost = !client::is_certainly_not_executed(e);
      if (!may_recover(e) || (is_lost ? lost++ == kRepeats : Clock::now() > gives_up))
        throw explain_call(e, uri_);
      if (is_lost && has_arrived(target)) return;
      pause(kQueueFull_s, stop_);
    }
  }
}

/// Tells if the robot rests at the target of a command whose reply was lost. False without a target.
bool RemoteRobot::has_arrived(const Target& target) {
  const Vector3d position = rest_position();
  return target && (position - *target).norm() <= kArrived_m;
}

Vector3d RemoteRobot::rest_position() {
  const auto begin = Clock::now();
  auto gives_up = after(motion_s_);
  bool is_stopping = false;
  const auto read = [&](auto&& f) { return call_patiently(uri_, kPatience_s, stop_, f); };
  while (true) {
    const Corbot::RobotState state = read([&] { return reads_->get()->Status(); });
    if (state == Corbot::Error) throw Corbot::NotReady("its status is Error");
    if (state == Corbot::Standby) break;
    if (!is_stopping && stop_.stop_requested()) {
      is_stopping = true;
      gives_up = std::min(gives_up, after(kRestAtStop_s));
    }
    if (Clock::now() > gives_up) {
      const std::chrono::duration<double> waited = Clock::now() - begin;
      throw client::Failure(client::ExitCode::kUnreachable,
                            fmt::format("{} is not at rest after {:.0f} s", uri_, waited.count()));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  const Corbot::CartesianCoord at = read([&] { return reads_->get()->CartCoord(); });
  return {at.x, at.y, at.z};
}

bool RemoteRobot::comes_to_rest(double within_s) {
  LazyReference<Corbot::Robot> robot(orb_.in(), uri_,
                                     kQuickReply_s);  // own reference, because commands run in another thread
  const auto gives_up = after(within_s);
  do {
    try {
      if (robot.get()->Status() != Corbot::Waiting) return true;
    } catch (const CORBA::Exception&) {  // NOLINT(bugprone-empty-catch): the loop reads again
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  } while (Clock::now() < gives_up);
  return false;
}

bool RemoteRobot::is_able() {
  return call_patiently(uri_, kAgain_s, stop_, [&] { return reads_->get()->Status(); }) != Corbot::Error;
}

Grip RemoteRobot::grip() {
  const auto read = [&](auto&& f) { return call_patiently(uri_, kPatience_s, stop_, f); };
  if (read([&] { return reads_->get()->GripperStatus(); }) == Corbot::Open) return Grip::kOpen;
  std::unique_lock lock(mutex_);
  const Corbot::Arm_var arm = arm_;
  lock.unlock();
  if (CORBA::is_nil(arm.in())) return Grip::kClosed;
  const Corbot::HoldingState holding = read([&] { return arm->Gripper().holding; });
  if (holding == Corbot::HoldingUnknown) return Grip::kClosed;
  return holding == Corbot::HoldingNo ? Grip::kClosedOnNothing : Grip::kClosedOnPiece;
}

void RemoteRobot::move(const Vector3d& point, double above_m) {
  command(*motions_, point + Vector3d(0, 0, above_m),
          [&](const auto& robot) { robot->Move(point.x(), point.y(), point.z(), above_m, 0); });
}

void RemoteRobot::move_s(const Vector3d& point, double above_m, double duration_s) {
  command(*motions_, point + Vector3d(0, 0, above_m),
          [&](const auto& robot) { robot->MoveS(point.x(), point.y(), point.z(), above_m, duration_s); });
}

void RemoteRobot::move_c(const Vector3d& begin, const Vector3d& middle, const Vector3d& end) {
  const auto to_point = [](const Vector3d& v) { return Corbot::Point{v.x(), v.y(), v.z()}; };
  command(*motions_, end, [&](const auto& robot) {
    try {
      robot->MoveC(to_point(begin), to_point(middle), to_point(end));
    } catch (const CORBA::NO_IMPLEMENT&) {
      throw Corbot::BadParameter("MoveC", 0, "the robot does not implement it");
    } catch (const CORBA::BAD_OPERATION&) {
      throw Corbot::BadParameter("MoveC", 0, "the robot does not have it");
    }
  });
}

void RemoteRobot::speed(double percent) {
  command(*others_, {}, [&](const auto& robot) { robot->Speed(percent); });
}

void RemoteRobot::delay(double duration_s) {
  command(*motions_, {}, [&](const auto& robot) { robot->Delay(duration_s); });
}

void RemoteRobot::open() {
  command(*motions_, {}, [](const auto& robot) { robot->Open(); });
}

void RemoteRobot::close() {
  command(*motions_, {}, [](const auto& robot) { robot->Close(); });
}

}  // namespace corbot::cell
