// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <omniORB4/Naming.hh>
#include <string>

#include "support/ports.h"
#include "support/process.h"

namespace corbot::test {

/// A naming service of its own for one test (omniNames); ends with the object and leaves nothing behind.
/// Started by the constructor, which throws when the service does not come up.
class NamingService {
 public:
  NamingService() : NamingService(free_port()) {}
  explicit NamingService(int port);
  NamingService(const NamingService&) = delete;
  NamingService& operator=(const NamingService&) = delete;
  ~NamingService();

  /// corbaloc of the root context.
  [[nodiscard]] std::string reference() const;
  /// Returns the object bound as Robots/<robot>.Robot; raises the exceptions of the service.
  [[nodiscard]] CORBA::Object_ptr resolve(const std::string& robot) const;
  /// Binds Robots/<robot>.Robot to it, beside what is bound there.
  void bind(const std::string& robot, CORBA::Object_ptr object) const;
  [[nodiscard]] bool knows(const std::string& robot) const;

 private:
  [[nodiscard]] CosNaming::NamingContextExt_ptr root() const;

  int port_;
  std::string logs_;
  std::unique_ptr<Process> process_;
};

}  // namespace corbot::test
