// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <mutex>
#include <string>

#include "cell.hh"

namespace corbot::cell {

[[nodiscard]] const char* to_string(Corbot::TransferStep step);

/// The state of one robot in Coordinator.State, and the events of its work. Any thread may call it.
class WorkStatus {
 public:
  /// Receives each event as plain text.
  using Report = std::function<void(const std::string& text)>;

  WorkStatus(const std::string& robot, Report report);
  /// Reports a text that was not there before.
  void set(Corbot::WorkState state, const std::string& text);
  /// Piece 0: the robot has none.
  void set_piece(Corbot::PieceNumber piece, Corbot::TransferStep step);
  void report(const std::string& text) const { report_(text); }
  [[nodiscard]] Corbot::RobotWork get() const;

 private:
  const Report report_;
  mutable std::mutex mutex_;
  Corbot::RobotWork work_;
};

}  // namespace corbot::cell
