// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mutex>
#include <string>

#include "client/explain.h"
#include "panel/port.h"

namespace corbot::panel {

/// By which the messages say how to name a robot.
inline constexpr const char* kNaming = "corbot panel";

/// Starts the ORB of a panel. Call it before the process starts any other ORB. Throws client::Failure.
[[nodiscard]] CORBA::ORB_var start_panel_orb();

/// An arm behind CORBA. Polls, Stops, calls and programs never share a connection.
class CorbaPort : public Port {
 public:
  /// Calls nothing. Each connect() passes `robot` to client::find_robot again.
  CorbaPort(CORBA::ORB_ptr orb, std::string robot);

  [[nodiscard]] nlohmann::json connect() override;
  [[nodiscard]] nlohmann::json state() override;
  /// Needs no servant if the robot is on this machine.
  void stop() override;
  /// After an acquire, calls have control of the arm until a release or the end of the lease.
  [[nodiscard]] nlohmann::json call(const Order& order) override;
  /// A program has control of the arm if this panel has it at the program's start.
  [[nodiscard]] std::unique_ptr<Performer> performer() override;

 private:
  /// A reference for Stops or for calls, and the address of its arm.
  struct Way {
    client::Address address;
    Corbot::Arm_var arm;
  };
  /// `group` identifies the connections.
  [[nodiscard]] static Way new_way(CORBA::ORB_ptr orb, const client::Address& address, CORBA::ULong group);
  [[nodiscard]] Way stop_way() const;
  [[nodiscard]] Way call_way() const;
  /// Throws if the arm does not answer, so that no motion reaches it late. Opens its connection again if the
  /// servant has closed it.
  static void check_connection(const Way& way);
  [[nodiscard]] Corbot::Arm_var control() const;
  void set_control(Corbot::Arm_ptr control);
  /// Returns the reference that has control; without control `arm`.
  [[nodiscard]] Corbot::Arm_var with_control(Corbot::Arm_ptr arm, CORBA::ULong group) const;
  /// Uses the arm's own reference again if control has ended, and returns true then. Throws if
  /// the arm does not answer.
  bool forget_ended_control(const Way& way);

  CORBA::ORB_var orb_;
  std::string robot_;
  client::Address address_;  // only the polling thread uses it and the next five members
  Corbot::Arm_var arm_;
  Corbot::Arm_var stop_connection_;  // shares its connections with stop_way_; has a poll's time-out
  unsigned polls_{0};
  nlohmann::json alarms_;
  nlohmann::json loop_;
  mutable std::mutex mutex_;
  Way stop_way_;
  Way call_way_;
  Corbot::Arm_var control_;  // nil: this panel has no control; the calling thread writes it
};

}  // namespace corbot::panel
