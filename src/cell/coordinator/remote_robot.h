// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "cell/coordinator/remote_call.h"
#include "cell/coordinator/work_gate.h"

namespace corbot::cell {

/// Calls Corbot::Robot over CORBA. If the robot is an Arm, commands use exclusive control, which a thread
/// renews.
class RemoteRobot : public RobotPort {
 public:
  /// `who` names the holder of control. `motion_s` is the time-out of one motion, gripper motion or delay.
  /// No command begins while `gate` is closed. Every command throws Stopped while the gate is stopped.
  /// `on_pause` is called with true when a command starts to wait for the gate, and then with false.
  RemoteRobot(CORBA::ORB_ptr orb, std::string uri, std::string who, double motion_s, std::stop_token stop,
              WorkGate& gate, std::function<void(bool)> on_pause = {});
  /// Throws NotReady if another client has control, and Failure if there is no reply.
  bool acquire() override;
  void release() override;
  void speed(double percent) override;
  void move(const Eigen::Vector3d& point, double above_m) override;
  void move_s(const Eigen::Vector3d& point, double above_m, double duration_s) override;
  void move_c(const Eigen::Vector3d& begin, const Eigen::Vector3d& middle,
              const Eigen::Vector3d& end) override;
  void delay(double duration_s) override;
  void open() override;
  void close() override;
  Eigen::Vector3d rest_position() override;
  Grip grip() override;
  bool is_able() override;
  bool is_halted() override { return gate_.is_stopped(); }
  void stop() override;
  /// Stops as stop() does, but commands may follow once the gate is open.
  void halt();
  /// Tells if the robot comes to rest within `within_s`. False also without a reply.
  [[nodiscard]] bool comes_to_rest(double within_s);

 private:
  class UnderWay;
  using Target = std::optional<Eigen::Vector3d>;

  template <class F>
  void command(LazyReference<Corbot::Robot>& robot, const Target& target, F&& f);
  [[nodiscard]] bool has_arrived(const Target& target);
  void use(const std::string& uri);
  void pass_gate();
  [[nodiscard]] bool has_control();
  void send_stop(std::unique_lock<std::mutex>& lock);
  void keep_control(const std::string& control);
  void control_has_ended();

  const CORBA::ORB_var orb_;
  const std::string uri_;
  const std::string who_;
  const double motion_s_;
  const std::stop_token stop_;
  WorkGate& gate_;
  const std::function<void(bool)> on_pause_;

  // A time-out belongs to a reference, so motions, reads and all other calls have one reference each.
  std::optional<LazyReference<Corbot::Robot>> motions_;
  std::optional<LazyReference<Corbot::Robot>> others_;
  std::optional<LazyReference<Corbot::Robot>> reads_;
  Corbot::Arm_var control_;

  std::mutex mutex_;  ///< guards the following members
  std::condition_variable ended_;
  Corbot::Arm_var arm_;  ///< public reference, for Stop; nil without control
  bool is_stopping_{false};
  bool is_under_way_{false};

  std::jthread keeper_;
};

}  // namespace corbot::cell
