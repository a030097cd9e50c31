// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/cell_status.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "client/explain.h"

namespace corbot::cli {

using client::printable;

namespace {

const char* mode_of(const CellView& view) {
  if (view.state.mode == Corbot::CellStopped) return "stopped; 'corbot cell start' begins or goes on";
  return view.is_paused ? "paused; 'corbot cell start' goes on" : "works";
}

const char* name_of(Corbot::WorkState state) {
  switch (state) {
    case Corbot::WorkIdle:
      return "idle";
    case Corbot::WorkWaiting:
      return "waits";
    case Corbot::WorkMoving:
      return "moves";
    case Corbot::WorkStopped:
      return "stopped";
    default:
      return "attention";
  }
}

const char* name_of(Corbot::TransferStep step) {
  switch (step) {
    case Corbot::StepReserved:
      return "reserved";
    case Corbot::StepPicking:
      return "picking";
    case Corbot::StepHeld:
      return "held";
    case Corbot::StepPlacing:
      return "placing";
    default:
      return "done";
  }
}

bool needs_person(const Corbot::RobotWork& work) {
  return work.state == Corbot::WorkAttention || work.state == Corbot::WorkStopped;
}

std::string line_of(const Corbot::RobotWork& work, double now_s, bool is_paused) {
  const bool is_held = is_paused && work.state == Corbot::WorkMoving;  // after the motion in progress
  std::string line =
      fmt::format("{:<12} {:<9} ", printable(work.robot.in()), is_held ? "paused" : name_of(work.state));
  line += is_held ? fmt::format("{:7}", "") : fmt::format("{:>5.0f} s", std::max(0.0, now_s - work.since));
  if (work.piece != 0) line += fmt::format("  piece {} {}", work.piece, name_of(work.step));
  const std::string text = printable(work.text.in());
  if (!needs_person(work) && !text.empty()) line += "  " + text;
  return line + "\n";
}

std::string line_of(const Corbot::PlaceInfo& place, double now_s) {
  std::string line = fmt::format("{:<12} ", printable(place.name.in()));
  line += place.capacity == 0 ? std::string("area")
                              : fmt::format("{} of {} slots have a piece, {} reserved", place.pieces,
                                            place.capacity, place.reserved);
  const std::string robot = printable(place.robot.in());
  if (place.shared)
    line += robot.empty()
                ? std::string("; its zone is free")
                : fmt::format("; {} is in its zone, for {:.0f} s", robot, std::max(0.0, now_s - place.since));
  return line + "\n";
}

std::string line_of(const Corbot::PieceEvent& lost) {
  const std::string slot = lost.where.slot < 0 ? "" : fmt::format(" slot {}", lost.where.slot);
  return fmt::format(
      "  piece {} is unclear: {} left it at {}{}, ({:.3f}, {:.3f}) m ({}). Find it, then use 'corbot cell "
      "resolve "
      "CELL {} PLACE SLOT', or '--gone' instead of PLACE\n",
      lost.piece, printable(lost.robot.in()), printable(lost.where.place.in()), slot, lost.where.position.x,
      lost.where.position.y, printable(lost.note.in()), lost.piece);
}

/// Returns "" if the place has space or a robot empties it.
std::string needs_exchange(const CellView& view, const Corbot::PlaceInfo& place) {
  const std::string name = printable(place.name.in());
  const bool is_last = std::count(view.last_places.begin(), view.last_places.end(), name) > 0;
  if (!is_last || place.capacity == 0 || place.pieces < place.capacity) return "";
  return fmt::format("  {} is full: empty it, then use 'corbot cell exchange CELL {}'\n", name, name);
}

}  // namespace

std::string status_text(const CellView& view) {
  std::string text = fmt::format("{} {}; {} pieces on {}\n", view.name, mode_of(view), view.state.placed,
                                 fmt::join(view.last_places, ", "));
  std::string persons;
  for (CORBA::ULong i = 0; i < view.state.robots.length(); ++i) {
    const Corbot::RobotWork& work = view.state.robots[i];
    text += line_of(work, view.now_s, view.is_paused);
    if (needs_person(work))
      persons += fmt::format("  {}: {}\n", printable(work.robot.in()), printable(work.text.in()));
  }
  for (CORBA::ULong i = 0; i < view.places.length(); ++i) text += line_of(view.places[i], view.now_s);
  for (CORBA::ULong i = 0; i < view.places.length(); ++i) persons += needs_exchange(view, view.places[i]);
  if (!view.store_fault.empty()) persons += "  " + view.store_fault + "\n";
  for (CORBA::ULong i = 0; i < view.unclear.length(); ++i) persons += line_of(view.unclear[i]);
  return text + (persons.empty() ? "no person is needed\n" : "a person is needed:\n" + persons);
}

}  // namespace corbot::cli
