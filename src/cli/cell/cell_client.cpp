// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/cell_client.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>
#include <utility>

#include "cell/orb_server.h"
#include "cell/running_cells.h"
#include "cell/store_refusal.h"
#include "cli/cell/cell_directory.h"
#include "client/explain.h"
#include "client/notice.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;

namespace {

constexpr CORBA::ULong kCall_ms = 5000;
constexpr CORBA::ULong kName_ms = 1000;
constexpr const char* kWrongRow = "in a row for another kind";
constexpr std::chrono::seconds kRetryFor{10};  // a program that died is restarted meanwhile
/// A supervisor kills a frozen coordinator after ten seconds. It starts the next after at most five more.
constexpr std::chrono::seconds kStopRetryFor{20};

template <class Interface>
typename Interface::_ptr_type connect(CORBA::ORB_ptr orb, const std::string& uri, CORBA::ULong timeout_ms) {
  try {
    typename Interface::_var_type reference = cell::reference_to<Interface>(orb, uri);
    omniORB::setClientCallTimeout(reference, timeout_ms);
    return reference._retn();
  } catch (const CORBA::SystemException& error) {
    throw Failure(ExitCode::kUnreachable,
                  fmt::format("{}: leads to no object (CORBA {}): give a corbaloc or corbaname that does",
                              client::printable(uri), error._name()));
  }
}

std::optional<Milestone> milestone_of(Corbot::TransferStep step) {
  switch (step) {
    case Corbot::StepReserved:
      return Milestone::kReserved;
    case Corbot::StepHeld:
      return Milestone::kHeld;
    case Corbot::StepPlaced:
      return Milestone::kPlaced;
    default:
      return std::nullopt;
  }
}

}  // namespace

std::string silence_text(const std::string& what, const std::string& uri, const std::string& error,
                         const std::filesystem::path& directory) {
  const std::string hint =
      cell::holder_of(directory)
          ? fmt::format(
                "a cell is up in {}, which starts it again: repeat the command, with the --ports of its "
                "'up'; 'corbot hold' stops an arm at once, until 'corbot clear'",
                directory.string())
          : std::string(
                "'corbot cell up CELL' starts a cell; to one that runs, write the --name, --ports and "
                "--state-dir of its 'up'");
  return fmt::format("{} at {} does not reply (CORBA {}); {}", what, client::printable(uri), error, hint);
}

CellClient::CellClient(const cell::CellConfig& cell) : cell_(cell) {
  int argc = 0;
  orb_ = CORBA::ORB_init(argc, nullptr);
  store_ = connect<Corbot::Store>(orb_, cell.store_uri(), kCall_ms);
  const auto look_ms = static_cast<CORBA::ULong>(cell.timing.look_s * 1000);
  camera_ = connect<Corbot::Camera>(orb_, cell.camera_uri(), kCall_ms + look_ms);
  coordinator_ = connect<Corbot::Coordinator>(orb_, cell.coordinator_uri(), kCall_ms);
}

CellClient::~CellClient() {
  try {
    orb_->destroy();
  } catch (const CORBA::Exception&) {  // NOLINT(bugprone-empty-catch): the process ends
  }
}

template <class F>
auto CellClient::call(const Peer& peer, F&& f) -> decltype(f()) {
  return call(peer, f, is_ours_ ? kRetryFor : std::chrono::seconds(0));
}

/// Repeats a call that the ORB could not deliver: every call of this class may be repeated.
template <class F>
auto CellClient::call(const Peer& peer, F&& f, std::chrono::seconds retry_for) -> decltype(f()) {
  const auto deadline = std::chrono::steady_clock::now() + retry_for;
  for (;;) {
    try {
      return cell::or_refusal(peer.name, f);
    } catch (const CORBA::SystemException& error) {
      const bool is_last = gave_up_ || std::chrono::steady_clock::now() >= deadline;
      if (is_last && !is_ours_ && !peer.is_elsewhere)
        throw Failure(ExitCode::kUnreachable,
                      silence_text(peer.name, peer.uri, error._name(), cell_.state_directory));
      if (is_last)
        throw Failure(peer.is_elsewhere ? ExitCode::kUnreachable : ExitCode::kRefused,
                      fmt::format("{} does not reply (CORBA {})", peer.name, error._name()));
    } catch (const CORBA::Exception& error) {
      throw Failure(ExitCode::kInternal, fmt::format("{} raised {}", peer.name, error._name()));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
}

void CellClient::check_foreign() {
  const auto check = [&](const std::string& what, const std::string& uri) {
    try {
      const CORBA::Object_var object = orb_->string_to_object(uri.c_str());
      omniORB::setClientCallTimeout(object, kCall_ms);
      if (!object->_non_existent()) return;
    } catch (const CORBA::SystemException&) {  // NOLINT(bugprone-empty-catch): reported below
    }
    throw Failure(ExitCode::kUnreachable,
                  fmt::format("{} does not reply at {}", what, client::printable(uri)));
  };
  for (const cell::CellRobot& robot : cell_.robots) {
    if (!robot.reference.empty()) check(robot.name, robot.reference);
  }
  if (!cell_.camera_reference.empty()) check("the camera", cell_.camera_reference);
  if (!cell_.store_reference.empty()) check("the store", cell_.store_reference);
}

template <class F>
void CellClient::for_each_event(CORBA::ULongLong after, F&& f) {
  for (;;) {
    const auto reply = call(store_peer(), [&] { return Corbot::PieceEvents_var(store_->History(0, after)); });
    const Corbot::PieceEvents& events = reply.in();
    if (events.length() == 0) return;
    for (CORBA::ULong i = 0; i < events.length(); ++i) f(events[i]);
    after = events[events.length() - 1].number;
  }
}

void CellClient::start_work() {
  for_each_event(0, [&](const Corbot::PieceEvent& event) { last_before_ = event.number; });
  start();
}

Corbot::CoordinatorState_var CellClient::state() {
  return call(coordinator_peer(), [&] { return Corbot::CoordinatorState_var(coordinator_->State()); });
}

void CellClient::expect_running() {
  is_ours_ = false;
  try {
    const auto coordinator =
        Corbot::Coordinator_var(connect<Corbot::Coordinator>(orb_, cell_.coordinator_uri(), kName_ms));
    const CORBA::String_var name = coordinator->Name();
    if (cell_.name == name.in()) return;
    throw Failure(
        ExitCode::kUnreachable,
        fmt::format("the coordinator at {} is of cell '{}', not of '{}': give the --name and --ports "
                    "of the cell's 'up'",
                    client::printable(cell_.coordinator_uri()), client::printable(name.in()), cell_.name));
  } catch (
      const CORBA::SystemException&) {  // NOLINT(bugprone-empty-catch): the command needs it, or does not
  }
}

bool CellClient::is_paused() {
  return call(coordinator_peer(), [&] { return coordinator_->Paused(); });
}

Corbot::PlaceInfos_var CellClient::places() {
  return call(store_peer(), [&] { return Corbot::PlaceInfos_var(store_->Places()); });
}

Corbot::PieceEvents_var CellClient::unclear() {
  return call(store_peer(), [&] { return Corbot::PieceEvents_var(store_->Unclear()); });
}

void CellClient::start() {
  call(coordinator_peer(), [&] {
    coordinator_->Resume();
    coordinator_->Start();
  });
}

void CellClient::pause() {
  call(coordinator_peer(), [&] { coordinator_->Pause(); });
}

void CellClient::stop() {
  const Peer peer = coordinator_peer();
  if (is_ours_) return call(peer, [&] { coordinator_->Stop(); });
  const bool may_come_back = peer.is_elsewhere || cell::holder_of(cell_.state_directory);
  const std::chrono::seconds retry_for = may_come_back ? kStopRetryFor : std::chrono::seconds(0);
  bool is_told = !may_come_back;
  const auto until = std::chrono::steady_clock::now() + retry_for;
  call(
      peer,
      [&] {
        try {
          coordinator_->Stop();
        } catch (const CORBA::SystemException& error) {
          const auto left = std::chrono::ceil<std::chrono::seconds>(until - std::chrono::steady_clock::now());
          if (!std::exchange(is_told, true))
            client::notice(stderr,
                           fmt::format("corbot: the coordinator has NOT confirmed the stop (CORBA {}): "
                                       "trying again for {} s\n",
                                       error._name(), std::max(left.count(), std::chrono::seconds::rep{0})));
          throw;
        }
      },
      retry_for);
}

void CellClient::resolve(Corbot::PieceNumber piece, const std::string& place, int slot,
                         const std::string& who) {
  call(store_peer(), [&] { store_->Resolve(piece, place.c_str(), slot, who.c_str()); });
}

void CellClient::exchange(const std::string& place, const std::string& who) {
  call(store_peer(), [&] { store_->Exchange(place.c_str(), who.c_str()); });
}

std::string CellClient::release(const std::string& robot, const std::string& who) {
  return call(store_peer(), [&] {
    std::string holder;
    Corbot::ClaimToken token = 0;
    try {
      token = store_->Claim(robot.c_str(), who.c_str(), 0);
    } catch (const Corbot::Claimed& present) {
      holder = client::printable(present.who.in());
      token = present.token;
    }
    store_->Release(token);
    return holder;
  });
}

bool CellClient::has_no_transfer() {
  return call(store_peer(), [&] { return Corbot::TransferInfos_var(store_->Transfers())->length() == 0; });
}

int CellClient::placed() {
  const auto reply = call(store_peer(), [&] { return Corbot::PlaceInfos_var(store_->Places()); });
  const Corbot::PlaceInfos& places = reply.in();
  CORBA::ULong count = 0;
  for (CORBA::ULong i = 0; i < places.length(); ++i) {
    const cell::Place* place = cell_.place(places[i].name.in());
    if (place != nullptr && cell_.is_last(*place)) count += places[i].pieces;
  }
  return static_cast<int>(count);
}

void CellClient::read_events(CellEnd& end) {
  for (const cell::CellRobot& robot : cell_.robots) end.history.robots.push_back(robot.name);
  for_each_event(0, [&](const Corbot::PieceEvent& event) {
    const cell::Place* place = cell_.place(event.where.place.in());
    const bool arrives = event.step == Corbot::StepPlaced && place != nullptr && cell_.is_last(*place);
    if (arrives) ++end.arrivals[event.piece];
    const auto milestone = milestone_of(event.step);
    if (event.number > last_before_ && milestone)
      end.history.milestones.push_back({event.time, event.robot.in(), event.piece, *milestone, arrives});
  });
}

/// Skips a robot that does not reply or is no Arm: it has no count.
void CellClient::read_overruns(CellEnd& end) {
  for (const cell::CellRobot& robot : cell_.robots) {
    try {
      const Corbot::Arm_var arm = cell::reference_to<Corbot::Arm>(orb_.in(), cell_.robot_uri(robot));
      omniORB::setClientCallTimeout(arm.in(), kCall_ms);
      if (!arm->_is_a(Corbot::Arm::_PD_repoId)) continue;
      end.overruns[robot.name] = Corbot::LoopInfo_var(arm->Diagnostics())->overruns;
    } catch (const CORBA::Exception&) {  // NOLINT(bugprone-empty-catch): see above
    }
  }
}

std::vector<std::uint8_t> CellClient::picture(bool marked) {
  const std::string name = camera_peer().name;
  try {
    const Corbot::Jpeg_var jpeg = camera_->Picture(marked);
    const CORBA::Octet* const bytes = jpeg->get_buffer();
    return {bytes, bytes + jpeg->length()};
  } catch (const Corbot::NotReady& error) {
    throw Failure(ExitCode::kRefused, fmt::format("{}: {}", name, client::printable(error.reason.in())));
  } catch (const CORBA::Exception& error) {
    throw Failure(ExitCode::kRefused, fmt::format("{} gives no picture (CORBA {})", name, error._name()));
  }
}

CellEnd CellClient::read_end() {
  CellEnd end;
  const auto frame =
      call(camera_peer(), [&] { return Corbot::Frame_var(camera_->Look(cell_.timing.look_s)); });
  for (CORBA::ULong i = 0; i < frame->pieces.length(); ++i) {
    const Corbot::Point& p = frame->pieces[i].position;
    std::string where;
    for (const cell::Place& place : cell_.places) {
      if (place.covers({p.x, p.y, p.z}))
        where = place.takes_at({p.x, p.y, p.z}, frame->pieces[i].kind.in()) ? place.name : kWrongRow;
    }
    ++end.seen[where];
  }
  try {
    end.camera_jpeg = picture(true);
  } catch (
      const Failure&) {  // NOLINT(bugprone-empty-catch): the verdict needs none, and other cameras have none
  }
  const auto reply = call(store_peer(), [&] { return Corbot::PlaceInfos_var(store_->Places()); });
  const Corbot::PlaceInfos& places = reply.in();
  for (CORBA::ULong i = 0; i < places.length(); ++i)
    end.in_ledger[places[i].name.in()] = static_cast<int>(places[i].pieces);
  read_events(end);
  read_overruns(end);
  return end;
}

CellEnd CellClient::read_early_end() {
  CellEnd end;
  try {
    read_events(end);
    end.camera_jpeg = picture(true);
  } catch (const Failure&) {  // NOLINT(bugprone-empty-catch): the pictures show what is known
  }
  return end;
}

}  // namespace corbot::cli
