// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <time.h>

#include <atomic>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "rt/backends/bus/device_error.h"
#include "rt/backends/gpio/gpio_lines.h"

namespace corbot::test {

/// GPIO lines in the hands of a test: outputs are recorded with the time, inputs are what the test says.
class FakeGpio {
 public:
  struct Change {
    std::int64_t time_ns;
    std::uint32_t values;
  };

  static std::int64_t now_ns() {
    timespec time{};
    ::clock_gettime(CLOCK_MONOTONIC, &time);
    return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
  }
  [[nodiscard]] std::vector<Change> changes() {
    const std::lock_guard lock(mutex_);
    return changes_;
  }
  [[nodiscard]] std::uint32_t outputs() const { return outputs_; }
  [[nodiscard]] int requests() const { return requests_; }
  [[nodiscard]] rt::GpioRequest last_request() {
    const std::lock_guard lock(mutex_);
    return request_;
  }
  void press(bool pressed) {
    const std::lock_guard lock(mutex_);
    if (pressed_ != pressed) has_edge_ = true;
    pressed_ = pressed;
    wake_.notify_all();
  }
  /// Pressed and released before any read of the level.
  void tap() {
    const std::lock_guard lock(mutex_);
    has_edge_ = true;
    wake_.notify_all();
  }
  void take_to_set(std::chrono::nanoseconds time) { set_takes_ns_ = time.count(); }
  void miss_edges() { sees_edges_ = false; }
  /// Unplugs the chip. Lines requested before stay dead for good.
  void unplug(int error = ENODEV) {
    error_ = error;
    ++unplugged_;
  }
  void plug() { error_ = 0; }
  /// From now on, calls to the chip do not return until this is taken back.
  void block(bool blocked) { blocked_ = blocked; }
  /// Blocks the calls that set a line.
  void block_sets(bool blocked) { sets_blocked_ = blocked; }
  void set_info(const std::string& line, const rt::GpioLineInfo& info) {
    const std::lock_guard lock(mutex_);
    infos_[line] = info;
  }
  /// The next so many set() fail, and leave the lines as they are.
  void fail_sets(int count) { sets_to_fail_ = count; }

  [[nodiscard]] std::unique_ptr<rt::GpioChips> chips() { return std::make_unique<Chips>(*this); }

 private:
  class Outputs final : public rt::GpioOutputs {
   public:
    explicit Outputs(FakeGpio& gpio) : gpio_(gpio), unplugged_(gpio.unplugged_) {
      const std::lock_guard lock(gpio.mutex_);
      if (gpio.outputs_ != 0) gpio.changes_.push_back({now_ns(), 0});
      gpio.outputs_ = 0;
    }
    ~Outputs() override {
      if (unplugged_ == gpio_.unplugged_) gpio_.outputs_ = 0;
    }
    [[nodiscard]] int set(std::uint32_t values) noexcept override {
      wait_while(gpio_.blocked_);
      wait_while(gpio_.sets_blocked_);
      const int error = gpio_.error_;
      if (error != 0) return error;
      if (unplugged_ != gpio_.unplugged_) return ENODEV;
      if (gpio_.sets_to_fail_ > 0) {
        --gpio_.sets_to_fail_;
        return EIO;
      }
      {
        const std::lock_guard lock(gpio_.mutex_);
        if (values != gpio_.outputs_) gpio_.changes_.push_back({now_ns(), values});
        gpio_.outputs_ = values;
      }
      for (const std::int64_t begun_ns = now_ns(); now_ns() < begun_ns + gpio_.set_takes_ns_;) {
      }
      return 0;
    }

   private:
    FakeGpio& gpio_;
    const int unplugged_;
  };
  class Input final : public rt::GpioInput {
   public:
    explicit Input(FakeGpio& gpio) : gpio_(gpio) {}
    bool wait_edge(std::chrono::nanoseconds longest) override {
      std::unique_lock lock(gpio_.mutex_);
      (void)gpio_.wake_.wait_for(lock, longest, [&] { return gpio_.has_edge_; });
      gpio_.check();
      return std::exchange(gpio_.has_edge_, false) && gpio_.sees_edges_;
    }
    [[nodiscard]] bool is_active() override {
      const std::lock_guard lock(gpio_.mutex_);
      gpio_.check();
      return gpio_.pressed_;
    }

   private:
    FakeGpio& gpio_;
  };
  class Chips final : public rt::GpioChips {
   public:
    explicit Chips(FakeGpio& gpio) : gpio_(gpio) {}
    [[nodiscard]] std::unique_ptr<rt::GpioOutputs> outputs(const rt::GpioRequest& request) override {
      gpio_.take(request);
      return std::make_unique<Outputs>(gpio_);
    }
    [[nodiscard]] std::unique_ptr<rt::GpioInput> input(const rt::GpioRequest& request) override {
      gpio_.take(request);
      return std::make_unique<Input>(gpio_);
    }
    [[nodiscard]] rt::GpioLineInfo info(const std::string&, const std::string& line) override {
      gpio_.check();
      const std::lock_guard lock(gpio_.mutex_);
      const auto found = gpio_.infos_.find(line);
      return found == gpio_.infos_.end() ? rt::GpioLineInfo{} : found->second;
    }

   private:
    FakeGpio& gpio_;
  };

  static void wait_while(const std::atomic<bool>& blocked) noexcept {
    while (blocked) {
      const timespec pause{0, 100'000};
      ::nanosleep(&pause, nullptr);
    }
  }
  void take(const rt::GpioRequest& request) {
    wait_while(blocked_);
    check();
    const std::lock_guard lock(mutex_);
    request_ = request;
    ++requests_;
  }
  void check() const {
    if (error_ != 0) throw rt::DeviceError(DeviceCause::kHungUp, "fake gpio: gone");
  }

  std::mutex mutex_;
  std::condition_variable wake_;
  std::vector<Change> changes_;
  rt::GpioRequest request_;
  std::map<std::string, rt::GpioLineInfo> infos_;  ///< by line; others are free inputs
  bool pressed_{false};
  bool has_edge_{false};
  std::atomic<bool> sees_edges_{true};
  std::atomic<std::uint32_t> outputs_{0};
  std::atomic<int> requests_{0};
  std::atomic<bool> blocked_{false};
  std::atomic<bool> sets_blocked_{false};
  std::atomic<int> error_{0};
  std::atomic<int> unplugged_{0};
  std::atomic<int> sets_to_fail_{0};
  std::atomic<std::int64_t> set_takes_ns_{0};
};

/// Several chips, by the name that a request has for them; they must outlive this.
class FakeBoard final : public rt::GpioChips {
 public:
  explicit FakeBoard(std::map<std::string, FakeGpio*> chips) {
    for (const auto& [name, gpio] : chips) chips_[name] = gpio->chips();
  }
  [[nodiscard]] std::unique_ptr<rt::GpioOutputs> outputs(const rt::GpioRequest& request) override {
    return chips_.at(request.chip)->outputs(request);
  }
  [[nodiscard]] std::unique_ptr<rt::GpioInput> input(const rt::GpioRequest& request) override {
    return chips_.at(request.chip)->input(request);
  }
  [[nodiscard]] rt::GpioLineInfo info(const std::string& chip, const std::string& line) override {
    return chips_.at(chip)->info(chip, line);
  }

 private:
  std::map<std::string, std::unique_ptr<rt::GpioChips>> chips_;
};

}  // namespace corbot::test
