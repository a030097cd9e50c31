// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mutex>
#include <string>

#include "client/explain.h"
#include "panel/robot_port.h"

namespace corbot::panel {

/// Starts the ORB of a panel. Call it before the process starts any other ORB. Throws client::Failure.
[[nodiscard]] CORBA::ORB_var start_panel_orb();

/// An arm behind CORBA. Polls and Stops never share a connection.
class CorbaPort : public RobotPort {
 public:
  /// Calls nothing. Each connect() passes `robot` to client::find_robot again.
  CorbaPort(CORBA::ORB_ptr orb, std::string robot);

  [[nodiscard]] nlohmann::json connect() override;
  [[nodiscard]] nlohmann::json state() override;
  void stop() override;

 private:
  /// The reference for Stops, and the address of its arm.
  struct StopWay {
    client::Address address;
    Corbot::Arm_var arm;
  };
  [[nodiscard]] static StopWay new_stop_way(CORBA::ORB_ptr orb, const client::Address& address);
  [[nodiscard]] StopWay stop_way() const;

  CORBA::ORB_var orb_;
  std::string robot_;
  client::Address address_;  // only the polling thread uses it and the next four members
  Corbot::Arm_var arm_;
  Corbot::Arm_var stop_connection_;  // shares its connections with stop_way_; has a poll's time-out
  unsigned polls_{0};
  nlohmann::json alarms_;
  mutable std::mutex mutex_;
  StopWay stop_way_;
};

}  // namespace corbot::panel
