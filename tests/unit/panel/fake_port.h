// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

#include "panel/watch.h"

namespace corbot::panel {

/// Returns an order as a line; that of a cell has the piece and the slot only where it is about them.
inline std::string text_of(const Order& order) {
  if (const auto* robot = std::get_if<client::Request>(&order)) return client::to_string(*robot);
  const auto& cell = std::get<CellRequest>(order);
  switch (cell.action) {
    case CellAction::kStart:
      return "start";
    case CellAction::kPause:
      return "pause";
    case CellAction::kExchange:
      return "exchange " + cell.place;
    default:
      return "resolve " + std::to_string(cell.piece) + " " + cell.place + " " + std::to_string(cell.slot);
  }
}

/// A simulated robot or cell. A test makes its calls fail, or hang until the test releases them.
class FakeRobot {
 public:
  /// Makes the polls in progress and all later polls hang, or releases them.
  void set_polls_hang(bool hang) { set(polls_hang_, hang); }
  void set_stops_hang(bool hang) { set(stops_hang_, hang); }
  void set_calls_hang(bool hang) { set(calls_hang_, hang); }
  void set_fault(std::string text) { set(fault_, std::move(text)); }
  void set_picture(const std::string& bytes) { set(picture_, std::make_shared<const std::string>(bytes)); }
  void set_padding(std::string text) { set(padding_, std::move(text)); }

  [[nodiscard]] std::shared_ptr<const std::string> picture() const {
    const std::lock_guard lock(mutex_);
    return picture_;
  }
  [[nodiscard]] int stops() const { return get(stops_); }
  [[nodiscard]] int failed_stops() const { return get(failed_stops_); }
  [[nodiscard]] int polls() const { return get(polls_); }
  [[nodiscard]] int hanging_polls() const { return get(hanging_polls_); }
  [[nodiscard]] int hanging_stops() const { return get(hanging_stops_); }
  [[nodiscard]] int hanging_calls() const { return get(hanging_calls_); }
  /// Returns the accepted calls, one a line, as they would stand in a program.
  [[nodiscard]] std::string calls() const {
    const std::lock_guard lock(mutex_);
    return calls_;
  }

  void connect() {
    const std::lock_guard lock(mutex_);
    fail();
  }
  nlohmann::json state() {
    std::unique_lock lock(mutex_);
    ++hanging_polls_;
    wake_.wait(lock, [&] { return !polls_hang_; });
    --hanging_polls_;
    fail();
    return {{"poll", ++polls_}, {"padding", padding_}};
  }
  void stop() {
    std::unique_lock lock(mutex_);
    ++hanging_stops_;
    wake_.wait(lock, [&] { return !stops_hang_; });
    --hanging_stops_;
    if (!fault_.empty()) ++failed_stops_;
    fail();
    ++stops_;
    wake_.notify_all();
  }
  /// Carries out one statement of a program. It hangs like a call; a Stop ends it.
  void perform(const client::Request& request, const std::atomic<bool>& is_cancelled) {
    std::unique_lock lock(mutex_);
    ++hanging_calls_;
    const int stops = stops_;
    wake_.wait(lock, [&] { return !calls_hang_ || stops_ != stops; });
    --hanging_calls_;
    if (!fault_.empty()) throw client::Failure(client::ExitCode::kRefused, fault_);
    if (is_cancelled) throw client::explain(Corbot::Stopped("by a Stop"));
    calls_ += client::to_string(request) + "\n";
  }
  nlohmann::json call(const Order& order) {
    std::unique_lock lock(mutex_);
    ++hanging_calls_;
    wake_.wait(lock, [&] { return !calls_hang_; });
    --hanging_calls_;
    fail();
    calls_ += text_of(order) + "\n";
    return {{"done", true}, {"ticket", 7}};
  }

 private:
  template <class Value>
  void set(Value& member, Value value) {
    const std::lock_guard lock(mutex_);
    member = std::move(value);
    wake_.notify_all();
  }
  [[nodiscard]] int get(const int& member) const {
    const std::lock_guard lock(mutex_);
    return member;
  }
  void fail() const {
    if (!fault_.empty()) throw std::runtime_error(fault_);
  }

  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool polls_hang_{false};
  bool stops_hang_{false};
  bool calls_hang_{false};
  std::string fault_;
  std::string padding_;
  std::shared_ptr<const std::string> picture_;
  int polls_{0};
  int stops_{0};
  int failed_stops_{0};
  int hanging_polls_{0};
  int hanging_stops_{0};
  int hanging_calls_{0};
  std::string calls_;
};

class FakePerformer : public Performer {
 public:
  explicit FakePerformer(std::shared_ptr<FakeRobot> robot) : robot_(std::move(robot)) {}
  std::string perform(const client::Request& request, const client::ProgressReport& report) override {
    report(0.5);
    robot_->perform(request, is_cancelled_);
    return {};
  }
  void begin_cancel() noexcept override { is_cancelled_ = true; }

 private:
  std::shared_ptr<FakeRobot> robot_;
  std::atomic<bool> is_cancelled_{false};
};

class FakePort : public Port {
 public:
  explicit FakePort(std::shared_ptr<FakeRobot> robot) : robot_(std::move(robot)) {}
  nlohmann::json connect() override {
    robot_->connect();
    return {{"urdf", "<robot/>"}};
  }
  nlohmann::json state() override { return robot_->state(); }
  void stop() override { robot_->stop(); }
  nlohmann::json call(const Order& order) override { return robot_->call(order); }
  std::unique_ptr<Performer> performer() override { return std::make_unique<FakePerformer>(robot_); }
  [[nodiscard]] std::shared_ptr<const std::string> picture() const override { return robot_->picture(); }

 private:
  std::shared_ptr<FakeRobot> robot_;
};

}  // namespace corbot::panel
