// SPDX-License-Identifier: Apache-2.0
#include "robot/motion_queue.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>
#include <utility>

#include "corbot/channel/fingerprint.h"
#include "planner/frame_settings.h"
#include "planner/setting_rules.h"
#include "planner/workspace_setting.h"
#include "robot/call_error.h"

namespace corbot {
namespace {

constexpr double kEcho_s = 2.0;  // for actions that the task completes within two cycles
constexpr std::chrono::milliseconds kLook{5};
constexpr std::chrono::seconds kRest{
    10};  // for actions that the task completes as fast as the arm's limits allow

/// One of a bounded number of calls; the destructor frees the slot.
class Place {
 public:
  Place(std::atomic<int>& taken, int capacity) : taken_(taken) {
    if (taken_.fetch_add(1) < capacity) return;
    taken_.fetch_sub(1);
    throw queue_full(capacity);
  }
  Place(const Place&) = delete;
  Place& operator=(const Place&) = delete;
  ~Place() { taken_.fetch_sub(1); }

 private:
  std::atomic<int>& taken_;
};

bool is_idle(const Snapshot& now) { return now.command_id == 0 && now.waiting_id == 0 && now.backlog == 0; }

CallError under_way(std::size_t motions) {
  return not_ready((motions == 1 ? std::string("a motion of others is")
                                 : fmt::format("{} motions of others are", motions)) +
                   " still under way: call again when the arm is at rest, or Stop it");
}

std::string still_to_come(const Snapshot& now) {
  std::string text = "of the servant before this one ";
  if (now.command_id != 0) {
    const double left_s = std::max(now.command_duration_s - now.virtual_time_s, 0.0);
    text += fmt::format("motion {} is still under way, ", now.command_id);
    text +=
        now.state == RtState::kPaused ? "paused" : fmt::format("{:.1f} s to go", left_s / now.override_ratio);
    if (now.backlog > 0) text += fmt::format(", and {} more are queued", now.backlog);
  } else {
    text += "motions are still queued";
  }
  return text + "; call again when the arm is at rest, or Stop it";
}

}  // namespace

corbot_ticket MotionQueue::accept(const MotionRequest& request, const PlanSettings& settings,
                                  std::uint64_t arrival, const std::function<Control::Use()>& admit,
                                  const Wanted& wanted) {
  const LivingTask task = access_.living();
  // Read before anything that takes time. A Stop that is counted later, or was since the request arrived,
  // ends this call. The task also refuses the motion if it is handed over after all.
  const std::uint64_t epoch = arrival != 0 ? arrival : task.stops();
  const std::uint64_t clears = task.own().control.clear_count.load(std::memory_order_acquire);
  // Follows the read of the number of stops: control that ends from now on counts a stop.
  const Control::Use use = admit();
  const Place place(starting_, capacity_);
  Patience patience{std::chrono::duration<double>(kRestKnown_s)};
  for (;;) {
    const bool is_last = patience.is_over();
    const std::uint64_t seen = access_.changes();
    if (const auto ticket = plan_next(request, settings, task, {epoch, clears})) return *ticket;
    // Without a lock: the thread that reads the cause takes the lock, too.
    if (is_in_error(task)) throw not_ready(view_.error_cause());
    if (is_last)
      throw not_ready(fmt::format("the arm has not come to rest in {:g} s; call again", kRestKnown_s));
    check(wanted);
    access_.wait_change(seen);
  }
}

/// Returns nothing if the arm's rest position is not known yet, or no longer after a Cancel or a change of
/// limits.
std::optional<corbot_ticket> MotionQueue::plan_next(const MotionRequest& request,
                                                    const PlanSettings& settings, const LivingTask& task,
                                                    const Begin& begin) {
  using Basis = std::tuple<PlanStart, std::optional<JointRanges>, std::optional<FurtherShapes>>;
  const auto basis = [&]() -> std::optional<Basis> {
    // A Clear ends an Error, and the Error has ended all motions that were accepted before.
    if (task.own().control.clear_count.load(std::memory_order_acquire) != begin.clears)
      throw not_ready("an Error and its Clear came before the motion was planned; call again");
    const auto start = plan_start(task, begin.epoch);
    if (!start) return std::nullopt;
    limits_.check_known(request);
    shapes_.check_known_at(request, frames_in_force(planner_.model().kinematics, settings).base_T_0);
    return Basis{*start, limits_.wanted(), shapes_.shapes()};
  };
  const auto check_stops = [&] {
    if (task.stops() != begin.epoch) throw stopped("a Stop came before the motion was planned");
  };
  const std::lock_guard turn(turn_mutex_);
  std::unique_lock lock(order_mutex_);
  access_.check(task);
  check_stops();
  if (tickets_.pending() >= static_cast<std::size_t>(capacity_)) throw queue_full(capacity_);
  const auto planned = basis();
  if (!planned) return std::nullopt;
  lock.unlock();
  PlanSettings limited = settings;
  const auto& [start, ranges, shapes] = *planned;
  limited.soft_limits = ranges;
  limited.further_shapes = shapes;
  PlanResult result = planner_.plan(start, limited, request);
  lock.lock();
  access_.check(task);
  check_stops();
  if (basis() != planned) return std::nullopt;
  if (const auto* refusal = std::get_if<PlanRefusal>(&result))
    throw refused(request, *refusal, planner_.model().kinematics);
  return hand_over(task, begin.epoch, result, start, shapes.value_or(FurtherShapes{}));
}

PlanStart MotionQueue::next_start() {
  const LivingTask task = access_.living();
  {
    const std::lock_guard lock(order_mutex_);
    access_.check(task);
    if (const auto start = plan_start(task, task.stops())) return *start;
  }
  if (is_in_error(task)) throw not_ready(view_.error_cause());
  throw not_ready("the arm is not at rest yet after a Stop or a Cancel; call again");
}

bool MotionQueue::is_in_error(const LivingTask& task) {
  Snapshot now{};
  return task.segment().snapshot.load(now) && now.incarnation == task.incarnation &&
         now.state == RtState::kError;
}

std::optional<PlanStart> MotionQueue::plan_start(const LivingTask& task, std::uint64_t epoch) {
  Snapshot now{};
  if (!task.segment().snapshot.load(now) || now.incarnation != task.incarnation) return std::nullopt;
  if (now.state == RtState::kError) return std::nullopt;
  if (is_earlier_stop(now.stops_done, epoch)) return std::nullopt;
  if (const auto last = tickets_.last_pending()) {
    // A motion that a Stop or a Cancel ends, or that belonged to an earlier task: its end has yet to be
    // reported.
    if (last->cancelled || last->epoch != epoch || last->incarnation != task.incarnation) return std::nullopt;
    return last->end;
  }
  // The verdict may precede the snapshot, and a cancelled command waits in the ring for its turn. The task
  // has the commands of a previous servant from the first snapshot on, or never.
  const bool has_ended = pushed_to_ != task.incarnation || now.last_done_id >= last_pushed_ ||
                         (is_idle(now) && last_pushed_ <= inherited_through_);
  if (!has_ended) return std::nullopt;
  // A servant with unreadable records has left motions without tickets.
  if (!is_idle(now)) throw not_ready(still_to_come(now));
  return PlanStart{now.position_q, now.gripper};
}

void MotionQueue::check_empty(const LivingTask& task, const Wanted& wanted) {
  for (Patience patience{std::chrono::duration<double>(kRestKnown_s)};;) {
    const bool is_last = patience.is_over();
    const std::uint64_t seen = access_.changes();
    Snapshot now{};
    {
      const std::lock_guard lock(order_mutex_);
      access_.check(task);
      if (const std::size_t pending = tickets_.pending(); pending > 0) throw under_way(pending);
      // The commands of this servant follow all those of previous ones, and all of them have verdicts. The
      // verdicts may precede the snapshot.
      if (pushed_to_ == task.incarnation && last_pushed_ > inherited_through_) return;
      // A servant with unreadable records has left motions without tickets.
      if (task.segment().snapshot.load(now) && now.incarnation == task.incarnation && is_idle(now)) return;
    }
    if (is_last) throw not_ready(still_to_come(now));
    check(wanted);
    access_.wait_change(seen);
  }
}

void MotionQueue::check_rest(const LivingTask& task, const Check& check) const {
  access_.check(task);
  Snapshot now{};
  if (!last_snapshot(task.segment(), now) || now.incarnation != task.incarnation)
    throw not_ready("the real-time task has not reported the position of the arm yet; call again");
  const std::size_t pending = tickets_.pending();
  if (pending > 0 || !is_idle(now)) {
    throw not_ready(
        "motions are under way, which were planned before this change: call again when the arm is at "
        "rest, or Stop it");
  }
  if (const auto refusal = check(now.position_q)) throw refused(*refusal, planner_.model().kinematics);
}

template <class Setting>
void MotionQueue::change(Setting& setting, const std::optional<typename Setting::Value>& wanted,
                         const Check& check) {
  const LivingTask task = access_.living();
  {
    const std::lock_guard lock(order_mutex_);
    check_rest(task, check);
  }
  // The disk may be slow: only other changes of this setting wait for it.
  setting.change(wanted, [&] {
    const std::lock_guard lock(order_mutex_);
    check_rest(task, check);
    setting.take(wanted);
  });
}

void MotionQueue::change_limits(const JointRanges& wanted) {
  change(limits_, wanted,
         [&](const Joints& position_q) { return check_stands_within(planner_.model(), wanted, position_q); });
}

void MotionQueue::change_shapes(const std::optional<FurtherShapes>& wanted, const PlanSettings& settings) {
  std::optional<PlacedShapes> placed;
  if (wanted) placed = {*wanted, frames_in_force(planner_.model().kinematics, settings).base_T_0};
  change(shapes_, placed, [&](const Joints& position_q) {
    return wanted ? check_stands_within(planner_.model(), settings, *wanted, position_q) : std::nullopt;
  });
}

void MotionQueue::reset_limits() {
  (void)access_.living();  // like every other change: a frozen task later resumes the motions that it has
  limits_.change(std::nullopt, [&] {
    const std::lock_guard lock(order_mutex_);
    limits_.take(std::nullopt);
  });
}

void MotionQueue::inherit(const std::vector<Ticket>& former) {
  if (former.empty()) return;
  const std::lock_guard lock(order_mutex_);
  last_pushed_ = inherited_through_ = former.back().last;
  pushed_to_ = former.back().incarnation;
}

/// Writes the knots of a command that has any, before the command is published; see kKnotSlots.
void MotionQueue::write_knots(ServantSegment& own, const PlanResult& plan, std::size_t number,
                              Command& command) {
  KnotRange* const range = knots_of(command);
  if (range == nullptr || range->count == 0) return;
  const PlannedRate& rate = plan.rates.at(number);
  if (rate.knots.size() > kMostKnots || rate.pieces.size() > rate::kMostPieces)
    throw internal("the planner returned more knots or pieces than a slot has");
  range->slot = static_cast<std::uint16_t>(knot_slots_++ % kKnotSlots);
  std::copy(rate.knots.begin(), rate.knots.end(), own.rates[range->slot].knots.begin());
  std::copy(rate.pieces.begin(), rate.pieces.end(), own.rates[range->slot].pieces.begin());
}

/// Writes the shapes that the next commands name. They differ from those in the segment only while nothing is
/// pending.
void MotionQueue::write_shapes(ServantSegment& own, const FurtherShapes& shapes) {
  FurtherShapes there;
  (void)own.shapes.load(there);
  if (there != shapes) own.shapes.store(shapes);
}

corbot_ticket MotionQueue::hand_over(const LivingTask& task, std::uint64_t epoch, PlanResult& plan,
                                     const PlanStart& start, const FurtherShapes& shapes) {
  auto& commands = std::get<std::vector<Command>>(plan);
  if (commands.empty() || commands.size() > 2) throw internal("the planner returned no motion");
  ServantSegment& own = task.own();
  write_shapes(own, shapes);
  // Only this function fills the ring, so free space stays free.
  if (task.channel->queued() + commands.size() > own.commands.capacity())
    throw queue_full(static_cast<int>(own.commands.capacity()));
  std::atomic<std::uint64_t>& next = own.next_command_id;
  Ticket ticket;
  // A new segment counts from 1 again, but a servant uses each ticket number once.
  ticket.first = std::max(next.load(std::memory_order_relaxed), last_number_ + 1);
  ticket.last = ticket.first + commands.size() - 1;
  ticket.incarnation = task.incarnation;
  ticket.epoch = epoch;
  ticket.end = {commands.back().end_q, start.gripper};
  ticket.handed_until = own.commands.published() + commands.size();
  for (std::size_t i = 0; i < commands.size(); ++i) {
    Command& command = commands[i];
    command.id = ticket.first + i;
    command.epoch = epoch;
    command.incarnation = static_cast<std::uint32_t>(task.incarnation);
    command.shapes = number_of(shapes);
    write_knots(own, plan, i, command);
    if (i == 1) ticket.second_from_s = ticket.duration_s;
    ticket.duration_s += command.duration_s;
    if (command.kind == MotionKind::kGripper)
      ticket.end.gripper = command.gripper.from + command.gripper.law.distance;
  }
  // Both precede the task's answer and the loss of this process after the commands are published: no number
  // is used twice.
  tickets_.add(ticket);
  last_number_ = ticket.last;
  next.store(ticket.last + 1, std::memory_order_release);
  // Each motion has its own producer: a producer that is kept would lose a command after a corrupt index, see
  // ring.h.
  if (!RingProducer(own.commands, task.segment().commands_tail).push_all(commands.data(), commands.size())) {
    tickets_.remove(ticket.last);
    throw queue_full(static_cast<int>(own.commands.capacity()));
  }
  last_pushed_ = ticket.last;
  pushed_to_ = task.incarnation;
  // The task may have died in between, and the link may have failed all pending motions before this one was
  // added. No later task carries this motion out.
  if (!access_.is_living(task)) tickets_.fail(ticket.last, access_.cause());
  return ticket.last;
}

void MotionQueue::cancel(corbot_ticket id, const Wanted& wanted) {
  const bool knows_all = access_.has_inherited();  // read before the look-up
  const auto ticket = tickets_.find(id);
  if (!ticket) throw knows_all ? no_such_motion(id) : not_ready(access_.cause());
  if (ticket->state != TicketState::kPending) return;
  const LivingTask task = access_.living();
  std::optional<TicketTable::Range> range;
  {
    std::unique_lock one(cancel_mutex_, std::try_to_lock);
    while (!one.owns_lock()) {
      check(wanted);
      access_.wait_change(access_.changes());
      (void)one.try_lock();
    }
    std::uint64_t count = 0;
    {
      const std::lock_guard lock(order_mutex_);
      access_.check(task);
      range = tickets_.cancel_from(id);
      if (!range) return;
      // Includes the ranges of earlier requests that the task has not read: the task reads the newest request
      // only.
      count = unfinished_cancel_ = request_cancel(task, tickets_.cancelled().value_or(*range));
    }
    Snapshot echo{};
    const auto is_echoed = [&](const Snapshot& now) {
      echo = now;
      return now.cancels_done == count;
    };
    access_.await(task, kEcho_s, "a Cancel", is_echoed, wanted);
    // No motion of the range can begin any more. A motion in progress decelerates, and its verdict follows.
    tickets_.end_cancelled(std::max(echo.command_id, echo.last_done_id));
    unfinished_cancel_ = 0;
  }
  for (Patience patience{kRest};;) {
    const bool is_last = patience.is_over();
    if (tickets_.wait_ended(range->first, range->last, kLook)) return;
    access_.check(task);
    if (is_last) throw not_ready(fmt::format("a Cancel did not end in {} s", kRest.count()));
    check(wanted);
  }
}

void MotionQueue::finish_cancel(const Snapshot& before) {
  // If another thread holds the lock, a Cancel is under way or another thread is here: the next snapshot
  // suffices.
  const std::unique_lock one(cancel_mutex_, std::try_to_lock);
  if (!one.owns_lock() || unfinished_cancel_ == 0 || before.cancels_done != unfinished_cancel_) return;
  unfinished_cancel_ = 0;
  tickets_.end_cancelled(std::max(before.command_id, before.last_done_id));
}

void MotionQueue::repeat_cancel() {
  const std::lock_guard one(cancel_mutex_);
  const std::lock_guard lock(order_mutex_);
  const auto range = tickets_.cancelled();
  if (range) (void)request_cancel(access_.connected(), *range);
}

std::uint64_t MotionQueue::request_cancel(const LivingTask& task, const TicketTable::Range& range) {
  CancelRequest last{};
  Snapshot now{};
  // A servant that was killed during the store leaves the cell torn. The task's echo then gives the count.
  if (!task.own().control.cancel.load(last)) last.count = 0;
  if (last_snapshot(task.segment(), now)) last.count = std::max(last.count, now.cancels_done);
  task.own().control.cancel.store({last.count + 1, range.first, range.last});
  return last.count + 1;
}

}  // namespace corbot
