// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <atomic>
#include <limits>

#include "contract/device_fixture.h"
#include "rt/backends/loopback/loopback_backend.h"

namespace corbot::test {
namespace {

constexpr std::size_t kMostFrames = 60'000;

/// The simulator inside the backend; what its servos were given is copied in the writing thread.
class LoopbackFixture final : public DeviceFixture {
 public:
  explicit LoopbackFixture(const ArmModel& arm) : servos_(arm.dof + 1), frames_(kMostFrames) {}

  void set_up() override {}
  [[nodiscard]] std::string backend_section() const override {
    return "[backend]\nkind = \"loopback\"\n[backend.loopback]\nreadback = true\n";
  }
  [[nodiscard]] DeviceFacts facts() const override {
    DeviceFacts facts;
    facts.unit = 1e-6;
    facts.period_s = 0.020;
    facts.approach_speed = 400.0;  // that of the motion: what was left of it within a frame
    facts.read_unit = 1.0;
    facts.has_encoders = true;
    facts.goes_off_unplugged = false;
    return facts;
  }
  void attach(Backend& backend) override { backend_ = dynamic_cast<rt::LoopbackBackend*>(&backend); }
  void unplug() override { backend_->set_plugged(false); }
  void plug() override { backend_->set_plugged(true); }

  void after_write() noexcept override {
    std::size_t taken = taken_.load(std::memory_order_relaxed);
    for (; taken < std::min<std::size_t>(backend_->frame_count(), kMostFrames); ++taken) {
      frames_[taken] = backend_->recorded(taken);
    }
    taken_.store(taken, std::memory_order_release);
  }
  std::vector<Output> outputs() override {
    std::vector<Output> seen;
    const std::size_t taken = taken_.load(std::memory_order_acquire);
    for (std::size_t i = 0; i < taken; ++i) {
      for (std::size_t servo = 0; servo < servos_; ++servo) {
        seen.push_back({frames_[i].time_ns, servo, frames_[i].pulse_us[servo]});
      }
    }
    return seen;
  }
  std::vector<double> now() override {
    const std::size_t taken = taken_.load(std::memory_order_acquire);
    std::vector<double> values(servos_, std::numeric_limits<double>::quiet_NaN());
    for (std::size_t i = 0; taken > 0 && i < servos_; ++i) values[i] = frames_[taken - 1].pulse_us[i];
    return values;
  }

 private:
  const std::size_t servos_;
  std::vector<rt::RecordedFrame> frames_;
  std::atomic<std::size_t> taken_{0};
  rt::LoopbackBackend* backend_{nullptr};
};

}  // namespace

std::vector<DeviceFixtureKind> loopback_fixtures() {
  return {{"loopback", [](const ArmModel& arm, const std::string&) -> std::unique_ptr<DeviceFixture> {
             return std::make_unique<LoopbackFixture>(arm);
           }}};
}

}  // namespace corbot::test
