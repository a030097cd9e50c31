// SPDX-License-Identifier: Apache-2.0
// Drives whose power fails: their counts afterwards are not trusted.
#include <thread>

#include "unit/can/drives_fixture.h"

namespace corbot::rt {
namespace {

using ::testing::HasSubstr;

class RestartedDrives : public Drives {
 protected:
  /// Waits until node 1 has been set up so many times from now on.
  bool is_tried(int times) {
    while (port_.read(CanPort::Clock::time_point{})) {
    }
    return wait_until(within(30), [&] {
      while (const auto frame = port_.read(CanPort::Clock::time_point{})) {
        const bool is_begin =
            frame->data[0] == static_cast<int>(NmtCommand::kPreOperational) && frame->data[1] == 1;
        if (is_begin) --times;
      }
      return times <= 0;
    });
  }
  void expect_refused() {
    EXPECT_TRUE(is_tried(3));
    EXPECT_EQ(backend_->health(), BackendHealth::kLost);
    EXPECT_EQ(emulator_.counts().at(1), 0);
    EXPECT_EQ(emulator_.counts("targets").at(1), 0);
  }
  void SetUp() override {
    Drives::SetUp();
    port_.open(emulator_.bus(), {kNmt});
  }

  CanPort port_;
};

TEST_F(RestartedDrives, AreNotMovedWhenTheyCountAnew) {
  open();
  ASSERT_TRUE(arrives());
  emulator_.command("reset 1 lost");
  expect_lost(DeviceCause::kDeviceFault, "node 1 has restarted");
  expect_refused();
}

TEST_F(RestartedDrives, AreKnownThoughTheirBootUpWasMissed) {
  open();
  ASSERT_TRUE(arrives());
  emulator_.command("silent on 1");
  expect_lost(DeviceCause::kHeartbeatLost, "node 1: no heartbeat");
  emulator_.command("reset 1 lost");
  emulator_.command("silent off 1");
  expect_refused();
}

TEST_F(RestartedDrives, AreSetUpAgainWhenOneRestartsAfterItsSetUp) {
  CanPort port;
  port.open(emulator_.bus(), {kSdoRequest + 2});
  emulator_.command("silent on 2");
  std::jthread restarts([&] {
    // When node 2 has its turn, node 1 has had it; the second request is answered.
    if (!port.read(CanPort::Clock::now() + std::chrono::seconds(10))) return;
    emulator_.command("reset 1");
    emulator_.command("silent off 2");
  });
  open();
  restarts.join();
  EXPECT_TRUE(arrives());
}

TEST_F(RestartedDrives, AreNotStartedWhenOneRestartsAfterEverySetUp) {
  CanPort port;
  port.open(emulator_.bus(), {kSdoRequest + 2, kSdoRequest + 3});
  emulator_.command("silent on 2");
  std::jthread restarts([&](const std::stop_token& end) {
    // Nodes 2 and 3 are gates: while a set-up waits for one of them, the other is closed. So each set-up finds node 1
    // restarted before it can end, however late this thread is.
    canid_t closed = kSdoRequest + 2;
    while (!end.stop_requested()) {
      const auto request = port.read(CanPort::Clock::now() + std::chrono::milliseconds(10));
      if (!request || request->can_id != closed) continue;
      if (closed == kSdoRequest + 2) {
        emulator_.command("silent on 3");
        emulator_.command("reset 1");
        emulator_.command("silent off 2");
        closed = kSdoRequest + 3;
      } else {
        emulator_.command("silent on 2");
        emulator_.command("silent off 3");
        closed = kSdoRequest + 2;
      }
    }
  });
  EXPECT_THAT(refused().what(), HasSubstr("node 1 has restarted while it was set up"));
  restarts.request_stop();
  restarts.join();
  while (const auto frame = port_.read(CanPort::Clock::time_point{})) {
    EXPECT_NE(frame->data[0], static_cast<int>(NmtCommand::kStart));
  }
}

TEST_F(RestartedDrives, MaySagALittle) {
  Cia402Drives drives(settings_);
  drives.open();
  const auto leads_to = [&](std::int32_t first) {
    return wait_until(within(10), [&] {
      drives.send(frame(first / kCountsPerRad), false);
      // It must have reported: its count by now is not yet known here.
      return drives.measure(frame()).value[0] == first / kCountsPerRad;
    });
  };
  ASSERT_TRUE(leads_to(2'000));
  drives.close();
  emulator_.command("reset 1 lost");
  drives.open();
  ASSERT_TRUE(leads_to(3'000));
  drives.close();
  emulator_.command("reset 1 lost");
  for (int i = 0; i < 2; ++i) {
    try {
      drives.open();
      FAIL() << "opened";
    } catch (const DeviceError& error) {
      EXPECT_EQ(error.cause(), DeviceCause::kDeviceFault);
      EXPECT_THAT(error.what(),
                  HasSubstr("node 1 counts 0 after its restart, it stood at 3000: reference it"));
    }
    drives.close();
  }
}

}  // namespace
}  // namespace corbot::rt
