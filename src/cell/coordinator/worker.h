// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <future>
#include <stop_token>
#include <string>
#include <vector>

#include "cell/cell_config.h"
#include "cell/coordinator/ports.h"
#include "cell/coordinator/work_status.h"
#include "cell/coordinator/world_robot.h"

namespace corbot::cell {

/// One piece on its way. Points: the middle of the piece's foot, world, metres.
struct Transfer {
  Corbot::PieceNumber piece{};
  const Kind* kind{};
  Eigen::Vector3d source{};
  Eigen::Vector3d target{};
};

/// Brings pieces from one place to another with one robot. An intent is durable before the motion that may
/// change the world; an outcome is what the camera has seen. The thread of run() makes all calls but
/// RobotPort::stop().
class Worker {
 public:
  struct Ports {
    RobotPort& robot;
    CameraPort& camera;
    StorePort& store;
  };

  /// `cell`, of which `robot` is one, and the ports must outlive the worker. `who` names this process in the
  /// ledger; no other process may have that name.
  Worker(const CellConfig& cell, const CellRobot& robot, Ports ports, std::string who,
         WorkStatus::Report report, std::stop_token stop, WorkStatus::OnActivity on_activity = {});
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;
  virtual ~Worker() = default;

  /// Works until a stop is requested, until the claim is lost, or until a person is needed. Throws nothing.
  void run();
  /// Once run() has returned: takes back a reservation that nothing has touched, leaves the zone where the
  /// tool is back at its wait pose, and gives back claim and control. Throws nothing.
  void finish();
  [[nodiscard]] Corbot::RobotWork status() const { return status_.get(); }

 protected:
  /// Waits until the intent is in the ledger. Virtual for a test: its checker must find a worker that does
  /// not wait.
  virtual void await_intent(std::future<void>& intent) { intent.get(); }

 private:
  void begin();
  void connect();
  void refuse_leftovers();
  Transfer find();
  bool pick(const Transfer& transfer);
  void place(const Transfer& transfer);

  Transfer checked(const Corbot::TransferInfo& info) const;
  Corbot::Sightings nearest_first(const Corbot::Frame& frame) const;
  void withdraw(const Transfer& transfer, const std::string& why);
  void refuse_source(const Transfer& transfer, const std::string& why);

  void approach(const Transfer& transfer, const ToolGoal& goal, Corbot::TransferStep intent);
  void retreat(const ToolGoal& goal);
  ToolGoal grasp_goal(const Transfer& transfer, const Place& place, const Eigen::Vector3d& foot) const;
  /// The message of a failure names `at`, a place or a point there.
  [[nodiscard]] Corbot::Frame look(const std::string& at);
  bool sees_piece_at(const Place& place, const Eigen::Vector3d& foot);

  void advance(const Transfer& transfer, Corbot::TransferStep step, const std::string& note = "");
  void enter(const Place& place);
  void leave();
  bool is_at_wait();

  template <class F>
  auto call(F&& f) -> decltype(f());
  void wait_for(Activity activity, const std::string& text, double pause_s = 0);
  void end_if_stopped() const;
  [[nodiscard]] std::string key_of(const Place& place) const;

  const CellConfig& cell_;
  const CellRobot& robot_;
  const Place& from_;
  const Place& to_;
  const ToolGoal wait_;
  RobotPort& arm_;
  CameraPort& camera_;
  StorePort& store_;
  const std::string who_;
  const std::stop_token stop_;
  WorldRobot motions_;
  WorkStatus status_;

  Corbot::ClaimToken token_{0};
  std::string zone_{};                       ///< the shared place whose zone the robot is in
  const char* step_{"begin"};                ///< of the recipe, for messages
  int failures_{0};                          ///< failed picks in a row
  std::vector<Eigen::Vector3d> left_out_{};  ///< feet of pieces that the robot cannot reach
};

}  // namespace corbot::cell
