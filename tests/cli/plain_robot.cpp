// SPDX-License-Identifier: Apache-2.0
// A robot of robot.idl alone, whose tool moves in lines at 0.05 m/s or less. Usage: plain_robot PORT [FAULT].
// FAULT: early (a motion returns before the arm is at rest), silent (an unreachable point is accepted), hasty
// (Delay returns at once), full (there is no Speed).
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <robot.hh>
#include <string>
#include <thread>

namespace {

using Clock = std::chrono::steady_clock;
using Vector = std::array<double, 3>;

constexpr double kReach_m = 0.5;

double distance(const Vector& a, const Vector& b) {
  return std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
}

void require(bool is_good, const char* parameter, double value) {
  if (!is_good) throw Corbot::BadParameter(parameter, value, "not allowed");
}

void pause(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

class PlainRobot : public POA_Corbot::Robot {
 public:
  explicit PlainRobot(std::string fault) : fault_(std::move(fault)) {}

  Corbot::JointCoord* ArtiCoord() override {
    auto* joints = new Corbot::JointCoord;
    joints->length(3);
    const Vector tool = now();
    for (CORBA::ULong i = 0; i < 3; ++i) (*joints)[i] = tool[i] - kReady[i];
    return joints;
  }
  Corbot::CartesianCoord CartCoord() override {
    const Vector tool = now();
    return {tool[0], tool[1], tool[2], 0, 0, 0};
  }
  Corbot::GripperState GripperStatus() override { return gripper_; }
  Corbot::RobotState Status() override {
    const std::lock_guard lock(mutex_);
    return Clock::now() < end_ ? Corbot::Waiting : Corbot::Standby;
  }
  Corbot::RobotKind RobotType() override { return Corbot::Cartesian; }
  CORBA::Long DoF() override { return 3; }
  Corbot::JointRanges* MovRange() override {
    auto* ranges = new Corbot::JointRanges;
    ranges->length(3);
    for (CORBA::ULong i = 0; i < 3; ++i) (*ranges)[i] = {-kReach_m, kReach_m};
    return ranges;
  }
  CORBA::Double Reach() override { return kReach_m; }
  void Move(double x, double y, double z, double d, double t) override { go({x, y, z + d}, t); }
  void MoveS(double x, double y, double z, double d, double t) override { go({x, y, z + d}, t); }
  void MoveC(const Corbot::Point&, const Corbot::Point&, const Corbot::Point&) override {
    throw CORBA::NO_IMPLEMENT();
  }
  void Drive(CORBA::Long, double, double) override { throw CORBA::NO_IMPLEMENT(); }
  void Ready() override { go(kReady, 0); }
  void Delay(double t) override {
    require(t >= 0 && t <= 3600, "t", t);
    if (fault_ == "hasty") return;
    const std::lock_guard turn(turn_);
    pause(t);
  }
  void Open() override { gripper_ = Corbot::Open; }
  void Close() override { gripper_ = Corbot::Close; }
  void Speed(double percent) override {
    if (fault_ == "full") throw CORBA::NO_IMPLEMENT();
    require(percent > 0 && percent <= 100, "percent", percent);
    percent_ = percent;
  }
  void ArtSpeed(CORBA::Long, double) override { throw CORBA::NO_IMPLEMENT(); }
  void AllSpeed(double) override { throw CORBA::NO_IMPLEMENT(); }

 private:
  static constexpr Vector kReady{0.2, 0, 0.1};

  Vector now() {
    const std::lock_guard lock(mutex_);
    const std::chrono::duration<double> since = Clock::now() - begin_, whole = end_ - begin_;
    const double part = whole.count() > 0 ? std::min(1.0, since / whole) : 1;
    Vector tool{};
    for (std::size_t i = 0; i < 3; ++i) tool[i] = from_[i] + part * (to_[i] - from_[i]);
    return tool;
  }

  void go(const Vector& target, double t) {
    for (const double value : target) require(std::isfinite(value), "P", value);
    require(t >= 0, "t", t);
    if (distance(target, kReady) > kReach_m) {
      if (fault_ == "silent") return;
      throw Corbot::Unreachable({target[0], target[1], target[2]}, "too far");
    }
    const std::lock_guard turn(turn_);
    const Vector here = now();
    const double duration_s = std::max(t, distance(here, target) / (0.05 * percent_ / 20));
    {
      const std::lock_guard lock(mutex_);
      from_ = here, to_ = target, begin_ = Clock::now();
      end_ = begin_ + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(duration_s));
    }
    pause(fault_ == "early" ? duration_s / 2 : duration_s);
  }

  const std::string fault_;
  std::mutex turn_;  ///< motions, one after the other
  std::mutex mutex_;
  Vector from_{kReady}, to_{kReady};
  Clock::time_point begin_, end_;
  std::atomic<double> percent_{100};
  std::atomic<Corbot::GripperState> gripper_{Corbot::Close};
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  const std::string end_point = "giop:tcp:127.0.0.1:" + std::string(argv[1]);
  const char* options[][2] = {{"endPoint", end_point.c_str()}, {nullptr, nullptr}};
  int none = 0;
  const CORBA::ORB_var orb = CORBA::ORB_init(none, nullptr, "omniORB4", options);
  const CORBA::Object_var object = orb->resolve_initial_references("omniINSPOA");
  const PortableServer::POA_var poa = PortableServer::POA::_narrow(object);
  PlainRobot robot(argc > 2 ? argv[2] : "");
  const PortableServer::ObjectId_var id = PortableServer::string_to_ObjectId("plain");
  poa->activate_object_with_id(id, &robot);
  const PortableServer::POAManager_var manager = poa->the_POAManager();
  manager->activate();
  std::puts("serves");
  std::fflush(stdout);
  orb->run();
}
