// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "corbot/channel/servant_mailbox.h"
#include "shm/message.h"
#include "shm/run_directory.h"
#include "shm/segment.h"

namespace corbot {

/// The users that may connect besides the task's own user (and root, but not as the servant).
struct ChannelPolicy {
  std::optional<uid_t> servant_user{};  ///< as the servant, or to read
  std::optional<gid_t> stop_group{};    ///< to stop, and to read the result
  /// The supervisor keeps this task's segment, also when the task ends normally.
  bool is_supervised{false};
};

/// The real-time task's end of its socket. Gives each connecting process the segments that its role allows,
/// and no others; at most one servant at a time. The connection shows that a process lives: the kernel closes
/// it at any end of the process. Runs in a thread of its own, never in the cycle's. Not real-time safe.
class ChannelServer {
 public:
  /// Stores the segment of a servant that has just connected for its successor. Called in the thread, before
  /// the cycle works for that servant.
  using Keep = std::function<void(const Descriptor& servant)>;

  /// Listens. Throws SegmentError if another task of that robot listens.
  ChannelServer(std::string robot, std::uint64_t fingerprint, ChannelPolicy policy);
  ChannelServer(const ChannelServer&) = delete;
  ChannelServer& operator=(const ChannelServer&) = delete;
  ~ChannelServer() { close(); }

  /// Returns true if an earlier task was killed, or ended while a servant was connected. The servant may
  /// hold its segment.
  [[nodiscard]] bool left_behind() const noexcept { return left_behind_; }
  /// Waits until a servant connects, at most `window`. Returns its segment of the earlier task, if it has one
  /// that is sealed, of this user and of this robot. To be called before serve().
  [[nodiscard]] std::optional<Segment<const TaskSegment>> await_predecessor(
      std::chrono::milliseconds window, const std::atomic<bool>& cancelled);
  /// Returns true if a servant connected during that wait. To be called before serve().
  [[nodiscard]] bool servant_waits() const noexcept;
  /// Takes the servant's segment that an earlier task kept, for the next servant to read. To be called before
  /// serve().
  void inherit_servant(Descriptor servant);

  /// Returns the segment of the last task that may have moved the arm, as that task recorded it, or nothing
  /// if it is not known.
  [[nodiscard]] std::optional<std::uint64_t> last_task() const noexcept {
    return directory_->last_task(robot_);
  }
  /// Records this segment as the last one from now on. To be called before serve(), or in the thread. Returns
  /// false if that fails.
  bool set_last_task(std::uint64_t segment) noexcept {
    last_task_ = segment;
    return directory_->set_last_task(robot_, segment);
  }

  /// Starts the thread. All arguments outlive close().
  void serve(const Segment<TaskSegment>& task, const Segment<StopSegment>& stop, ServantMailbox& mailbox,
             Keep keep);
  [[nodiscard]] std::string path() const { return directory_->socket_path(robot_); }
  [[nodiscard]] bool servant_connected() const noexcept { return connected_.load(std::memory_order_acquire); }

  /// Ends thread and connections. While a servant is connected, the socket stays in its directory; the
  /// servant removes it unless another task starts.
  void close() noexcept;

 private:
  enum class Role { kNone, kOffered, kServant, kReader };
  struct Attached {
    Segment<const ServantSegment> segment;
    ServantOffer offer;
  };
  struct Peer {
    Descriptor connection;
    ucred user;
    Role role{Role::kNone};
    std::optional<Message> hello{};
    std::unique_ptr<Attached> attached{};
  };
  using Peers = std::list<Peer>;

  void run();
  void accept_all();
  /// Returns false if the connection is over.
  [[nodiscard]] bool handle(Peer& peer);
  [[nodiscard]] bool answer(Peer& peer, const Message& message);
  [[nodiscard]] bool admit(Peer& peer, const Message& hello);
  void admit_servant(Peer& peer, const Message& hello);
  void begin_service(Peer& peer);
  void drop_closed();
  [[nodiscard]] bool has_servant();
  void drop_oldest();
  void listen_again() noexcept;
  void unmap_former();
  [[nodiscard]] bool is_own(const Peer& peer) const noexcept;
  [[nodiscard]] bool is_servant_user(const Peer& peer) const noexcept;
  [[nodiscard]] bool may_stop(const Peer& peer) const noexcept;
  [[nodiscard]] const Peer* servant() const noexcept;

  const std::string robot_;
  const std::uint64_t fingerprint_;
  const ChannelPolicy policy_;
  std::optional<RunDirectory> directory_;
  std::optional<RunDirectory::Listening> listening_;
  bool left_behind_{false};
  Peers peers_;  ///< oldest first

  const Segment<TaskSegment>* task_{nullptr};
  const Segment<StopSegment>* stop_{nullptr};
  ServantMailbox* mailbox_{nullptr};
  Keep keep_;
  /// newest last; a segment stays mapped when its servant is gone
  std::list<std::unique_ptr<Attached>> attached_;
  Descriptor inherited_;
  std::optional<std::uint64_t> last_task_{};  ///< as set
  std::uint64_t last_session_{0};

  Descriptor end_event_;
  std::atomic<bool> connected_{false};
  std::thread thread_;
};

}  // namespace corbot
