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

/// The ports that a worker gets in place of these. They must outlive the servant.
using WrapPorts = std::function<WorkerPorts(const CellRobot& robot, WorkerPorts ports)>;

/// Corbot::Coordinator: one worker and one thread for each robot.
class CoordinatorServant : public POA_Corbot::Coordinator {
 public:
  /// `cell` must outlive it. `robots`: names of those that it drives.
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
  /// Start, unless a Stop before this process holds the work still.
  void start_unless_stopped();
  Corbot::CoordinatorState* State() override;
  /// Stops every robot, gives back claims and control, and returns what State has as `placed`. The ORB ends
  /// later.
  std::uint64_t end();

 private:
  struct RobotThread;

  void begin();
  std::uint64_t count_placed();

  const CellConfig& cell_;
  const std::chrono::steady_clock::time_point begin_{std::chrono::steady_clock::now()};
  ActivityRecord activities_;
  WorkGate gate_;
  std::mutex mutex_;  ///< for what follows
  Corbot::CellMode mode_{Corbot::CellStopped};
  bool has_ended_{false};
  std::vector<std::unique_ptr<RobotThread>> threads_;
  std::atomic<std::uint64_t> placed_{0};  ///< as the store had it last
  std::mutex store_mutex_;                ///< for what follows, and held while the store is asked
  std::unique_ptr<RemoteStore> store_;    ///< empty at the end
};

}  // namespace corbot::cell
