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

/// Corbot::Robot over CORBA. Where the robot is an Arm, all goes by exclusive control, which a thread renews.
class RemoteRobot : public RobotPort {
 public:
  /// `who` names the holder of control. `motion_s`: time-out of one motion, also of the gripper, and of a delay.
  /// While `gate` is closed no command begins. While the gate is stopped every command raises Stopped.
  /// `on_pause`: a command waits for the gate, or does not any more.
  RemoteRobot(CORBA::ORB_ptr orb, std::string uri, std::string who, double motion_s, std::stop_token stop,
              WorkGate& gate, std::function<void(bool)> on_pause = {});
  /// NotReady: somebody else has control. Failure: no reply.
  bool acquire() override;
  void release() override;
  void speed(double percent) override;
  void move(const Eigen::Vector3d& point, double above_m) override;
  void move_s(const Eigen::Vector3d& point, double above_m, double duration_s) override;
  void delay(double duration_s) override;
  void open() override;
  void close() override;
  Eigen::Vector3d rest_position() override;
  Grip grip() override;
  bool is_able() override;
  bool is_halted() override { return gate_.is_stopped(); }
  void stop() override;
  /// The same, but commands may follow once the gate is open.
  void halt();
  /// Within that time. False also without a reply.
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

  // Several references, since a time-out is a reference's: for what moves, for reads, and for all else.
  std::optional<LazyReference<Corbot::Robot>> motions_;
  std::optional<LazyReference<Corbot::Robot>> others_;
  std::optional<LazyReference<Corbot::Robot>> reads_;
  Corbot::Arm_var control_;

  std::mutex mutex_;  ///< for what follows
  std::condition_variable ended_;
  Corbot::Arm_var arm_;  ///< as anybody reaches it, for Stop; nil without control
  bool is_stopping_{false};
  bool is_under_way_{false};

  std::jthread keeper_;
};

}  // namespace corbot::cell
