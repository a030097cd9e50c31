// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <mutex>
#include <string>

#include "cell.hh"
#include "cell/activity.h"

namespace corbot::cell {

[[nodiscard]] const char* to_string(Corbot::TransferStep step);

/// The state of one robot in Coordinator.State, and the events of its work. Any thread may call it.
class WorkStatus {
 public:
  /// Receives each event as plain text.
  using Report = std::function<void(const std::string& text)>;

  /// Receives each change of what the robot does, in its order. The next change waits for its return.
  using OnActivity = std::function<void(const ActivityChange& change)>;

  WorkStatus(const std::string& robot, Report report, OnActivity on_activity = {});
  /// Reports a text that was not there before. The robot moves with WorkMoving, and is idle with what is
  /// neither that nor WorkWaiting.
  void set(Corbot::WorkState state, const std::string& text);
  /// Piece 0: the robot has none.
  void set_piece(Corbot::PieceNumber piece, Corbot::TransferStep step);
  void set_activity(Activity activity);
  [[nodiscard]] Activity activity() const;
  /// The shared place whose zone the robot is in now; empty: it is in none.
  void set_zone(const std::string& place);
  void report(const std::string& text) const { report_(text); }
  [[nodiscard]] Corbot::RobotWork get() const;

 private:
  template <class F>
  void update(F&& f);

  const Report report_;
  const OnActivity on_activity_;
  std::mutex order_mutex_;  ///< of changes, and taken before the other
  mutable std::mutex mutex_;
  Corbot::RobotWork work_;
  ActivityChange now_;
};

}  // namespace corbot::cell
