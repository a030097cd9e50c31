// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "net/places.h"
#include "robot/corbot_robot.h"

namespace corbot::omni {

/// The slot of a call of the present thread, during the lifetime of this object.
class Place {
 public:
  /// Throws the interface's exception if no slot is free: Corbot::QueueFull, or Corbot::NotReady for a call
  /// that changes how the arm moves. A Stop continues without a slot.
  explicit Place(corbot_place_kind kind);
  Place(const Place&) = delete;
  Place& operator=(const Place&) = delete;
  ~Place();

  /// Returns the presence of the caller, as defined by corbot_caller.
  [[nodiscard]] corbot_presence presence() const;

 private:
  int place_;
};

/// Returns the connection of the request that this thread carries out.
[[nodiscard]] corbot_connection connection_of_call() noexcept;
/// Returns the number of stops at the arrival of the request's last bytes. Valid from the first line of an
/// operation on, as its arguments are read by then.
[[nodiscard]] std::uint64_t arrival_of_call() noexcept;

/// Returns the Stop that the present thread carries out, if it was counted when its request arrived.
[[nodiscard]] corbot_counted_stop counted_stop_of_call() noexcept;

/// Records for each thread of the ORB which request of which connection it carries out. Counts a Stop before
/// anything else that its request needs. A request is the robot's if its object key is `name` or begins with
/// `control`. To be called once in a process, after the ORB's start and before it serves.
void note_requests(corbot_robot& robot, std::string name, std::string control);

}  // namespace corbot::omni
