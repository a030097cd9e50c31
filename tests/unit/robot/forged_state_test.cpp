// SPDX-License-Identifier: Apache-2.0
// Tests random segments of a previous servant: bytes that no servant writes. All that is taken over is valid,
// and one record's bytes cost no other record. CORBOT_SEED repeats a run.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "config/load_profile.h"
#include "corbot/motion/frames.h"
#include "robot/inherited_state.h"
#include "robot/settings.h"
#include "robot/ticket_table.h"
#include "support/cases.h"
#include "support/paths.h"

namespace corbot::forged_state_test {
namespace {

constexpr std::uint64_t kFirst = 1000;
constexpr std::uint64_t kTickets = 2 * kKeptTickets;
constexpr std::uint64_t kNext = kFirst + kTickets;
constexpr std::uint64_t kIncarnation = 7;

class ForgedState : public ::testing::Test {
 protected:
  ForgedState() {
    random_.seed(test::drawn_seed());
    fill();
  }

  std::uint64_t below(std::uint64_t end) {
    return std::uniform_int_distribution<std::uint64_t>(0, end - 1)(random_);
  }

  /// Writes the segment of a servant that has worked for a while.
  void fill() {
    Settings settings(former_->state.settings);
    settings.change([](PlanSettings& now) { now.speed_ratio = 0.5; });
    settings.change([](PlanSettings& now) { now.tool_pitch_rad = 0.25; });
    settings.change([](PlanSettings& now) {
      now.tool_frame = Pose{{0.05, 0.0, 0.01}, about({1.0, 0.0, 0.0}, 0.3)};
      now.base_frame = Pose{{2.0, -1.0, 0.5}, {}};
    });
    AlarmLog alarms;
    alarms.keep_in(former_->state.alarms);
    for (int i = 1; i <= 100; ++i) alarms.add(i, i > 60, "alarm " + std::to_string(i));
    TicketTable tickets;
    tickets.keep_in(former_->state.tickets);
    for (std::uint64_t id = kFirst; id < kNext; ++id) {
      Ticket ticket;
      ticket.first = id;
      ticket.last = id;
      ticket.duration_s = static_cast<double>(id);
      ticket.incarnation = kIncarnation;
      tickets.add(ticket);
      if (id < kNext - 10) tickets.complete(id, id % 3 == 0 ? Verdict::kStopped : Verdict::kDone);
    }
    former_->next_command_id = kNext;
  }
  [[nodiscard]] unsigned char* bytes() { return reinterpret_cast<unsigned char*>(&former_->state); }

  void check(const InheritedState& state) {
    if (state.settings) {
      EXPECT_TRUE(state.settings->speed_ratio > 0.0 && state.settings->speed_ratio <= 1.0);
      EXPECT_LE(std::abs(state.settings->tool_pitch_rad.value_or(0.0)), M_PI);
      if (state.settings->tool_orientation) {
        EXPECT_NEAR(squared_norm(*state.settings->tool_orientation), 1.0, 1e-5);
      }
      const auto& [tool, base] = std::pair(state.settings->tool_frame, state.settings->base_frame);
      EXPECT_TRUE(!tool || is_frame(*tool, kFarthestTool_m));
      EXPECT_TRUE(!base || is_frame(*base, kFarthestBase_m));
      for (const double ratio : state.settings->joint_speed_ratio) EXPECT_TRUE(ratio > 0.0 && ratio <= 1.0);
    }
    EXPECT_LE(state.alarms.size(), kKeptAlarms);
    for (const AlarmEntry& alarm : state.alarms) {
      EXPECT_TRUE(std::isfinite(alarm.time_s));
      EXPECT_LT(alarm.text.size(), sizeof(AlarmRecord::text));
      for (const char c : alarm.text) EXPECT_TRUE(c >= 0x20 && c < 0x7f);
    }
    EXPECT_LE(state.tickets.size(), kKeptTickets);
    std::uint64_t last = 0;
    for (const Ticket& ticket : state.tickets) {
      EXPECT_GT(ticket.first, last);
      EXPECT_GE(ticket.last, ticket.first);
      EXPECT_LT(ticket.last, kNext);
      EXPECT_TRUE(std::isfinite(ticket.duration_s) && ticket.duration_s >= 0.0);
      EXPECT_GE(ticket.second_from_s, 0.0);
      EXPECT_LE(ticket.second_from_s, ticket.duration_s);
      for (std::size_t i = 0; i < arm_.dof; ++i)
        EXPECT_TRUE(ticket.end.position_q[i] >= arm_.joints[i].lower_q - 1e-6 &&
                    ticket.end.position_q[i] <= arm_.joints[i].upper_q + 1e-6);
      EXPECT_TRUE(ticket.end.gripper >= -1e-6 && ticket.end.gripper <= 1.0 + 1e-6);
      last = ticket.last;
    }
  }
  /// Uses the state as a new servant does: everything pending ends, and the copy is readable again.
  void use(const InheritedState& state) {
    auto own = std::make_unique<ServantSegment>();
    own->next_command_id = kNext;
    Settings settings(own->state.settings);
    AlarmLog alarms;
    TicketTable tickets;
    alarms.keep_in(own->state.alarms);
    tickets.keep_in(own->state.tickets);
    if (state.settings) settings.inherit(*state.settings);
    alarms.inherit(state.alarms);
    tickets.inherit(state.tickets);
    EXPECT_EQ(alarms.list(), state.alarms);
    Snapshot now{};
    now.incarnation = kIncarnation;
    tickets.reconcile(now);
    EXPECT_EQ(tickets.pending(), 0u);
    const InheritedState again = read_inherited(*own, arm_, kNext);
    EXPECT_EQ(again.invalid, 0);
    EXPECT_EQ(again.alarms, state.alarms);
    EXPECT_EQ(again.tickets.size(), state.tickets.size());
  }

  const ArmModel arm_{load_profile(CORBOT_SHIPPED_PROFILE).arm};
  std::mt19937_64 random_;
  std::unique_ptr<ServantSegment> former_{std::make_unique<ServantSegment>()};
};

TEST_F(ForgedState, WhatAServantHasLeftIsReadWhole) {
  const InheritedState state = read_inherited(*former_, arm_, kNext);
  EXPECT_EQ(state.invalid, 0);
  ASSERT_TRUE(state.settings);
  EXPECT_EQ(state.settings->speed_ratio, 0.5);
  EXPECT_EQ(state.settings->tool_pitch_rad, 0.25);
  ASSERT_EQ(state.alarms.size(), kKeptAlarms);
  EXPECT_EQ(state.alarms.front().text, "alarm 37");
  EXPECT_FALSE(state.alarms.front().active);
  EXPECT_EQ(state.alarms.back().text, "alarm 100");
  EXPECT_TRUE(state.alarms.back().active);
  ASSERT_EQ(state.tickets.size(), kKeptTickets);
  EXPECT_EQ(state.tickets.back().last, kNext - 1);
  EXPECT_EQ(state.tickets.back().state, TicketState::kPending);
  const Ticket& ended = state.tickets[kKeptTickets - 11];
  EXPECT_EQ(ended.state, ended.last % 3 == 0 ? TicketState::kStopped : TicketState::kDone);
  EXPECT_EQ(ended.duration_s, static_cast<double>(ended.last));
  check(state);
  use(state);
}

/// Words of all kinds over the records, one to many.
TEST_F(ForgedState, RandomWordsAreNeverTakenOver) {
  const double kDoubles[] = {0.0,
                             -1.0,
                             1e300,
                             1e-300,
                             5.0,
                             std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::infinity(),
                             -std::numeric_limits<double>::infinity()};
  const auto original = std::make_unique<ServantSegment>();
  std::memcpy(static_cast<void*>(&original->state), bytes(), sizeof(ServantState));
  constexpr int kRounds = CORBOT_SANITIZED ? 50 : 200;
  for (int round = 0; round < kRounds && !HasFailure(); ++round) {
    std::memcpy(bytes(), static_cast<void*>(&original->state), sizeof(ServantState));
    const std::uint64_t changes = std::uint64_t{1} << below(14);
    for (std::uint64_t i = 0; i < changes; ++i) {
      const std::uint64_t kind = below(4);
      std::uint64_t word = kind == 0   ? random_()
                           : kind == 1 ? below(8)
                           : kind == 2 ? kFirst + below(kTickets)
                                       : 0;
      if (kind == 3) std::memcpy(&word, &kDoubles[below(std::size(kDoubles))], sizeof(word));
      std::memcpy(bytes() + 8 * below(sizeof(ServantState) / 8), &word, sizeof(word));
    }
    const InheritedState state = read_inherited(*former_, arm_, kNext);
    check(state);
    use(state);
  }
}

TEST_F(ForgedState, RandomBytesAreNeverTakenOver) {
  for (int round = 0; round < 50 && !HasFailure(); ++round) {
    for (std::size_t at = 0; at < sizeof(ServantState); at += 8) {
      const std::uint64_t word = random_();
      std::memcpy(bytes() + at, &word, sizeof(word));
    }
    former_->next_command_id = random_();
    const InheritedState state = read_inherited(*former_, arm_, kNext);
    check(state);
    use(state);
  }
}

TEST_F(ForgedState, OneRecordsBytesCostNoOtherRecord) {
  for (int round = 0; round < 200 && !HasFailure(); ++round) {
    const std::size_t place = below(kKeptTickets);
    const std::uint64_t id = kFirst + kKeptTickets + place;
    auto& cell = former_->state.tickets[place];
    const auto saved = std::make_unique<unsigned char[]>(sizeof(cell));
    std::memcpy(saved.get(), static_cast<void*>(&cell), sizeof(cell));
    auto* const begin = reinterpret_cast<unsigned char*>(&cell);
    for (std::size_t i = 0; i < sizeof(cell); ++i) begin[i] = static_cast<unsigned char>(random_());
    const InheritedState state = read_inherited(*former_, arm_, kNext);
    EXPECT_EQ(state.tickets.size(), kKeptTickets - 1) << id;
    EXPECT_EQ(state.alarms.size(), kKeptAlarms);
    EXPECT_TRUE(state.settings);
    EXPECT_EQ(state.invalid, 1);
    EXPECT_TRUE(std::none_of(state.tickets.begin(), state.tickets.end(),
                             [&](const Ticket& ticket) { return ticket.last == id; }));
    std::memcpy(static_cast<void*>(&cell), saved.get(), sizeof(cell));
  }
}

/// Each record is well written, and of no servant of this robot.
TEST_F(ForgedState, FramesThatThisArmCannotHaveAreLeftOut) {
  const PlanSettings good = to_settings([] {
    SettingsRecord record = to_record(PlanSettings{});
    record.frames_set = kSettingsToolFrame | kSettingsBaseFrame;
    record.tool_frame.position_m = {0.05, 0.0, 0.0};
    return record;
  }());
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const std::vector<std::function<void(SettingsRecord&)>> lies{
      [](SettingsRecord& r) { r.tool_frame.position_m[1] = std::nan(""); },
      [](SettingsRecord& r) { r.base_frame.position_m[0] = -101.0; },
      [](SettingsRecord& r) { r.tool_frame.position_m[2] = 11.0; },
      [](SettingsRecord& r) {
        r.tool_frame.orientation = {0.0, 0.0, 0.0, 0.0};
      },
      [](SettingsRecord& r) { r.base_frame.orientation.w = 1.0 + 1e-6; },
      [](SettingsRecord& r) {
        r.tool_frame.orientation = {0.5, -0.5, 0.5, 0.5};
      },  // this arm cannot take it
      [](SettingsRecord& r) { r.base_frame.orientation.x = kInfinity; },
      [](SettingsRecord& r) { r.frames_set = 4; }};
  former_->state.settings.store(to_record(good));
  ASSERT_TRUE(read_inherited(*former_, arm_, kNext).settings);
  for (std::size_t i = 0; i < lies.size(); ++i) {
    SettingsRecord record = to_record(good);
    lies[i](record);
    former_->state.settings.store(record);
    const InheritedState state = read_inherited(*former_, arm_, kNext);
    EXPECT_FALSE(state.settings) << i;
    EXPECT_GE(state.invalid, 1) << i;
  }
}

}  // namespace
}  // namespace corbot::forged_state_test
