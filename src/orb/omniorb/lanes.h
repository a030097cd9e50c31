// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <vector>

#include <omniORB4/CORBA.h>

namespace corbot::omni {

/// Keeps the way of a Stop free for clients that set no option.
///
/// An omniORB client process opens at most five connections to an address and carries one call on each, so
/// five calls that wait for motions hold up every other call of that process, Stop included. The servant
/// therefore listens at several addresses, the lanes. On each at most kCallsPerLane calls may wait at once,
/// all clients together; a waiting call that finds its lane full is answered, before anything is planned,
/// with a LOCATION_FORWARD to a lane that has room. Any CORBA client follows that by itself and stays there,
/// so wherever a reference points, of its five connections at least two are free. When every lane is full the
/// call is refused (QueueFull).
class Lanes {
 public:
  static constexpr int kCallsPerLane = 3;

  /// A waiting call's place; given back by the destructor.
  class Place {
   public:
    explicit Place(std::atomic<int>& held) noexcept : held_(&held) {}
    Place(Place&& other) noexcept : held_(other.held_) { other.held_ = nullptr; }
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;
    Place& operator=(Place&&) = delete;
    ~Place() {
      if (held_ != nullptr) held_->fetch_sub(1);
    }

   private:
    std::atomic<int>* held_;
  };

  explicit Lanes(std::size_t count);

  /// A reference to the robot through lane `lane` alone.
  void set_reference(std::size_t lane, CORBA::Object_ptr reference);
  /// A place for a call that came in on `lane`. Throws omniORB::LOCATION_FORWARD when that lane is full and
  /// another is not, Corbot::QueueFull when all are.
  [[nodiscard]] Place enter(std::size_t lane);
  /// No call waits in any lane.
  [[nodiscard]] bool idle() const noexcept;
  /// Waiting calls that all lanes together can hold.
  [[nodiscard]] int capacity() const noexcept { return static_cast<int>(lanes_.size()) * kCallsPerLane; }

 private:
  struct Lane {
    std::atomic<int> held{0};
    CORBA::Object_var reference;
  };
  std::vector<std::unique_ptr<Lane>> lanes_;
};

}  // namespace corbot::omni
