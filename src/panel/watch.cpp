// SPDX-License-Identifier: Apache-2.0
#include "panel/watch.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

namespace corbot::panel {

namespace {
constexpr std::chrono::milliseconds kPollInterval{20};
constexpr std::chrono::milliseconds kCellPollInterval{160};
constexpr std::chrono::milliseconds kReconnectInterval{500};
/// A servant or coordinator that has died is back within this time: its supervisor waits at most five seconds
/// before it starts it again. A motion may go on meanwhile, and a coordinator moves the robots again.
constexpr std::chrono::milliseconds kStopTries{8000};
/// A supervisor has ended a frozen servant within this time, unless `respond_s` of its profile is longer. A
/// Stop that hangs longer is not tried again, so that its failure is reported soon.
constexpr std::chrono::milliseconds kFrozen{5000};
}  // namespace

Watch::Watch(std::string name, std::unique_ptr<Port> port, Watched what)
    : name_(std::move(name)),
      port_(std::move(port)),
      what_(what),
      programs_({[this] { return port_->performer(); }, [this] { request_stop(); },
                 [this] {
                   const std::lock_guard lock(mutex_);
                   wake_.notify_all();
                 }}) {}

Watch::~Watch() {
  end();
  if (polls_.joinable()) polls_.join();
  if (calls_.joinable()) calls_.join();
  if (stops_.joinable()) stops_.join();
}

void Watch::start(std::function<void()> changed, const std::atomic<std::uint64_t>& received_stops) {
  changed_ = std::move(changed);
  received_stops_ = &received_stops;
  stops_ = std::thread([this] { run_stops(); });
  calls_ = std::thread([this] { run_calls(); });
  polls_ = std::thread([this] { run_polls(); });
}

void Watch::end() {
  if (programs_.is_running()) request_stop();
  const std::lock_guard lock(mutex_);
  ending_ = true;
  wake_.notify_all();
}

Watch::State Watch::newest() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

nlohmann::json Watch::description() const {
  const std::lock_guard lock(mutex_);
  return description_;
}

std::uint64_t Watch::request_stop() {
  programs_.cancel();
  const std::lock_guard lock(mutex_);
  wake_.notify_all();
  return ++stops_requested_;
}

Watch::StopResult Watch::last_stop() const {
  const std::lock_guard lock(mutex_);
  return last_stop_;
}

std::shared_ptr<const Watch::Call> Watch::request_call(Order order) {
  const std::lock_guard lock(mutex_);
  if (call_) return nullptr;
  call_ = std::make_shared<Call>(std::move(order), stops_requested_);
  wake_.notify_all();
  return call_;
}

bool Watch::start_program(client::Program program) { return programs_.start(std::move(program)); }

bool Watch::sleep_until(Clock::time_point time) {
  std::unique_lock lock(mutex_);
  return !wake_.wait_until(lock, time, [&] { return ending_; });
}

void Watch::publish(nlohmann::json state) {
  state[key()] = name_;
  if (what_ == Watched::kRobot) state["program"] = programs_.state();
  {
    const std::lock_guard lock(mutex_);
    state["number"] = ++newest_.number;
    state["connection"] = connections_;
    state["stops"] = received_stops_->load();
    newest_.text = std::make_shared<const std::string>(
        state.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  }
  changed_();
}

void Watch::run_polls() {
  do {
    try {
      poll_until_failure();
      return;
    } catch (const std::exception& error) {
      publish({{"connected", false}, {"text", error.what()}});
    }
  } while (sleep_until(Clock::now() + kReconnectInterval));
}

void Watch::poll_until_failure() {
  nlohmann::json description = port_->connect();
  {
    const std::lock_guard lock(mutex_);
    description_ = std::move(description);
    ++connections_;
  }
  const auto interval = what_ == Watched::kRobot ? kPollInterval : kCellPollInterval;
  Clock::time_point due = Clock::now();
  do {
    nlohmann::json state = port_->state();
    state["connected"] = true;
    publish(std::move(state));
    due = std::max(due + interval, Clock::now());  // a late poll delays the next ones
  } while (sleep_until(due));
}

void Watch::run_stops() {
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [&] {
      const bool may_end = ending_ && !call_ && !programs_.is_running();
      return may_end || stops_requested_ != last_stop_.number;
    });
    const std::uint64_t number = stops_requested_;
    if (number == last_stop_.number) return;
    lock.unlock();
    StopResult result{number, stop()};
    lock.lock();
    last_stop_ = std::move(result);
    lock.unlock();
    changed_();
    lock.lock();
  }
}

std::string Watch::stop() {
  const Clock::time_point begin = Clock::now();
  std::optional<Clock::time_point> last_try;
  for (;;) {
    try {
      port_->stop();
      return {};
    } catch (const std::exception& error) {
      const Clock::time_point now = Clock::now();
      const bool is_silent = what_ == Watched::kRobot && now > begin + kFrozen;
      if (!last_try) last_try = is_silent ? now : now + kStopTries;
      if (now >= *last_try) return error.what();
    }
    std::this_thread::sleep_for(kPollInterval);
  }
}

void Watch::run_calls() {
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [&] { return ending_ || call_; });
    const std::shared_ptr<Call> call = call_;
    if (ending_) break;
    lock.unlock();
    make(*call);
    lock.lock();
    if (stops_requested_ != call->stops && starts_motion(call->order)) {
      // The robot or cell may have accepted the motion after it had carried out that Stop.
      ++stops_requested_;
      if (call->failure.empty()) call->failure = "a Stop was requested meanwhile: this motion does not go on";
    }
    call->has_ended = true;
    call_ = nullptr;
    wake_.notify_all();
    lock.unlock();
    changed_();
    lock.lock();
  }
  call_ = nullptr;
  wake_.notify_all();
}

void Watch::make(Call& call) {
  try {
    call.reply = port_->call(call.order);
  } catch (const std::exception& error) {
    call.failure = error.what();
  }
}

}  // namespace corbot::panel
