// SPDX-License-Identifier: Apache-2.0
// Tests the safety of a person beside the arm with every device: no power and no motion without a Clear.
#include <iostream>
#include <random>

#include "contract/contract.h"
#include "support/cases.h"

namespace corbot::test {
namespace {

class Standby : public Contract {
 protected:
  void SetUp() override {
    Contract::SetUp();
    if (IsSkipped()) return;
    open();
    ASSERT_TRUE(arrives()) << off();
  }
  /// Returns true if each output from `from` on is the servo's previous one, or nothing. The target of a
  /// drive without power may become the position of its shaft.
  [[nodiscard]] bool is_nothing_new(std::size_t from) {
    const double most = facts_.takes_power_off ? 0.01 : facts_.unit + facts_.noise;
    const std::vector<Output> seen = fixture_->outputs();
    std::vector<double> last(kMaxServos, NAN);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      double& value = last[seen[i].servo];
      const bool is_off = seen[i].value <= 0.0 && !facts_.takes_joints;
      if (i >= from && !is_off && std::abs(seen[i].value - value) > most) return false;
      if (!is_off) value = seen[i].value;
    }
    return true;
  }
  [[nodiscard]] bool comes_back() { return reaches(BackendHealth::kOpen) && arrives(); }
};

TEST_P(Standby, NothingIsEnergisedOrMovedBetweenALossAndClear) {
  if (!facts_.pluggable) GTEST_SKIP() << "skipped: this plug cannot be pulled";
  const std::size_t from = fixture_->outputs().size();
  lose_and_find(0.4);
  ASSERT_TRUE(wait_until(within(20), [&] { return !facts_.takes_power_off || !fixture_->is_energised(); }));
  const bool was_energised = fixture_->is_energised();
  EXPECT_TRUE(rests(300));
  EXPECT_EQ(fixture_->is_energised(), was_energised);
  EXPECT_EQ(backend_->health(), BackendHealth::kStandby);
  EXPECT_TRUE(backend_->cause() != DeviceCause::kNone || GetParam().name == "loopback") << "why it was lost";
  EXPECT_TRUE(is_nothing_new(from));
  const std::int64_t cleared_ns = std::chrono::steady_clock::now().time_since_epoch().count();
  driver_->clear();
  ASSERT_TRUE(comes_back()) << off();
  EXPECT_TRUE(fixture_->is_energised());
  EXPECT_LE(worst_jump(fixture_->outputs(), from, cleared_ns), 0.0);
}

TEST_P(Standby, NothingIsMovedBetweenAPressAndClear) {
  const std::size_t from = fixture_->outputs().size();
  driver_->set_emergency_stop(true);
  if (facts_.takes_power_off) {
    ASSERT_TRUE(reaches(BackendHealth::kStandby));
    EXPECT_TRUE(wait_until(within(20), [&] { return !fixture_->is_energised(); }));
  }
  EXPECT_TRUE(rests(300));
  if (!facts_.takes_power_off) {
    EXPECT_EQ(backend_->health(), BackendHealth::kOpen) << "it holds the arm";
    EXPECT_TRUE(fixture_->is_energised());
  }
  EXPECT_TRUE(is_nothing_new(from));
  const std::int64_t cleared_ns = std::chrono::steady_clock::now().time_since_epoch().count();
  driver_->set_emergency_stop(false);
  ASSERT_TRUE(comes_back()) << off();
  EXPECT_TRUE(wait_until(within(20), [&] { return fixture_->is_energised(); }));
  EXPECT_LE(worst_jump(fixture_->outputs(), from, cleared_ns), 0.0);
}

TEST_P(Standby, WithAFrozenCycleAPressTakesTheEnergyWhereThatCanBe) {
  driver_->freeze(true);
  stop_.set(StopSource::kGpio, true);
  if (facts_.takes_power_off) {
    EXPECT_TRUE(wait_until(within(20), [&] { return !fixture_->is_energised(); }));
    EXPECT_NE(backend_->health(), BackendHealth::kOpen);
  } else {
    EXPECT_EQ(backend_->health(), BackendHealth::kOpen);
    EXPECT_TRUE(fixture_->is_energised());
  }
  stop_.set(StopSource::kGpio, false);
  driver_->set_emergency_stop(true);  // as the cycle does when it goes on
  driver_->freeze(false);
  EXPECT_TRUE(rests(200));
  driver_->set_emergency_stop(false);
  EXPECT_TRUE(comes_back()) << off();
}

TEST_P(Standby, SaysWhereTheServosAreThoughNothingIsReadBackElse) {
  if (!facts_.pluggable) GTEST_SKIP() << "skipped: this plug cannot be pulled";
  lose_and_find();
  ASSERT_TRUE(runs(200));
  if (facts_.has_encoders) {
    ASSERT_TRUE(wait_until(within(20), [&] { return driver_->feedback().measured; }));
  }
  const ServoFeedback feedback = driver_->feedback();
  EXPECT_EQ(feedback.measured, facts_.has_encoders);
  for (std::size_t i = 0; (feedback.measured || feedback.commanded) && i < profile_.arm.dof; ++i) {
    EXPECT_NEAR(feedback.position_q[i], home_.position_q[i], 0.02) << i;
  }
}

TEST_P(Standby, AStopAtAnyInstantOfTheWayBackHaltsIt) {
  if (!facts_.pluggable) GTEST_SKIP() << "skipped: this plug cannot be pulled";
  std::mt19937_64 random(test::drawn_seed());
  lose_and_find(0.4);
  for (int i = 0; i < 3; ++i) {
    driver_->set_emergency_stop(false);
    driver_->clear();
    ASSERT_TRUE(runs(std::uniform_int_distribution<std::uint64_t>(0, 700)(random)));
    driver_->set_emergency_stop(true);
    // A controller on a slow line gets a frame in 100 ms.
    EXPECT_TRUE(wait_until(within(10), [&] { return rests(200); })) << i;
    const bool is_open = backend_->health() == BackendHealth::kOpen;
    EXPECT_TRUE(backend_->health() == BackendHealth::kStandby || (is_open && !facts_.takes_power_off)) << i;
    if (is_open) {
      EXPECT_LE(off(), half_a_unit()) << "open is there";
    }
  }
  driver_->set_emergency_stop(false);
  EXPECT_TRUE(comes_back()) << off();
}

TEST_P(Standby, IsLostAgainAndFoundAgain) {
  if (!facts_.pluggable) GTEST_SKIP() << "skipped: this plug cannot be pulled";
  lose_and_find();
  const std::size_t from = fixture_->outputs().size();
  lose_and_find(0.3);
  EXPECT_TRUE(rests(200));
  EXPECT_TRUE(is_nothing_new(from));
  driver_->clear();
  EXPECT_TRUE(comes_back()) << off();
}

TEST_P(Standby, Closes) {
  if (!facts_.pluggable) GTEST_SKIP() << "skipped: this plug cannot be pulled";
  lose_and_find();
  driver_->end();
  backend_->close();
  EXPECT_EQ(backend_->health(), BackendHealth::kClosed);
}

TEST_P(Standby, AStartInErrorWaitsForClear) {
  driver_->end();
  driver_.reset();
  backend_->close();
  make_backend();
  const std::size_t from = fixture_->outputs().size();
  ServoFrame first = Driver::frame(profile_.arm, home_);
  first.needs_clear = first.power_off = true;
  backend_->open(first);
  EXPECT_EQ(backend_->health(), BackendHealth::kStandby);
  driver_ = std::make_unique<Driver>(profile_.arm, *backend_, *fixture_, home_);
  driver_->set_emergency_stop(true);
  driver_->start();
  EXPECT_TRUE(wait_until(within(20), [&] { return !facts_.takes_power_off || !fixture_->is_energised(); }));
  // The outputs that the previous end has switched off stay off.
  EXPECT_TRUE(wait_until(within(20), [&] { return rests(100); }));
  EXPECT_TRUE(rests(300));
  EXPECT_EQ(backend_->health(), BackendHealth::kStandby);
  EXPECT_TRUE(is_nothing_new(from));
  driver_->set_emergency_stop(false);
  EXPECT_TRUE(comes_back()) << off();
}

TEST_P(Standby, TellsWhichFrameTheDeviceHasAndThatItKeepsUp) {
  const std::uint64_t cycle = driver_->cycles();
  EXPECT_TRUE(wait_until(within(20), [&] { return backend_->times().cycle >= cycle; }));
  const std::uint64_t taken = backend_->times().cycle;
  EXPECT_LE(taken, driver_->cycles() + 1) << "it is being written";
  EXPECT_TRUE(wait_until(within(60), [&] { return backend_->times().speed_ratio == 1.0; }));
  driver_->move(pose(1600.0), 0.2);
  ASSERT_TRUE(wait_until(within(20), [&] { return !driver_->moving(); }));
  const std::uint64_t last = driver_->cycles() + 1;
  ASSERT_TRUE(wait_until(within(20), [&] { return backend_->times().cycle >= last; }));
  EXPECT_TRUE(arrives()) << off();
}

INSTANTIATE_TEST_SUITE_P(Backends, Standby, ::testing::ValuesIn(all_fixtures()),
                         [](const auto& test) { return test.param.name; });
INSTANTIATE_TEST_SUITE_P(Slides, Standby, ::testing::ValuesIn(sliding_fixtures()),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace corbot::test
