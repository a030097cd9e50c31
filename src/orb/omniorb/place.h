// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "net/places.h"
#include "robot/corbot_robot.h"

namespace corbot::omni {

/// The place of a call of the present thread, as long as the object lives.
class Place {
 public:
  /// Throws the exception that the interface names when there is none: Corbot::QueueFull, or Corbot::NotReady
  /// for what changes how the arm moves. A Stop goes on without one.
  explicit Place(corbot_place_kind kind);
  Place(const Place&) = delete;
  Place& operator=(const Place&) = delete;
  ~Place();

  /// Of its call, as corbot_caller says it.
  [[nodiscard]] corbot_presence presence() const;

 private:
  int place_;
};

/// On which the request came that this thread carries out.
[[nodiscard]] corbot_connection connection_of_call() noexcept;
/// The number of stops when the last bytes of that had arrived. From the first line of an operation on: its arguments are
/// read by then.
[[nodiscard]] std::uint64_t arrival_of_call() noexcept;

/// This is the Stop that the present thread carries out, where it was counted when its request arrived.
[[nodiscard]] corbot_counted_stop counted_stop_of_call() noexcept;

/// From now on each thread of the ORB knows which request, of which connection, it carries out, and a Stop is counted before
/// all else that its request needs. A request is the robot's by its object key: `name`, or one that begins with `control`.
/// After the ORB's start, before it serves; once in a process.
void note_requests(corbot_robot& robot, std::string name, std::string control);

}  // namespace corbot::omni
