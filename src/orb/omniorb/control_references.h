// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <arm.hh>

namespace corbot::omni {

/// The references that Acquire returns. Their object key is the robot's name and the key to exclusive control, and every
/// such object key comes to the same servant, so what a process has given out is valid in the next one, too, and one
/// that was never given out is answered like one that has ended.
class ControlReferences {
 public:
  ControlReferences(CORBA::ORB_ptr orb, const std::string& robot);

  /// `servant` outlives the ORB's service.
  void serve(PortableServer::Servant servant);
  [[nodiscard]] Corbot::Arm_ptr make(const char* key) const;
  /// The object key of each of these references begins with this.
  [[nodiscard]] std::string key_prefix() const;
  /// The key of the reference on which the call came that this thread carries out, see corbot_read_key; never empty.
  [[nodiscard]] std::string key_of_call() const;

 private:
  PortableServer::POA_var poa_;
  PortableServer::Current_var current_;
};

}  // namespace corbot::omni
