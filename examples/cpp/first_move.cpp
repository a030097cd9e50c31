// SPDX-License-Identifier: Apache-2.0
// Prints the joints and moves the tool, twice; the second point is out of reach. first_move [REFERENCE]
#include <csignal>
#include <cstdio>

#include "arm.hh"

volatile std::sig_atomic_t interrupted = 0;

// Each exception of the interface has members of its own.
static void explain(const CORBA::Exception& error) {
  std::fprintf(stderr, "%s", error._name());
  if (const auto* far = Corbot::Unreachable::_downcast(&error)) {
    std::fprintf(stderr, ": nothing moved: %s", far->reason.in());
  } else if (const auto* limit = Corbot::LimitExceeded::_downcast(&error)) {
    std::fprintf(stderr, ": nothing moved: %s", limit->quantity.in());
    if (limit->articulation >= 0) std::fprintf(stderr, " of joint %d", static_cast<int>(limit->articulation));
    std::fprintf(stderr, ": %.4g is not within %.4g to %.4g", limit->value, limit->lower, limit->upper);
  } else if (const auto* full = Corbot::QueueFull::_downcast(&error)) {
    std::fprintf(stderr, ": %d motions or calls wait already: try again when one has ended",
                 static_cast<int>(full->capacity));
  } else if (const auto* bad = Corbot::BadParameter::_downcast(&error)) {
    std::fprintf(stderr, ": %s = %g: %s", bad->parameter.in(), bad->value, bad->reason.in());
  } else if (const auto* fault = Corbot::NotReady::_downcast(&error)) {
    std::fprintf(stderr, ": %s", fault->reason.in());
  } else if (CORBA::TRANSIENT::_downcast(&error)) {
    std::fprintf(stderr, ": is the robot up?");
  }
  std::fprintf(stderr, "\n");
}

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
        explain(refusal);
      } catch (const Corbot::LimitExceeded& refusal) {
        explain(refusal);
      }
      Corbot::JointCoord_var joints = arm->ArtiCoord();
      std::printf("joints");
      for (CORBA::ULong i = 0; i < joints->length(); ++i) std::printf(" %.1f", joints[i]);
      std::printf(" degrees\n");
    }
  } catch (const CORBA::Exception& error) {
    return explain(error), 1;
  }
}
