// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <future>
#include <mutex>
#include <optional>
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
/// change the world; an outcome is what the camera has seen. At its start and after each fault it finds out where
/// robot and piece are, by the ledger, the gripper and the camera. The thread of run() makes all calls but
/// go_on() and RobotPort::stop().
class Worker {
 public:
  using Ports = WorkerPorts;

  /// `cell`, of which `robot` is one, and the ports must outlive the worker. `who` names this process in the
  /// ledger; no other process may have that name.
  Worker(const CellConfig& cell, const CellRobot& robot, Ports ports, std::string who,
         WorkStatus::Report report, std::stop_token stop, WorkStatus::OnActivity on_activity = {});
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;
  virtual ~Worker() = default;

  /// Works until a stop is requested. Where a person is needed it waits for go_on().
  void run();
  /// From any thread: a person has looked at what the work waits for, and says Start.
  void go_on();
  /// While it runs, from its thread: a command waits for the end of a pause, or does not any more.
  void set_paused(bool is_paused) { status_.set_activity(is_paused ? Activity::kIdle : Activity::kMoving); }
  /// From any thread: waits until the worker waits for a person, and its claim says so. False: not until then.
  [[nodiscard]] bool lets_go(std::chrono::steady_clock::time_point gives_up);
  /// Once run() has returned: takes back a reservation that nothing has touched, leaves the zone where the
  /// tool is back at its wait pose, and gives back claim and control. Throws nothing.
  void finish();
  [[nodiscard]] Corbot::RobotWork status() const { return status_.get(); }

 protected:
  /// Waits until the intent is in the ledger. Virtual for a test: its checker must find a worker that does
  /// not wait.
  virtual void await_intent(std::future<void>& intent) { intent.get(); }

 private:
  void work();
  void count_anew_after_answer();
  void end_motion_fault(const std::string& text);
  /// Adds to the text what goes on with the work: Start, and nothing else.
  void await_start(Corbot::WorkState state, const std::string& text);
  void await_person(Corbot::WorkState state, const std::string& text, const std::function<bool()>& is_over);
  bool give_back_control();
  [[nodiscard]] int starts();

  // Resolution.
  std::optional<Transfer> resolve();
  void connect();
  std::string take_robot();
  [[nodiscard]] bool may_replace(const std::string& who, bool is_exclusive);
  void find_zone(const Eigen::Vector3d& tool);
  void move_out(const Eigen::Vector3d& tool);
  bool resolve_transfer(const Corbot::TransferInfo& left, const Transfer& transfer, Grip grip);
  void resolve_as_unclear(const Transfer& transfer);
  [[nodiscard]] std::string own_unclear();
  [[nodiscard]] bool is_resolved();
  void check_unclear();

  Transfer find();
  bool pick(const Transfer& transfer);
  void check_other_piece(const Transfer& transfer, Grip grip);
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
  [[nodiscard]] std::string how_to_clear() const;
  [[nodiscard]] std::string error_note();
  [[nodiscard]] std::string how_to_resolve(Corbot::PieceNumber piece) const;
  void enter(const Place& place);
  void leave();
  bool is_at_wait();

  template <class F>
  auto call(F&& f) -> decltype(f());
  void wait_for(Activity activity, const std::string& text, double pause_s = 0);
  void end_if_stopped();
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
  bool is_marked_{false};       ///< the claim says that its holder waits for a person
  std::string zone_{};          ///< the shared place whose zone the robot is in
  const char* step_{"begin"};   ///< of the recipe, for messages
  int failures_{0};             ///< failed picks in a row
  std::string motion_fault_{};  ///< the last
  int equal_faults_{0};         ///< of that text in a row
  int heeded_{0};               ///< Starts that no longer pass on a claim whose holder waits for a person
  std::string last_fault_{};    ///< that interrupted the work
  std::chrono::steady_clock::time_point interrupted_{};  ///< since then the work is being resumed
  std::mutex mutex_{};                                   ///< for what follows
  std::condition_variable_any gone_on_{};
  int starts_{0};                            ///< answers of a person
  int counted_starts_{0};                    ///< since then `failures_` and `left_out_` count
  bool has_let_go_{false};                   ///< it waits for a person, and its claim says so
  std::vector<Eigen::Vector3d> left_out_{};  ///< feet of pieces that the robot cannot reach
};

}  // namespace corbot::cell
