// SPDX-License-Identifier: Apache-2.0
#include "panel/cell_port.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

#include "cell/orb_server.h"
#include "cell/store_refusal.h"
#include "cell/wall_clock.h"
#include "client/explain.h"
#include "panel/own_reference.h"

namespace corbot::panel {

namespace {

using client::ExitCode;
using client::Failure;
using client::printable;
using nlohmann::json;

constexpr std::chrono::seconds kLookInterval{1};
constexpr double kEventsFor_s = 90;
constexpr std::size_t kMostEvents = 200;
/// Whose word the ledger records.
constexpr const char* kWho = "panel";
constexpr double kDegrees = 180.0 / 3.14159265358979323846;

const char* word_of(Corbot::WorkState state) {
  constexpr std::array kWords{"idle", "waits", "moves", "stopped", "attention"};
  return kWords.at(std::min<std::size_t>(state, kWords.size() - 1));
}

const char* word_of(Corbot::TransferStep step) {
  constexpr std::array kWords{"reserved", "picking",   "held",    "placing",
                              "placed",   "withdrawn", "unclear", "gone"};
  return kWords.at(std::min<std::size_t>(step, kWords.size() - 1));
}

json list_of(const Eigen::Vector3d& point) { return {point.x(), point.y(), point.z()}; }
json list_of(const Corbot::Point& point) { return {point.x, point.y, point.z}; }

json data_of(const cell::Place& place) {
  json slots = json::array();
  for (int slot = 0; place.slots && slot < place.slots->count(); ++slot)
    slots.push_back(list_of(place.slot_position(slot)));
  const Eigen::Vector2d half_m = place.half_size_m();
  return {{"name", place.name},
          {"position_m", list_of(place.frame.position_m)},
          {"yaw_deg", place.frame.yaw_rad * kDegrees},
          {"size_m", {2 * half_m.x(), 2 * half_m.y()}},
          {"slots_m", std::move(slots)},
          {"shared", place.is_shared}};
}

json data_of(const cell::CellConfig& cell, const cell::CellRobot& robot) {
  return {{"name", robot.name},
          {"robot", cell.robot_name(robot)},
          {"position_m", list_of(robot.frame.position_m)},
          {"yaw_deg", robot.frame.yaw_rad * kDegrees},
          {"from", robot.from},
          {"to", robot.to}};
}

json data_of(const Corbot::RobotWork& work) {
  return {{"name", printable(work.robot.in())},
          {"state", word_of(work.state)},
          {"piece", work.piece},
          {"step", work.piece == 0 ? "" : word_of(work.step)},
          {"since_s", work.since},
          {"text", printable(work.text.in())}};
}

json data_of(const Corbot::PlaceInfo& place) {
  return {{"name", printable(place.name.in())},
          {"pieces", place.pieces},
          {"capacity", place.capacity},
          {"reserved", place.reserved},
          {"holder", printable(place.robot.in())},
          {"since_s", place.since}};
}

json data_of(const Corbot::PieceEvent& event) {
  return {{"number", event.number},
          {"time_s", event.time},
          {"piece", event.piece},
          {"kind", printable(event.kind.in())},
          {"robot", printable(event.robot.in())},
          {"step", word_of(event.step)},
          {"place", printable(event.where.place.in())},
          {"slot", event.where.slot},
          {"position_m", list_of(event.where.position)},
          {"note", printable(event.note.in())}};
}

template <class List>
json list_of(const List& list) {
  json data = json::array();
  for (CORBA::ULong i = 0; i < list.length(); ++i) data.push_back(data_of(list[i]));
  return data;
}

/// Calls `f`, and turns each exception into a Failure that names the program.
template <class F>
auto ask(const char* program, const std::string& uri, F&& f) -> decltype(f()) {
  try {
    return cell::or_refusal(program, f);
  } catch (const CORBA::Exception& error) {
    throw Failure(ExitCode::kUnreachable,
                  fmt::format("{} at {} does not reply (CORBA {})", program, printable(uri), error._name()));
  }
}

/// Returns a reference whose calls share no connection with those of other groups.
template <class Interface>
typename Interface::_var_type way_to(CORBA::ORB_ptr orb, const char* program, const std::string& uri,
                                     CORBA::ULong group) {
  return ask(program, uri, [&] {
    const CORBA::Object_var shared = orb->string_to_object(uri.c_str());
    typename Interface::_var_type own = own_reference<Interface>(shared.in(), group);
    omniORB::setClientCallTimeout(own.in(), kRestTimeout_ms);
    return own;
  });
}

/// Throws if the program does not answer, so that no order reaches it late. Opens its connection again if the
/// program has closed it.
template <class Read>
void check_connection(const char* program, const std::string& uri, Read&& read) {
  ask(program, uri, [&] {
    try {
      read();
    } catch (const CORBA::COMM_FAILURE&) {
      read();  // of a program that has started again
    }
  });
}

}  // namespace

CellPort::CellPort(CORBA::ORB_ptr orb, cell::CellConfig cell)
    : orb_(CORBA::ORB::_duplicate(orb)), cell_(std::move(cell)) {}

CellPort::~CellPort() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    wake_.notify_all();
  }
  if (looks_.joinable()) looks_.join();
}

json CellPort::connect() {
  const std::string uri = cell_.coordinator_uri();
  ask("the coordinator", uri, [&] {
    coordinator_ = cell::reference_to<Corbot::Coordinator>(orb_.in(), uri);
    store_ = cell::reference_to<Corbot::Store>(orb_.in(), cell_.store_uri());
    const CORBA::String_var name = coordinator_->Name();
    if (cell_.name != name.in())
      throw Failure(ExitCode::kUnreachable,
                    fmt::format("the coordinator at {} is of cell '{}': name the cell by its directory", uri,
                                printable(name.in())));
  });
  is_ledger_checked_ = false;
  if (!looks_.joinable()) looks_ = std::thread([this] { run_looks(); });
  json places = json::array();
  for (const cell::Place& place : cell_.places) {
    places.push_back(data_of(place));
    places.back()["last"] = cell_.is_last(place);
  }
  json robots = json::array();
  for (const cell::CellRobot& robot : cell_.robots) robots.push_back(data_of(cell_, robot));
  json kinds = json::array();
  for (const cell::Kind& kind : cell_.kinds)
    kinds.push_back({{"name", kind.name}, {"hue_deg", kind.hue_deg}});
  return {{"places", std::move(places)}, {"robots", std::move(robots)}, {"kinds", std::move(kinds)}};
}

json CellPort::state() {
  json state = ask("the coordinator", cell_.coordinator_uri(), [&] {
    const bool is_paused = coordinator_->Paused();
    const Corbot::CoordinatorState_var now = coordinator_->State();
    return json{{"state", now->mode == Corbot::CellStopped ? "stopped"
                          : is_paused                      ? "paused"
                                                           : "works"},
                {"placed", now->placed},
                {"robots", list_of(now->robots)}};
  });
  state["time_s"] = cell::now_s();
  try {
    ask("the store", cell_.store_uri(), [&] { read_store(state); });
    state["store"] = "";
  } catch (const Failure& failure) {
    state["store"] = failure.what();
    is_ledger_checked_ = false;
  }
  state["pieces"] = pieces();
  state["events"] = events_;
  const std::lock_guard lock(mutex_);
  state["camera"] = seen_;
  return state;
}

void CellPort::read_store(json& state) {
  const Corbot::PlaceInfos_var places = store_->Places();
  state["places"] = list_of(places.in());
  const Corbot::PieceEvents_var unclear = store_->Unclear();
  state["unclear"] = list_of(unclear.in());
  if (!std::exchange(is_ledger_checked_, true)) forget_other_ledger();
  for (;;) {
    const Corbot::PieceEvents_var events = store_->History(0, last_event_);
    if (events->length() == 0) break;
    for (CORBA::ULong i = 0; i < events->length(); ++i) take(events.in()[i]);
    drop_old_events();
  }
  drop_old_events();
}

void CellPort::forget_other_ledger() {
  if (last_event_ == 0) return;
  const Corbot::PieceEvents_var events = store_->History(0, last_event_ - 1);
  if (events->length() > 0 && events.in()[0].time == last_time_s_) return;
  last_event_ = 0;
  events_.clear();
  pieces_.clear();
}

void CellPort::drop_old_events() {
  while (events_.size() > kMostEvents ||
         (!events_.empty() && events_.front()["time_s"] < cell::now_s() - kEventsFor_s))
    events_.pop_front();
}

void CellPort::take(const Corbot::PieceEvent& event) {
  last_event_ = event.number;
  last_time_s_ = event.time;
  json data = data_of(event);
  events_.push_back(data);
  const bool is_in_area = event.step == Corbot::StepWithdrawn && event.where.slot < 0;
  if (event.step == Corbot::StepGone || is_in_area) {  // in an area, a robot that takes it gives a new number
    pieces_.erase(event.piece);
    return;
  }
  data["number"] = event.piece;
  for (const char* key : {"piece", "time_s", "note"}) data.erase(key);
  pieces_[event.piece] = std::move(data);
}

json CellPort::pieces() const {
  json list = json::array();
  for (const auto& [number, piece] : pieces_) list.push_back(piece);
  return list;
}

void CellPort::stop() {
  const std::string uri = cell_.coordinator_uri();
  const auto way = way_to<Corbot::Coordinator>(orb_.in(), "the coordinator", uri, kStopConnections);
  ask("the coordinator", uri, [&] { way->Stop(); });
}

json CellPort::call(const Order& order) {
  const auto& request = std::get<CellRequest>(order);
  if (request.action == CellAction::kResolve || request.action == CellAction::kExchange)
    tell_store(request);
  else
    tell_coordinator(request.action);
  return {{"done", true}};
}

void CellPort::tell_coordinator(CellAction action) {
  const std::string uri = cell_.coordinator_uri();
  const auto way = way_to<Corbot::Coordinator>(orb_.in(), "the coordinator", uri, kCallConnections);
  check_connection("the coordinator", uri, [&] { (void)way->Paused(); });
  ask("the coordinator", uri, [&] {
    if (action == CellAction::kPause) return way->Pause();
    way->Resume();
    way->Start();
  });
}

void CellPort::tell_store(const CellRequest& request) {
  const std::string uri = cell_.store_uri();
  const auto way = way_to<Corbot::Store>(orb_.in(), "the store", uri, kCallConnections);
  check_connection("the store", uri, [&] { const Corbot::PlaceInfos_var places = way->Places(); });
  ask("the store", uri, [&] {
    if (request.action == CellAction::kExchange) return way->Exchange(request.place.c_str(), kWho);
    way->Resolve(request.piece, request.place.c_str(), request.slot, kWho);
  });
}

std::unique_ptr<Performer> CellPort::performer() {
  throw Failure(ExitCode::kUsage, "a cell runs no program: its coordinator moves its robots");
}

std::shared_ptr<const std::string> CellPort::picture() const {
  const std::lock_guard lock(mutex_);
  return picture_;
}

void CellPort::run_looks() {
  std::unique_lock lock(mutex_);
  while (!ending_) {
    lock.unlock();
    look();
    lock.lock();
    wake_.wait_for(lock, kLookInterval, [&] { return ending_; });
  }
}

void CellPort::look() {
  json seen;
  std::shared_ptr<const std::string> picture;
  try {
    ask("the camera", cell_.camera_uri(), [&] {
      const CORBA::Object_var shared = orb_->string_to_object(cell_.camera_uri().c_str());
      const Corbot::Camera_var camera = own_reference<Corbot::Camera>(shared.in(), kCameraConnections);
      omniORB::setClientCallTimeout(camera.in(), kRestTimeout_ms);
      const Corbot::Frame_var frame = camera->Look(cell_.timing.look_s);
      seen = {{"number", frame->number}, {"time_s", frame->time}, {"pieces", json::array()}, {"text", ""}};
      for (CORBA::ULong i = 0; i < frame->pieces.length(); ++i)
        seen["pieces"].push_back({{"kind", printable(frame->pieces[i].kind.in())},
                                  {"position_m", list_of(frame->pieces[i].position)}});
      const Corbot::Jpeg_var jpeg = camera->Picture(true);
      picture = std::make_shared<const std::string>(reinterpret_cast<const char*>(jpeg->get_buffer()),
                                                    jpeg->length());
    });
  } catch (const Failure& failure) {
    seen = {{"number", 0}, {"pieces", json::array()}, {"text", failure.what()}};
  }
  const std::lock_guard lock(mutex_);
  seen_ = std::move(seen);
  picture_ = std::move(picture);
}

}  // namespace corbot::panel
