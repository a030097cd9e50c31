// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <arm.hh>
#include <cmath>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "support/paths.h"
#include "support/process.h"

namespace corbot::test {

/// The ORB of this test program: an omniORB client without any option.
CORBA::ORB_ptr client_orb();

/// A robot of its own for one test: real-time task and servant on a free port, under a unique
/// name. The client is an ordinary omniORB client without any option.
class RobotRig : public ::testing::Test {
 protected:
  void SetUp() override;
  /// Ends servant and task and checks that nothing is left behind.
  void TearDown() override;

  /// A unique name that begins with `stem`, and a free port for it.
  void take_name(const std::string& stem);
  /// Task, servant and client; what they find may be an Error.
  void start();
  void start_rt(const std::vector<std::string>& more = {});
  void start_servant(const std::vector<std::string>& more = {});
  /// As a client: corbaloc, narrow.
  [[nodiscard]] Corbot::Arm_var connect() const;
  [[nodiscard]] Corbot::Arm_var connect(const std::string& reference) const;

  /// Waits until the robot reports this state.
  [[nodiscard]] bool wait_for(Corbot::RobotState state, double seconds = 30.0);

  /// The alarms, without those of overruns (140), which a busy machine adds by itself.
  [[nodiscard]] std::vector<Corbot::AlarmInfo> alarms() const;

  /// Every operation that moves something raises NotReady.
  void expect_no_motion_accepted();

  std::string profile_ = CORBOT_TEST_PROFILE;
  std::string name_;
  int port_ = 0;
  std::string reference_;
  std::unique_ptr<Process> rt_;
  std::unique_ptr<Process> servant_;
  Corbot::Arm_var arm_;
};

/// Largest difference of any joint, degrees.
double distance_deg(const Corbot::JointCoord& a, const Corbot::JointCoord& b);

/// Runs `call` and returns the name of the CORBA exception that it raised, "" when none.
template <class Call>
std::string raised_by(Call&& call) {
  try {
    call();
  } catch (const CORBA::Exception& exception) {
    return exception._name();
  }
  return "";
}

}  // namespace corbot::test
