// SPDX-License-Identifier: Apache-2.0
// A bare omniORB servant: no planning, no channel, four doubles. Serves until its standard input closes.
#include <unistd.h>

#include <cstdio>
#include <echo.hh>

namespace {

class Echo final : public POA_CorbotBench::Echo {
 public:
  CorbotBench::Values* Joints() override {
    auto* values = new CorbotBench::Values;  // the mapping hands ownership to the ORB
    values->length(4);
    for (CORBA::ULong i = 0; i < 4; ++i) (*values)[i] = 0.25 * i;
    return values;
  }
  void Motion(CORBA::Double, CORBA::Double, CORBA::Double, CORBA::Double, CORBA::Double) override {}
};

}  // namespace

int main(int argc, char** argv) {
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
}
