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

/// A transfer of one piece. Points are positions of the foot's middle, world, in metres.
struct Transfer {
  Corbot::PieceNumber piece{};
  const Kind* kind{};
  Eigen::Vector3d source{};
  Eigen::Vector3d target{};
};

/// Brings pieces from one place to another with one robot. An intent is durable before the motion that may
/// change the world. An outcome is what the camera has seen. At the start and after each fault the worker
/// determines the state of robot and piece by ledger, gripper and camera. The thread of run() makes all calls
/// but go_on() and RobotPort::stop().
class Worker {
 public:
  using Ports = WorkerPorts;

  /// `cell`, its robot `robot` and the ports must outlive the worker. `who` names this process in the ledger
  /// and must be unique among processes.
  Worker(const CellConfig& cell, const CellRobot& robot, Ports ports, std::string who,
         WorkStatus::Report report, std::stop_token stop, WorkStatus::OnActivity on_activity = {});
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;
  virtual ~Worker() = default;

  /// Works until a stop is requested. Waits for go_on() if the work needs a person.
  void run();
  /// Continues the work after a person's Start. Any thread may call it.
  void go_on();
  /// Notes that a command starts or ends its wait for the end of a pause. Only the thread of run() calls it.
  void set_paused(bool is_paused) { status_.set_activity(is_paused ? Activity::kIdle : Activity::kMoving); }
  /// Waits until the worker waits for a person and its claim is marked. Returns false at `gives_up`. Any
  /// thread may call it.
  [[nodiscard]] bool lets_go(std::chrono::steady_clock::time_point gives_up);
  /// Releases everything after run() has returned: withdraws an untouched reservation, and releases claim and
  /// control. Leaves the zone if the tool is at its wait pose. A marked claim of a stopped cell stays. Throws
  /// nothing.
  void finish();
  [[nodiscard]] Corbot::RobotWork status() const { return status_.get(); }

 protected:
  /// Waits until the intent is in the ledger. Virtual for a test, which checks that it detects a worker
  /// without this wait.
  virtual void await_intent(std::future<void>& intent) { intent.get(); }

 private:
  void work();
  void count_anew_after_answer();
  void end_motion_fault(const std::string& text);
  /// Waits for a person's Start. Appends the command for it to the text.
  void await_start(Corbot::WorkState state, const std::string& text);
  void await_person(Corbot::WorkState state, const std::string& text, const std::function<bool()>& is_over);
  bool give_back_control();
  [[nodiscard]] int starts();

  // Resolution of the state.
  std::optional<Transfer> resolve();
  void connect();
  /// Another coordinator that has the robot or its claim.
  struct Holder {
    std::string text;
    bool awaits_person{};
  };
  std::optional<Holder> take_robot();
  [[nodiscard]] bool may_replace(const std::string& who, Corbot::ClaimToken token, bool is_exclusive);
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

  bool moves_on_arc(const Place& place, const ToolGoal& from, const ToolGoal& to);
  void approach(const Transfer& transfer, const Place& place, const ToolGoal& goal,
                Corbot::TransferStep intent);
  void retreat(const Place& place, const ToolGoal& goal);
  ToolGoal grasp_goal(const Transfer& transfer, const Place& place, const Eigen::Vector3d& foot) const;
  /// Takes a picture. The message of a failure names `at`, a place or a point on it.
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
  void check_able();
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
  bool is_marked_{false};              ///< the claim has the mark of a waiting holder
  std::string zone_{};                 ///< shared place whose zone the robot is in; empty: none
  const char* step_{"begin"};          ///< step of the recipe, for messages
  int failures_{0};                    ///< consecutive failed picks
  std::string motion_fault_{};         ///< text of the last motion fault
  int equal_faults_{0};                ///< consecutive faults with this text
  int heeded_{0};                      ///< Starts so far that cannot replace a marked claim any more
  Corbot::ClaimToken ended_claim_{0};  ///< marked claim whose holder has ended
  int heeded_at_end_{0};               ///< `heeded_` when that end was first seen
  std::string last_fault_{};           ///< text of the last fault that interrupted the work
  std::chrono::steady_clock::time_point interrupted_{};  ///< begin of the attempts to resume the work
  std::mutex mutex_{};                                   ///< guards starts_ and has_let_go_
  std::condition_variable_any gone_on_{};
  int starts_{0};                            ///< Starts by a person
  int counted_starts_{0};                    ///< `starts_` at the last reset of the counts
  bool has_let_go_{false};                   ///< waits for a person, with a marked claim
  std::vector<Eigen::Vector3d> left_out_{};  ///< foot positions of pieces out of the robot's reach
};

}  // namespace corbot::cell
