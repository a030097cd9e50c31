// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <omniORB4/CORBA.h>

namespace corbot::omni {

/// Keeps a connection free for Stop, for clients that set no option.
///
/// An omniORB client process opens at most five connections to an address and carries one call on each, so
/// five calls that wait for motions hold up every other call of that process, Stop included. The servant
/// therefore listens at several addresses, the lanes. On each, at most kConnectionsPerLane connections may be
/// held by waiting calls, all clients together; a waiting call that finds its lane full is answered, before
/// anything is planned, with a LOCATION_FORWARD to a lane that has room. Any CORBA client follows that by
/// itself and stays there, so wherever a reference points, of its five connections at least two are free.
/// When every lane is full the call is refused (QueueFull).
///
/// Other clients (JacORB, ORBit2) put all their calls on one connection. They need no lanes, and must not be
/// forwarded while calls are running: JacORB then sends every unanswered request of the reference once more,
/// also those that have been accepted, and the arm would move twice. So a connection that has a running
/// call is never forwarded, and one that has been forwarded starts nothing for a while: requests that crossed
/// the forward are forwarded, too.
class Lanes {
 public:
  static constexpr int kConnectionsPerLane = 3;

  /// A running call; the destructor reports its end.
  class Call {
   public:
    Call(Lanes& lanes, std::size_t lane, std::string peer, bool waits)
        : lanes_(&lanes), lane_(lane), peer_(std::move(peer)), waits_(waits) {}
    Call(Call&& other) noexcept
        : lanes_(std::exchange(other.lanes_, nullptr)),
          lane_(other.lane_),
          peer_(std::move(other.peer_)),
          waits_(other.waits_) {}
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;
    Call& operator=(Call&&) = delete;
    ~Call() {
      if (lanes_ != nullptr) lanes_->leave(lane_, peer_, waits_);
    }

   private:
    Lanes* lanes_;
    std::size_t lane_;
    std::string peer_;
    bool waits_;
  };

  /// Reads from the ORB on which connection each request comes; one object a process.
  explicit Lanes(std::size_t count);

  /// A reference to the robot through lane `lane` alone.
  void set_reference(std::size_t lane, CORBA::Object_ptr reference);
  /// A call of the present thread, come in on `lane`, that starts a motion and returns. Throws
  /// omniORB::LOCATION_FORWARD when its connection has just been forwarded.
  [[nodiscard]] Call start(std::size_t lane);
  /// One that waits for a motion. Throws omniORB::LOCATION_FORWARD, too, when that lane is full and another
  /// is not, Corbot::QueueFull when all are.
  [[nodiscard]] Call wait(std::size_t lane);
  /// No call waits in any lane.
  [[nodiscard]] bool idle() const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Connection {
    int calls{0};    ///< running, waiting ones included
    int waiting{0};  ///< of them
    Clock::time_point last_end{};
    Clock::time_point forwarded{};
    std::size_t forwarded_to{0};
  };
  struct Lane {
    CORBA::Object_var reference;
    std::map<std::string, Connection> connections;  ///< by the peer's address
    [[nodiscard]] int held() const;
  };

  void leave(std::size_t lane, const std::string& peer, bool waits);
  void check_forwarded(const Connection& connection) const;
  [[noreturn]] void forward(Connection& connection, std::size_t lane);
  [[noreturn]] void refuse() const;
  static void forget_old(Lane& lane);

  mutable std::mutex mutex_;
  std::vector<Lane> lanes_;
  int waiting_{0};
};

}  // namespace corbot::omni
