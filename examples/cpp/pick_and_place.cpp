// SPDX-License-Identifier: Apache-2.0
// Takes a piece from one place to another with any robot that has robot.idl. pick_and_place [REFERENCE]
#include <cstdio>

#include "robot.hh"

namespace {

constexpr Corbot::Point kFrom{0.20, 0.10, 0.03};  // the grasp, metres
constexpr Corbot::Point kTo{0.20, -0.10, 0.03};
constexpr double kAbove_m = 0.06;
constexpr double kSettle_s = 0.1;  // before the gripper moves

// Comes from above, opens or closes the gripper, and goes up again, both in a line.
void visit(Corbot::Robot_ptr robot, const Corbot::Point& p, bool closes) {
  robot->Move(p.x, p.y, p.z, kAbove_m, 0);
  robot->MoveS(p.x, p.y, p.z, 0, 0);
  robot->Delay(kSettle_s);
  closes ? robot->Close() : robot->Open();
  robot->MoveS(p.x, p.y, p.z, kAbove_m, 0);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    CORBA::ORB_var orb = CORBA::ORB_init(argc, argv);
    CORBA::Object_var object = orb->string_to_object(argc > 1 ? argv[1] : "corbaloc::127.0.0.1:12810/lynx5");
    Corbot::Robot_var robot = Corbot::Robot::_narrow(object);
    robot->Open();
    visit(robot, kFrom, true);
    visit(robot, kTo, false);
    std::puts("the piece is there");
  } catch (const Corbot::Unreachable& e) {
    const Corbot::Point& p = e.target;
    return std::fprintf(stderr, "(%.3f, %.3f, %.3f) m is out of reach: %s\n", p.x, p.y, p.z, e.reason.in()),
           1;
  } catch (const CORBA::Exception& e) {
    return std::fprintf(stderr, "the robot refused: %s\n", e._name()), 1;
  }
}
