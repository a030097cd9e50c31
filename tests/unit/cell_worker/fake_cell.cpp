// SPDX-License-Identifier: Apache-2.0
#include "unit/cell_worker/fake_cell.h"
#include "cell/coordinator/process_name.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

namespace corbot::test {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double kGrasp_m = 0.030;
constexpr double kNear_m = 0.003;
constexpr double kFreeHeight_m = 0.085;  // height at which a held piece clears standing pieces
constexpr Corbot::ClaimToken kToken = 7;

Corbot::Point to_point(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }

bool is_end(Corbot::TransferStep step) { return step >= Corbot::StepPlaced; }

/// Returns this process's directory for a coordinator's files.
struct TemporaryDirectory {
  TemporaryDirectory() {
    std::string made = testing::TempDir() + "corbot-cell-XXXXXX";
    if (::mkdtemp(made.data()) == nullptr) throw std::runtime_error(made + " cannot be made");
    path = made;
  }
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;
  ~TemporaryDirectory() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
  std::filesystem::path path;
};

}  // namespace

cell::CellConfig demo_cell() {
  static const TemporaryDirectory directory;
  cell::CellConfig config;
  config.name = "demo";
  config.state_directory = directory.path;
  const double quarter = std::numbers::pi / 4;
  cell::Place pallet1{"pallet1", {{0.085, 0.239, 0}, 0}, Vector2d(0.165, 0.110), {}, false};
  cell::Place store1{"store1", {{0.24, 0, 0}, 0}, {}, cell::SlotGrid{1, 4, {0.05, 0.05}}, true};
  cell::Place pallet2{"pallet2", {{0.395, -0.239, 0}, 0}, {}, cell::SlotGrid{4, 3, {0.045, 0.042}}, false};
  config.places = {pallet1, store1, pallet2};
  cell::CellRobot robot1;
  robot1.name = "robot1";
  robot1.frame = {{0, 0, 0}, quarter};
  robot1.from = "pallet1";
  robot1.to = "store1";
  robot1.wait_m = {0.153, 0.129, 0.09};
  cell::CellRobot robot2 = robot1;
  robot2.name = "robot2";
  robot2.frame = {{0.48, 0, 0}, 5 * quarter};
  robot2.from = "store1";
  robot2.to = "pallet2";
  robot2.wait_m = {0.327, -0.129, 0.09};
  config.robots = {robot1, robot2};
  cell::Kind red;
  red.name = "red";
  red.grasp_m = kGrasp_m;
  config.kinds = {red};
  return config;
}

FakeCell::FakeCell(const cell::CellConfig& config, const std::string& robot)
    : config_(config), robot_(*config.robot(robot)) {
  pieces.reserve(100);  // the ledger points to one
}

void FakeCell::add_to_area(double x, double y) { pieces.push_back({{x, y, 0}}); }

void FakeCell::add_to_slot(const std::string& place, int slot) {
  pieces.push_back({config_.place(place)->slot_position(slot), false, ++last_number_});
}

void FakeCell::add_to_gripper() {
  measures_grip = true;
  is_told_open_ = false;
  pieces.push_back({tool_ - Vector3d(0, 0, kGrasp_m), true});
}

std::size_t FakeCell::count(const std::string& place) const {
  return std::count_if(pieces.begin(), pieces.end(), [&](const Piece& piece) {
    return !piece.is_held && config_.place(place)->covers(piece.foot);
  });
}

int FakeCell::count_reports(const std::string& part) const {
  return static_cast<int>(std::count_if(reports.begin(), reports.end(), [&](const std::string& text) {
    return text.find(part) != std::string::npos;
  }));
}

void FakeCell::report(const std::string& text) {
  const std::lock_guard lock(mutex_);
  reports.push_back(text);
}

void FakeCell::require(bool rule, const std::string& text) {
  if (!rule) violations.push_back(text);
}

/// Transforms by the definition of the angle, not by the code under test.
Vector3d FakeCell::to_world(const Vector3d& local) const {
  const double c = std::cos(robot_.frame.yaw_rad);
  const double s = std::sin(robot_.frame.yaw_rad);
  return robot_.frame.position_m +
         Vector3d(c * local.x() - s * local.y(), s * local.x() + c * local.y(), local.z());
}

void FakeCell::interrupt() {
  was_interrupted = true;
  if (interruption == Interruption::kFault) throw Corbot::NotReady("in the test");
  is_dead_ = true;
  throw Killed();
}

void FakeCell::interruptible(const std::function<void()>& effect, const std::function<void()>& half) {
  if (is_dead_) throw Killed();
  const bool is_it = calls_++ == interrupted_call;
  if (is_it && moment == Moment::kBefore) interrupt();
  if (is_it && moment == Moment::kMiddle) {
    half();
    interrupt();
  }
  effect();
  if (is_it) interrupt();
}

void FakeCell::resolve() {
  const std::lock_guard lock(mutex_);
  is_unclear_ = false;
}

// --- Robot ---

bool FakeCell::acquire() {
  if (on_acquire) on_acquire();
  const std::lock_guard lock(mutex_);
  interruptible([&] { record.emplace_back("acquire"); });
  return is_exclusive;
}

void FakeCell::begin_command(const std::string& name) {
  require(!stop_source.stop_requested(), name + " begins after a stop was requested");
  require(!is_superseded_ || name == "move", name + " begins after Superseded");
  const int number = commands_++;
  require(goes_on || command_stopped_by_other < 0 || number <= command_stopped_by_other,
          name + " begins after a Stop");
  record.push_back(name);
  if (number == command_stopped_by_other) {
    is_in_error = is_held_by_other;
    throw Corbot::Stopped("by another client");
  }
  if (number != stopped_command) return;
  stop_source.request_stop();
  if (is_exclusive) throw Corbot::Stopped("in the test");
}

void FakeCell::check_way(const Vector3d& to, bool is_line) {
  require(is_line || (tool_.z() > kFreeHeight_m && to.z() > kFreeHeight_m),
          "a free motion is as low as pieces");
  require(!is_line || (tool_ - to).head<2>().norm() < kNear_m, "a line is not vertical");
  for (const cell::Place& place : config_.places) {
    if (!place.is_shared) continue;
    const bool is_over = place.covers(to, 0.02) || place.covers(tool_, 0.02);
    require(!is_over || zone_ == place.name, "the tool is over a shared place, and not in its zone");
  }
  if (to.z() > kFreeHeight_m) return;
  const Vector3d foot = to - Vector3d(0, 0, kGrasp_m);
  const bool is_pick = ledger_.step == Corbot::StepPicking && (foot - ledger_.source).norm() < kNear_m;
  const bool is_place = ledger_.step == Corbot::StepPlacing && (foot - ledger_.target).norm() < kNear_m;
  require(is_pick || is_place, "the way down begins before its intent is in the ledger");
}

void FakeCell::go_to(const Vector3d& tool) {
  if (is_unreachable && is_unreachable(tool)) throw Corbot::Unreachable({}, "too far");
  if (!fails_over.empty() && config_.place(fails_over)->covers(tool)) {
    ++failures;
    throw Corbot::NotReady("in the test");
  }
  tool_ = tool;
  has_looked_ = false;
  changed_.notify_all();
  for (Piece& piece : pieces) {
    if (piece.is_held) piece.foot = tool - Vector3d(0, 0, kGrasp_m);
  }
}

void FakeCell::speed(double /*percent*/) {
  const std::lock_guard lock(mutex_);
  interruptible([&] { begin_command("speed"); });
}

void FakeCell::move(const Vector3d& point, double above_m) {
  const std::lock_guard lock(mutex_);
  const Vector3d to = to_world(point) + Vector3d(0, 0, above_m);
  interruptible(
      [&] {
        begin_command("move");
        check_way(to, false);
        go_to(to);
      },
      [&] { go_to((tool_ + to) / 2); });
}

void FakeCell::move_s(const Vector3d& point, double above_m, double duration_s) {
  const std::lock_guard lock(mutex_);
  const Vector3d to = to_world(point) + Vector3d(0, 0, above_m);
  interruptible(
      [&] {
        begin_command(to.z() > tool_.z() ? "up" : "down");
        check_way(to, true);
        require(std::abs(duration_s - (to - tool_).norm() / 0.25) < 1e-9, "60 mm at 0.25 m/s last 0.24 s");
        go_to(to);
      },
      [&] { go_to((tool_ + to) / 2); });
}

void FakeCell::move_c(const Vector3d& begin, const Vector3d& middle, const Vector3d& end) {
  const std::lock_guard lock(mutex_);
  const Vector3d to = to_world(end);
  interruptible(
      [&] {
        begin_command("arc");
        if (on_arc) on_arc();
        require((to_world(begin) - tool_).norm() < kNear_m, "an arc begins away from the tool");
        require(zone_.empty(), "an arc is in a zone");
        for (const Vector3d& point : {to_world(middle), to}) {
          check_way(point, false);
          go_to(point);
        }
      },
      [&] { go_to(to_world(middle)); });
}

void FakeCell::delay(double /*duration_s*/) {
  const std::lock_guard lock(mutex_);
  interruptible([&] { begin_command("delay"); });
}

void FakeCell::open() {
  const std::lock_guard lock(mutex_);
  const auto effect = [&] {
    begin_command("open");
    is_told_open_ = true;
    for (Piece& piece : pieces) {
      if (!std::exchange(piece.is_held, false)) continue;
      require(std::abs(piece.foot.z()) < kNear_m, "a piece falls");
      if (loses_pieces) piece.foot = {9, 9, 9};
    }
  };
  interruptible(effect, [&] { is_told_open_ = true; });  // the fingers have hardly moved
}

void FakeCell::close() {
  const std::lock_guard lock(mutex_);
  const auto effect = [&] {
    begin_command("close");
    is_told_open_ = false;
    for (Piece& piece : pieces) {
      const Vector3d grasp = piece.foot + Vector3d(0, 0, kGrasp_m);
      if (piece.is_held || (grasp - tool_).norm() > kNear_m) continue;
      if (failing_grasps-- <= 0) piece.is_held = true;
    }
    if (on_close) on_close();
  };
  interruptible(effect, [&] { is_told_open_ = false; });
}

Vector3d FakeCell::rest_position() {
  const std::lock_guard lock(mutex_);
  if (is_dead_) throw Killed();
  return robot_.frame.to_local(tool_);
}

cell::Grip FakeCell::grip() {
  const std::lock_guard lock(mutex_);
  if (is_dead_) throw Killed();
  if (is_told_open_) return cell::Grip::kOpen;
  if (!measures_grip) return cell::Grip::kClosed;
  const bool is_held = std::any_of(pieces.begin(), pieces.end(), [](const Piece& p) { return p.is_held; });
  return is_held ? cell::Grip::kClosedOnPiece : cell::Grip::kClosedOnNothing;
}

// --- Camera ---

Corbot::Frame FakeCell::look(double /*timeout_s*/) {
  const std::lock_guard lock(mutex_);
  interruptible([&] {
    record.emplace_back("look");
    has_looked_ = true;
  });
  require(!stop_source.stop_requested(), "a look after a stop was requested");
  require((tool_ - robot_.wait_m).norm() < kNear_m, "a look while the arm may hide pieces");
  Corbot::Frame frame;
  for (const Piece& piece : pieces) {
    if (piece.is_held) continue;
    const CORBA::ULong at = frame.pieces.length();
    frame.pieces.length(at + 1);
    frame.pieces[at].kind = "red";
    frame.pieces[at].position =
        to_point(piece.foot + Vector3d(0.001, -0.001, 0));  // a camera's error of measurement
  }
  return frame;
}

// --- Store ---

void FakeCell::store_call() {
  require(!is_superseded_, "a call of the store after Superseded");
  if (store_calls_++ != superseded_call) return;
  is_superseded_ = true;
  throw Corbot::Superseded(kToken, superseded_by);
}

Corbot::ClaimToken FakeCell::claim(const std::string&, const std::string& who, Corbot::ClaimToken replaces) {
  const std::lock_guard lock(mutex_);
  interruptible([&] { record.emplace_back("claim"); });
  const bool is_another = (is_claimed && replaces != 5) || is_superseded_;
  const bool is_to_wait = !is_exclusive || cell::is_waiting_name(holder);
  if (is_superseded_ || (is_another && is_to_wait && !on_claimed))
    stop_source.request_stop();  // the real store would wait for long
  if (is_another && on_claimed) on_claimed();
  if (is_another) throw Corbot::Claimed("robot1", holder.c_str(), 5, 0);
  holder = who;
  return kToken;
}

void FakeCell::release(Corbot::ClaimToken /*token*/) {
  const std::lock_guard lock(mutex_);
  interruptible([&] {
    record.emplace_back("release");
    store_call();
  });
}

std::optional<Vector3d> FakeCell::free_slot(const cell::Place& place) const {
  for (int slot = 0; slot < place.slots->count(); ++slot) {
    const Vector3d foot = place.slot_position(slot);
    const auto is_there = [&](const Piece& piece) { return (piece.foot - foot).norm() < 0.01; };
    if (std::none_of(pieces.begin(), pieces.end(), is_there)) return foot;
  }
  return std::nullopt;
}

FakeCell::Piece* FakeCell::source_piece(const cell::Place& place, const Corbot::Sightings& seen) {
  for (Piece& piece : pieces) {
    const Vector3d seen_m =
        seen.length() == 0 ? Vector3d(9, 9, 9) : Vector3d(seen[0].position.x, seen[0].position.y, 0);
    const bool is_first = place.slots ? piece.number != 0 : (seen_m - piece.foot).norm() < kNear_m;
    if (is_first && place.covers(piece.foot)) return &piece;
  }
  return nullptr;
}

Corbot::TransferInfo FakeCell::reserve(Corbot::ClaimToken token, const std::string& from,
                                       const std::string& to, const Corbot::Sightings& seen,
                                       double /*timeout_s*/) {
  const std::lock_guard lock(mutex_);
  Corbot::TransferInfo reserved;
  interruptible([&] {
    record.emplace_back("reserve");
    store_call();
    require(token == kToken && is_end(ledger_.step), "Reserve while a transfer is under way");
    require(zone_.empty(), "Reserve waits inside of a zone");
    begin_transfer(from, to, seen);
    reserved = info();
  });
  return reserved;
}

void FakeCell::begin_transfer(const std::string& from, const std::string& to, const Corbot::Sightings& seen) {
  const auto distance_m = [&](CORBA::ULong i) {
    return (Vector2d(seen[i].position.x, seen[i].position.y) - robot_.frame.position_m.head<2>()).norm();
  };
  for (CORBA::ULong i = 1; i < seen.length(); ++i)
    require(distance_m(i - 1) <= distance_m(i), "a farther piece comes first");
  ++reserves_;
  if (on_reserve) on_reserve(reserves_);
  if (written[Corbot::StepPlaced] >= last_placed || reserves_ > 200) {
    stop_source.request_stop();
    throw Corbot::Empty(from.c_str());
  }
  Piece* piece = source_piece(*config_.place(from), seen);
  if (piece == nullptr) throw Corbot::Empty(from.c_str());
  const std::optional<Vector3d> target = free_slot(*config_.place(to));
  if (!target) throw Corbot::Full(to.c_str(), 4);
  if (piece->number == 0) piece->number = ++last_number_;
  ledger_ = {piece, Corbot::StepReserved, piece->foot, *target};
}

Corbot::TransferInfo FakeCell::info() const {
  Corbot::TransferInfo info;
  info.piece = ledger_.piece->number;
  info.kind = "red";
  info.robot = robot_.name.c_str();
  info.step = ledger_.step;
  info.source.position = to_point(ledger_.source);
  info.target.position = to_point(ledger_.target);
  return info;
}

/// Checks that an outcome is true in the world, and that a look has shown it.
void FakeCell::check_outcome(Corbot::TransferStep step) {
  const Piece& piece = *ledger_.piece;
  const auto stands = [&](const Vector3d& foot) {
    return !piece.is_held && (piece.foot - foot).norm() < kNear_m;
  };
  if (step == Corbot::StepHeld) require(piece.is_held, "held in the ledger alone");
  if (step == Corbot::StepPlaced) require(stands(ledger_.target), "placed in the ledger alone");
  if (step == Corbot::StepWithdrawn) require(stands(ledger_.source), "withdrawn in the ledger alone");
  if (step == Corbot::StepHeld || step == Corbot::StepPlaced)
    require(has_looked_, "an outcome that no look has shown");
}

void FakeCell::advance(Corbot::ClaimToken /*token*/, Corbot::PieceNumber piece, Corbot::TransferStep step,
                       const std::string& note) {
  std::unique_lock lock(mutex_);
  if (is_dead_) throw Killed();
  require(ledger_.piece != nullptr && ledger_.piece->number == piece, "Advance of another piece");
  const bool is_intent = step == Corbot::StepPicking || step == Corbot::StepPlacing;
  if (is_intent && late_s > 0) {
    const Vector3d& spot = step == Corbot::StepPicking ? ledger_.source : ledger_.target;
    const auto is_over = [&] { return (tool_ - spot).head<2>().norm() < kNear_m; };
    const auto is_low = [&] { return tool_.z() < kFreeHeight_m; };
    require(changed_.wait_for(lock, std::chrono::seconds(30), is_over), "no Move beside the intent");
    (void)changed_.wait_for(lock, std::chrono::duration<double>(late_s), is_low);
  }
  interruptible([&] {
    store_call();
    if (!is_intent) {
      check_outcome(step);
      record.push_back(cell::to_string(step));
    }
    ledger_.step = step;
    last_note = note;
    ++written[step];
    if (step == Corbot::StepUnclear) is_unclear_ = true;
    if (step == Corbot::StepWithdrawn && config_.place(robot_.from)->size_m) ledger_.piece->number = 0;
  });
}

void FakeCell::enter(Corbot::ClaimToken /*token*/, const std::string& place, double /*timeout_s*/) {
  const std::lock_guard lock(mutex_);
  interruptible([&] {
    record.push_back("enter " + place);
    store_call();
    require(zone_.empty() || zone_ == place, "a second zone is entered");
    if (occupied-- > 0) throw Corbot::Occupied(place.c_str(), "another", 0);
    zone_ = place;
  });
}

void FakeCell::leave(Corbot::ClaimToken /*token*/, const std::string& place) {
  const std::lock_guard lock(mutex_);
  interruptible([&] {
    record.push_back("leave " + place);
    store_call();
    require((tool_ - robot_.wait_m).norm() < kNear_m, "a zone is left while the tool is in it");
    zone_.clear();
  });
}

Corbot::PlaceInfos FakeCell::places() {
  const std::lock_guard lock(mutex_);
  Corbot::PlaceInfos all;
  interruptible([&] { store_call(); });
  all.length(zone_.empty() ? 0 : 1);
  if (zone_.empty()) return all;
  all[0].name = zone_.c_str();
  all[0].robot = robot_.name.c_str();
  return all;
}

Corbot::TransferInfos FakeCell::transfers() {
  const std::lock_guard lock(mutex_);
  interruptible([&] { store_call(); });
  Corbot::TransferInfos all;
  if (is_end(ledger_.step)) return all;
  all.length(1);
  all[0] = info();
  return all;
}

Corbot::PieceEvents FakeCell::unclear() {
  const std::lock_guard lock(mutex_);
  interruptible([&] { store_call(); });
  Corbot::PieceEvents all;
  if (!is_unclear_) return all;
  all.length(1);
  all[0].piece = ledger_.piece->number;
  all[0].robot = robot_.name.c_str();
  return all;
}

}  // namespace corbot::test
