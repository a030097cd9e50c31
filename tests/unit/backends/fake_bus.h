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
#include "support/wait_until.h"

namespace corbot::rt {

using Clock = std::chrono::steady_clock;
using test::wait_until;

/// A device whose bus the test holds in its hands.
struct FakeBus {
  std::atomic<bool> there{true};
  std::atomic<bool> fails{false};
  std::atomic<bool> halt_fails{false};
  std::atomic<bool> is_drive{false};  ///< it can take its energy off, and has encoders
  std::atomic<double> lag_q{0.0};     ///< of a drive that is energised, under its load
  std::atomic<bool> is_energised{false};
  std::atomic<bool> energises_for_ever{false};
  std::atomic<std::int64_t> period_ns{1'000'000};  ///< that it announces
  std::atomic<std::int64_t> busy_ns{0};            ///< that a frame takes it
  std::atomic<bool> powers_up{false};  ///< it reports no pulse of a servo that it was not sent one
  std::atomic<int> energised{0};
  std::atomic<int> de_energised{0};
  std::atomic<bool> is_silent{false};  ///< reports no positions
  std::atomic<int> silences{0};        ///< so many readings report no positions
  std::atomic<int> misses{0};          ///< so many questions get no answer
  std::atomic<int> garbles_every{0};   ///< of so many readings one is wrong; 0: none
  std::atomic<double> garbled_us{0.0};
  int readings{0};
  std::atomic<bool> pressed{false};  ///< the emergency stop
  std::atomic<bool> has_stop_input{false};
  std::atomic<bool> is_unheard{false};      ///< the emergency stop
  std::atomic<bool> is_approaching{false};  ///< it says that its approach has not ended
  std::atomic<double> is_at_us{0.0};        ///< that it reports on an approach; 0: nothing
  std::atomic<int> opened{0}, closed{0};
  std::atomic<bool> blocks_open{false};
  std::atomic<bool> blocks_close{false};  ///< as drives do that take their time for a quick stop
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
  std::vector<Clock::time_point> sent_at;
  std::vector<std::uint32_t> servos;  ///< in the frame
  std::vector<double> pulses_us;      ///< of the first servo
  std::vector<double> second_us;      ///< of the second servo
  std::vector<double> positions_q;    ///< of the first joint
  std::vector<std::pair<std::uint64_t, bool>> copy() {
    const std::lock_guard lock(mutex);
    return sent;
  }
};

class FakeDevice final : public BusDevice {
 public:
  explicit FakeDevice(FakeBus& bus) : bus_(bus) {}
  std::string open() override {
    while (bus_.blocks_open) std::this_thread::sleep_for(std::chrono::microseconds(100));
    if (!bus_.there) throw DeviceError(DeviceCause::kNotThere, "/dev/fake: not there");
    ++bus_.opened;
    const std::lock_guard lock(bus_.mutex);
    bus_.opened_at.push_back(Clock::now());
    return "a fake device";
  }
  void close() noexcept override {
    while (bus_.blocks_close) std::this_thread::sleep_for(std::chrono::microseconds(100));
    ++bus_.closed;
  }
  void close_after_fault() noexcept override {
    close();
    if (bus_.is_drive) bus_.is_energised = false;
  }
  [[nodiscard]] std::int64_t period_ns() const noexcept override { return bus_.period_ns; }
  [[nodiscard]] std::int64_t approach_ns() const noexcept override { return bus_.approach_ns; }
  [[nodiscard]] std::optional<bool> has_arrived(BusReading& on_the_way) override {
    const bool is_garbled = bus_.garbles_every > 0 && ++bus_.readings % bus_.garbles_every == 0;
    if (bus_.is_at_us > 0.0)
      on_the_way = {BusReading::Unit::kPulses, {is_garbled ? bus_.garbled_us : bus_.is_at_us}, {}};
    return bus_.is_approaching ? std::optional(false) : std::nullopt;
  }
  void halt() override {
    ++bus_.halted;
    if (bus_.halt_fails) throw DeviceError(DeviceCause::kNoAnswer, "/dev/fake: no answer to a stop");
    ++bus_.halts_done;
  }
  bool energise(const std::function<bool()>& is_stopped) override {
    ++bus_.energised;
    while (bus_.energises_for_ever) {
      if (is_stopped()) return false;
      std::this_thread::sleep_for(std::chrono::microseconds(100));
    }
    bus_.is_energised = true;
    return true;
  }
  bool de_energise() override {
    if (!bus_.is_drive) return false;
    ++bus_.de_energised;
    bus_.is_energised = false;
    return true;
  }
  [[nodiscard]] bool has_encoders() const noexcept override { return bus_.is_drive; }
  bool send(const ServoFrame& frame, bool approach) override {
    if (bus_.fails) throw DeviceError(DeviceCause::kHungUp, "/dev/fake: cut");
    if (bus_.busy_ns > 0) std::this_thread::sleep_for(std::chrono::nanoseconds(bus_.busy_ns));
    const std::lock_guard lock(bus_.mutex);
    bus_.sent.emplace_back(frame.cycle, approach);
    bus_.sent_at.push_back(Clock::now());
    bus_.servos.push_back(frame.servo_count);
    bus_.pulses_us.push_back(frame.pulse_us[0]);
    bus_.second_us.push_back(frame.pulse_us[1]);
    bus_.positions_q.push_back(frame.position_q[0]);
    return true;
  }
  BusReading measure(const ServoFrame& frame) override {
    if (bus_.misses > 0) {
      --bus_.misses;
      throw DeviceError(DeviceCause::kNoAnswer, "/dev/fake: no answer");
    }
    if (bus_.is_silent || bus_.silences-- > 0) return {};
    bus_.silences = 0;
    BusReading reading{bus_.has_encoders ? BusReading::Unit::kJoints : BusReading::Unit::kPulses,
                       frame.pulse_us};
    const std::lock_guard lock(bus_.mutex);
    for (std::size_t i = 0; i < bus_.reported_us.size(); ++i) reading.value[i] = bus_.reported_us[i];
    if (bus_.powers_up) {
      for (std::size_t i = 0; i < kMaxServos; ++i) {
        if (bus_.servos.empty() || i >= bus_.servos.back()) reading.value[i] = 0.0;
      }
    }
    // The servo is where it was sent.
    if (!bus_.pulses_us.empty())
      reading.value[0] = bus_.has_encoders ? bus_.positions_q.back() : bus_.pulses_us.back();
    if (bus_.is_energised) reading.value[0] -= bus_.lag_q;
    if (bus_.garbles_every > 0 && ++bus_.readings % bus_.garbles_every == 0)
      reading.value[0] = bus_.garbled_us;
    return reading;
  }
  [[nodiscard]] std::optional<BusReading> held() const override {
    if (!bus_.is_energised || !bus_.has_encoders) return std::nullopt;
    const std::lock_guard lock(bus_.mutex);
    BusReading reading{BusReading::Unit::kJoints, {}, {}};
    reading.value[0] = bus_.positions_q.empty() ? bus_.reported_us.at(0) : bus_.positions_q.back();
    return reading;
  }
  [[nodiscard]] bool has_stop_input() const noexcept override { return bus_.has_stop_input; }
  StopInputLevel emergency_stop() override {
    ++bus_.asked;
    if (bus_.is_unheard) return StopInputLevel::kUnheard;
    return bus_.pressed ? StopInputLevel::kPressed : StopInputLevel::kReleased;
  }
  void relax() override { ++bus_.relaxed; }

 private:
  FakeBus& bus_;
};

class BusBackendTest : public ::testing::Test {
 protected:
  BusBackendTest() {
    arm_.dof = 1;
    arm_.joints[0].lower_q = -20.0;
    arm_.joints[0].upper_q = 20.0;
    arm_.servos[0] = {0, 1500.0, 600.0, -1.0, 500.0, 2500.0};
    arm_.gripper = {1, 1900.0, 1100.0, 0.5};
  }
  std::unique_ptr<BusBackend> make(bool readback = false, bool relax = false) {
    settings_.readback = readback;
    settings_.relax_at_end = relax;
    return std::make_unique<BusBackend>(arm_, std::make_unique<FakeDevice>(bus_), settings_, stop_);
  }
  void be_drive(double at_q) {
    bus_.is_drive = bus_.has_encoders = true;
    bus_.approach_ns = 0;
    bus_.reported_us = {at_q};
  }
  static ServoFrame frame(std::uint64_t cycle, double pulse_us = 1500.0) {
    ServoFrame result;
    result.cycle = cycle;
    result.servo_count = 1;
    result.pulse_us[0] = pulse_us;
    return result;
  }
  /// Returns the frame that the cycle writes in Error. `off`: at rest, or if no ramp is possible.
  static ServoFrame stopped(std::uint64_t cycle, double pulse_us = 1500.0, bool off = false) {
    ServoFrame result = frame(cycle, pulse_us);
    result.needs_clear = true;
    result.power_off = off;
    return result;
  }
  bool becomes(const BusBackend& backend, BackendHealth health) {
    return wait_until([&] { return backend.health() == health; });
  }
  void lose(BusBackend& backend) {
    bus_.fails = true;
    ASSERT_TRUE(becomes(backend, BackendHealth::kLost));
  }
  /// As the cycle does: it goes on to say that it is in Error, until the device stands by. Returns its newest
  /// frame.
  ServoFrame answer(BusBackend& backend, const ServoFrame& held) {
    ServoFrame latched = held;
    latched.needs_clear = true;
    EXPECT_TRUE(wait_until([&] {
      backend.write(latched);
      ++latched.cycle;
      return backend.health() == BackendHealth::kStandby;
    }));
    return latched;
  }
  /// As the cycle and a person do: the device stands by once the Error is known, and is cleared. Returns the
  /// number of the first frame after that.
  std::uint64_t clear(BusBackend& backend, const ServoFrame& held) {
    ServoFrame cleared = held;
    cleared.cycle = answer(backend, held).cycle;
    backend.write(cleared);
    return cleared.cycle;
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
  BusSettings settings_{"fake", false, false, 0.001};
  EmergencyStop stop_;
  FakeBus bus_;
};

}  // namespace corbot::rt
