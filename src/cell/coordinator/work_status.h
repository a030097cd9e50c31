// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <mutex>
#include <string>

#include "cell.hh"
#include "cell/activity.h"

namespace corbot::cell {

[[nodiscard]] const char* to_string(Corbot::TransferStep step);

/// Holds one robot's state for Coordinator.State, and reports the events of its work. Any thread may call it.
class WorkStatus {
 public:
  /// Receives each event as plain text.
  using Report = std::function<void(const std::string& text)>;

  /// Receives each change of the robot's activity in order. The next change waits until the call returns.
  using OnActivity = std::function<void(const ActivityChange& change)>;

  WorkStatus(const std::string& robot, Report report, OnActivity on_activity = {});
  /// Sets state and text, and reports a new text. WorkMoving sets the activity to moving. WorkWaiting keeps
  /// the activity. Every other state sets it to idle.
  void set(Corbot::WorkState state, const std::string& text);
  /// Sets the piece in work and its step. Piece 0 means none.
  void set_piece(Corbot::PieceNumber piece, Corbot::TransferStep step);
  void set_activity(Activity activity);
  [[nodiscard]] Activity activity() const;
  /// Sets the shared place whose zone the robot is in; empty: none.
  void set_zone(const std::string& place);
  void report(const std::string& text) const { report_(text); }
  [[nodiscard]] Corbot::RobotWork get() const;

 private:
  template <class F>
  void update(F&& f);

  const Report report_;
  const OnActivity on_activity_;
  std::mutex order_mutex_;  ///< keeps changes in order; locked before mutex_
  mutable std::mutex mutex_;
  Corbot::RobotWork work_;
  ActivityChange now_;
};

}  // namespace corbot::cell
