// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>
#include <vector>

#include "rt/backends/bus/bus_backend.h"

namespace corbot::rt {

using Clock = std::chrono::steady_clock;

template <class Condition>
bool wait_until(Condition&& condition) {
  const auto deadline = Clock::now() + std::chrono::seconds(20);
  while (!condition()) {
    if (Clock::now() > deadline) return false;
    std::this_thread::yield();
  }
  return true;
}

/// A device whose bus the test holds in its hands.
struct FakeBus {
  std::atomic<bool> there{true};
  std::atomic<bool> fails{false};
  std::atomic<bool> halt_fails{false};
  std::atomic<bool> is_energising{false};  ///< at open()
  std::atomic<bool> is_silent{false};      ///< reports no positions
  std::atomic<int> misses{0};              ///< so many questions get no answer
  std::atomic<bool> pressed{false};        ///< the emergency stop
  std::atomic<int> opened{0};
  std::atomic<int> closed{0};
  std::atomic<int> relaxed{0};
  std::atomic<int> halted{0};
  std::atomic<int> halts_done{0};                    ///< of them, those that did not fail
  std::atomic<int> asked{0};                         ///< for the emergency stop
  std::atomic<std::int64_t> approach_ns{2'000'000};  ///< 0: does not interpolate
  std::vector<double> reported_us;  ///< what the device says at the start; empty: what it is sent
  bool has_encoders{false};
  std::mutex mutex;
  std::vector<std::chrono::steady_clock::time_point> opened_at;
  std::vector<std::pair<std::uint64_t, bool>> sent;  ///< cycle, approach
  std::vector<double> pulses_us;                     ///< of the first servo
  std::vector<std::pair<std::uint64_t, bool>> copy() {
    const std::lock_guard lock(mutex);
    return sent;
  }
};

class FakeDevice final : public BusDevice {
 public:
  explicit FakeDevice(FakeBus& bus) : bus_(bus) {}
  std::string open() override {
    if (!bus_.there) throw DeviceError(DeviceCause::kNotThere, "/dev/fake: not there");
    ++bus_.opened;
    const std::lock_guard lock(bus_.mutex);
    bus_.opened_at.push_back(Clock::now());
    return "a fake device";
  }
  void close() noexcept override { ++bus_.closed; }
  [[nodiscard]] std::int64_t period_ns() const noexcept override { return 1'000'000; }
  [[nodiscard]] std::int64_t approach_ns() const noexcept override { return bus_.approach_ns; }
  void halt() override {
    ++bus_.halted;
    if (bus_.halt_fails) throw DeviceError(DeviceCause::kNoAnswer, "/dev/fake: no answer to a stop");
    ++bus_.halts_done;
  }
  [[nodiscard]] bool energises_at_open() const noexcept override { return bus_.is_energising; }
  void send(const ServoFrame& frame, bool approach) override {
    if (bus_.fails) throw DeviceError(DeviceCause::kHungUp, "/dev/fake: cut");
    const std::lock_guard lock(bus_.mutex);
    bus_.sent.emplace_back(frame.cycle, approach);
    bus_.pulses_us.push_back(frame.pulse_us[0]);
  }
  BusReading measure(const ServoFrame& frame) override {
    if (bus_.misses > 0) {
      --bus_.misses;
      throw DeviceError(DeviceCause::kNoAnswer, "/dev/fake: no answer");
    }
    if (bus_.is_silent) return {};
    BusReading reading{bus_.has_encoders ? BusReading::Unit::kJoints : BusReading::Unit::kPulses,
                       frame.pulse_us};
    for (std::size_t i = 0; i < bus_.reported_us.size(); ++i) reading.value[i] = bus_.reported_us[i];
    const std::lock_guard lock(bus_.mutex);
    if (!bus_.pulses_us.empty()) reading.value[0] = bus_.pulses_us.back();  // the servo is where it was sent
    return reading;
  }
  bool emergency_stop() override {
    ++bus_.asked;
    return bus_.pressed;
  }
  void relax() override { ++bus_.relaxed; }

 private:
  FakeBus& bus_;
};

class BusBackendTest : public ::testing::Test {
 protected:
  BusBackendTest() {
    arm_.dof = 1;
    arm_.servos[0] = {0, 1500.0, 600.0, -1.0, 500.0, 2500.0};
    arm_.gripper = {1, 1900.0, 1100.0, 0.5};
  }
  std::unique_ptr<BusBackend> make(bool readback = false, bool relax = false) {
    return std::make_unique<BusBackend>(arm_, std::make_unique<FakeDevice>(bus_),
                                        BusSettings{"fake", readback, relax, 0.001}, stop_);
  }
  static ServoFrame frame(std::uint64_t cycle, double pulse_us = 1500.0) {
    ServoFrame result;
    result.cycle = cycle;
    result.servo_count = 1;
    result.pulse_us[0] = pulse_us;
    return result;
  }
  std::uint64_t newest_sent() {
    const auto sent = bus_.copy();
    return sent.empty() ? 0 : sent.back().first;
  }
  auto approaches() {
    const auto sent = bus_.copy();
    return std::count_if(sent.begin(), sent.end(), [](const auto& frame) { return frame.second; });
  }
  ArmModel arm_;
  EmergencyStop stop_;
  FakeBus bus_;
};

}  // namespace corbot::rt
