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
  std::optional<gid_t> stop_group{};    ///< to stop, and to see that it has stopped
  bool is_supervised{false};  ///< whoever supervises this task keeps its segment, also when it ends in order
};

/// The real-time task's end of its socket: hands each process that connects the segments that its role may
/// have, and no others; at most one servant at a time. That a process lives is seen by its connection, which
/// the kernel closes however it dies. In a thread of its own, never in the cycle's. Not real-time safe.
class ChannelServer {
 public:
  /// Called in the thread with the segment of a servant that has just connected, to be kept for a successor,
  /// before the cycle works for it.
  using Keep = std::function<void(const Descriptor& servant)>;

  /// Listens. Throws SegmentError when another task of that robot does.
  ChannelServer(std::string robot, std::uint64_t fingerprint, ChannelPolicy policy);
  ChannelServer(const ChannelServer&) = delete;
  ChannelServer& operator=(const ChannelServer&) = delete;
  ~ChannelServer() { close(); }

  /// An earlier task was killed, or ended while a servant was connected, which may hold its segment.
  [[nodiscard]] bool left_behind() const noexcept { return left_behind_; }
  /// Before serve(): waits until a servant connects, at most that long. Its segment of the earlier task,
  /// where it has one that is sealed, of this user and this robot.
  [[nodiscard]] std::optional<Segment<const TaskSegment>> await_predecessor(
      std::chrono::milliseconds window, const std::atomic<bool>& cancelled);
  /// Before serve(): a servant has connected during that wait.
  [[nodiscard]] bool servant_waits() const noexcept;
  /// What an earlier task kept of its servant, for the next one to read. Before serve().
  void inherit_servant(Descriptor servant);

  /// The segment of the last task that may have moved the arm, as that task said; nothing where it is not
  /// known.
  [[nodiscard]] std::optional<std::uint64_t> last_task() const noexcept {
    return directory_->last_task(robot_);
  }
  /// From now on it is that. Before serve(), or in the thread. False when it cannot be said.
  bool set_last_task(std::uint64_t segment) noexcept {
    last_task_ = segment;
    return directory_->set_last_task(robot_, segment);
  }

  /// Starts the thread. All of them outlive close().
  void serve(const Segment<TaskSegment>& task, const Segment<StopSegment>& stop, ServantMailbox& mailbox,
             Keep keep);
  [[nodiscard]] std::string path() const { return directory_->socket_path(robot_); }
  [[nodiscard]] bool servant_connected() const noexcept { return connected_.load(std::memory_order_acquire); }

  /// Ends thread and connections. The socket stays in its directory while a servant is connected, which
  /// removes it unless another task comes.
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
  /// False when the connection is over.
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
  std::list<std::unique_ptr<Attached>> attached_;  ///< newest last; it stays mapped when its servant is gone
  Descriptor inherited_;
  std::optional<std::uint64_t> last_task_{};  ///< as it was set
  std::uint64_t last_session_{0};

  Descriptor end_event_;
  std::atomic<bool> connected_{false};
  std::thread thread_;
};

}  // namespace corbot
