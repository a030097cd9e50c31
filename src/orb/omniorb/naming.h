// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include <omniORB4/CORBA.h>
#include <omniORB4/Naming.hh>

namespace corbot::omni {

/// Keeps `Robots/<name>.Robot` bound in a naming service, in a thread of its own. It binds when the service
/// comes up, and again after a restart or if the name points elsewhere. It works without the service while
/// that is down, and un-binds at the end. It logs each change once.
class NameBinder {
 public:
  /// `service`: corbaloc of the naming context.
  NameBinder(CORBA::ORB_ptr orb, std::string service, std::string robot, CORBA::Object_ptr reference);
  NameBinder(const NameBinder&) = delete;
  NameBinder& operator=(const NameBinder&) = delete;
  ~NameBinder();

 private:
  void run();
  void keep_bound();
  void unbind();
  [[nodiscard]] CosNaming::NamingContext_ptr root() const;
  /// Returns true if the name is bound to our object.
  [[nodiscard]] bool is_ours(CosNaming::NamingContext_ptr context) const;

  CORBA::ORB_var orb_;
  const std::string service_;
  const std::string robot_;
  CORBA::Object_var reference_;
  CosNaming::Name name_;
  bool bound_{false};
  bool has_warned_{false};

  std::mutex mutex_;
  std::condition_variable end_requested_;
  bool end_{false};
  std::thread thread_;
};

}  // namespace corbot::omni
