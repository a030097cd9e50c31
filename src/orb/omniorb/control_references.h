// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <arm.hh>

namespace corbot::omni {

/// The references that Acquire returns. Their object key consists of the robot's name and the key of
/// exclusive control. One servant serves all such object keys. A reference that a process has issued is
/// therefore valid in the next process, too. A reference that was never issued gets the same answer as one
/// whose control has ended.
class ControlReferences {
 public:
  ControlReferences(CORBA::ORB_ptr orb, const std::string& robot);

  /// `servant` outlives the ORB's service.
  void serve(PortableServer::Servant servant);
  [[nodiscard]] Corbot::Arm_ptr make(const char* key) const;
  /// Returns the prefix of the object keys of these references.
  [[nodiscard]] std::string key_prefix() const;
  /// Returns the key in the reference of this thread's call, see corbot_read_key; never empty.
  [[nodiscard]] std::string key_of_call() const;

 private:
  PortableServer::POA_var poa_;
  PortableServer::Current_var current_;
};

}  // namespace corbot::omni
