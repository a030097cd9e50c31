// SPDX-License-Identifier: Apache-2.0
// fault_client CORBALOC [X Y Z X Y Z]: moves the arm to and fro between two places for ever, freely and in
// straight lines, and prints a line a call: 'ok', or the exception's name and its reason. `drive` in place of
// numbers: it turns joint 0 instead.
#include <arm.hh>
#include <cstdlib>
#include <exception>
#include <string>
#include <vector>

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
  std::vector<Corbot::Point> places{{0.20, 0.08, 0.10}, {0.20, -0.08, 0.08}};
  if (argc == 3) places.resize(1);
  for (int i = 2; i + 2 < argc && argc == 8; i += 3) {
    places[static_cast<std::size_t>(i / 3)] = {std::atof(argv[i]), std::atof(argv[i + 1]),
                                               std::atof(argv[i + 2])};
  }
  int orb_argc = 1;
  CORBA::ORB_var orb = CORBA::ORB_init(orb_argc, argv);
  CORBA::Object_var object = orb->string_to_object(reference.c_str());
  Corbot::Arm_var arm = Corbot::Arm::_narrow(object);
  const bool drives = places.size() == 1;
  for (std::size_t i = 0;; ++i) {
    try {
      if (drives) {
        Corbot::JointCoord_var joints = arm->ArtiCoord();
        arm->Drive(0, joints[0] < 15.0 ? 30.0 : -30.0, 60.0);
      } else {
        const Corbot::Point& to = places[i % 2];
        i % 4 < 2 ? arm->Move(to.x, to.y, to.z, 0.0, 0.0) : arm->MoveS(to.x, to.y, to.z, 0.0, 0.0);
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
