// SPDX-License-Identifier: Apache-2.0
#include "cell/coordinator/work_status.h"
#include "cell/wall_clock.h"

#include <chrono>
#include <iterator>
#include <utility>

namespace corbot::cell {

namespace {

const char* prefix_of(Corbot::WorkState state) {
  if (state == Corbot::WorkWaiting) return "waits: ";
  return state == Corbot::WorkAttention ? "attention: " : "";
}

}  // namespace

const char* to_string(Corbot::TransferStep step) {
  constexpr const char* kNames[] = {"reserved", "picking",   "held",    "placing",
                                    "placed",   "withdrawn", "unclear", "gone"};
  const auto index = static_cast<std::size_t>(step);
  return index < std::size(kNames) ? kNames[index] : "unknown";
}

WorkStatus::WorkStatus(const std::string& robot, Report report, OnActivity on_activity)
    : report_(std::move(report)), on_activity_(std::move(on_activity)) {
  now_.robot = robot;
  work_.robot = robot.c_str();
  work_.state = Corbot::WorkIdle;
  work_.piece = 0;
  work_.step = Corbot::StepPlaced;
  work_.since = now_s();
  work_.text = "";
}

/// Applies `f`, which changes the work and, by its argument, the activity. get() does not wait for the
/// record.
template <class F>
void WorkStatus::update(F&& f) {
  const std::lock_guard order(order_mutex_);
  {
    const std::lock_guard lock(mutex_);
    ActivityChange to = now_;
    f(to);
    if (to == now_) return;
    now_ = std::move(to);
    now_.time_s = now_s();
  }
  if (on_activity_) on_activity_(now_);
}

void WorkStatus::set(Corbot::WorkState state, const std::string& text) {
  bool is_new = false;
  update([&](ActivityChange& to) {
    if (state != Corbot::WorkWaiting)
      to.activity = state == Corbot::WorkMoving ? Activity::kMoving : Activity::kIdle;
    is_new = work_.state != state || text != work_.text.in();
    if (work_.state != state) work_.since = now_s();
    work_.state = state;
    work_.text = text.c_str();
  });
  if (is_new && !text.empty()) report_(prefix_of(state) + text);
}

void WorkStatus::set_piece(Corbot::PieceNumber piece, Corbot::TransferStep step) {
  update([&](ActivityChange& to) {
    work_.piece = piece;
    work_.step = step;
    work_.since = now_s();
    to.piece = piece;
  });
}

void WorkStatus::set_activity(Activity activity) {
  update([&](ActivityChange& to) { to.activity = activity; });
}

Activity WorkStatus::activity() const {
  const std::lock_guard lock(mutex_);
  return now_.activity;
}

void WorkStatus::set_zone(const std::string& place) {
  update([&](ActivityChange& to) { to.zone = place; });
}

Corbot::RobotWork WorkStatus::get() const {
  const std::lock_guard lock(mutex_);
  return work_;
}

}  // namespace corbot::cell
