// SPDX-License-Identifier: Apache-2.0
#include "shm/channel_server.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <vector>

#include "corbot/running_time.h"

namespace corbot {
namespace {

using Kind = SegmentError::Kind;
using Clock = std::chrono::steady_clock;

/// Number of connections above which the oldest that is not the servant's is closed.
constexpr std::size_t kMostConnections = 64;
/// Period of work without an event: the unmapping of a previous servant's segment.
constexpr int kTidy_ms = 200;

/// Returns the groups of the peer process at the time of its connection.
std::vector<gid_t> groups_of(const Descriptor& connection, gid_t first) {
  std::vector<gid_t> groups(64);
  auto size = static_cast<socklen_t>(groups.size() * sizeof(gid_t));
  if (::getsockopt(connection.get(), SOL_SOCKET, SO_PEERGROUPS, groups.data(), &size) != 0) {
    if (errno != ERANGE) return {first};
    groups.resize(size / sizeof(gid_t));
    if (::getsockopt(connection.get(), SOL_SOCKET, SO_PEERGROUPS, groups.data(), &size) != 0) return {first};
  }
  groups.resize(size / sizeof(gid_t));
  groups.push_back(first);
  return groups;
}

void refuse(const Descriptor& connection, const std::string& robot, const SegmentError& error) {
  (void)send_message(connection, Message::refusal(robot, error));
}

SegmentError not_allowed(const std::string& robot, const ucred& user, const char* what) {
  return {Kind::kPermission, "uid " + std::to_string(user.uid) + " may not " + what + " " + robot +
                                 ": run as the user who started the robot"};
}

}  // namespace

ChannelServer::ChannelServer(std::string robot, std::uint64_t fingerprint, ChannelPolicy policy)
    : robot_(std::move(robot)),
      fingerprint_(fingerprint),
      policy_(policy),
      directory_(RunDirectory::open(true)),
      end_event_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  check_robot_name(robot_);
  if (!end_event_) throw SegmentError(Kind::kSystem, std::string("eventfd: ") + std::strerror(errno));
  listening_ = directory_->listen(robot_, policy_.stop_group);
  left_behind_ = listening_->left_behind;
}

std::optional<Segment<const TaskSegment>> ChannelServer::await_predecessor(
    std::chrono::milliseconds window, const std::atomic<bool>& cancelled) {
  constexpr std::chrono::milliseconds kStep{20};
  RunningTime waited(2 * kStep, Clock::now());
  while (waited.look(Clock::now()) < window && !cancelled.load()) {
    std::vector<pollfd> waiting{{listening_->socket.get(), POLLIN, 0}};
    for (const Peer& peer : peers_) {
      if (!peer.hello) waiting.push_back({peer.connection.get(), POLLIN, 0});
    }
    ::poll(waiting.data(), waiting.size(), static_cast<int>(kStep.count()));
    accept_all();
    for (auto peer = peers_.begin(); peer != peers_.end();) {
      Message hello;
      const Received got = peer->hello ? Received::kNothing : receive_message(peer->connection, hello);
      if (got == Received::kMessage) peer->hello = std::move(hello);
      peer = got == Received::kClosed ? peers_.erase(peer) : std::next(peer);
    }
    for (Peer& peer : peers_) {
      if (!peer.hello || peer.hello->record.type != MessageType::kServantHello || !is_servant_user(peer))
        continue;
      try {
        if (peer.hello->record.abi == kSegmentAbi && peer.hello->task)
          return Segment<const TaskSegment>::open(std::move(peer.hello->task),
                                                  {robot_, ::geteuid(), fingerprint_});
      } catch (const SegmentError&) {
        // not a segment of a task of this robot: the position is determined without it
      }
      return std::nullopt;
    }
  }
  return std::nullopt;
}

void ChannelServer::inherit_servant(Descriptor servant) { inherited_ = std::move(servant); }

void ChannelServer::serve(const Segment<TaskSegment>& task, const Segment<StopSegment>& stop,
                          ServantMailbox& mailbox, Keep keep) {
  task_ = &task;
  stop_ = &stop;
  mailbox_ = &mailbox;
  keep_ = std::move(keep);
  thread_ = std::thread([this] { run(); });
}

void ChannelServer::run() {
  for (;;) {
    std::vector<pollfd> waiting{{end_event_.get(), POLLIN, 0}, {listening_->socket.get(), POLLIN, 0}};
    for (const Peer& peer : peers_) waiting.push_back({peer.connection.get(), POLLIN, 0});
    const bool has_hello =
        std::any_of(peers_.begin(), peers_.end(), [](const Peer& peer) { return peer.hello.has_value(); });
    ::poll(waiting.data(), waiting.size(), has_hello ? 0 : kTidy_ms);
    if ((waiting[0].revents & POLLIN) != 0) return;
    drop_closed();
    accept_all();
    for (auto peer = peers_.begin(); peer != peers_.end();) {
      peer = handle(*peer) ? std::next(peer) : peers_.erase(peer);
    }
    connected_.store(servant() != nullptr && servant()->role == Role::kServant, std::memory_order_release);
    unmap_former();
    if (!directory_->is_found(robot_, *listening_)) listen_again();
  }
}

/// Listens again after the file was removed: the connections remain, but no new process would find the task.
void ChannelServer::listen_again() noexcept {
  try {
    auto directory = RunDirectory::open(true);
    auto listening = directory->listen(robot_, policy_.stop_group);
    directory_ = std::move(directory);
    listening_ = std::move(listening);
    if (last_task_) (void)directory_->set_last_task(robot_, *last_task_);
  } catch (const SegmentError&) {
    // not possible now: the next turn tries again
  }
}

void ChannelServer::accept_all() {
  for (;;) {
    Descriptor connection(
        ::accept4(listening_->socket.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!connection) return;
    if (peers_.size() >= kMostConnections) drop_oldest();
    const ucred user = peer_of(connection);
    peers_.push_back({std::move(connection), user});
  }
}

void ChannelServer::drop_oldest() {
  const auto oldest = std::find_if(peers_.begin(), peers_.end(), [](const Peer& peer) {
    return peer.role != Role::kServant && peer.role != Role::kOffered;
  });
  if (oldest != peers_.end()) peers_.erase(oldest);
}

/// Removes closed connections before a new servant is checked: a servant that has just died does not block
/// it.
void ChannelServer::drop_closed() {
  peers_.remove_if([](const Peer& peer) { return is_closed(peer.connection); });
}

bool ChannelServer::handle(Peer& peer) {
  if (peer.hello) {
    const Message hello = std::move(*peer.hello);
    peer.hello.reset();
    return answer(peer, hello);
  }
  Message message;
  switch (receive_message(peer.connection, message)) {
    case Received::kNothing:
      return true;
    case Received::kClosed:
      return false;
    case Received::kMessage:
      break;
  }
  return answer(peer, message);
}

bool ChannelServer::answer(Peer& peer, const Message& message) {
  if (message.record.abi != kSegmentAbi) {
    refuse(peer.connection, robot_,
           {Kind::kWrongVersion,
            "the real-time task of " + robot_ + " speaks version " + std::to_string(kSegmentAbi) + ", not " +
                std::to_string(message.record.abi) + "; stop the other version of corbot ('corbot down')"});
    return false;
  }
  if (message.record.type == MessageType::kReady && peer.role == Role::kOffered) {
    begin_service(peer);
    return true;
  }
  if (peer.role != Role::kNone) return false;
  try {
    return admit(peer, message);
  } catch (const SegmentError& error) {
    refuse(peer.connection, robot_, error);
    return false;
  }
}

bool ChannelServer::admit(Peer& peer, const Message& hello) {
  Message welcome = Message::make(MessageType::kWelcome, robot_);
  const Carried task{kCarriesTask, task_->memory().get()};
  const Carried stop{kCarriesStop, stop_->memory().get()};
  const int servants = attached_.empty() ? inherited_.get() : attached_.back()->segment.memory().get();
  const Carried servant{kCarriesServant, servants};
  switch (hello.record.type) {
    case MessageType::kServantHello:
      if (!is_servant_user(peer)) throw not_allowed(robot_, peer.user, "serve");
      admit_servant(peer, hello);
      welcome.record.session = peer.attached->offer.session;
      return send_message(peer.connection, std::move(welcome), {task, servant});
    case MessageType::kObserverHello:
      if (!is_own(peer) && !is_servant_user(peer)) throw not_allowed(robot_, peer.user, "watch");
      peer.role = Role::kReader;
      return send_message(peer.connection, std::move(welcome), {task, servant});
    case MessageType::kStopHello:
      if (!may_stop(peer)) throw not_allowed(robot_, peer.user, "stop");
      peer.role = Role::kReader;
      // lets the client see that the arm has stopped
      return send_message(peer.connection, std::move(welcome), {task, stop});
    case MessageType::kWelcome:
    case MessageType::kRefused:
    case MessageType::kReady:
      break;
  }
  return false;
}

void ChannelServer::admit_servant(Peer& peer, const Message& hello) {
  // The servant may have died since drop_closed(), while this thread waited for a processor.
  if (const Peer* const dead = servant(); dead != nullptr && is_closed(dead->connection))
    peers_.remove_if([&](const Peer& each) { return &each == dead; });
  if (const Peer* const other = servant(); other != nullptr) {
    throw SegmentError(Kind::kInUse, robot_ + ": in use by another servant, pid " +
                                         std::to_string(other->user.pid) +
                                         "; stop it with 'corbot down', or give this robot another name");
  }
  Descriptor memory(::dup(hello.servant.get()));
  peer.attached = std::make_unique<Attached>(
      Attached{Segment<const ServantSegment>::open(std::move(memory), {robot_, peer.user.uid, fingerprint_}),
               ServantOffer{nullptr, ++last_session_}});
  peer.attached->offer.segment = &*peer.attached->segment;
  peer.role = Role::kOffered;
}

void ChannelServer::begin_service(Peer& peer) {
  peer.role = Role::kServant;
  attached_.push_back(std::move(peer.attached));
  inherited_ = Descriptor();
  if (keep_) keep_(attached_.back()->segment.memory());
  mailbox_->post(attached_.back()->offer);
}

/// Unmaps old segments. The cycle reads the newest one, or the one before until it has taken the newest.
void ChannelServer::unmap_former() {
  const std::uint64_t used = mailbox_->connected();
  attached_.remove_if([&](const std::unique_ptr<Attached>& each) { return each->offer.session < used; });
}

bool ChannelServer::is_own(const Peer& peer) const noexcept {
  return peer.user.uid == ::geteuid() || peer.user.uid == 0;
}

bool ChannelServer::is_servant_user(const Peer& peer) const noexcept {
  return peer.user.uid == ::geteuid() || (policy_.servant_user && peer.user.uid == *policy_.servant_user);
}

bool ChannelServer::may_stop(const Peer& peer) const noexcept {
  if (is_own(peer) || is_servant_user(peer)) return true;
  if (!policy_.stop_group) return false;
  const std::vector<gid_t> groups = groups_of(peer.connection, peer.user.gid);
  return std::find(groups.begin(), groups.end(), *policy_.stop_group) != groups.end();
}

const ChannelServer::Peer* ChannelServer::servant() const noexcept {
  const auto found = std::find_if(peers_.begin(), peers_.end(), [](const Peer& peer) {
    return peer.role == Role::kServant || peer.role == Role::kOffered;
  });
  return found == peers_.end() ? nullptr : &*found;
}

bool ChannelServer::servant_waits() const noexcept {
  return std::any_of(peers_.begin(), peers_.end(), [this](const Peer& peer) {
    return peer.hello && peer.hello->record.type == MessageType::kServantHello && is_servant_user(peer);
  });
}

/// Returns true if a servant is connected, or about to connect: it holds the segment of this task, or of the
/// previous one.
bool ChannelServer::has_servant() {
  accept_all();
  for (Peer& peer : peers_) {
    Message hello;
    if (peer.role == Role::kNone && !peer.hello &&
        receive_message(peer.connection, hello) == Received::kMessage)
      peer.hello = std::move(hello);
  }
  // A servant that has gone leaves nothing that needs the socket, not even an unread message.
  peers_.remove_if([](const Peer& peer) { return has_hung_up(peer.connection); });
  return servant() != nullptr || servant_waits();
}

void ChannelServer::close() noexcept {
  if (thread_.joinable()) {
    const std::uint64_t one = 1;
    (void)!::write(end_event_.get(), &one, sizeof(one));
    thread_.join();
  }
  connected_.store(false, std::memory_order_release);
  if (!listening_) return;
  try {
    // A servant closes its connection before it checks whether it has to remove the socket.
    directory_->end(
        robot_, *listening_, [this] { return has_servant(); }, policy_.is_supervised);
  } catch (const SegmentError&) {
    // no process has released the directory for two seconds: the socket is left behind
  }
  listening_.reset();
  peers_.clear();
}

}  // namespace corbot
