// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>

#include <filesystem>

#include "rt/backends/bus/bus_backend.h"
#include "rt/backends/can/sdo_client.h"
#include "rt/backends/can/socketcan.h"
#include "support/emulated_drives.h"
#include "support/paths.h"

namespace corbot::rt {

using test::wait_until;
using test::within;

inline constexpr double kCountsPerRad = 50'000.0;
inline constexpr int kStandsAt = 12'000;

/// Two joints' drives and a gripper's, emulated, on a bus of their own, and the backend for them.
class Drives : public ::testing::Test {
 protected:
  Drives()
      : directory_(std::string(CORBOT_SCRATCH_DIR) + "/" + test::unique_name("drives")),
        emulator_(CORBOT_BIN_DIR "/corbot-sim", directory_, 3, {"--position", std::to_string(kStandsAt)}) {
    std::filesystem::create_directory(directory_);
    arm_.dof = 2;
    for (std::size_t i = 0; i < 2; ++i) {
      arm_.joints[i].lower_q = -2.0;
      arm_.joints[i].upper_q = 2.0;
      arm_.servos[i] = {static_cast<std::uint32_t>(i), 1500.0, 600.0, 1.0, 500.0, 2500.0};
    }
    arm_.gripper = {2, 1900.0, 1100.0, 0.5};
    settings_.interface = emulator_.bus();
    settings_.joints = {{1, kCountsPerRad, 0.0, 1.0}, {2, kCountsPerRad, kStandsAt, -1.0}};
    settings_.gripper = GripperDrive{3, 0.0, 20'000.0};
    settings_.gripper_model = arm_.gripper;
  }
  ~Drives() override {
    backend_.reset();
    EXPECT_EQ(emulator_.stop(), 0);
    std::filesystem::remove_all(directory_);
  }
  void SetUp() override { emulator_.start(); }

  /// Joint 1 at 0.25 rad, joint 2 at 0, the gripper at half: 12500, 12000 and 10000 counts.
  static ServoFrame frame(double first_q = 0.25) {
    static std::uint64_t cycle = 0;  // not the clock, which goes on if the whole process stands still
    ServoFrame frame;
    frame.cycle = ++cycle;
    frame.servo_count = 3;
    frame.time_ns = CanPort::Clock::now().time_since_epoch().count();
    frame.position_q[0] = first_q;
    frame.pulse_us[0] = frame.pulse_us[1] = frame.pulse_us[2] = 1500.0;
    return frame;
  }
  void open(bool relax = false, bool readback = true) {
    backend_ = std::make_unique<BusBackend>(arm_, std::make_unique<Cia402Drives>(settings_),
                                            BusSettings{"socketcan", readback, relax, 0.02}, stop_);
    backend_->open(frame());
    log_ = to_string(backend_->drain_log());
  }
  bool becomes(BackendHealth health) {
    return wait_until(within(30), [&] {
      log_ += to_string(backend_->drain_log());
      return backend_->health() == health;
    });
  }
  /// As the cycle, which follows what stands by, and a person do after a loss.
  bool clear() {
    const auto write = [&](bool needs_clear) {
      const ServoFeedback feedback = backend_->read();
      ServoFrame now = frame();
      if (feedback.measured) now.position_q = feedback.position_q;
      now.needs_clear = now.power_off = needs_clear;
      backend_->write(now);
    };
    if (!wait_until(within(30), [&] {
          write(true);
          log_ += to_string(backend_->drain_log());
          return backend_->health() == BackendHealth::kStandby;
        }))
      return false;
    write(false);
    return becomes(BackendHealth::kOpen);
  }
  bool arrives(std::int32_t first = 12'500) {
    return wait_until(within(30), [&] {
      backend_->write(frame(first / kCountsPerRad));
      return emulator_.counts() == std::map<int, std::int32_t>{{1, first}, {2, kStandsAt}, {3, 10'000}};
    });
  }
  void expect_lost(DeviceCause cause, const std::string& text) {
    ASSERT_TRUE(becomes(BackendHealth::kLost)) << log_;
    EXPECT_EQ(backend_->cause(), cause) << log_;
    EXPECT_TRUE(wait_until(within(10), [&] {
      log_ += to_string(backend_->drain_log());
      return log_.find(text) != std::string::npos;
    })) << log_;
  }
  DriveState state_of_node(std::uint8_t node) {
    CanPort port;
    port.open(emulator_.bus(), {kSdoAnswer + node});
    DriveWatch watch({node});
    return state_of(static_cast<std::uint16_t>(SdoClient(port, watch, node).read({0x6041})));
  }
  /// Whatever was sent so far has been carried to all who listen, and who has come to listen does.
  void await_bus() { (void)emulator_.counts(); }
  /// The port receives the frames from here on, and none from before.
  void listen(CanPort& port, const std::vector<canid_t>& identifiers) {
    port.open(emulator_.bus(), identifiers);
    await_bus();
    while (port.read(CanPort::Clock::time_point{})) {
    }
  }
  /// Returns the error of opening and enabling.
  DeviceError refused() {
    try {
      Cia402Drives drives(settings_);
      drives.open();
      (void)drives.energise([] { return false; });
    } catch (const DeviceError& error) {
      return error;
    }
    return {DeviceCause::kNone, ""};
  }

  std::string directory_;
  test::EmulatedDrives emulator_;
  ArmModel arm_;
  EmergencyStop stop_;
  Cia402Settings settings_;
  std::unique_ptr<BusBackend> backend_;
  std::string log_;
};

}  // namespace corbot::rt
