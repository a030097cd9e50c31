// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "interop/matrix_client.h"
#include "support/naming_service.h"
#include "support/robot_rig.h"

namespace corbot::test {

/// A robot, a naming service and a client of the matrix, which carries out the scenario with the numbers of
/// the robot's arm.
class Scenario : public RobotRig {
 protected:
  void SetUp() override {}  // begin() does
  void TearDown() override;

  /// The arm's profile is that of its name in CORBOT_TEST_PROFILES.
  void begin(const ClientKind& kind, const std::string& arm);
  /// The whole scenario, but what is for other arms.
  void run();

  int steps_ = 0;

 private:
  void step(const std::string& line, const std::optional<std::string>& expected);
  std::string ask(const std::string& command);
  [[nodiscard]] std::string filled_in(std::string line) const;
  [[nodiscard]] bool has_part(const std::string& part) const;
  [[nodiscard]] bool cannot(const std::string& answer) const;

  ClientKind kind_;
  std::unique_ptr<NamingService> service_;
  MatrixClient client_;
  std::map<std::string, std::string> values_;
};

}  // namespace corbot::test
