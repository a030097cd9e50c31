// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "cell.hh"
#include "cell/cell_config.h"
#include "panel/port.h"

namespace corbot::panel {

/// A cell behind CORBA: its coordinator and store. A thread takes a picture each second, since a picture is
/// slow.
class CellPort : public Port {
 public:
  /// Calls nothing.
  CellPort(CORBA::ORB_ptr orb, cell::CellConfig cell);
  ~CellPort() override;

  [[nodiscard]] nlohmann::json connect() override;
  [[nodiscard]] nlohmann::json state() override;
  void stop() override;
  [[nodiscard]] nlohmann::json call(const Order& order) override;
  /// A cell runs no program. Throws client::Failure.
  [[nodiscard]] std::unique_ptr<Performer> performer() override;
  [[nodiscard]] std::shared_ptr<const std::string> picture() const override;

 private:
  void tell_coordinator(CellAction action);
  void tell_store(const CellRequest& request);
  void read_store(nlohmann::json& state);
  /// Makes the next read begin at the first event if the store's ledger is not the one that was read before.
  void forget_other_ledger();
  void drop_old_events();
  void take(const Corbot::PieceEvent& event);
  void run_looks();
  void look();
  [[nodiscard]] nlohmann::json pieces() const;

  CORBA::ORB_var orb_;
  const cell::CellConfig cell_;
  // Only the polling thread uses these members.
  Corbot::Coordinator_var coordinator_;
  Corbot::Store_var store_;
  bool is_ledger_checked_{false};   // since connect() or a failure
  CORBA::ULongLong last_event_{0};  // that was read
  double last_time_s_{0};           // of that event
  std::deque<nlohmann::json> events_;
  std::map<CORBA::ULongLong, nlohmann::json> pieces_;

  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool ending_{false};
  nlohmann::json seen_;  // the newest detections; null: none yet
  std::shared_ptr<const std::string> picture_;
  std::thread looks_;
};

}  // namespace corbot::panel
