// SPDX-License-Identifier: Apache-2.0
#include "shm/channel_client.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

namespace corbot {
namespace {

using Kind = SegmentError::Kind;
using Clock = std::chrono::steady_clock;

/// Longest wait for an answer. A task that is not frozen answers at once, except while it searches a servant
/// for the segment of the previous task.
constexpr std::chrono::seconds kAnswer{3};
/// A servant continues its predecessor's numbers, unless they cannot be valid.
constexpr std::uint64_t kLargestStep = 1'000'000;
constexpr std::uint64_t kMostClears = std::uint64_t{1} << 52;

struct Connected {
  Descriptor connection;
  uid_t peer;
};

Connected connect_to(const std::string& robot) {
  check_robot_name(robot);
  const auto directory = RunDirectory::open(false);
  if (!directory) {
    throw SegmentError(Kind::kAbsent, robot +
                                          ": absent: no real-time task runs for this robot; start it with "
                                          "'corbot up'");
  }
  Descriptor connection = directory->connect(robot);
  const uid_t peer = peer_of(connection).uid;
  if (!directory->is_trusted(peer)) {
    throw SegmentError(Kind::kPermission, directory->socket_path(robot) + ": uid " + std::to_string(peer) +
                                              " listens there, another user");
  }
  return {std::move(connection), peer};
}

/// Returns the answer to a hello; throws a refusal.
Message await_answer(const Descriptor& connection, const std::string& robot,
                     const std::function<bool()>& cancelled) {
  for (const auto deadline = Clock::now() + kAnswer; Clock::now() < deadline && !cancelled();) {
    Message answer;
    switch (receive_message(connection, answer)) {
      case Received::kMessage:
        if (answer.record.abi != kSegmentAbi) {
          throw SegmentError(Kind::kWrongVersion, "the real-time task of " + robot + " speaks version " +
                                                      std::to_string(answer.record.abi) +
                                                      ", this program speaks version " +
                                                      std::to_string(kSegmentAbi) +
                                                      "; stop the other version of corbot ('corbot down')");
        }
        if (answer.record.type == MessageType::kRefused) throw answer.error();
        if (answer.record.type != MessageType::kWelcome || answer.robot() != robot)
          throw SegmentError(Kind::kForeign, robot + ": an unexpected answer from its real-time task");
        return answer;
      case Received::kClosed:
        throw SegmentError(Kind::kAbsent, "the real-time task of " + robot + " has ended");
      case Received::kNothing:
        break;
    }
    pollfd waiting{connection.get(), POLLIN, 0};
    ::poll(&waiting, 1, 20);
  }
  throw SegmentError(Kind::kSilent, "the real-time task of " + robot + " does not answer");
}

[[noreturn]] void throw_gone(const std::string& robot) {
  throw SegmentError(Kind::kAbsent, "the real-time task of " + robot + " has ended");
}

bool never() { return false; }

}  // namespace

Observer Observer::of(const std::string& robot) {
  Connected task = connect_to(robot);
  if (!send_message(task.connection, Message::make(MessageType::kObserverHello, robot))) throw_gone(robot);
  Message welcome = await_answer(task.connection, robot, never);
  Observer observer(std::move(task.connection),
                    Segment<const TaskSegment>::open(std::move(welcome.task), {robot, task.peer}));
  if (welcome.servant) {
    // Its owner may be another user; the task has checked it.
    try {
      observer.servant_ = Segment<const ServantSegment>::open(std::move(welcome.servant), {robot, task.peer});
    } catch (const SegmentError&) {
      // only the task may read it
    }
  }
  return observer;
}

bool task_runs(const std::string& robot) {
  try {
    const auto directory = RunDirectory::open(false);
    return directory && directory->connect(robot);
  } catch (const SegmentError& error) {
    return error.kind() == Kind::kSilent;
  }
}

StopPort StopPort::of(const std::string& robot) {
  Connected task = connect_to(robot);
  if (!send_message(task.connection, Message::make(MessageType::kStopHello, robot))) throw_gone(robot);
  Message welcome = await_answer(task.connection, robot, never);
  return {std::move(task.connection),
          Segment<const TaskSegment>::open(std::move(welcome.task), {robot, task.peer}),
          Segment<StopSegment>::open(std::move(welcome.stop), {robot, task.peer})};
}

bool StopPort::newest(Snapshot& out) const noexcept {
  return task_->snapshot.load(out) && out.incarnation == task_->incarnation;
}

void StopPort::request() noexcept {
  // The cycle after the newest one may have read the count before the change; the cycle after that reads it
  // changed.
  constexpr std::uint64_t kReadAfter = 2;
  Snapshot before{};
  Snapshot after{};
  const bool has_before = newest(before);
  stop_->count.fetch_add(1, std::memory_order_acq_rel);
  read_by_cycle_.reset();
  if (has_before && newest(after)) read_by_cycle_ = after.cycle + kReadAfter;
  stops_before_ = before.stops_done;
}

StopPort::Outcome StopPort::outcome() noexcept {
  // precedes the snapshot: the last snapshot of a task that is gone counts
  const bool lives = !is_closed(connection_);
  Snapshot now{};
  const bool has_now = newest(now);
  const bool slows_down = now.state == RtState::kStopping || (now.flags & kSnapshotFaultStop) != 0;
  if (has_now && read_by_cycle_ && now.cycle >= *read_by_cycle_ && !slows_down) {
    if (now.state == RtState::kError || is_earlier_stop(stops_before_, now.stops_done))
      return Outcome::kAtRest;
    request();
  } else if (has_now && !read_by_cycle_) {
    request();  // its first cycle began with the previous count
  }
  return lives ? Outcome::kPending : Outcome::kTaskGone;
}

ServantPort::ServantPort(std::string robot, std::uint64_t fingerprint, Inherit inherit)
    : robot_(std::move(robot)),
      fingerprint_(fingerprint),
      inherit_(std::move(inherit)),
      own_(std::make_shared<Segment<ServantSegment>>(Segment<ServantSegment>::create(robot_, fingerprint))) {}

std::shared_ptr<ServantChannel> ServantPort::connect(const std::function<bool()>& cancelled) {
  Connected peer = connect_to(robot_);
  Message hello = Message::make(MessageType::kServantHello, robot_);
  hello.record.fingerprint = fingerprint_;
  if (!send_message(peer.connection, std::move(hello),
                    {{kCarriesTask, last_task_.get()}, {kCarriesServant, own_->memory().get()}}))
    throw_gone(robot_);
  Message welcome = await_answer(peer.connection, robot_, cancelled);
  auto task = Segment<const TaskSegment>::open(std::move(welcome.task), {robot_, peer.peer, fingerprint_});
  inherit(welcome, *task, peer.peer);
  last_task_ = Descriptor(::fcntl(task.memory().get(), F_DUPFD_CLOEXEC, 0));
  if (!send_message(peer.connection, Message::make(MessageType::kReady, robot_))) throw_gone(robot_);
  return std::make_shared<ServantChannel>(std::move(peer.connection), welcome.record.session, std::move(task),
                                          own_);
}

/// Continues numbers, flags and tails of the previous servant, before the task works for this one.
void ServantPort::inherit(const Message& welcome, const TaskSegment& task, uid_t peer) {
  ServantSegment& own = **own_;
  std::optional<Segment<const ServantSegment>> former;
  if (welcome.servant && !has_inherited_) {
    for (const uid_t owner : {::geteuid(), peer}) {
      try {
        Descriptor memory(::fcntl(welcome.servant.get(), F_DUPFD_CLOEXEC, 0));
        former = Segment<const ServantSegment>::open(std::move(memory), {robot_, owner, fingerprint_});
        break;
      } catch (const SegmentError&) {
        // not a segment of a servant of this robot
      }
    }
  }
  if (former && (*former)->header.id == own.header.id) former.reset();
  Snapshot now{};
  const bool has_snapshot = last_snapshot(task, now);
  const std::uint64_t done = has_snapshot ? std::max(now.last_done_id, now.command_id) : 0;
  std::uint64_t next = std::max(own.next_command_id.load(std::memory_order_relaxed), done + 1);
  const ServantSegment* const before = former ? &**former : nullptr;
  if (before != nullptr) {
    const std::uint64_t theirs = before->next_command_id.load(std::memory_order_acquire);
    if (theirs > next && theirs - next <= kLargestStep) next = theirs;
    const double ratio = before->control.override_ratio.load(std::memory_order_relaxed);
    if (std::isfinite(ratio) && ratio > 0.0 && ratio <= 1.0) own.control.override_ratio.store(ratio);
    own.control.pause.store(before->control.pause.load(std::memory_order_relaxed) != 0 ? 1 : 0);
    (void)raise_stop_count(own.control.stop_count,
                           before->control.stop_count.load(std::memory_order_acquire));
    // Reports of a Clear contain its number, and are read in place of the previous one.
    const std::uint64_t clears = before->control.clear_count.load(std::memory_order_acquire);
    if (clears < kMostClears) own.control.clear_count.store(clears);
    // A StopAndHold that no Clear has ended. It is added, since this servant may have received one already.
    if (before->control.hold_count.load(std::memory_order_acquire) !=
        before->control.holds_cleared.load(std::memory_order_acquire))
      own.control.hold_count.fetch_add(1, std::memory_order_release);
  }
  own.next_command_id.store(next, std::memory_order_release);
  if (own.task_id.load(std::memory_order_relaxed) != task.header.id) {
    const bool same = before != nullptr && before->task_id.load(std::memory_order_acquire) == task.header.id;
    const auto begin = [](RingTail<>& tail, const RingTail<>* theirs, std::uint64_t published,
                          std::size_t capacity) {
      std::uint64_t taken = theirs != nullptr ? theirs->taken() : 0;
      // The last report is read again: the servant may have been killed before it recorded the report. The
      // exception is a slot that the task, which still uses the previous tail, may be writing.
      if (taken > 0 && published - taken < capacity / 2) --taken;
      tail.begin_at(published - taken <= capacity ? taken : published);
    };
    begin(own.completions_tail, same ? &before->completions_tail : nullptr, task.completions.published(),
          task.completions.capacity());
    begin(own.alarms_tail, same ? &before->alarms_tail : nullptr, task.alarms.published(),
          task.alarms.capacity());
    own.task_id.store(task.header.id, std::memory_order_release);
  }
  if (!has_inherited_ && inherit_) inherit_({before, has_snapshot ? &now : nullptr});
  has_inherited_ = true;
}

}  // namespace corbot
