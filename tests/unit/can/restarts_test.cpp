// SPDX-License-Identifier: Apache-2.0
// Drives whose power fails: their counts afterwards are not trusted.
#include <atomic>
#include <csignal>
#include <ctime>
#include <thread>

#include "unit/can/drives_fixture.h"

namespace corbot::rt {
namespace {

using ::testing::HasSubstr;

class RestartedDrives : public Drives {
 protected:
  /// Waits until node 1 has been set up so many times from now on.
  /// Though it is cleared again and again.
  bool is_tried(int times) {
    while (port_.read(CanPort::Clock::time_point{})) {
    }
    return wait_until(within(30), [&] {
      ServoFrame now = frame();
      now.needs_clear = now.power_off = backend_->health() != BackendHealth::kStandby;
      backend_->write(now);
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
    EXPECT_NE(backend_->health(), BackendHealth::kOpen);
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

TEST_F(RestartedDrives, SayThatTheyCountAnewThoughOneIgnoredItsTargetsBefore) {
  open();
  ASSERT_TRUE(arrives());
  emulator_.command("ignore on 2");
  expect_lost(DeviceCause::kTargetIgnored, "node 2 does not follow");
  emulator_.command("reset 1 lost");
  emulator_.command("ignore off 2");
  expect_refused();
  // At the latest by the Clear after its boot-up was seen.
  ASSERT_TRUE(
      wait_until(within(30), [&] { return is_tried(1) && backend_->cause() == DeviceCause::kCountChanged; }));
  EXPECT_TRUE(wait_until(within(30), [&] {
    log_ += to_string(backend_->drain_log());
    return log_.find("reference it, then restart corbot") != std::string::npos;
  })) << log_;
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
    // Nodes 2 and 3 are gates: while a set-up waits for one of them, the other is closed. So each set-up
    // finds node 1 restarted before it can end, however late this thread is.
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
  await_bus();
  while (const auto frame = port_.read(CanPort::Clock::time_point{})) {
    EXPECT_NE(frame->data[0], static_cast<int>(NmtCommand::kStart));
  }
}

TEST_F(RestartedDrives, MaySagALittle) {
  Cia402Drives drives(settings_);
  drives.open();
  (void)drives.energise([] { return false; });
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
  (void)drives.energise([] { return false; });
  ASSERT_TRUE(leads_to(3'000));
  drives.close();
  emulator_.command("reset 1 lost");
  for (int i = 0; i < 2; ++i) {
    try {
      drives.open();
      (void)drives.energise([] { return false; });
      FAIL() << "opened";
    } catch (const DeviceError& error) {
      EXPECT_EQ(error.cause(), DeviceCause::kCountChanged);
      EXPECT_THAT(error.what(),
                  HasSubstr("node 1 counts 0 after its restart, it stood at 3000: reference it"));
    }
    drives.close();
  }
}

/// The thread that asks stands still from their start on, as the whole machine may, and so do they, a little
/// longer.
class DrivesOnAMachineThatStandsStill : public RestartedDrives {
 protected:
  static void stand_still(int) {
    constexpr timespec kMoment{0, 1'000'000};
    while (stands_still) ::nanosleep(&kMoment, nullptr);
  }
  /// They do not lose what a listener would that comes late to the bus.
  bool become_operational() {
    return wait_until(within(30), [&] {
      return emulator_.counts("states") == std::map<int, std::int32_t>{{1, 5}, {2, 5}, {3, 5}};
    });
  }

  inline static std::atomic<bool> stands_still{false};
};

TEST_F(DrivesOnAMachineThatStandsStill, AreNotGivenUpAsLate) {
  constexpr std::chrono::milliseconds kLongerThanTheyMayTake{2300};
  ASSERT_NE(std::signal(SIGUSR1, stand_still), SIG_ERR);
  stands_still = true;
  std::string failure;
  std::thread asking([&] {
    try {
      Cia402Drives(settings_).open();
    } catch (const DeviceError& error) {
      failure = error.what();
    }
  });
  EXPECT_TRUE(become_operational());
  ASSERT_EQ(::pthread_kill(asking.native_handle(), SIGUSR1), 0);
  for (const char* node : {"1", "2", "3"}) emulator_.command(std::string("silent on ") + node);
  std::this_thread::sleep_for(kLongerThanTheyMayTake);
  stands_still = false;
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  for (const char* node : {"1", "2", "3"}) emulator_.command(std::string("silent off ") + node);
  asking.join();
  EXPECT_EQ(failure, "");
  EXPECT_NE(std::signal(SIGUSR1, SIG_DFL), SIG_ERR);
}

}  // namespace
}  // namespace corbot::rt
