// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <robot.hh>
#include <string>
#include <vector>

#include "support/process.h"

namespace corbot::bench {

enum class Call { kRead, kMove };  ///< CartCoord; a Move to where the arm is

/// A client of one object, robot or echo.
class Probe {
 public:
  Probe() = default;
  Probe(const Probe&) = delete;
  Probe& operator=(const Probe&) = delete;
  virtual ~Probe() = default;
  /// Round trips of `count` calls, one after another, us.
  virtual std::vector<double> measure(Call call, int count) = 0;
};

/// An omniORB client within this process.
class OmniProbe final : public Probe {
 public:
  OmniProbe(CORBA::ORB_ptr orb, const std::string& reference);
  std::vector<double> measure(Call call, int count) override;

 private:
  Corbot::Robot_var robot_;
  Corbot::CartesianCoord here_{};
};

/// An ORBit2 client, a process of its own (client_orbit2.c).
class Orbit2Probe final : public Probe {
 public:
  Orbit2Probe(const std::string& program, const std::string& reference);
  std::vector<double> measure(Call call, int count) override;

 private:
  test::Process client_;
};

}  // namespace corbot::bench
