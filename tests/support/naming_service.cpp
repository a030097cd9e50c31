// SPDX-License-Identifier: Apache-2.0
#include "support/naming_service.h"

#include <fmt/core.h>
#include <signal.h>

#include <filesystem>
#include <stdexcept>
#include <vector>

#include "support/paths.h"
#include "support/robot_rig.h"

namespace corbot::test {

NamingService::NamingService(int port)
    : port_(port), logs_(fmt::format("{}/{}", CORBOT_SCRATCH_DIR, unique_name("naming"))) {
  std::filesystem::create_directories(logs_);
  process_ = std::make_unique<Process>(
      std::vector<std::string>{"omniNames", "-start", std::to_string(port), "-logdir", logs_, "-ORBendPoint",
                               fmt::format("giop:tcp:127.0.0.1:{}", port), "-errlog", logs_ + "/errors"});
  const bool answers = wait_until(within(30), [&] {
    return raised_by([&] { CORBA::Object_var found = resolve("nobody"); }) == "NotFound";
  });
  if (!answers) throw std::runtime_error("omniNames does not come up: " + process_->errors());
}

NamingService::~NamingService() {
  process_->signal(SIGKILL);
  process_.reset();
  std::filesystem::remove_all(logs_);
}

std::string NamingService::reference() const {
  return fmt::format("corbaloc::127.0.0.1:{}/NameService", port_);
}

CosNaming::NamingContextExt_ptr NamingService::root() const {
  CORBA::Object_var object = client_orb()->string_to_object(reference().c_str());
  return CosNaming::NamingContextExt::_narrow(object);
}

CORBA::Object_ptr NamingService::resolve(const std::string& robot) const {
  CosNaming::NamingContextExt_var context = root();
  return context->resolve_str(("Robots/" + robot + ".Robot").c_str());
}

void NamingService::bind(const std::string& robot, CORBA::Object_ptr object) const {
  CosNaming::NamingContextExt_var context = root();
  CosNaming::Name_var name = context->to_name(("Robots/" + robot + ".Robot").c_str());
  context->rebind(name, object);
}

bool NamingService::knows(const std::string& robot) const {
  return raised_by([&] { CORBA::Object_var found = resolve(robot); }).empty();
}

}  // namespace corbot::test
