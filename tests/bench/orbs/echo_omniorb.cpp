// SPDX-License-Identifier: Apache-2.0
// A bare omniORB servant: a constant for CartCoord, nothing for Move. Serves until its standard input closes.
#include <unistd.h>

#include <cstdio>
#include <robot.hh>

namespace {

class Echo final : public POA_Corbot::Robot {
 public:
  Corbot::CartesianCoord CartCoord() override { return {0.2, 0.0, 0.1, 0.0, 0.0, 0.0}; }
  void Move(CORBA::Double, CORBA::Double, CORBA::Double, CORBA::Double, CORBA::Double) override {}

  Corbot::JointCoord* ArtiCoord() override { throw CORBA::NO_IMPLEMENT(); }
  Corbot::GripperState GripperStatus() override { throw CORBA::NO_IMPLEMENT(); }
  Corbot::RobotState Status() override { throw CORBA::NO_IMPLEMENT(); }
  Corbot::RobotKind RobotType() override { throw CORBA::NO_IMPLEMENT(); }
  CORBA::Long DoF() override { throw CORBA::NO_IMPLEMENT(); }
  Corbot::JointRanges* MovRange() override { throw CORBA::NO_IMPLEMENT(); }
  CORBA::Double Reach() override { throw CORBA::NO_IMPLEMENT(); }
  void MoveS(CORBA::Double, CORBA::Double, CORBA::Double, CORBA::Double, CORBA::Double) override {
    throw CORBA::NO_IMPLEMENT();
  }
  void MoveC(const Corbot::Point&, const Corbot::Point&, const Corbot::Point&) override {
    throw CORBA::NO_IMPLEMENT();
  }
  void Drive(CORBA::Long, CORBA::Double, CORBA::Double) override { throw CORBA::NO_IMPLEMENT(); }
  void Ready() override { throw CORBA::NO_IMPLEMENT(); }
  void Delay(CORBA::Double) override { throw CORBA::NO_IMPLEMENT(); }
  void Open() override { throw CORBA::NO_IMPLEMENT(); }
  void Close() override { throw CORBA::NO_IMPLEMENT(); }
  void Speed(CORBA::Double) override { throw CORBA::NO_IMPLEMENT(); }
  void ArtSpeed(CORBA::Long, CORBA::Double) override { throw CORBA::NO_IMPLEMENT(); }
  void AllSpeed(CORBA::Double) override { throw CORBA::NO_IMPLEMENT(); }
};

}  // namespace

int main(int argc, char** argv) try {
  CORBA::ORB_var orb = CORBA::ORB_init(argc, argv);
  CORBA::Object_var object = orb->resolve_initial_references("omniINSPOA");
  PortableServer::POA_var poa = PortableServer::POA::_narrow(object);
  Echo echo;
  PortableServer::ObjectId_var id = PortableServer::string_to_ObjectId("echo");
  poa->activate_object_with_id(id, &echo);
  PortableServer::POAManager_var manager = poa->the_POAManager();
  manager->activate();
  std::puts("ready");
  std::fflush(stdout);
  char byte = 0;
  while (::read(STDIN_FILENO, &byte, 1) > 0) {
  }
  orb->destroy();
  return 0;
} catch (const CORBA::Exception& error) {
  std::fprintf(stderr, "echo on omniORB: CORBA %s\n", error._name());
  return 1;
}
