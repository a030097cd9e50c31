// SPDX-License-Identifier: Apache-2.0
// The emulated drive against CiA 301 and CiA 402, frame by frame, without a bus and without a clock.
#include <gmock/gmock.h>

#include <random>

#include "support/cases.h"
#include "unit/can/node_fixture.h"

namespace corbot::sim {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
TEST(NewNode, Boots) {
  Cia402Node node(7, {});
  EXPECT_EQ(node.next_event_ns(), 0);
  node.advance(1);
  const auto sent = node.take_sent();
  ASSERT_EQ(sent.size(), 1u);
  EXPECT_EQ(sent[0].can_id, 0x707u);
  EXPECT_EQ(sent[0].can_dlc, 1);
  EXPECT_EQ(sent[0].data[0], 0);
  EXPECT_FALSE(node.next_event_ns());
}

TEST_F(Node, AnswersSdo) {
  EXPECT_EQ(read(0x1000), std::make_pair(0x43, 0x00020192u));
  EXPECT_EQ(read(0x6041), std::make_pair(0x4B, 0x0250u));
  EXPECT_EQ(read(0x6061), std::make_pair(0x4F, 0u));
  EXPECT_EQ(write(0x6060, 0, 8, 1), 0u);
  EXPECT_EQ(read(0x6061).second, 8u);
  EXPECT_THAT(say(0x604, {0x40, 0, 0x10, 0, 0, 0, 0, 0}), IsEmpty()) << "another node's";
  EXPECT_THAT(say(0x605, {0x40, 0, 0x10}), IsEmpty());
}

TEST_F(Node, AbortsWithTheRightCode) {
  EXPECT_EQ(read(0x2000), std::make_pair(0x80, kAbortNoObject));
  EXPECT_EQ(read(0x1018, 9), std::make_pair(0x80, kAbortNoSubIndex));
  EXPECT_EQ(write(0x1000, 0, 1, 4), kAbortReadOnly);
  EXPECT_EQ(write(0x6060, 0, 8, 4), kAbortTooLong);
  EXPECT_EQ(write(0x607A, 0, 8, 2), kAbortTooShort);
  EXPECT_EQ(write(0x60C2, 1, 0, 1), kAbortTooLow);
  EXPECT_EQ(write(0x60C2, 2, 1, 1), kAbortTooHigh);
  EXPECT_EQ(write(0x6060, 0, 3, 1), kAbortRange) << "a mode that it has not";
  EXPECT_EQ(number(say(0x605, {0xE0, 0, 0, 0, 0, 0, 0, 0}).at(0), 4, 4), kAbortCommand);
  EXPECT_EQ(number(say(0x605, {0x60, 0, 0, 0, 0, 0, 0, 0}).at(0), 4, 4), kAbortCommand);
  node_.abort_next(0x08000020);
  EXPECT_EQ(write(0x6060, 0, 8, 1), 0x08000020u);
  EXPECT_EQ(write(0x6060, 0, 8, 1), 0u);
}

TEST_F(Node, TellsItsNameInSegments) {
  EXPECT_EQ(read(0x1008), std::make_pair(0x41, 21u));
  std::string name;
  int toggle = 0;
  for (bool is_last = false; !is_last; toggle ^= 0x10) {
    const can_frame answer = say(0x605, {0x60 | toggle, 0, 0, 0, 0, 0, 0, 0}).at(0);
    ASSERT_EQ(answer.data[0] & 0xF0, toggle);
    is_last = (answer.data[0] & 1) != 0;
    name.append(reinterpret_cast<const char*>(answer.data) + 1, 7 - (answer.data[0] >> 1 & 7u));
  }
  EXPECT_EQ(name, "corbot emulated drive");
  EXPECT_EQ(read(0x1008).first, 0x41);
  EXPECT_EQ(number(say(0x605, {0x70, 0, 0, 0, 0, 0, 0, 0}).at(0), 4, 4), kAbortToggle);
}

TEST_F(Node, ObeysNetworkManagement) {
  EXPECT_EQ(write(0x1017, 0, 100, 2), 0u);
  EXPECT_EQ(wait_ms(100).at(0).data[0], 127);
  auto sent = say(0, {1, 0});
  ASSERT_EQ(sent.size(), 1u) << "TPDO1 as from the factory: the statusword, when it changes";
  EXPECT_EQ(sent[0].can_id, 0x185u);
  EXPECT_EQ(wait_ms(100).at(0).data[0], 5);
  say(0, {2, 4});
  EXPECT_EQ(wait_ms(100).at(0).data[0], 5) << "another node's";
  say(0, {2, 5});
  EXPECT_EQ(wait_ms(100).at(0).data[0], 4);
  EXPECT_EQ(read(0x1000).first, -1) << "no SDO while stopped";
  sent = say(0, {0x81, 5});
  ASSERT_EQ(sent.size(), 1u);
  EXPECT_EQ(sent[0].data[0], 0);
  EXPECT_EQ(read(0x1017).second, 0u) << "all is as after power-up";
}

TEST_F(Node, ResetsItsCommunicationOnly) {
  enable();
  EXPECT_EQ(write(0x1017, 0, 100, 2), 0u);
  EXPECT_EQ(write(0x6085, 0, 4'000'000, 4), 0u);
  const auto sent = say(0, {0x82, 5});
  ASSERT_EQ(sent.size(), 1u);
  EXPECT_EQ(sent[0].can_id, 0x705u);
  EXPECT_EQ(sent[0].data[0], 0);
  EXPECT_EQ(read(0x1017).second, 0u);
  EXPECT_EQ(read(0x1600, 2).second, 0u);
  EXPECT_EQ(read(0x6085).second, 4'000'000u);
  EXPECT_EQ(read(0x6061).second, 8u);
  EXPECT_EQ(node_.drive().state(), State::kOperationEnabled);
}

TEST_F(Node, ProtectsItsMapping) {
  EXPECT_EQ(write(0x1600, 0, 0, 1), kAbortState) << "the PDO is on";
  EXPECT_EQ(write(0x1400, 1, 0x206, 4), kAbortRange) << "the identifier of one that is on";
  EXPECT_EQ(write(0x1400, 1, 0x80000205, 4), 0u);
  EXPECT_EQ(write(0x1600, 1, 0x60400010, 4), kAbortState) << "the count is not 0";
  EXPECT_EQ(write(0x1600, 0, 0, 1), 0u);
  EXPECT_EQ(write(0x1600, 1, 0x60400020, 4), kAbortNotMappable) << "length";
  EXPECT_EQ(write(0x1600, 1, 0x60410010, 4), kAbortNotMappable) << "direction";
  EXPECT_EQ(write(0x1600, 1, 0x20000010, 4), kAbortNoObject);
  for (int sub = 1; sub <= 3; ++sub) EXPECT_EQ(write(0x1600, sub, 0x607A0020, 4), 0u);
  EXPECT_EQ(write(0x1600, 0, 3, 1), kAbortPdoLength);
  EXPECT_EQ(write(0x1600, 0, 4, 1), kAbortNotMappable) << "the fourth is empty";
  EXPECT_EQ(write(0x1600, 0, 2, 1), 0u);
  EXPECT_EQ(write(0x1400, 2, 245, 1), kAbortRange);
  EXPECT_EQ(write(0x1400, 1, 0x205, 4), 0u);
}

TEST_F(Node, TakesAndSendsProcessDataAtSync) {
  enable();
  const auto sent = cycle(15, 100);
  ASSERT_EQ(sent.size(), 1u);
  EXPECT_EQ(sent[0].can_id, 0x185u);
  EXPECT_EQ(sent[0].can_dlc, 6);
  EXPECT_EQ(number(sent[0], 0, 2), 0x1237u);
  wait_ms(50);
  EXPECT_EQ(static_cast<int>(number(cycle(15, 100).at(0), 2, 4)), 100);
  say(0, {0x80, 5});
  EXPECT_THAT(say(0x080, {}), IsEmpty()) << "PDOs only while operational";
}

TEST_F(Node, ReportsAPdoThatIsTooShort) {
  enable();
  (void)say(0x205, {15, 0, 1});
  const auto sent = say(0x080, {});
  ASSERT_FALSE(sent.empty());
  EXPECT_EQ(sent[0].can_id, 0x85u);
  EXPECT_EQ(number(sent[0], 0, 2), 0x8210u);
}

TEST_F(Node, GoesThroughTheStates) {
  enable();
  cycle(7, 0);
  EXPECT_EQ(node_.drive().state(), State::kSwitchedOn);
  cycle(15, 0);
  cycle(6, 0);
  EXPECT_EQ(node_.drive().state(), State::kReadyToSwitchOn);
  cycle(0, 0);
  EXPECT_EQ(node_.drive().state(), State::kSwitchOnDisabled);
  cycle(15, 0);
  EXPECT_EQ(node_.drive().state(), State::kSwitchOnDisabled) << "no short cut";
}

TEST_F(Node, StopsQuicklyOnARamp) {
  enable();
  for (int i = 1; i <= 20; ++i) cycle(15, 200 * i);
  const int before = node_.drive().position();
  cycle(0x0B, 4200);
  EXPECT_EQ(node_.drive().state(), State::kQuickStopActive);
  wait_ms(100);
  EXPECT_EQ(node_.drive().state(), State::kSwitchOnDisabled);
  EXPECT_GT(node_.drive().position(), before) << "not at once";
  EXPECT_LT(node_.drive().position(), before + 5000);
}

TEST_F(Node, FailsAndIsResetByAnEdge) {
  enable();
  node_.emergency(0x3210, now_ns_);
  auto sent = node_.take_sent();
  ASSERT_FALSE(sent.empty());
  EXPECT_EQ(sent[0].can_id, 0x85u);
  EXPECT_EQ(number(sent[0], 0, 3), 0x013210u);
  wait_ms(10);
  EXPECT_EQ(node_.drive().state(), State::kFault);
  EXPECT_EQ(read(0x603F).second, 0x3210u);
  cycle(0, 0);
  sent = cycle(0x80, 0);
  EXPECT_EQ(node_.drive().state(), State::kSwitchOnDisabled);
  EXPECT_TRUE(std::any_of(sent.begin(), sent.end(),
                          [&](const can_frame& f) { return f.can_id == 0x85 && number(f, 0, 2) == 0; }));
  node_.emergency(0x3210, now_ns_);
  (void)node_.take_sent();
  cycle(0x80, 0);
  EXPECT_EQ(node_.drive().state(), State::kFault) << "the bit is held";
  cycle(0, 0);
  cycle(0x80, 0);
  EXPECT_EQ(node_.drive().state(), State::kSwitchOnDisabled);
}

TEST_F(Node, ReactsWhenItsMasterFallsSilent) {
  const std::pair<std::uint32_t, State> reactions[] = {{0, State::kOperationEnabled},
                                                       {1, State::kFault},
                                                       {2, State::kSwitchOnDisabled},
                                                       {3, State::kSwitchOnDisabled}};
  for (const auto& [reaction, state] : reactions) {
    say(0, {0x81, 5});
    enable();
    EXPECT_EQ(write(0x6007, 0, reaction, 2), 0u);
    EXPECT_EQ(write(0x1016, 1, 0x7F0064, 4), 0u);
    wait_ms(300);
    EXPECT_EQ(node_.drive().state(), State::kOperationEnabled) << "it begins with the first heartbeat";
    for (int i = 0; i < 5; ++i) {
      (void)say(0x77F, {5});
      EXPECT_THAT(wait_ms(99), IsEmpty());
    }
    EXPECT_EQ(node_.drive().state(), State::kOperationEnabled);
    const auto sent = wait_ms(20);
    ASSERT_FALSE(sent.empty()) << reaction;
    EXPECT_EQ(sent[0].can_id, 0x85u);
    EXPECT_EQ(number(sent[0], 0, 2), 0x8130u);
    EXPECT_EQ(node_.drive().state(), state) << reaction;
  }
}

TEST_F(Node, WarnsAndGoesOn) {
  enable();
  node_.emergency(0x8120, now_ns_);
  EXPECT_EQ(node_.take_sent().at(0).can_id, 0x85u);
  EXPECT_EQ(node_.drive().state(), State::kOperationEnabled);
  EXPECT_NE(number(cycle(15, 0).at(0), 0, 2) & 0x80u, 0u);
}

TEST_F(Node, FailsWhenItCannotFollow) {
  enable();
  cycle(15, 500'000);
  wait_ms(100);
  EXPECT_EQ(node_.drive().error_code(), Cia402Drive::kFollowingError);
  EXPECT_NE(node_.drive().statusword() & 1u << 13, 0u);
}

TEST_F(Node, KeepsItsPositionLimit) {
  enable();
  EXPECT_EQ(write(0x607D, 2, 1000, 4), 0u);
  for (int i = 1; i <= 20; ++i) cycle(15, 100 * i);
  wait_ms(50);
  EXPECT_EQ(node_.drive().position(), 1000);
  EXPECT_NE(number(cycle(15, 2000).at(0), 0, 2) & 1u << 11, 0u);
}

TEST_F(Node, KeepsItsShaftWhenItsPowerFails) {
  enable();
  for (int i = 1; i <= 20; ++i) cycle(15, 100 * i);
  wait_ms(50);
  node_.power_cycle(now_ns_);
  EXPECT_EQ(node_.take_sent().at(0).can_id, 0x705u);
  EXPECT_EQ(node_.drive().state(), State::kSwitchOnDisabled);
  EXPECT_EQ(node_.drive().position(), 2000);
}

TEST_F(Node, ABlockedShaftStaysAndFollowsWhenItIsFree) {
  enable();
  node_.set_blocked(true, now_ns_);
  for (int i = 1; i <= 20; ++i) cycle(15, 100 * i);
  wait_ms(2000);
  EXPECT_EQ(node_.drive().position(), 0);
  EXPECT_EQ(node_.drive().demand(), 2000);
  EXPECT_EQ(node_.drive().state(), State::kOperationEnabled) << "the drive's own window is 20 degrees";
  node_.set_blocked(false, now_ns_);
  wait_ms(50);
  EXPECT_EQ(node_.drive().position(), 2000);
}

TEST_F(Node, SaysThatItIgnoresItsTargets) {
  enable();
  EXPECT_NE(number(cycle(15, 0).at(0), 0, 2) & 1u << 12, 0u);
  node_.set_ignoring(true, now_ns_);
  for (int i = 1; i <= 20; ++i) cycle(15, 100 * i);
  EXPECT_EQ(node_.drive().position(), 0);
  EXPECT_EQ(number(cycle(15, 2000).at(0), 0, 2) & 1u << 12, 0u);
  EXPECT_EQ(node_.drive().state(), State::kOperationEnabled);
  node_.set_ignoring(false, now_ns_);
  cycle(15, 2000);
  wait_ms(50);
  EXPECT_EQ(node_.drive().position(), 2000);
}

TEST_F(Node, SurvivesRandomFrames) {
  std::mt19937_64 random(test::seed());
  const canid_t ids[] = {0, 0x80, 0x205, 0x305, 0x605, 0x605, 0x605, 0x605};
  const std::uint16_t indices[] = {0x1017, 0x1400, 0x1600, 0x1800, 0x1A00,
                                   0x6040, 0x6060, 0x607A, 0x60C2, 0x1008};
  std::size_t sent = 0;
  const int frames = test::cases(1'000'000);
  for (int i = 0; i < frames; ++i) {
    can_frame frame{};
    const std::uint64_t dice = random();
    frame.can_id = ids[dice % 8];
    frame.can_dlc = static_cast<std::uint8_t>(dice >> 8 & 15);
    for (std::uint8_t& byte : frame.data) byte = static_cast<std::uint8_t>(random());
    if (frame.can_id == 0x605 && (dice & 1 << 20) != 0) {
      frame.can_dlc = 8;
      frame.data[0] = static_cast<std::uint8_t>(1 << (5 + (dice >> 24) % 2) | (dice >> 32 & 0xF));
      const std::uint16_t index = indices[(dice >> 40) % 10];
      frame.data[1] = static_cast<std::uint8_t>(index);
      frame.data[2] = static_cast<std::uint8_t>(index >> 8);
      frame.data[3] = static_cast<std::uint8_t>((dice >> 48) % 3);
    }
    node_.receive(frame, now_ns_ += 20'000);
    sent += node_.take_sent().size();
  }
  EXPECT_GT(sent, static_cast<std::size_t>(frames / 100));
}

}  // namespace
}  // namespace corbot::sim
