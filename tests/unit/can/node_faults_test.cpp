// SPDX-License-Identifier: Apache-2.0
// The faults and the peculiarities that the emulated drive can be given, and its homing.
#include "unit/can/node_fixture.h"

namespace corbot::sim {
namespace {

constexpr unsigned kVoltage = 1u << 4;
constexpr unsigned kAttained = 1u << 12;
constexpr unsigned kHomingError = 1u << 13;

class FaultyNode : public Node {
 protected:
  template <class Change>
  void rules(const Change& change) {
    node_.change_rules(change);
  }
  unsigned statusword() { return read(0x6041).second; }
  /// In homing mode, by these methods and speeds; until it ends.
  void home(int method, int offset = 0) {
    EXPECT_EQ(write(0x6098, 0, static_cast<std::uint32_t>(method), 1), 0u);
    EXPECT_EQ(write(0x607C, 0, static_cast<std::uint32_t>(offset), 4), 0u);
    EXPECT_EQ(write(0x6060, 0, 6, 1), 0u);
    cycle(0x0F, 0);
    cycle(0x1F, 0);
    for (int i = 0; i < 60'000 && (statusword() & (kAttained | kHomingError)) == 0; ++i) {
      node_.advance(now_ns_ += 1'000'000);
    }
  }
};

TEST_F(FaultyNode, StaysDisabledWhenItsTorqueIsReleased) {
  enable();
  node_.set_sto(true, now_ns_);
  EXPECT_EQ(node_.drive().state(), State::kSwitchOnDisabled);
  EXPECT_EQ(statusword() & kVoltage, 0u);
  EXPECT_TRUE(node_.turn(-700, now_ns_));
  cycle(6, 0);
  EXPECT_EQ(node_.drive().state(), State::kSwitchOnDisabled) << "no way out of it";
  node_.set_sto(false, now_ns_);
  cycle(15, 0);
  EXPECT_EQ(node_.drive().state(), State::kSwitchOnDisabled);
  EXPECT_EQ(statusword() & kVoltage, kVoltage);
  EXPECT_EQ(node_.drive().position(), -700);
  for (const int word : {6, 7, 15}) cycle(word, -700);
  EXPECT_EQ(node_.drive().state(), State::kOperationEnabled);
  EXPECT_FALSE(node_.turn(-700, now_ns_)) << "its motor holds it";
}

TEST_F(FaultyNode, LeavesOperationUnasked) {
  enable();
  node_.leave_operation(now_ns_);
  EXPECT_EQ(node_.drive().state(), State::kSwitchOnDisabled);
  EXPECT_EQ(statusword() & kVoltage, kVoltage);
}

TEST_F(FaultyNode, RefusesWritesAtTheWrongTime) {
  rules([](ObjectRules& r) {
    r.set_when({0x60C2, {}}, WriteWhen::kModeInactive);
    r.set_when({0x1017, {}}, WriteWhen::kPreOperational);
    r.set_when({0x1006, {}}, WriteWhen::kPdosOff);
    r.set_when({0x6085, {}}, WriteWhen::kDisabled);
    r.set_when({0x1005, {}}, WriteWhen::kNever);
  });
  EXPECT_EQ(write(0x60C2, 1, 2, 1), 0u) << "there is no mode yet";
  EXPECT_EQ(write(0x1006, 0, 1000, 4), kAbortState) << "from the factory the first PDOs are on";
  EXPECT_EQ(write(0x1400, 1, 0x80000205, 4), 0u);
  EXPECT_EQ(write(0x1800, 1, 0x80000185, 4), 0u);
  EXPECT_EQ(write(0x1006, 0, 1000, 4), 0u);
  EXPECT_EQ(write(0x1005, 0, 0x80, 4), kAbortReadOnly);
  EXPECT_EQ(write(0x1017, 0, 100, 2), 0u);
  EXPECT_EQ(write(0x6085, 0, 1000, 4), 0u);
  enable();
  EXPECT_EQ(write(0x60C2, 1, 1, 1), kAbortState);
  EXPECT_EQ(write(0x1017, 0, 200, 2), kAbortState);
  EXPECT_EQ(write(0x6085, 0, 2000, 4), kAbortState);
  EXPECT_EQ(write(0x60C2, 9, 1, 1), kAbortNoSubIndex) << "what is not there comes first";
}

TEST_F(FaultyNode, LacksObjectsAndKeepsWhatIsStored) {
  rules([](ObjectRules& r) {
    r.set_missing({0x60C2, {}}, true);
    r.set_missing({0x1018, std::uint8_t{4}}, true);
    r.set_unanswered({0x6502, {}}, true);
  });
  EXPECT_TRUE(node_.store(0x101801, 0x2A, now_ns_));
  EXPECT_FALSE(node_.store(0x606000, 0x100, now_ns_)) << "it has one byte";
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(read(0x60C2, 1), std::make_pair(0x80, kAbortNoObject));
    EXPECT_EQ(read(0x1018, 4), std::make_pair(0x80, kAbortNoSubIndex));
    EXPECT_EQ(read(0x1018, 1).second, 0x2Au);
    EXPECT_EQ(read(0x6502).first, -1);
    say(0, {0x81, 5});
  }
  rules([](ObjectRules& r) { r.set_missing({0x60C2, {}}, false); });
  EXPECT_EQ(read(0x60C2, 1).second, 1u);
}

TEST_F(FaultyNode, AbortsOneQuery) {
  node_.abort_next(0x08000020, ObjectPattern{0x1017, {}});
  EXPECT_EQ(write(0x6060, 0, 8, 1), 0u);
  EXPECT_EQ(write(0x1017, 0, 100, 2), 0x08000020u);
  EXPECT_EQ(write(0x1017, 0, 100, 2), 0u);
}

TEST_F(FaultyNode, IsHomedToItsSwitches) {
  enable();
  node_.set_switches({2'000.0, -3'000.0, 4'000.0});
  home(19, 500);
  EXPECT_EQ(statusword() & (kAttained | kHomingError), kAttained);
  EXPECT_NEAR(node_.drive().position(), 500, 20);
  EXPECT_TRUE(wait_ms(100).empty());
  EXPECT_EQ(node_.drive().error_code(), 0);
  home(17, -100);
  EXPECT_EQ(statusword() & (kAttained | kHomingError), kAttained);
  EXPECT_NEAR(node_.drive().position(), -100, 20);
  node_.set_switches({1e6, -3'000.0, 4'000.0});
  home(19);
  EXPECT_EQ(statusword() & (kAttained | kHomingError), kHomingError) << "the axis ends before its switch";
}

TEST_F(FaultyNode, IsHomedWhereItStandsUntilItsPowerFails) {
  node_.set_incremental(true);
  enable();
  for (int i = 1; i <= 20; ++i) cycle(15, 100 * i);
  wait_ms(50);
  EXPECT_EQ(write(0x6060, 0, 6, 1), 0u);
  EXPECT_EQ(statusword() & kAttained, 0u);
  home(37, 250);
  EXPECT_EQ(node_.drive().position(), 250);
  EXPECT_EQ(write(0x6060, 0, 8, 1), 0u);
  EXPECT_EQ(write(0x6060, 0, 6, 1), 0u);
  EXPECT_EQ(statusword() & kAttained, kAttained) << "also when the mode has changed meanwhile";
  node_.power_cycle(now_ns_);
  (void)node_.take_sent();
  EXPECT_EQ(node_.drive().position(), 0);
  EXPECT_EQ(write(0x6060, 0, 6, 1), 0u);
  EXPECT_EQ(statusword() & kAttained, 0u);
  EXPECT_EQ(write(0x6098, 0, 34, 1), kAbortRange) << "a method that it has not";
}

TEST_F(FaultyNode, IsHaltedWhileItIsHomed) {
  enable();
  EXPECT_EQ(write(0x6098, 0, 19, 1), 0u);
  EXPECT_EQ(write(0x6060, 0, 6, 1), 0u);
  cycle(0x0F, 0);
  cycle(0x1F, 0);
  wait_ms(300);
  EXPECT_GT(node_.drive().position(), 100);
  cycle(0x11F, 0);
  wait_ms(300);
  const int at = node_.drive().position();
  wait_ms(300);
  EXPECT_EQ(node_.drive().position(), at);
  EXPECT_EQ(statusword() & kAttained, 0u);
  EXPECT_EQ(node_.drive().state(), State::kOperationEnabled);
}

}  // namespace
}  // namespace corbot::sim
