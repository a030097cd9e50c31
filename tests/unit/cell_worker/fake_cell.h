// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "cell/coordinator/worker.h"

namespace corbot::test {

/// Returns the part of the cell profiles/cell that a worker needs. Its robot1 at yaw 45 degrees takes from an
/// area, robot2 at yaw 225 degrees from slots.
[[nodiscard]] cell::CellConfig demo_cell();

/// The exception of a killed worker's process: no call returns.
struct Killed {};

/// The kind of interruption of a worker's call.
enum class Interruption { kKill, kFault };
/// The time of the interruption: before the effect, during it (a motion ends on its way), or after it.
enum class Moment { kBefore, kMiddle, kAfter };

/// Simulates table, robot, camera and ledger of one worker, in one process. Pieces move when they are
/// gripped. `violations` lists each breach of a rule of the work. Points are in the world frame, in metres.
class FakeCell : public cell::RobotPort, public cell::CameraPort, public cell::StorePort {
 public:
  struct Piece {
    Eigen::Vector3d foot{};
    bool is_held{false};
    Corbot::PieceNumber number{0};  ///< 0: not in the ledger
  };

  FakeCell(const cell::CellConfig& config, const std::string& robot);
  void add_to_area(double x, double y);
  void add_to_slot(const std::string& place, int slot);
  /// Closes the gripper on a piece that is not in the ledger. The gripper measures its opening.
  void add_to_gripper();

  // Faults, all off at first.
  int failing_grasps{0};
  bool loses_pieces{false};  ///< a released piece vanishes
  bool is_exclusive{true};   ///< an Arm: control excludes others, and a stop ends the current motion
  bool is_claimed{false};
  std::string holder{"another"};     ///< holder of the claim
  std::function<void()> on_claimed;  ///< called when a claim finds another holder; empty: requests a stop
  std::function<void()> on_acquire;  ///< called first; it may throw as the robot does
  bool is_in_error{false};
  bool measures_grip{false};  ///< the device measures the gripper's opening
  std::atomic<bool> is_cell_stopped{false};
  int interrupted_call{-1};  ///< number of the interrupted call, of any port; -1: none
  Interruption interruption{Interruption::kKill};
  Moment moment{Moment::kBefore};
  bool was_interrupted{false};
  bool goes_on{false};                  ///< commands may follow a Stop of another client
  double late_s{0};                     ///< delay of an intent after the Move; the descent ends it
  int superseded_call{-1};              ///< number of the store's call that throws Superseded
  Corbot::ClaimToken superseded_by{8};  ///< token of the new claim
  int stopped_command{-1};              ///< number of the command that requests a stop
  int command_stopped_by_other{-1};     ///< number of the command that another client stops; -1: none
  bool is_held_by_other{false};         ///< the stop is a StopAndHold, which leaves an Error
  int occupied{0};                      ///< number of calls of Enter that find another robot
  std::function<bool(const Eigen::Vector3d&)> is_unreachable;
  std::function<void()> on_arc;         ///< called before an arc begins, and may refuse it
  std::string fails_over{};             ///< every motion to this place throws NotReady
  int failures{0};                      ///< number of failed motions to that place
  std::function<void(int)> on_reserve;  ///< called with the number of calls
  std::function<void()> on_close;       ///< called when the gripper has closed
  int last_placed{1};                   ///< number of placed pieces after which Reserve requests a stop

  std::stop_source stop_source;
  std::vector<Piece> pieces;
  std::vector<std::string> record;              ///< calls in order, without intents
  std::vector<std::string> holders_at_release;  ///< the claim's holder at each release of control
  std::vector<std::string> violations;
  std::vector<std::string> reports;
  std::vector<cell::ActivityChange> activities;
  std::map<Corbot::TransferStep, int> written;
  std::string last_note;  ///< note of the last written step

  [[nodiscard]] std::size_t count(const std::string& place) const;
  [[nodiscard]] int count_reports(const std::string& part) const;
  void report(const std::string& text);
  /// Starts the process again.
  void revive() { is_dead_ = false; }
  /// Removes the unclear pieces, as a person does.
  void resolve();
  /// Ends the transfer, as another coordinator does.
  void end_transfer() { ledger_.step = Corbot::StepWithdrawn; }

  // RobotPort
  bool acquire() override;
  void release() override { holders_at_release.push_back(holder); }
  void speed(double percent) override;
  void move(const Eigen::Vector3d& point, double above_m) override;
  void move_s(const Eigen::Vector3d& point, double above_m, double duration_s) override;
  void move_c(const Eigen::Vector3d& begin, const Eigen::Vector3d& middle,
              const Eigen::Vector3d& end) override;
  void delay(double duration_s) override;
  void open() override;
  void close() override;
  Eigen::Vector3d rest_position() override;
  cell::Grip grip() override;
  bool is_able() override { return !is_in_error; }
  bool is_halted() override { return is_cell_stopped; }
  void stop() override {}
  // CameraPort
  Corbot::Frame look(double timeout_s) override;
  // StorePort
  Corbot::ClaimToken claim(const std::string& robot, const std::string& who,
                           Corbot::ClaimToken replaces) override;
  void release(Corbot::ClaimToken token) override;
  Corbot::TransferInfo reserve(Corbot::ClaimToken token, const std::string& from, const std::string& to,
                               const Corbot::Sightings& seen, double timeout_s) override;
  void advance(Corbot::ClaimToken token, Corbot::PieceNumber piece, Corbot::TransferStep step,
               const std::string& note) override;
  void enter(Corbot::ClaimToken token, const std::string& place, double timeout_s) override;
  void leave(Corbot::ClaimToken token, const std::string& place) override;
  Corbot::PlaceInfos places() override;
  Corbot::TransferInfos transfers() override;
  Corbot::PieceEvents unclear() override;

 private:
  struct Ledger {
    Piece* piece{nullptr};
    Corbot::TransferStep step{Corbot::StepPlaced};
    Eigen::Vector3d source{};
    Eigen::Vector3d target{};
  };

  /// Carries out `effect`, or nothing, or `half` if the call is interrupted in the middle.
  void interruptible(
      const std::function<void()>& effect, const std::function<void()>& half = [] {});
  [[noreturn]] void interrupt();
  [[nodiscard]] Corbot::TransferInfo info() const;
  void begin_command(const std::string& name);
  void check_way(const Eigen::Vector3d& to, bool is_line);
  void check_outcome(Corbot::TransferStep step);
  void store_call();
  void begin_transfer(const std::string& from, const std::string& to, const Corbot::Sightings& seen);
  void go_to(const Eigen::Vector3d& tool);
  [[nodiscard]] Eigen::Vector3d to_world(const Eigen::Vector3d& local) const;
  [[nodiscard]] std::optional<Eigen::Vector3d> free_slot(const cell::Place& place) const;
  Piece* source_piece(const cell::Place& place, const Corbot::Sightings& seen);
  void require(bool rule, const std::string& text);

  const cell::CellConfig& config_;
  const cell::CellRobot& robot_;
  std::mutex mutex_;
  std::condition_variable changed_;
  Eigen::Vector3d tool_{0, 0, 0.3};
  int commands_{0};
  int store_calls_{0};
  int reserves_{0};
  bool is_superseded_{false};
  bool is_dead_{false};
  int calls_{0};
  bool is_told_open_{true};
  bool has_looked_{false};  ///< a look has followed the arm's last motion
  bool is_unclear_{false};
  Corbot::PieceNumber last_number_{0};
  std::string zone_;
  Ledger ledger_;
};

}  // namespace corbot::test
