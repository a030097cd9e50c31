// SPDX-License-Identifier: Apache-2.0
#include "cell/coordinator/worker.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "cell/coordinator/attention.h"
#include "cell/coordinator/pause.h"
#include "client/explain.h"

namespace corbot::cell {

using Eigen::Vector3d;

namespace {

constexpr double kStoreWait_s = 2;     // a stop waits for it, and the supervisor kills after 5 s
constexpr double kLookAgain_s = 0.5;   // between two looks at an area from which nothing can be taken
constexpr double kConnectAgain_s = 1;  // between two attempts to reach robot and store
constexpr std::chrono::seconds kConnectFor{10};
constexpr double kAtWait_m = 0.005;
constexpr int kSettleReads = 10;  // of the position, 0.1 s apart

Vector3d to_vector(const Corbot::Point& point) { return {point.x, point.y, point.z}; }

/// A message as part of a sentence.
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
  const auto end = [&](const std::string& why, Corbot::WorkState state = Corbot::WorkAttention) {
    if (stop_.stop_requested()) return status_.set(Corbot::WorkIdle, "stopped");
    status_.set(state, fmt::format("{}: {}", step_, why));
    try {
      arm_.release();  // the person may need it
    } catch (const std::exception& error) {
      status_.report("control was not given back: " + plain_text(error));
    }
  };
  try {
    begin();
    while (true) {
      const Transfer transfer = find();
      if (pick(transfer)) place(transfer);
    }
  } catch (const WorkEnded&) {
    status_.set(Corbot::WorkIdle, "stopped");
  } catch (const Corbot::Superseded& e) {
    token_ = 0;
    status_.set(Corbot::WorkAttention, fmt::format("superseded: claim {} is the robot's now", e.present));
  } catch (const RobotStopped& e) {
    end(e.what(), Corbot::WorkStopped);
  } catch (const CORBA::Exception& e) {
    end(fmt::format("unexpected exception {}", e._name()));
  } catch (const std::exception& e) {
    end(e.what());
  }
}

// --- The recipe ---

void Worker::begin() {
  step_ = "begin";
  connect();
  refuse_leftovers();
  status_.set(Corbot::WorkMoving, "");
  motions_.speed(wait_);
  motions_.open(wait_);
  motions_.move(wait_);
}

Transfer Worker::find() {
  step_ = "find";
  while (true) {
    std::string cause;
    try {
      if (from_.slots) {
        status_.set_activity(Activity::kWaitingForPiece);  // the store waits as well
        return checked(call([&] { return store_.reserve(token_, from_.name, to_.name, {}, kStoreWait_s); }));
      }
      enter(from_);
      const Corbot::Sightings seen = nearest_first(look(from_.name));
      return checked(call([&] { return store_.reserve(token_, from_.name, to_.name, seen, 0); }));
    } catch (const Corbot::Empty&) {
      cause = from_.name + " is empty";
    } catch (const Corbot::Full&) {
      cause = to_.name + " is full";
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
    approach(transfer, goal, Corbot::StepPicking);
  } catch (const PointRefused& refusal) {
    refuse_source(transfer, refusal.what());
    return false;
  }
  motions_.close(goal);
  retreat(goal);
  if (sees_piece_at(from_, transfer.source)) {
    motions_.open(wait_);
    withdraw(transfer, "the piece still stands there after the pick");
    return false;
  }
  failures_ = 0;
  advance(transfer, Corbot::StepHeld);
  leave();
  return true;
}

void Worker::place(const Transfer& transfer) {
  step_ = "place";
  enter(to_);
  status_.set(Corbot::WorkMoving, "");
  const ToolGoal goal = grasp_goal(transfer, to_, transfer.target);
  if (sees_piece_at(to_, transfer.target)) {
    leave();
    throw Attention(fmt::format(
        "a piece that is not in the ledger stands at {}, {}: take it away; the gripper holds piece {}",
        to_.name, describe(transfer.target), transfer.piece));
  }
  approach(transfer, goal, Corbot::StepPlacing);
  motions_.open(goal);
  retreat(goal);
  const bool is_there = sees_piece_at(to_, transfer.target);
  advance(transfer, is_there ? Corbot::StepPlaced : Corbot::StepUnclear,
          is_there ? "" : "not seen at the target");
  leave();
  if (!is_there) {
    throw Attention(fmt::format("piece {} is not seen at {}, {}: find the piece", transfer.piece, to_.name,
                                describe(transfer.target)));
  }
}

// --- Parts of the recipe ---

void Worker::connect() {
  const auto give_up = std::chrono::steady_clock::now() + kConnectFor;
  const auto again = [&](const client::Failure& why) {
    if (std::chrono::steady_clock::now() > give_up) throw Attention(plain_text(why));
    status_.set(Corbot::WorkIdle, plain_text(why));
    pause(kConnectAgain_s, stop_);
  };
  while (true) {
    try {
      end_if_stopped();
      const bool is_exclusive = arm_.acquire();
      try {
        token_ = store_.claim(robot_.name, who_, 0);
      } catch (const Corbot::Claimed& e) {
        // Control of the arm proves that the holder of the claim cannot move it. A holder of our own name is
        // this very process, and a call whose reply was lost.
        if (!is_exclusive && who_ != e.who.in()) {
          throw Attention(fmt::format("'{}' works with {} by claim {}: make sure that it has ended",
                                      client::printable(e.who.in()), robot_.name, e.token));
        }
        token_ = store_.claim(robot_.name, who_, e.token);
      }
      return;
    } catch (const client::Failure& e) {
      again(e);
    } catch (const Corbot::NotReady& e) {
      again(client::explain(e));
    }
  }
}

/// Leftovers of a run before show where pieces and arm may be, and not where they are.
void Worker::refuse_leftovers() {
  const Corbot::TransferInfos transfers = call([&] { return store_.transfers(); });
  for (CORBA::ULong i = 0; i < transfers.length(); ++i) {
    const Corbot::TransferInfo& left = transfers[i];
    if (left.robot.in() != robot_.name) continue;
    throw Attention(fmt::format(
        "the ledger has piece {} on its way from {} to {}, {}, from a run before: move the arm to {}, "
        "bring all pieces back to where the work begins, and begin a new ledger",
        left.piece, from_.name, to_.name, to_string(left.step), wait_.key));
  }
  const Corbot::PlaceInfos places = call([&] { return store_.places(); });
  for (CORBA::ULong i = 0; i < places.length(); ++i) {
    if (places[i].robot.in() != robot_.name) continue;
    throw Attention(fmt::format(
        "the ledger has {} in the zone of {} from a run before: move the arm to {}, and begin a new ledger",
        robot_.name, client::printable(places[i].name.in()), wait_.key));
  }
}

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
  throw Attention(
      fmt::format("{} failed picks in a row, the last at {}, {}: {}; check the gripper, the camera and {}",
                  failures_, from_.name, describe(transfer.source), why, key_of(from_)));
}

void Worker::refuse_source(const Transfer& transfer, const std::string& why) {
  motions_.move(wait_);
  advance(transfer, Corbot::StepWithdrawn, why);
  leave();
  if (from_.slots) throw Attention(why);  // the store would give the same piece again
  left_out_.push_back(transfer.source);
  status_.report(fmt::format("leaves out the piece at {}: {}", describe(transfer.source), why));
}

/// To the piece's grasp. The way down begins when the intent is in the ledger.
void Worker::approach(const Transfer& transfer, const ToolGoal& goal, Corbot::TransferStep intent) {
  std::future<void> written = std::async(std::launch::async, [&] { advance(transfer, intent); });
  motions_.move_above(goal);
  await_intent(written);
  motions_.descend(goal);
  motions_.settle(goal);
}

void Worker::retreat(const ToolGoal& goal) {
  motions_.ascend(goal);
  motions_.move(wait_);
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
  } catch (const Attention& why) {
    throw Attention(fmt::format("no picture of {}: {}; check camera in cell.toml", at, why.what()));
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
    status_.set_activity(Activity::kWaitingForZone);  // the store waits as well
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

/// The position is measured, and the arm comes to rest a little after its set-points.
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
      store_.release(std::exchange(token_, 0));
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

// --- Calls, and what they raise ---

/// Superseded, Empty, Full and Occupied pass on.
template <class F>
auto Worker::call(F&& f) -> decltype(f()) {
  end_if_stopped();
  try {
    return f();
  } catch (const client::Failure& e) {
    throw Attention(plain_text(e));
  } catch (const Corbot::NotReady& e) {
    throw Attention(client::printable(e.reason.in()));
  } catch (const Corbot::BadParameter& e) {
    throw Attention(plain_text(client::explain(e)));
  } catch (const Corbot::WrongStep& e) {
    throw Attention(fmt::format("the ledger has the transfer at {}, from where {} is not allowed",
                                to_string(e.present), to_string(e.wanted)));
  }
}

void Worker::end_if_stopped() const {
  if (stop_.stop_requested()) throw WorkEnded();
}

void Worker::wait_for(Activity activity, const std::string& text, double pause_s) {
  status_.set_activity(activity);
  status_.set(Corbot::WorkWaiting, text);
  if (pause_s > 0) pause(pause_s, stop_);
  end_if_stopped();
}

std::string Worker::key_of(const Place& place) const { return cell_.key_of(place) + ".position_m"; }

}  // namespace corbot::cell
