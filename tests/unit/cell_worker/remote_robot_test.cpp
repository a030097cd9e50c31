// SPDX-License-Identifier: Apache-2.0
// Tests a worker's robot over CORBA: a robot of robot.idl alone that loses replies, and a real arm.
#include "cell/coordinator/remote_robot.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <future>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>

#include "support/robot_rig.h"
#include "support/running_seconds.h"

namespace corbot::test {
namespace {

using Eigen::Vector3d;

/// The end of the next motion of a PlainRobot.
enum class Mishap { kNone, kQueueFull, kLostBefore, kLostAfter };

/// A servant of robot.idl that moves at once.
class PlainRobot : public POA_Corbot::Robot {
 public:
  Mishap mishap{Mishap::kNone};
  bool has_arcs{true}, knows_arcs{true};
  int losses{0};  ///< number of lost replies of Status
  std::vector<std::string> moved;

  Corbot::JointCoord* ArtiCoord() override { return new Corbot::JointCoord; }
  Corbot::CartesianCoord CartCoord() override { return {tool_.x(), tool_.y(), tool_.z(), 0, 0, 0}; }
  Corbot::GripperState GripperStatus() override { return Corbot::Open; }
  Corbot::RobotState Status() override {
    if (losses-- > 0) throw CORBA::COMM_FAILURE(0, CORBA::COMPLETED_MAYBE);
    return Corbot::Standby;
  }
  Corbot::RobotKind RobotType() override { return Corbot::Scara; }
  CORBA::Long DoF() override { return 0; }
  Corbot::JointRanges* MovRange() override { return new Corbot::JointRanges; }
  CORBA::Double Reach() override { return 1; }
  void Move(double x, double y, double z, double d, double /*t*/) override { go("Move", {x, y, z + d}); }
  void MoveS(double x, double y, double z, double d, double /*t*/) override { go("MoveS", {x, y, z + d}); }
  void MoveC(const Corbot::Point&, const Corbot::Point&, const Corbot::Point& end) override {
    if (!has_arcs) throw CORBA::NO_IMPLEMENT(0, CORBA::COMPLETED_NO);
    if (!knows_arcs) throw CORBA::BAD_OPERATION(0, CORBA::COMPLETED_NO);
    go("MoveC", {end.x, end.y, end.z});
  }
  void Drive(CORBA::Long, double, double) override { go("Drive", tool_); }
  void Ready() override { go("Ready", tool_); }
  void Delay(double) override { go("Delay", tool_); }
  void Open() override { go("Open", tool_); }
  void Close() override { go("Close", tool_); }
  void Speed(double) override {}
  void ArtSpeed(CORBA::Long, double) override {}
  void AllSpeed(double) override {}

 private:
  void go(const std::string& name, const Vector3d& tool) {
    const Mishap mishap_now = std::exchange(mishap, Mishap::kNone);
    if (mishap_now == Mishap::kQueueFull) throw Corbot::QueueFull(16);
    if (mishap_now == Mishap::kLostBefore) throw CORBA::COMM_FAILURE(0, CORBA::COMPLETED_MAYBE);
    moved.push_back(name);
    tool_ = tool;
    if (mishap_now == Mishap::kLostAfter) throw CORBA::COMM_FAILURE(0, CORBA::COMPLETED_MAYBE);
  }

  Vector3d tool_{0, 0, 0.3};
};

/// A PlainRobot, served in this process.
class Activated {
 public:
  Activated() {
    const CORBA::Object_var object = client_orb()->resolve_initial_references("RootPOA");
    poa_ = PortableServer::POA::_narrow(object);
    const PortableServer::POAManager_var manager = poa_->the_POAManager();
    manager->activate();
    id_ = poa_->activate_object(&robot);
    const CORBA::Object_var reference = poa_->id_to_reference(id_);
    const CORBA::String_var text = client_orb()->object_to_string(reference.in());
    uri = text.in();
  }
  Activated(const Activated&) = delete;
  Activated& operator=(const Activated&) = delete;
  ~Activated() { poa_->deactivate_object(id_); }

  PlainRobot robot;
  std::string uri;

 private:
  PortableServer::POA_var poa_;
  PortableServer::ObjectId_var id_;
};

TEST(RemoteRobot, CommandsAreRepeatedUnlessTheRobotHasArrived) {
  Activated activated;
  PlainRobot& plain = activated.robot;
  cell::WorkGate gate;
  cell::RemoteRobot robot(client_orb(), activated.uri, "test", 10, std::stop_token(), gate);
  EXPECT_FALSE(robot.acquire());  // robot.idl has no control
  const Vector3d point(0.2, 0.1, 0.03);
  struct Case {
    Mishap mishap;
    std::size_t moves;
    std::size_t opens;
  };
  // A gripper has no position to compare, so the command is repeated after a lost reply.
  for (const Case& c : {Case{Mishap::kNone, 1, 1}, Case{Mishap::kQueueFull, 1, 1},
                        Case{Mishap::kLostBefore, 1, 1}, Case{Mishap::kLostAfter, 1, 2}}) {
    plain.moved.clear();
    plain.mishap = c.mishap;
    robot.move_s(point, 0.06, 0.24);
    EXPECT_EQ(plain.moved.size(), c.moves);
    EXPECT_LT((robot.rest_position() - Vector3d(0.2, 0.1, 0.09)).norm(), 1e-9);
    plain.moved.clear();
    plain.mishap = c.mishap;
    robot.open();
    EXPECT_EQ(plain.moved.size(), c.opens);
    robot.move(Vector3d(0.1, 0, 0.2), 0);
  }
  robot.stop();
  EXPECT_THROW(robot.open(), Corbot::Stopped);
}

TEST(RemoteRobot, ARobotWithoutArcsRefusesAnArcAsABadParameter) {
  Activated activated;
  cell::WorkGate gate;
  cell::RemoteRobot robot(client_orb(), activated.uri, "test", 10, std::stop_token(), gate);
  const Vector3d begin(0.2, 0, 0.1), middle(0.14, 0.14, 0.11), end(0, 0.2, 0.1);
  activated.robot.mishap = Mishap::kLostAfter;
  robot.move_c(begin, middle, end);
  EXPECT_THAT(activated.robot.moved, testing::ElementsAre("MoveC")) << "the arm has arrived";
  EXPECT_LT((robot.rest_position() - end).norm(), 1e-9);
  activated.robot.has_arcs = false;
  EXPECT_THROW(robot.move_c(begin, middle, end), Corbot::BadParameter);
  activated.robot.has_arcs = true;
  activated.robot.knows_arcs = false;
  EXPECT_THROW(robot.move_c(begin, middle, end), Corbot::BadParameter);
}

/// The first call on a dead servant's connection fails.
TEST(RemoteRobot, AStateIsAskedOnceMoreWhereTheConnectionFails) {
  Activated activated;
  cell::WorkGate gate;
  cell::RemoteRobot robot(client_orb(), activated.uri, "test", 10, std::stop_token(), gate);
  activated.robot.losses = 1;
  EXPECT_TRUE(robot.is_able());
  activated.robot.losses = 2;
  EXPECT_THROW((void)robot.is_able(), client::Failure);
}

TEST(RemoteRobot, TheTimeOfAPauseIsNoTimeWithoutAReply) {
  Activated activated;
  cell::WorkGate gate;
  gate.set_paused(true);
  cell::RemoteRobot robot(client_orb(), activated.uri, "test", 0.5, std::stop_token(), gate);
  activated.robot.mishap = Mishap::kQueueFull;
  auto command = std::async(std::launch::async, [&] { robot.open(); });
  std::this_thread::sleep_for(std::chrono::milliseconds(600));
  gate.set_paused(false);
  EXPECT_NO_THROW(command.get());
}

class RemoteArm : public RobotRig {
 protected:
  /// Tells if the remaining time of control rises again within five seconds.
  bool is_renewed() {
    const auto ends = std::chrono::steady_clock::now() + std::chrono::seconds(5);
    double least_s = 1e9;
    while (std::chrono::steady_clock::now() < ends) {
      const Corbot::ControlInfo_var control = arm_->Control();
      if (control->left > least_s + 0.5) return true;
      least_s = std::min(least_s, control->left);
    }
    return false;
  }
};

TEST_F(RemoteArm, HasControlUntilReleaseAndAStopEndsTheMotionUnderWay) {
  std::stop_source stop;
  cell::WorkGate gate;
  cell::RemoteRobot robot(client_orb(), reference_, "test", 60, stop.get_token(), gate);
  ASSERT_TRUE(robot.acquire());
  EXPECT_EQ(raised_by([&] { arm_->Open(); }), "NotReady") << "others are kept out";
  EXPECT_TRUE(is_renewed());
  const Vector3d above(0.2, 0, 0.1);
  robot.speed(100);
  robot.move(above, 0.02);
  EXPECT_LT((robot.rest_position() - Vector3d(0.2, 0, 0.12)).norm(), 0.005);

  robot.speed(1);  // the next motion lasts for long
  auto slow = std::async(std::launch::async, [&] { return raised_by([&] { robot.move_s(above, 0, 60); }); });
  ASSERT_TRUE(wait_for(Corbot::Waiting));
  stop.request_stop();
  robot.stop();
  EXPECT_EQ(slow.get(), "Stopped");
  EXPECT_EQ(raised_by([&] { robot.open(); }), "Stopped");
  robot.release();
  EXPECT_EQ(raised_by([&] { arm_->Open(); }), "");
}

TEST_F(RemoteArm, AStopEndsAMotionWhoseReplyWasLost) {
  std::stop_source stop;
  cell::WorkGate gate;
  cell::RemoteRobot robot(client_orb(), reference_, "test", 6, stop.get_token(), gate);
  ASSERT_TRUE(robot.acquire());
  robot.speed(1);
  std::string raised;
  auto slow = std::async(std::launch::async, [&] {
    try {
      raised = raised_by([&] { robot.move_s({0.2, 0, 0.1}, 0, 60); });
    } catch (const client::Failure& e) {
      raised = e.what();
    }
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(6500));
  ASSERT_EQ(arm_->Status(), Corbot::Waiting) << "the motion goes on after its reply is given up";
  stop.request_stop();
  EXPECT_LT(running_seconds_of([&] { robot.stop(); }), 1.5);
  EXPECT_TRUE(wait_for(Corbot::Standby, 0.5));
  EXPECT_LT(running_seconds_of([&] { slow.get(); }), 1);
  EXPECT_EQ(raised, "Stopped");
  robot.release();
}

/// A worker treats Stopped as a person's Stop.
TEST_F(RemoteArm, TheEndOfTheTaskIsNoStop) {
  cell::WorkGate gate;
  cell::RemoteRobot robot(client_orb(), reference_, "test", 60, std::stop_token(), gate);
  ASSERT_TRUE(robot.acquire());
  robot.speed(1);
  auto slow = std::async(std::launch::async, [&] {
    return raised_by([&] { robot.move_s({0.2, 0, 0.1}, 0, 60); });
  });
  ASSERT_TRUE(wait_for(Corbot::Waiting));
  EXPECT_EQ(rt_->terminate(), 0) << rt_->errors();
  EXPECT_EQ(slow.get(), "NotReady");
  rt_.reset();
}

TEST_F(RemoteArm, AStopDoesNotWaitForAFrozenServant) {
  std::stop_source stop;
  cell::WorkGate gate;
  cell::RemoteRobot robot(client_orb(), reference_, "test", 5, stop.get_token(), gate);
  ASSERT_TRUE(robot.acquire());
  robot.speed(1);
  auto slow = std::async(std::launch::async, [&] {
    try {
      robot.move_s({0.2, 0, 0.1}, 0, 60);
    } catch (const std::exception&) {    // NOLINT(bugprone-empty-catch): the test is of stop()
    } catch (const CORBA::Exception&) {  // NOLINT(bugprone-empty-catch)
    }
  });
  ASSERT_TRUE(wait_for(Corbot::Waiting));
  servant_->signal(SIGSTOP);
  stop.request_stop();
  EXPECT_LT(running_seconds_of([&] { robot.stop(); }), 3.5);
  EXPECT_LT(running_seconds_of([&] { slow.get(); }), 5);
  servant_->signal(SIGCONT);
}

TEST_F(RemoteArm, ADelayMayLastAsLongAsAMotion) {
  cell::WorkGate gate;
  cell::RemoteRobot robot(client_orb(), reference_, "test", 60, std::stop_token(), gate);
  ASSERT_TRUE(robot.acquire());
  EXPECT_LT(running_seconds_of([&] { robot.delay(5.5); }), 8) << "it was given up, and repeated";
  robot.release();
}

TEST_F(RemoteArm, ControlThatHasEndedIsAcquiredAgain) {
  cell::WorkGate gate;
  cell::RemoteRobot robot(client_orb(), reference_, "test", 10, std::stop_token(), gate);
  ASSERT_TRUE(robot.acquire());
  servant_->signal(SIGSTOP);
  std::this_thread::sleep_for(std::chrono::milliseconds(6500));
  servant_->signal(SIGCONT);
  ASSERT_TRUE(wait_until(within(10), [&] {
    const Corbot::ControlInfo_var control = arm_->Control();
    return std::string(control->holder.in()).empty();
  }));
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));  // the next renewal is refused
  EXPECT_TRUE(robot.acquire());
  EXPECT_EQ(raised_by([&] { robot.open(); }), "");
  robot.release();
}

}  // namespace
}  // namespace corbot::test
