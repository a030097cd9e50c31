// SPDX-License-Identifier: Apache-2.0
#include "cell/coordinator/worker.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "cell/coordinator/attention.h"
#include "cell/coordinator/pause.h"
#include "cell/coordinator/process_name.h"
#include "client/explain.h"

namespace corbot::cell {

using Eigen::Vector3d;

namespace {

constexpr double kStoreWait_s = 2;               // a stop waits so long; the supervisor kills after 5 s
constexpr double kLookAgain_s = 0.5;             // between two looks at an area without a usable piece
constexpr double kConnectAgain_s = 1;            // between two attempts to reach robot and store
constexpr std::chrono::seconds kConnectFor{10};  // then the status calls for a person
constexpr std::chrono::seconds kPersonPause{1};  // between two checks of a person's answer
constexpr double kFaultPause_s = 0.1;
/// A stand-by has control for an instant to look at the claim. Refusals in a row, this time apart, are those
/// of a robot at work.
constexpr double kInstant_s = 0.1;
constexpr int kRefusalsAtWork = 4;
constexpr double kOverShared_m = 0.05;  // margin of a shared place; wait poses are outside
constexpr double kAtWait_m = 0.005;
constexpr int kSettleReads = 10;  // reads of the position, 0.1 s apart

Vector3d to_vector(const Corbot::Point& point) { return {point.x, point.y, point.z}; }

/// Returns an exception's message as printable text.
std::string plain_text(const std::exception& error) { return client::printable(error.what()); }

}  // namespace

Worker::Worker(const CellConfig& cell, const CellRobot& robot, Ports ports, std::string who,
               WorkStatus::Report report, std::stop_token stop, WorkStatus::OnActivity on_activity)
    : cell_(cell),
      robot_(robot),
      from_(*cell.place(robot.from)),
      to_(*cell.place(robot.to)),
      wait_{robot.wait_m, cell.key_of(robot) + ".wait_m"},
      arm_(ports.robot),
      camera_(ports.camera),
      store_(ports.store),
      who_(std::move(who)),
      stop_(std::move(stop)),
      motions_(robot, ports.robot, stop_),
      status_(robot.name, std::move(report), std::move(on_activity)) {}

void Worker::run() {
  while (true) {
    interrupted_ = std::chrono::steady_clock::now();
    try {
      work();
    } catch (const WorkEnded&) {
      return status_.set(Corbot::WorkIdle, "stopped");
    } catch (const RobotUnable&) {  // NOLINT(bugprone-empty-catch): connect() reports the cause
    } catch (const Corbot::Superseded& e) {
      token_ = 0;
      is_marked_ = false;
      heeded_ = starts();
      status_.set(Corbot::WorkIdle, e.present == 0
                                        ? std::string("superseded: the claim was released")
                                        : fmt::format("superseded: claim {} is the robot's now", e.present));
    } catch (const RobotStopped& e) {
      await_start(Corbot::WorkStopped, e.what() + error_note());
    } catch (const PieceUnclear& e) {
      await_person(Corbot::WorkAttention, e.what(), [&] { return is_resolved(); });
    } catch (const MotionFault& e) {
      end_motion_fault(e.what());
    } catch (const Fault& e) {
      last_fault_ = fmt::format("{}: {}", step_, e.what());
      status_.set(Corbot::WorkAttention, last_fault_);
    } catch (const CORBA::Exception& e) {
      await_start(Corbot::WorkAttention, fmt::format("unexpected exception {}", e._name()));
    } catch (const std::exception& e) {
      await_start(Corbot::WorkAttention, e.what());
    }
    if (stop_.stop_requested()) return status_.set(Corbot::WorkIdle, "stopped");
    pause(kFaultPause_s, stop_);
  }
}

void Worker::work() {
  count_anew_after_answer();
  if (const auto held = resolve()) place(*held);
  while (true) {
    const Transfer transfer = find();
    if (pick(transfer)) place(transfer);
  }
}

void Worker::go_on() {
  const std::lock_guard lock(mutex_);
  ++starts_;
  gone_on_.notify_all();
}

int Worker::starts() {
  const std::lock_guard lock(mutex_);
  return starts_;
}

bool Worker::lets_go(std::chrono::steady_clock::time_point gives_up) {
  std::unique_lock lock(mutex_);
  return gone_on_.wait_until(lock, gives_up, [&] { return has_let_go_; });
}

/// Resets the counts of faults after a person's answer, since the person may have removed the cause.
void Worker::count_anew_after_answer() {
  const std::lock_guard lock(mutex_);
  if (std::exchange(counted_starts_, starts_) == starts_) return;
  equal_faults_ = 0;
  failures_ = 0;
  left_out_.clear();
}

void Worker::end_motion_fault(const std::string& text) {
  if (stop_.stop_requested()) return;
  equal_faults_ = text == motion_fault_ ? equal_faults_ + 1 : 1;
  motion_fault_ = text;
  last_fault_ = fmt::format("{}: {}", step_, text);
  if (equal_faults_ < cell_.timing.attempts) return status_.set(Corbot::WorkIdle, last_fault_);
  await_start(Corbot::WorkAttention, fmt::format("{} times in a row: {}", equal_faults_, text));
}

void Worker::await_start(Corbot::WorkState state, const std::string& text) {
  await_person(state, text + "; 'corbot cell start CELL' goes on", [] { return false; });
}

void Worker::await_person(Corbot::WorkState state, const std::string& text,
                          const std::function<bool()>& is_over) {
  if (stop_.stop_requested()) return;
  const int before = starts();
  status_.set(state, fmt::format("{}: {}", step_, text));
  bool has_control = !give_back_control();  // the person may need control
  std::unique_lock lock(mutex_);
  while (before == starts_ && !stop_.stop_requested()) {
    has_let_go_ = !has_control;
    gone_on_.notify_all();
    gone_on_.wait_for(lock, stop_, kPersonPause, [&] { return before != starts_; });
    lock.unlock();
    if (has_control) has_control = !give_back_control();
    const bool ends = is_over();
    lock.lock();
    if (ends) break;
  }
  has_let_go_ = false;
  lock.unlock();
  status_.set(Corbot::WorkIdle, "");  // no person is needed any more
}

/// Marks the claim, then releases control. The mark keeps a stand-by from taking control and moving the arm.
bool Worker::give_back_control() {
  try {
    if (token_ != 0 && !is_marked_) token_ = store_.claim(robot_.name, waiting_name(who_), token_);
    is_marked_ = token_ != 0;
  } catch (const Corbot::Claimed& e) {
    is_marked_ = waiting_name(who_) == e.who.in();  // the reply of the first call was lost
    token_ = is_marked_ ? e.token : 0;
  } catch (const std::exception& error) {
    status_.report("control is kept, since the claim cannot say that a person is needed: " +
                   plain_text(error));
    return false;
  } catch (const CORBA::Exception& error) {  // a store of another cell does not know the robot
    status_.report(fmt::format("control is kept, since the claim cannot say that a person is needed: {}",
                               error._name()));
    return false;
  }
  try {
    arm_.release();
  } catch (const std::exception& error) {
    status_.report("control was not given back: " + plain_text(error));
  }
  return true;
}

// --- Resolution of the state, without assumptions ---

/// Determines the state of robot and piece at the start and after each fault. Returns the transfer whose
/// piece is in the gripper; the next step places it.
std::optional<Transfer> Worker::resolve() {
  step_ = "begin";
  connect();
  const Vector3d tool = motions_.rest_position();
  find_zone(tool);
  std::optional<Corbot::TransferInfo> left;
  const Corbot::TransferInfos transfers = call([&] { return store_.transfers(); });
  for (CORBA::ULong i = 0; i < transfers.length(); ++i) {
    if (transfers[i].robot.in() == robot_.name) left = transfers[i];
  }
  const bool has_touched = left && left->step != Corbot::StepReserved;
  const Grip grip = call([&] { return arm_.grip(); });
  // An arm that has never moved counts as closed. Without a measured opening, only a pick of this worker
  // proves a piece in the gripper.
  const Corbot::RobotWork last = status_.get();
  const bool has_gripped = grip == Grip::kClosedOnPiece ||
                           (grip == Grip::kClosed && last.piece != 0 && last.step != Corbot::StepReserved);
  if (has_gripped && !has_touched)
    throw Attention(
        fmt::format("the gripper of {} is closed on a piece that is not in the ledger: hold the piece, and "
                    "use 'corbot open'",
                    robot_.name));
  motions_.speed(wait_);
  // A fault may have interrupted the gripper's motion.
  if (grip == Grip::kOpen) {
    motions_.open(wait_);
  } else if (has_touched) {
    motions_.close(wait_);
  }
  move_out(tool);
  bool is_held = false;
  std::optional<Transfer> transfer;
  if (left) {
    transfer = checked(*left);
    status_.set_piece(transfer->piece, left->step);
    is_held = resolve_transfer(*left, *transfer, call([&] { return arm_.grip(); }));
  } else {
    status_.set_piece(0, Corbot::StepPlaced);  // another coordinator may have ended the transfer
    if (grip != Grip::kOpen) motions_.open(wait_);
  }
  if (!is_held || zone_ != to_.name) leave();
  check_unclear();
  if (!last_fault_.empty()) status_.report("goes on");
  last_fault_.clear();
  return is_held ? transfer : std::nullopt;
}

void Worker::connect() {
  for (int refusals = 0;;) {
    end_if_stopped();
    const auto is_late = [&] { return std::chrono::steady_clock::now() - interrupted_ > kConnectFor; };
    std::string why;
    bool is_standby = false;
    bool awaits_person = false;
    const int before = starts();
    try {
      if (arm_.is_able()) {
        const auto holder = take_robot();
        if (!holder) {
          heeded_ = before;
          return;
        }
        why = holder->text;
        is_standby = true;
        awaits_person = holder->awaits_person;
      } else {
        why = is_late() ? how_to_clear() : robot_.name + " is in Error, or has no real-time task";
      }
    } catch (const Corbot::NotReady& e) {
      if (++refusals < kRefusalsAtWork) {
        pause(kInstant_s, stop_);
        continue;
      }
      why = "stand-by: " + client::printable(e.reason.in());
      is_standby = true;
    } catch (const Corbot::BadParameter& e) {  // a store of another cell does not know the robot
      why = plain_text(client::explain(e));
    } catch (const client::Failure& e) {
      why = plain_text(e);
    }
    const bool late = is_late();
    if (late && !last_fault_.empty()) why += "; the work ended at " + last_fault_;
    refusals = 0;
    if (is_standby) heeded_ = before;
    const bool needs_person = awaits_person || (late && !is_standby);
    const Corbot::WorkState otherwise = late ? Corbot::WorkWaiting : Corbot::WorkIdle;
    status_.set(needs_person ? Corbot::WorkAttention : otherwise, why);
    pause(kConnectAgain_s, stop_);
  }
}

/// Acquires control and the claim. Returns nothing on success, or else the holder. Throws Failure if only a
/// person's Start can continue the work.
std::optional<Worker::Holder> Worker::take_robot() {
  const bool is_exclusive = arm_.acquire();
  if (token_ != 0 && !is_marked_) return std::nullopt;  // the store refuses a token of an ended claim
  try {
    token_ = store_.claim(robot_.name, who_, token_);
  } catch (const Corbot::Claimed& e) {
    const std::string who = e.who.in();
    if (!may_replace(who, e.token, is_exclusive)) {
      if (is_exclusive) arm_.release();
      if (is_waiting_name(who) && is_of_dead_process(who))
        throw client::Failure(
            client::ExitCode::kRefused,
            fmt::format(
                "'{}' has ended while {} waited for a person: look at {}, then use 'corbot cell start CELL'",
                client::printable(who), robot_.name, robot_.name));
      return Holder{
          fmt::format(
              "stand-by: '{}' {} {} by claim {}; where it has ended for good, use 'corbot cell release CELL "
              "{}'",
              client::printable(who), is_waiting_name(who) ? "waits for a person, with" : "works with",
              robot_.name, e.token, robot_.name),
          is_waiting_name(who)};
    }
    try {
      token_ = store_.claim(robot_.name, who_, e.token);
    } catch (const Corbot::Claimed& other) {
      return Holder{
          fmt::format("stand-by: '{}' was first to claim {}", client::printable(other.who.in()), robot_.name),
          false};
    }
  }
  is_marked_ = false;
  return std::nullopt;
}

/// Tells if this worker may replace the claim's holder. Control of the arm proves that the holder cannot move
/// it. A holder that waits for a person has released control, so replacing it needs proof of its end and a
/// later Start. That Start counts until the claim passes on, also if another coordinator asks for control at
/// the same time. The worker looks each second and needs 0.3 s to recognise a robot at work. A Start in the
/// last 1.3 s before the end may count as later. A holder with this worker's name is this process: the reply
/// of an earlier claim was lost.
bool Worker::may_replace(const std::string& who, Corbot::ClaimToken token, bool is_exclusive) {
  if (who == who_ || who == waiting_name(who_)) return true;
  if (!is_waiting_name(who)) return is_exclusive || is_of_dead_process(who);
  if (!is_of_dead_process(who)) return false;
  if (ended_claim_ != token) heeded_at_end_ = heeded_;
  ended_claim_ = token;
  return starts() > heeded_at_end_;
}

/// Determines the robot's zone from the ledger. A tool over a shared place must be in its zone, so the
/// function enters the zone if necessary.
void Worker::find_zone(const Vector3d& tool) {
  zone_.clear();
  const Corbot::PlaceInfos places = call([&] { return store_.places(); });
  for (CORBA::ULong i = 0; i < places.length(); ++i) {
    if (places[i].robot.in() == robot_.name) zone_ = places[i].name.in();
  }
  status_.set_zone(zone_);
  for (const Place& place : cell_.places) {
    if (!place.is_shared || !place.covers(tool, kOverShared_m) || zone_ == place.name) continue;
    try {
      call([&] { store_.enter(token_, place.name, 0); });
      zone_ = place.name;
      status_.set_zone(zone_);
    } catch (const Corbot::Occupied& e) {
      throw Attention(fmt::format("{} is in the zone of {}, and {} is over it, at {}: move {} to {} by hand",
                                  client::printable(e.robot.in()), place.name, robot_.name, describe(tool),
                                  robot_.name, wait_.key));
    }
  }
}

/// Moves the tool straight up and then to the wait pose.
void Worker::move_out(const Vector3d& tool) {
  if ((tool - wait_.point).norm() <= kAtWait_m) return;
  status_.set(Corbot::WorkMoving, "");
  if (tool.z() < wait_.point.z() - kAtWait_m) motions_.rise(tool, wait_.point.z(), wait_);
  motions_.move(wait_);
}

/// Ends or continues a transfer after a fault. Returns true if the piece is in the gripper. The tool is at
/// its wait pose, so a picture shows the places.
bool Worker::resolve_transfer(const Corbot::TransferInfo& left, const Transfer& transfer, Grip grip) {
  const bool may_hold = grip == Grip::kClosed || grip == Grip::kClosedOnPiece;
  const auto end_at = [&](Corbot::TransferStep step, const std::string& note) {
    if (grip != Grip::kOpen) motions_.open(wait_);
    advance(transfer, step, note);
    return false;
  };
  const auto sees_at = [&](const Place& place, const Vector3d& foot) {
    if (zone_ != place.name) leave();
    enter(place);
    return sees_piece_at(place, foot);
  };
  if (left.step == Corbot::StepReserved) return end_at(Corbot::StepWithdrawn, "not touched before a fault");
  if (left.step == Corbot::StepPicking) {
    if (sees_at(from_, transfer.source)) {
      check_other_piece(transfer, grip);
      return end_at(Corbot::StepWithdrawn, "it stands there after a fault");
    }
    if (may_hold) advance(transfer, Corbot::StepHeld, "not seen at its source, the gripper is closed");
  }
  if (left.step == Corbot::StepPlacing) {
    if (sees_at(to_, transfer.target) && grip != Grip::kClosedOnPiece)
      return end_at(Corbot::StepPlaced, "seen there after a fault");
    if (may_hold) advance(transfer, Corbot::StepHeld, "not seen at the target, the gripper is closed");
  }
  if (!may_hold) resolve_as_unclear(transfer);
  return may_hold;
}

/// Marks the piece as unclear. The note lists the pieces seen outside of places, for the person who searches.
void Worker::resolve_as_unclear(const Transfer& transfer) {
  const Corbot::Frame frame = look("the table");
  std::string seen;
  for (CORBA::ULong i = 0; i < frame.pieces.length(); ++i) {
    const Vector3d foot = to_vector(frame.pieces[i].position);
    const auto carries = [&](const Place& place) { return place.carries(foot); };
    if (std::none_of(cell_.places.begin(), cell_.places.end(), carries)) seen += " " + describe(foot);
  }
  const std::string where =
      seen.empty() ? "no piece is seen outside of places" : "seen outside of places:" + seen;
  advance(transfer, Corbot::StepUnclear, "the gripper is open; " + where);
}

/// Returns the instructions for a piece that this robot has lost; empty: none is lost.
std::string Worker::own_unclear() {
  const Corbot::PieceEvents events = call([&] { return store_.unclear(); });
  for (CORBA::ULong i = 0; i < events.length(); ++i) {
    const Corbot::PieceEvent& event = events[i];
    if (event.robot.in() != robot_.name) continue;
    return fmt::format("piece {} is not where it should be, at {}, {} ({}): {}", event.piece,
                       event.where.place.in(), describe(to_vector(event.where.position)),
                       client::printable(event.note.in()), how_to_resolve(event.piece));
  }
  return "";
}

/// Tells if no piece is unclear any more, or if a stop is requested. False if the store does not reply.
bool Worker::is_resolved() {
  try {
    return own_unclear().empty();
  } catch (const std::exception&) {
    return false;
  } catch (const WorkEnded&) {
    return true;
  }
}

std::string Worker::how_to_clear() const {
  return fmt::format("{} is in Error: look at 'corbot status', put the cause right, then use 'corbot clear'",
                     robot_.name);
}

/// Returns the instructions to clear an Error; empty: no Error. A StopAndHold ends a motion as a Stop does,
/// and leaves an Error. During a stop of the cell the function does not call the robot.
std::string Worker::error_note() {
  try {
    return arm_.is_halted() || arm_.is_able() ? "" : "; " + how_to_clear();
  } catch (const client::Failure&) {
    return "";  // the next connect() reports the cause
  }
}

std::string Worker::how_to_resolve(Corbot::PieceNumber piece) const {
  return fmt::format("find the piece, and say by 'corbot cell resolve CELL {} PLACE SLOT' where it stands",
                     piece);
}

void Worker::check_unclear() {
  const std::string text = own_unclear();
  if (!text.empty()) throw PieceUnclear(text);
}

// --- Recipe ---

Transfer Worker::find() {
  step_ = "find";
  while (true) {
    count_anew_after_answer();
    std::string cause;
    try {
      if (from_.slots) {
        status_.set_activity(Activity::kWaitingForPiece);  // the call blocks in the store
        return checked(call([&] { return store_.reserve(token_, from_.name, to_.name, {}, kStoreWait_s); }));
      }
      enter(from_);
      const Corbot::Sightings seen = nearest_first(look(from_.name));
      return checked(call([&] { return store_.reserve(token_, from_.name, to_.name, seen, 0); }));
    } catch (const Corbot::Empty&) {
      cause = from_.name + (left_out_.empty() ? " is empty" : " has no piece within reach");
    } catch (const Corbot::Full&) {
      cause = to_.name + " is full";
      if (!to_.row_kinds.empty()) cause += " for the kinds of the pieces at " + from_.name;
    }
    leave();
    wait_for(Activity::kWaitingForPiece, cause, from_.slots ? 0 : kLookAgain_s);
  }
}

bool Worker::pick(const Transfer& transfer) {
  step_ = "pick";
  status_.set_piece(transfer.piece, Corbot::StepReserved);
  enter(from_);
  status_.set(Corbot::WorkMoving, "");
  if (!sees_piece_at(from_, transfer.source)) {
    withdraw(transfer, "no piece is seen there");
    return false;
  }
  const ToolGoal goal = grasp_goal(transfer, from_, transfer.source);
  try {
    approach(transfer, from_, goal, Corbot::StepPicking);
  } catch (const PointRefused& refusal) {
    refuse_source(transfer, refusal.what());
    return false;
  }
  motions_.close(goal);
  retreat(from_, goal);
  if (sees_piece_at(from_, transfer.source)) {
    check_other_piece(transfer, call([&] { return arm_.grip(); }));
    motions_.open(wait_);
    withdraw(transfer, "the piece still stands there after the pick");
    return false;
  }
  failures_ = 0;
  advance(transfer, Corbot::StepHeld);
  leave();
  return true;
}

/// Throws Attention if the gripper measures a piece although one stands at the source after the grasp. The
/// gripper then holds another piece, and must not drop it.
void Worker::check_other_piece(const Transfer& transfer, Grip grip) {
  if (grip != Grip::kClosedOnPiece) return;
  leave();
  throw Attention(fmt::format(
      "the gripper of {} holds a piece, and a piece stands at {}, {}: take that away, or hold the "
      "other one, and use 'corbot open'",
      robot_.name, from_.name, describe(transfer.source)));
}

void Worker::place(const Transfer& transfer) {
  step_ = "place";
  enter(to_);
  status_.set(Corbot::WorkMoving, "");
  const ToolGoal goal = grasp_goal(transfer, to_, transfer.target);
  if (sees_piece_at(to_, transfer.target)) {
    leave();
    throw Attention(fmt::format(
        "the gripper holds piece {}, and a piece that is not in the ledger stands at {}, {}: take that away",
        transfer.piece, to_.name, describe(transfer.target)));
  }
  approach(transfer, to_, goal, Corbot::StepPlacing);
  motions_.open(goal);
  retreat(to_, goal);
  const bool is_there = sees_piece_at(to_, transfer.target);
  advance(transfer, is_there ? Corbot::StepPlaced : Corbot::StepUnclear,
          is_there ? "" : "not seen at the target");
  leave();
  if (!is_there) {
    throw PieceUnclear(fmt::format("piece {} is not seen at {}, {}: {}", transfer.piece, to_.name,
                                   describe(transfer.target), how_to_resolve(transfer.piece)));
  }
  equal_faults_ = 0;
}

// --- Parts of the recipe ---

Corbot::Sightings Worker::nearest_first(const Corbot::Frame& frame) const {
  std::vector<std::pair<double, CORBA::ULong>> order;
  for (CORBA::ULong i = 0; i < frame.pieces.length(); ++i) {
    const Vector3d foot = to_vector(frame.pieces[i].position);
    const auto is_here = [&](const Vector3d& spot) { return (spot - foot).norm() <= kOnPlace_m; };
    if (cell_.kind(frame.pieces[i].kind.in()) == nullptr || !from_.carries(foot)) continue;
    if (std::any_of(left_out_.begin(), left_out_.end(), is_here)) continue;
    order.emplace_back((foot - robot_.frame.position_m).norm(), i);
  }
  std::sort(order.begin(), order.end());
  Corbot::Sightings seen;
  seen.length(static_cast<CORBA::ULong>(order.size()));
  for (CORBA::ULong i = 0; i < seen.length(); ++i) seen[i] = frame.pieces[order[i].second];
  return seen;
}

Transfer Worker::checked(const Corbot::TransferInfo& info) const {
  Transfer transfer{info.piece, cell_.kind(info.kind.in()), to_vector(info.source.position),
                    to_vector(info.target.position)};
  if (transfer.kind != nullptr && from_.carries(transfer.source) && to_.carries(transfer.target))
    return transfer;
  throw Attention(fmt::format(
      "the store gives piece {} of kind '{}' at {} and the target {}, which are not of {} and {}: have "
      "store and coordinator the same cell.toml?",
      info.piece, client::printable(info.kind.in()), describe(transfer.source), describe(transfer.target),
      from_.name, to_.name));
}

void Worker::withdraw(const Transfer& transfer, const std::string& why) {
  advance(transfer, Corbot::StepWithdrawn, why);
  leave();
  if (++failures_ < cell_.timing.attempts) return;
  std::string text =
      fmt::format("{} failed picks in a row, the last at {}, {}: {}; check the gripper, the camera and {}",
                  failures_, from_.name, describe(transfer.source), why, key_of(from_));
  if (from_.slots) {  // the ledger keeps the piece and would select it again
    text += fmt::format(
        "; where piece {} was taken away, put it back, or empty {} and use 'corbot cell exchange CELL {}'",
        transfer.piece, from_.name, from_.name);
  }
  throw Attention(text);
}

void Worker::refuse_source(const Transfer& transfer, const std::string& why) {
  motions_.move(wait_);
  advance(transfer, Corbot::StepWithdrawn, why);
  leave();
  if (from_.slots) throw Attention(why);  // the store would select the same piece again
  left_out_.push_back(transfer.source);
  status_.report(fmt::format("leaves out the piece at {}: {}", describe(transfer.source), why));
}

/// Returns true after a motion on an arc. Returns false, without a motion, if cell.toml demands no arc, or if
/// the robot refuses it.
bool Worker::moves_on_arc(const Place& place, const ToolGoal& from, const ToolGoal& to) {
  if (!robot_.moves_on_arc(place)) return false;
  try {
    motions_.move_on_arc(from, to);
    return true;
  } catch (const PointRefused& refusal) {
    status_.report(fmt::format("moves freely, since the arc was refused: {}", refusal.what()));
    return false;
  }
}

/// Moves to the grasp of the piece. The descent begins when the intent is in the ledger.
void Worker::approach(const Transfer& transfer, const Place& place, const ToolGoal& goal,
                      Corbot::TransferStep intent) {
  std::future<void> written = std::async(std::launch::async, [&] { advance(transfer, intent); });
  if (!moves_on_arc(place, wait_, motions_.above(goal))) motions_.move_above(goal);
  await_intent(written);
  motions_.descend(goal);
  motions_.settle(goal);
}

void Worker::retreat(const Place& place, const ToolGoal& goal) {
  motions_.ascend(goal);
  if (!moves_on_arc(place, motions_.above(goal), wait_)) motions_.move(wait_);
}

ToolGoal Worker::grasp_goal(const Transfer& transfer, const Place& place, const Vector3d& foot) const {
  return {foot + Vector3d(0, 0, transfer.kind->grasp_m), key_of(place)};
}

Corbot::Frame Worker::look(const std::string& at) {
  const Activity before = status_.activity();
  status_.set_activity(Activity::kLooking);
  try {
    Corbot::Frame frame = call([&] { return camera_.look(cell_.timing.look_s); });
    status_.set_activity(before);
    return frame;
  } catch (const Fault& why) {
    throw Fault(fmt::format("no picture of {}: {}; check camera in cell.toml", at, why.what()));
  }
}

bool Worker::sees_piece_at(const Place& place, const Vector3d& foot) {
  const Corbot::Frame frame = look(fmt::format("{}, {}", place.name, describe(foot)));
  for (CORBA::ULong i = 0; i < frame.pieces.length(); ++i) {
    if ((to_vector(frame.pieces[i].position) - foot).norm() <= kOnPlace_m) return true;
  }
  return false;
}

// --- The ledger ---

void Worker::advance(const Transfer& transfer, Corbot::TransferStep step, const std::string& note) {
  call([&] { store_.advance(token_, transfer.piece, step, client::printable(note).substr(0, 200)); });
  const bool is_target =
      step == Corbot::StepPlacing || step == Corbot::StepPlaced || step == Corbot::StepUnclear;
  const Vector3d& where = is_target ? transfer.target : transfer.source;
  status_.report(fmt::format("piece {} {} at {} ({:.3f}, {:.3f}){}{}", transfer.piece, to_string(step),
                             is_target ? to_.name : from_.name, where.x(), where.y(),
                             note.empty() ? "" : ": ", note));
  const bool is_end = step >= Corbot::StepPlaced;
  status_.set_piece(is_end ? 0 : transfer.piece, step);
}

void Worker::enter(const Place& place) {
  while (place.is_shared && zone_ != place.name) {
    status_.set_activity(Activity::kWaitingForZone);  // the call blocks in the store
    try {
      call([&] { store_.enter(token_, place.name, kStoreWait_s); });
      zone_ = place.name;
      status_.set_zone(zone_);
      status_.set_activity(Activity::kMoving);
    } catch (const Corbot::Occupied& e) {
      wait_for(Activity::kWaitingForZone,
               fmt::format("{} is in the zone of {}", client::printable(e.robot.in()), place.name));
    }
  }
}

void Worker::leave() {
  if (zone_.empty()) return;
  if (!is_at_wait()) {
    throw Attention(fmt::format("the tool is not within {:.0f} mm of {}, {}: the zone of {} stays occupied",
                                1e3 * kAtWait_m, wait_.key, describe(wait_.point), zone_));
  }
  call([&] { store_.leave(token_, zone_); });
  zone_.clear();
  status_.set_zone("");
}

/// Reads the position several times, since the arm comes to rest a little after its set-points.
bool Worker::is_at_wait() {
  for (int i = 0; i < kSettleReads; ++i) {
    if (motions_.is_at(wait_, kAtWait_m)) return true;
    pause(0.1, stop_);
  }
  return false;
}

void Worker::finish() {
  try {
    if (token_ != 0) {
      const Corbot::RobotWork last = status_.get();
      if (last.piece != 0 && last.step == Corbot::StepReserved)
        store_.advance(token_, last.piece, Corbot::StepWithdrawn, "the work was stopped");
      if (!zone_.empty() && is_at_wait()) {
        store_.leave(token_, zone_);
        status_.set_zone("");
      }
      // A released claim would let a stand-by move a stopped robot.
      if (!is_marked_ || !arm_.is_halted()) store_.release(std::exchange(token_, 0));
    }
  } catch (const std::exception& e) {
    status_.report("the claim was not given back: " + plain_text(e));
  } catch (const CORBA::Exception& e) {
    status_.report(std::string("the claim was not given back: ") + e._name());
  }
  try {
    arm_.release();
  } catch (const std::exception& e) {
    status_.report("control was not given back: " + plain_text(e));
  }
}

// --- Calls and their exceptions ---

/// Calls `f` and translates its exceptions. Superseded, Empty, Full and Occupied pass unchanged.
template <class F>
auto Worker::call(F&& f) -> decltype(f()) {
  end_if_stopped();
  try {
    return f();
  } catch (const client::Failure& e) {
    throw Fault(plain_text(e));
  } catch (const Corbot::NotReady& e) {
    throw Fault(client::printable(e.reason.in()));
  } catch (const Corbot::BadParameter& e) {
    throw Attention(plain_text(client::explain(e)));
  } catch (const Corbot::WrongStep& e) {
    throw Fault(fmt::format("the ledger has the transfer at {}, from where {} is not allowed",
                            to_string(e.present), to_string(e.wanted)));
  }
}

void Worker::end_if_stopped() {
  if (stop_.stop_requested()) throw WorkEnded();
  if (arm_.is_halted()) throw RobotStopped("the cell was stopped");
}

void Worker::wait_for(Activity activity, const std::string& text, double pause_s) {
  status_.set_activity(activity);
  status_.set(Corbot::WorkWaiting, text);
  if (pause_s > 0) pause(pause_s, stop_);
  end_if_stopped();
  check_able();
}

/// Throws RobotUnable if the robot is in Error, as after a StopAndHold, or does not answer. No command finds
/// that while the robot waits.
void Worker::check_able() {
  bool is_able = false;
  try {
    is_able = arm_.is_able();
  } catch (const client::Failure&) {  // NOLINT(bugprone-empty-catch): connect() reports it
  }
  if (!is_able) throw RobotUnable();
}

std::string Worker::key_of(const Place& place) const { return cell_.key_of(place) + ".position_m"; }

}  // namespace corbot::cell
