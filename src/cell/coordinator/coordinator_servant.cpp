// SPDX-License-Identifier: Apache-2.0
#include "cell/coordinator/coordinator_servant.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdio>
#include <thread>

#include "cell/coordinator/process_name.h"
#include "cell/coordinator/remote_robot.h"
#include "cell/coordinator/remote_services.h"
#include "cell/coordinator/worker.h"

namespace corbot::cell {

namespace {

constexpr double kRest_s = 2;                  // a stopped robot comes to rest within this time
constexpr std::chrono::seconds kStopReply{4};  // below the clients' time-out of 5 s
constexpr double kCountReply_s = 1;            // below the clients' time-out of 5 s
constexpr int kTurnTries = 50;                 // attempts to get the store's mutex in State
constexpr std::chrono::milliseconds kTurnPause{20};

/// Prints one line in one write, because other programs read the output.
void print_event(double time_s, const std::string& robot, const std::string& text) {
  const std::string line = fmt::format("{:.1f} {} {}\n", time_s, robot, client::printable(text));
  std::fwrite(line.data(), 1, line.size(), stdout);
  std::fflush(stdout);
}

}  // namespace

struct CoordinatorServant::RobotThread {
  RobotThread(CORBA::ORB_ptr orb, const CellConfig& cell, const CellRobot& robot, WorkGate& gate,
              WorkStatus::Report report, WorkStatus::OnActivity on_activity, const WrapPorts& wrap_ports)
      : name(robot.name),
        port(orb, cell.robot_uri(robot), process_name(), cell.timing.motion_s, stop.get_token(), gate,
             [this](bool is_paused) { worker.set_paused(is_paused); }),
        camera(orb, cell.camera_uri(), cell.timing.look_s, stop.get_token()),
        store(orb, cell.store_uri(), stop.get_token()),
        worker(cell, robot,
               wrap_ports ? wrap_ports(robot, {port, camera, store}) : WorkerPorts{port, camera, store},
               process_name(), std::move(report), stop.get_token(), std::move(on_activity)) {}

  /// Stops the robot and releases claim and control. Requires a requested stop.
  void finish() {
    port.stop();
    if (!thread.joinable()) return;
    thread.join();
    worker.finish();
  }

  const std::string name;
  std::stop_source stop;
  RemoteRobot port;
  RemoteCamera camera;
  RemoteStore store;
  Worker worker;
  std::thread thread;
};

CoordinatorServant::CoordinatorServant(CORBA::ORB_ptr orb, const CellConfig& cell,
                                       const std::vector<std::string>& robots, const WrapPorts& wrap_ports)
    : cell_(cell),
      activities_(cell.activity_file()),
      gate_(cell.hold_file()),
      store_(std::make_unique<RemoteStore>(orb, cell.store_uri(), std::stop_token(), 0, kCountReply_s)) {
  for (const std::string& name : robots) {
    const auto report = [this, name](const std::string& text) {
      const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin_;
      print_event(elapsed.count(), name, text);
    };
    const auto on_activity = [this](const ActivityChange& change) { activities_.add(change); };
    threads_.push_back(
        std::make_unique<RobotThread>(orb, cell, *cell.robot(name), gate_, report, on_activity, wrap_ports));
  }
}

CoordinatorServant::~CoordinatorServant() { end(); }

void CoordinatorServant::start_unless_stopped() {
  const std::lock_guard lock(mutex_);
  if (!gate_.is_stopped() && !has_ended_) begin();
}

/// Returns when each claim has the mark of a waiting holder, since the next holder may use another hold file.
void CoordinatorServant::Stop() {
  const auto gives_up = std::chrono::steady_clock::now() + kStopReply;
  const std::lock_guard lock(mutex_);
  gate_.stop();
  std::vector<std::string> moving(threads_.size());
  std::vector<std::string> unmarked(threads_.size());
  {
    std::vector<std::jthread> stops;  // parallel, since a servant may be frozen and the disk slow
    stops.emplace_back([&] { gate_.keep(); });
    for (std::size_t i = 0; i < threads_.size(); ++i)
      stops.emplace_back([&, &robot = *threads_[i], i] {
        robot.port.halt();
        if (!robot.port.comes_to_rest(kRest_s)) moving[i] = robot.name;
        if (mode_ == Corbot::CellRunning && !robot.worker.lets_go(gives_up)) unmarked[i] = robot.name;
      });
  }
  std::erase(moving, "");
  std::erase(unmarked, "");
  if (!moving.empty())
    throw Corbot::NotReady(fmt::format("not known to be at rest: {}", fmt::join(moving, ", ")).c_str());
  if (!unmarked.empty())
    throw Corbot::NotReady(
        fmt::format(
            "at rest, but the ledger does not say yet that it is stopped: {}; the store may be silent "
            "or its disk full. Until the store takes the stop, end stand-by coordinators: they would go on",
            fmt::join(unmarked, ", "))
            .c_str());
}

void CoordinatorServant::Start() {
  const std::lock_guard lock(mutex_);
  if (has_ended_) throw Corbot::NotReady("the coordinator ends");
  gate_.set_stopped(false);
  for (const auto& robot : threads_) robot->worker.go_on();
  if (mode_ != Corbot::CellRunning) begin();
}

/// Requires `mutex_`.
void CoordinatorServant::begin() {
  mode_ = Corbot::CellRunning;
  for (const auto& robot : threads_) robot->thread = std::thread([work = &robot->worker] { work->run(); });
}

void CoordinatorServant::Pause() { gate_.set_paused(true); }
void CoordinatorServant::Resume() { gate_.set_paused(false); }
CORBA::Boolean CoordinatorServant::Paused() { return gate_.is_paused(); }

/// Returns the store's count, or the last known one if the store does not reply. Requires `store_mutex_`.
std::uint64_t CoordinatorServant::count_placed() {
  if (!store_) return placed_;
  try {
    const Corbot::PlaceInfos places = store_->places();
    std::uint64_t placed = 0;
    for (CORBA::ULong i = 0; i < places.length(); ++i) {
      const Place* place = cell_.place(places[i].name.in());
      if (place != nullptr && cell_.is_last(*place)) placed += places[i].pieces;
    }
    placed_ = placed;
  } catch (const client::Failure&) {  // NOLINT(bugprone-empty-catch): the robots' threads report the failure
  }
  return placed_;
}

Corbot::CoordinatorState* CoordinatorServant::State() {
  Corbot::CoordinatorState_var state = new Corbot::CoordinatorState;
  {
    // Concurrent calls do not queue for a frozen store: each waits about 1 s for the mutex at most.
    std::unique_lock asks(store_mutex_, std::try_to_lock);
    for (int i = 0; i < kTurnTries && !asks.owns_lock(); ++i) {
      std::this_thread::sleep_for(kTurnPause);
      (void)asks.try_lock();
    }
    state->placed = asks.owns_lock() ? count_placed() : placed_.load();
  }
  const std::lock_guard lock(mutex_);
  state->mode = gate_.is_stopped() ? Corbot::CellStopped : mode_;
  state->robots.length(static_cast<CORBA::ULong>(threads_.size()));
  for (CORBA::ULong i = 0; i < threads_.size(); ++i) state->robots[i] = threads_[i]->worker.status();
  return state._retn();
}

std::uint64_t CoordinatorServant::end() {
  std::vector<std::unique_ptr<RobotThread>> threads;
  {
    const std::lock_guard lock(mutex_);
    has_ended_ = true;
    mode_ = Corbot::CellStopped;
    threads.swap(threads_);
  }
  for (const auto& robot : threads) robot->stop.request_stop();
  {
    std::vector<std::jthread> ends;  // parallel, since a servant may be frozen
    for (const auto& robot : threads) ends.emplace_back([&end = *robot] { end.finish(); });
  }
  const std::lock_guard lock(store_mutex_);
  const std::uint64_t placed = count_placed();
  store_.reset();
  return placed;
}

}  // namespace corbot::cell
