// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "cell.hh"
#include "cell/activity.h"
#include "cell/cell_config.h"
#include "cell/coordinator/ports.h"
#include "cell/coordinator/work_gate.h"

namespace corbot::cell {

class RemoteStore;

/// Returns a worker's ports in place of `ports`. The returned ports must outlive the servant.
using WrapPorts = std::function<WorkerPorts(const CellRobot& robot, WorkerPorts ports)>;

/// Implements Corbot::Coordinator with one worker and one thread for each robot.
class CoordinatorServant : public POA_Corbot::Coordinator {
 public:
  /// `cell` must outlive the servant. `robots` are the names of the robots that it drives.
  CoordinatorServant(CORBA::ORB_ptr orb, const CellConfig& cell, const std::vector<std::string>& robots,
                     const WrapPorts& wrap_ports = {});
  CoordinatorServant(const CoordinatorServant&) = delete;
  CoordinatorServant& operator=(const CoordinatorServant&) = delete;
  ~CoordinatorServant() override;

  char* Name() override { return CORBA::string_dup(cell_.name.c_str()); }
  void Start() override;
  void Pause() override;
  void Resume() override;
  CORBA::Boolean Paused() override;
  void Stop() override;
  /// Starts the work unless the hold file has a Stop from a previous process.
  void start_unless_stopped();
  Corbot::CoordinatorState* State() override;
  /// Stops every robot and releases claims and control. Returns the `placed` of State. Call it before the
  /// ORB's shutdown.
  std::uint64_t end();

 private:
  struct RobotThread;

  void begin();
  std::uint64_t count_placed();

  const CellConfig& cell_;
  const std::chrono::steady_clock::time_point begin_{std::chrono::steady_clock::now()};
  ActivityRecord activities_;
  WorkGate gate_;
  std::mutex mutex_;  ///< guards mode_, threads_ and has_ended_
  Corbot::CellMode mode_{Corbot::CellStopped};
  bool has_ended_{false};
  std::vector<std::unique_ptr<RobotThread>> threads_;
  std::atomic<std::uint64_t> placed_{0};  ///< the store's last known count
  std::mutex store_mutex_;                ///< guards store_, and is held during a call of the store
  std::unique_ptr<RemoteStore> store_;    ///< null after end()
};

}  // namespace corbot::cell
