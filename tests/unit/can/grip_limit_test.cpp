// SPDX-License-Identifier: Apache-2.0
#include "rt/backends/can/grip_limit.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "sim/devices/cia402_drive.h"

namespace corbot::rt {
namespace {

constexpr double kTravel = 40'000.0;
constexpr double kPeriod_s = 0.001;
/// 5 % of the travel, and what the fastest gripper moves in two periods.
constexpr int kLead = 2000 + 2 * 160;

TEST(GripLimit, FreeFingersGetWhatWasCommanded) {
  const GripLimit limit(kTravel, 0.5);
  std::int32_t last = 0;
  for (std::int32_t wanted = 0; wanted <= 40'000; wanted += 150) {
    last = limit.target(wanted, wanted - 500, last, kPeriod_s);  // a shaft that lags
    ASSERT_EQ(last, wanted);
  }
}

TEST(GripLimit, OnesThatAreHeldBackGetALeadAndNoMore) {
  for (const double travel : {kTravel, -kTravel}) {
    const GripLimit limit(travel, 0.5);
    std::int32_t last = 25'000;
    for (int i = 0; i < 1000; ++i) last = limit.target(0, 25'000, last, kPeriod_s);
    EXPECT_EQ(last, 25'000 - kLead);
    for (int i = 0; i < 1000; ++i) last = limit.target(40'000, 25'000, last, kPeriod_s);
    EXPECT_EQ(last, 25'000 + kLead) << "whichever way";
  }
}

TEST(GripLimit, WhatWasInTheWayIsGoneAndNothingJumps) {
  const GripLimit limit(kTravel, 0.5);
  std::int32_t last = 25'000 - kLead;
  std::int32_t shaft = 25'000;
  while (last > 0) {
    shaft = last;  // at once
    const std::int32_t next = limit.target(0, shaft, last, kPeriod_s);
    ASSERT_LE(std::abs(next - last), 160) << "at twice the mean speed";
    ASSERT_LT(next, last);
    last = next;
  }
  EXPECT_EQ(last, 0);
}

TEST(GripLimit, StaysWithinHalfOfTheDrivesOwnWindow) {
  GripLimit limit(kTravel, 0.5);
  limit.set_following_window(1000);
  std::int32_t last = 25'000;
  for (int i = 0; i < 1000; ++i) last = limit.target(0, 25'000, last, kPeriod_s);
  EXPECT_EQ(last, 24'500);
  for (const std::optional<std::uint32_t> none : {std::optional<std::uint32_t>(), {0xFFFF'FFFF}}) {
    limit.set_following_window(none);
    for (int i = 0; i < 1000; ++i) last = limit.target(0, 25'000, last, kPeriod_s);
    EXPECT_EQ(last, 25'000 - kLead);
  }
  limit.set_following_window(0);
  EXPECT_NEAR(limit.target(0, 25'000, 25'000, kPeriod_s), 25'000, 1);
}

TEST(GripLimit, ASlowBusDoesNotSlowTheFingers) {
  const GripLimit limit(kTravel, 0.5);
  // 20 frames a second: the shaft is where the last target was.
  std::int32_t last = 0;
  for (std::int32_t wanted = 0; wanted <= 40'000; wanted += 4000) {
    const std::int32_t shaft = last;
    last = limit.target(wanted, shaft, last, 0.05);
    ASSERT_EQ(last, wanted);
  }
}

/// The emulated drive: with the limit it stays in operation at something that the same drive alone faults at.
TEST(GripLimit, KeepsADriveFromItsFollowingError) {
  using sim::Cia402Drive;
  for (const bool is_limited : {false, true}) {
    Cia402Drive drive{sim::Cia402DriveOptions{.position = 40'000}};
    drive.set_mode(Cia402Drive::kModeCyclicPosition);
    drive.set_interpolation_s(kPeriod_s);
    for (const int word : {0x06, 0x07, 0x0F}) drive.control(static_cast<std::uint16_t>(word));
    drive.set_piece(31'000);
    const GripLimit limit(kTravel, 0.5);
    std::int32_t last = 40'000;
    std::int64_t now_ns = 0;
    for (std::int32_t wanted = 40'000; now_ns < 2'000'000'000; wanted = std::max(wanted - 80, 0)) {
      last = is_limited ? limit.target(wanted, drive.position(), last, kPeriod_s) : wanted;
      drive.set_target(last);
      drive.advance(now_ns += 1'000'000);
    }
    EXPECT_EQ(drive.position(), 31'000) << "nothing gets past a piece";
    EXPECT_EQ(drive.state() == Cia402Drive::State::kOperationEnabled, is_limited);
    if (!is_limited) {
      EXPECT_EQ(drive.error_code(), Cia402Drive::kFollowingError);
      continue;
    }
    EXPECT_NE(drive.statusword() & 0x0800, 0) << "its limit of current, which it shows";
    drive.set_piece(std::nullopt);
    while (now_ns < 4'000'000'000) {
      last = limit.target(0, drive.position(), last, kPeriod_s);
      drive.set_target(last);
      drive.advance(now_ns += 1'000'000);
    }
    EXPECT_EQ(drive.position(), 0);
  }
}

}  // namespace
}  // namespace corbot::rt
