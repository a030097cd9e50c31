// SPDX-License-Identifier: Apache-2.0
#include "orb/omniorb/control_references.h"

#include <omniORB4/CORBA.h>
#include <omniORB4/omniIOR.h>

#include <stdexcept>

#include "robot/corbot_robot.h"

namespace corbot::omni {

ControlReferences::ControlReferences(CORBA::ORB_ptr orb, const std::string& robot) {
  CORBA::Object_var object = orb->resolve_initial_references("RootPOA");
  PortableServer::POA_var root = PortableServer::POA::_narrow(object);
  CORBA::PolicyList policies;
  policies.length(5);
  policies[0] = root->create_lifespan_policy(PortableServer::PERSISTENT);
  policies[1] = root->create_id_assignment_policy(PortableServer::USER_ID);
  policies[2] = root->create_id_uniqueness_policy(PortableServer::MULTIPLE_ID);
  policies[3] = root->create_servant_retention_policy(PortableServer::NON_RETAIN);
  policies[4] = root->create_request_processing_policy(PortableServer::USE_DEFAULT_SERVANT);
  poa_ = root->create_POA(robot.c_str(), PortableServer::POAManager::_nil(), policies);
  object = orb->resolve_initial_references("POACurrent");
  current_ = PortableServer::Current::_narrow(object);
}

void ControlReferences::serve(PortableServer::Servant servant) {
  poa_->set_servant(servant);
  PortableServer::POAManager_var manager = poa_->the_POAManager();
  manager->activate();
}

Corbot::Arm_ptr ControlReferences::make(const char* key) const {
  PortableServer::ObjectId_var id = PortableServer::string_to_ObjectId(key);
  CORBA::Object_var object = poa_->create_reference_with_id(id, Corbot::Arm::_PD_repoId);
  return Corbot::Arm::_unchecked_narrow(object);
}

std::string ControlReferences::key_prefix() const {
  const char* const some_key = "-";
  Corbot::Arm_var arm = make(some_key);
  const omniIOR_var ior = arm->_PR_getobj()->_getIOR();
  const IOP::TaggedProfileList& profiles = ior->iopProfiles();
  for (CORBA::ULong i = 0; i < profiles.length(); ++i) {
    if (profiles[i].tag != IOP::TAG_INTERNET_IOP) continue;
    IIOP::ProfileBody body;
    IIOP::unmarshalProfile(profiles[i], body);
    const std::string key(reinterpret_cast<const char*>(body.object_key.get_buffer()),
                          body.object_key.length());
    if (key.size() > 1 && key.ends_with(some_key)) return key.substr(0, key.size() - 1);
  }
  throw std::runtime_error("this omniORB makes references of another form");
}

std::string ControlReferences::key_of_call() const {
  PortableServer::ObjectId_var id = current_->get_object_id();
  char key[CORBOT_KEY];
  corbot_read_key(id->get_buffer(), id->length(), key);
  return key;
}

}  // namespace corbot::omni
