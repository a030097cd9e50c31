// SPDX-License-Identifier: Apache-2.0
// fault_client CORBALOC: moves the arm to and fro for ever and prints a line a call: 'ok', or the exception's
// name and its reason.
#include <arm.hh>
#include <exception>

#include <fmt/core.h>

namespace {

void say(const std::string& line) {
  fmt::print("{}\n", line);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 2) return 2;
  const std::string reference = argv[1];
  int orb_argc = 1;
  CORBA::ORB_var orb = CORBA::ORB_init(orb_argc, argv);
  CORBA::Object_var object = orb->string_to_object(reference.c_str());
  Corbot::Arm_var arm = Corbot::Arm::_narrow(object);
  for (int i = 0;; ++i) {
    const double side = i % 2 == 0 ? 0.08 : -0.08;
    try {
      if (i % 4 < 2) {
        arm->Move(0.20, side, 0.10, 0.0, 0.0);
      } else {
        arm->MoveS(0.20, side, 0.08, 0.0, 0.0);
      }
      say("ok");
    } catch (const Corbot::NotReady& error) {
      say(fmt::format("NotReady {}", error.reason.in()));
    } catch (const CORBA::Exception& error) {
      say(fmt::format("{}", error._name()));
    }
  }
} catch (const CORBA::Exception& error) {
  say(fmt::format("start {}", error._name()));
  return 1;
} catch (const std::exception& error) {
  say(fmt::format("start {}", error.what()));
  return 1;
}
