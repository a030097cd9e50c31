// SPDX-License-Identifier: Apache-2.0
// Prints the joints and moves the tool, twice; the second point is out of reach. first_move [REFERENCE]
#include <csignal>
#include <cstdio>

#include "arm.hh"

volatile std::sig_atomic_t interrupted = 0;

int main(int argc, char** argv) {
  std::signal(SIGINT, [](int) { interrupted = 1; });
  try {
    CORBA::ORB_var orb = CORBA::ORB_init(argc, argv);
    CORBA::Object_var object = orb->string_to_object(argc > 1 ? argv[1] : "corbaloc::127.0.0.1:12810/lynx5");
    Corbot::Arm_var arm = Corbot::Arm::_narrow(object);
    const Corbot::Point points[] = {{0.20, 0.05, 0.08}, {0.90, 0.00, 0.10}};
    for (const Corbot::Point& p : points) {
      try {
        const Corbot::Ticket motion = arm->StartMove(p.x, p.y, p.z, 0, 0);  // metres; as fast as allowed
        Corbot::MotionInfo_var info = arm->Wait(motion, 0.1);
        while (info->state == Corbot::MotionQueued || info->state == Corbot::MotionRunning) {
          if (interrupted) arm->Stop();  // the end of this program would not stop the arm
          info = arm->Wait(motion, 0.1);
        }
        if (info->state != Corbot::MotionDone) return std::fprintf(stderr, "%s\n", info->reason.in()), 1;
        std::printf("moved to (%g, %g, %g) m\n", p.x, p.y, p.z);
      } catch (const Corbot::Unreachable& refusal) {
        std::fprintf(stderr, "nothing moved: %s\n", refusal.reason.in());
      }
      Corbot::JointCoord_var joints = arm->ArtiCoord();
      std::printf("joints");
      for (CORBA::ULong i = 0; i < joints->length(); ++i) std::printf(" %.1f", joints[i]);
      std::printf(" degrees\n");
    }
  } catch (const CORBA::Exception& error) {
    const bool nobody = CORBA::TRANSIENT::_downcast(&error) != nullptr;
    std::fprintf(stderr, "%s%s\n", error._name(), nobody ? ": is the robot up?" : "");
    return 1;
  }
}
