// SPDX-License-Identifier: Apache-2.0
// Tests what the arm may expect of every backend, whatever its device.
#include <gmock/gmock.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <random>
#include <sstream>
#include <utility>

#include "contract/contract.h"
#include "support/cases.h"

namespace corbot::test {

namespace {

namespace fs = std::filesystem;

std::size_t entries(const std::string& directory) {
  const auto begin = fs::directory_iterator(directory);
  return static_cast<std::size_t>(std::distance(begin, fs::directory_iterator()));
}
std::string describe_files() {
  std::string all;
  for (const auto& entry : fs::directory_iterator("/proc/self/fd")) {
    std::error_code gone;
    all += entry.path().filename().string() + " " + fs::read_symlink(entry, gone).string() + ", ";
  }
  return all;
}

bool says_where(const ServoFeedback& feedback) { return feedback.measured || feedback.commanded; }

TEST_P(Contract, TellsItsHealthAndItsName) {
  EXPECT_EQ(backend_->health(), BackendHealth::kClosed);
  EXPECT_EQ(backend_->name(), profile_.backend.kind);
  open();
  EXPECT_EQ(backend_->health(), BackendHealth::kOpen);
  EXPECT_EQ(backend_->cause(), DeviceCause::kNone);
  EXPECT_TRUE(arrives()) << off();
  driver_->end();
  backend_->close();
  backend_->close();
  EXPECT_EQ(backend_->health(), BackendHealth::kClosed);
}

TEST_P(Contract, HandsOverInOrderAndEndsOnTheNewest) {
  driver_.reset();
  home_ = pose(1300.0);
  open();
  ASSERT_TRUE(arrives()) << off();
  const std::size_t begin = fixture_->outputs().size();
  driver_->move(pose(1700.0), 1.5);
  ASSERT_TRUE(wait_until(within(30), [&] { return !driver_->moving(); }));
  ASSERT_TRUE(arrives()) << off();
  // A hold after the motion shows what was still under way.
  const std::uint64_t frames = backend_->times().frames;
  ASSERT_TRUE(wait_until(within(30), [&] { return backend_->times().frames > frames + 10; }));
  EXPECT_LE(off(), half_a_unit()) << "nothing old came after the newest";
  const std::vector<Output> seen = fixture_->outputs();
  std::vector<double> last(kMaxServos, -HUGE_VAL);
  std::vector<double> sign(kMaxServos, 1.0);
  for (std::size_t i = 0; facts_.takes_joints && i < profile_.arm.dof; ++i) {
    sign[i] = profile_.arm.servos[i].direction;
  }
  for (std::size_t i = begin; i < seen.size(); ++i) {
    const double value = seen[i].value * sign[seen[i].servo];
    EXPECT_GE(value + facts_.noise, last[seen[i].servo]) << "servo " << seen[i].servo;
    last[seen[i].servo] = std::max(last[seen[i].servo], value);
  }
}

TEST_P(Contract, FollowsAtItsRate) {
  constexpr double kSeconds = 1.5;
  constexpr double kWay_us = 400.0;
  const double unit_us =
      facts_.takes_joints ? facts_.unit * profile_.arm.servos[0].us_per_q : facts_.unit + 2.0 * facts_.noise;
  // A machine that is busy delays frames; one in a while it is not.
  const double wanted = 0.5 * std::min({kSeconds / facts_.period_s, kWay_us / unit_us, 100.0});
  home_ = pose(1300.0);
  open();
  ASSERT_TRUE(arrives()) << off();
  double to_us = 1300.0 + kWay_us;
  std::ptrdiff_t found = 0;
  EXPECT_TRUE(wait_until(within(60),
                         [&] {
                           const std::size_t begin = fixture_->outputs().size();
                           driver_->move(pose(std::exchange(to_us, 3000.0 - to_us)), kSeconds);
                           if (!wait_until(within(30), [&] { return !driver_->moving(); }) || !arrives())
                             return false;
                           const std::vector<Output> seen = fixture_->outputs();
                           found =
                               std::count_if(seen.begin() + static_cast<std::ptrdiff_t>(begin), seen.end(),
                                             [](const Output& output) { return output.servo == 0; });
                           return static_cast<double>(found) >= wanted;
                         }))
      << found << " outputs of the first servo, " << wanted << " wanted";
}

TEST_P(Contract, KeepsItsRateAndTellsTheAge) {
  open();
  ASSERT_TRUE(wait_until(within(30), [&] { return backend_->times().frames > 0; })) << "those of the cycle";
  const std::uint64_t before = backend_->times().frames;
  const auto begin = std::chrono::steady_clock::now();
  const auto wanted = static_cast<std::uint64_t>(1.0 / facts_.period_s);
  ASSERT_TRUE(wait_until(within(30), [&] { return backend_->times().frames >= before + wanted; }));
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const double most = seconds / facts_.period_s * 1.02 + 3.0;
  EXPECT_LE(static_cast<double>(backend_->times().frames - before), most) << "more than the bus carries";
  const BackendTimes times = backend_->times();
  EXPECT_GE(times.age_ns, 0);
  EXPECT_GE(times.age_max_ns, times.age_ns);
}

TEST_P(Contract, IsWithinHalfAUnit) {
  open();
  std::mt19937_64 random(test::drawn_seed());
  for (int i = 0; i < 10; ++i) {
    std::vector<double> pulses;
    for (std::size_t servo = 0; servo <= profile_.arm.dof; ++servo) {
      pulses.push_back(std::uniform_real_distribution<double>(1100.0, 1900.0)(random));
    }
    driver_->move(pose(pulses), 0.3);
    EXPECT_TRUE(arrives()) << off() << " off, unit " << facts_.unit;
  }
}

TEST_P(Contract, ReadsBackWhereTheServosAre) {
  open();
  if (facts_.read_unit == 0.0) {
    EXPECT_FALSE(says_where(driver_->feedback()));
    return;
  }
  driver_->move(pose(1620.0), 0.3);
  ASSERT_TRUE(arrives()) << off();
  const auto off_measured = [&] {
    const ServoFeedback feedback = driver_->feedback();
    if (!says_where(feedback) || feedback.time_ns == 0) return HUGE_VAL;
    double worst = 0.0;
    for (std::size_t i = 0; i < profile_.arm.dof; ++i) {
      const double scale = facts_.takes_joints ? 1.0 : profile_.arm.servos[i].us_per_q;
      worst = std::max(worst, scale * std::abs(feedback.position_q[i] - driver_->pose().position_q[i]));
    }
    return worst;
  };
  // Two roundings: what was put out, and what was read.
  const double bound = 0.5001 * (facts_.unit + facts_.read_unit);
  EXPECT_TRUE(wait_until(within(20), [&] { return off_measured() <= bound; })) << off_measured();
  EXPECT_EQ(backend_->has_encoders(), facts_.has_encoders);
  EXPECT_EQ(driver_->feedback().measured, facts_.has_encoders) << "what a controller sends is no measurement";
  EXPECT_EQ(driver_->feedback().commanded, !facts_.has_encoders);
}

TEST_P(Contract, SurvivesPulledPlugs) {
  if (!facts_.pluggable) GTEST_SKIP() << "skipped: this plug cannot be pulled";
  open();
  ASSERT_TRUE(arrives());
  std::mt19937_64 random(test::drawn_seed());
  const char* times = std::getenv("CORBOT_PLUGS");
  const int rounds = times != nullptr ? std::atoi(times) : 3;
  const std::size_t files = entries("/proc/self/fd");
  const std::string files_before = describe_files();
  const std::size_t threads = entries("/proc/self/task");
  for (int i = 0; i < rounds; ++i) {
    driver_->move(pose(i % 2 == 0 ? 1800.0 : 1200.0), 1.0);
    const timespec pause{0, std::uniform_int_distribution<long>(0, 900'000'000)(random)};
    ::nanosleep(&pause, nullptr);
    driver_->leave();
    fixture_->unplug();
    ASSERT_TRUE(reaches(BackendHealth::kLost)) << i;
    EXPECT_FALSE(backend_->drain_log().empty() && GetParam().name != "loopback")
        << "the operator reads of it";
    EXPECT_TRUE(wait_until(within(20), [&] { return !says_where(driver_->feedback()); })) << "nothing stale";
    ASSERT_TRUE(wait_until(within(20), [&] { return !driver_->moving(); }));
    // As after a bus that had stalled before it was lost: the arm was to be further on.
    Pose further = driver_->pose();
    further.position_q[0] += as_far_q(0.4);
    driver_->move(further, 0.0);
    const std::size_t from = fixture_->outputs().size();
    const std::int64_t plugged_ns = std::chrono::steady_clock::now().time_since_epoch().count();
    fixture_->plug();
    ASSERT_TRUE(reaches(BackendHealth::kStandby)) << i;
    driver_->clear();
    ASSERT_TRUE(reaches(BackendHealth::kOpen)) << i;
    ASSERT_TRUE(arrives()) << i << ": " << off();
    EXPECT_LE(worst_jump(fixture_->outputs(), from, plugged_ns), 0.0) << i;
  }
  // None is left of any round; on a busy machine the device may just be lost, and have one less.
  EXPECT_TRUE(wait_until(within(10), [&] { return entries("/proc/self/fd") <= files; }))
      << files_before << "\nnow " << describe_files();
  EXPECT_TRUE(wait_until(within(10), [&] { return entries("/proc/self/task") <= threads; }));
}

TEST_P(Contract, IsHaltedOnItsWayBackByAnEmergencyStop) {
  if (!facts_.pluggable) GTEST_SKIP() << "skipped: this plug cannot be pulled";
  if (facts_.has_encoders) GTEST_SKIP() << "skipped: it is held where it stands, and has no way back";
  open();
  ASSERT_TRUE(arrives());
  const double held = fixture_->now().at(0);
  driver_->leave();
  fixture_->unplug();
  ASSERT_TRUE(reaches(BackendHealth::kLost));
  Pose far = driver_->pose();
  far.position_q[0] += as_far_q(0.5);
  driver_->move(far, 0.0);
  const std::size_t before = fixture_->outputs().size();
  fixture_->plug();
  ASSERT_TRUE(reaches(BackendHealth::kStandby));
  driver_->clear();
  // The loss of the base's pulses with the plug, and their return, are no motion, whenever the record gets
  // them.
  const auto base_moves = [&] {
    const std::vector<Output> seen = fixture_->outputs();
    return std::any_of(seen.begin() + static_cast<std::ptrdiff_t>(before), seen.end(),
                       [&](const Output& output) {
                         return output.servo == 0 && output.value > 0.0 &&
                                std::abs(output.value - held) > facts_.unit + facts_.noise;
                       });
  };
  ASSERT_TRUE(wait_until(within(60), base_moves));
  driver_->set_emergency_stop(true);
  const double at = fixture_->now().at(0);
  const std::uint64_t cycle = driver_->cycles();
  ASSERT_TRUE(wait_until(within(60), [&] { return driver_->cycles() > cycle + 500; }));
  // No joint is slowed down faster than its acceleration allows.
  double least_us_per_s2 = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < profile_.arm.dof; ++i)
    least_us_per_s2 =
        std::min(least_us_per_s2, profile_.arm.joints[i].acceleration_q_s2 * profile_.arm.servos[i].us_per_q);
  const double braking = facts_.approach_speed * facts_.approach_speed / (2.0 * least_us_per_s2);
  const double allowed = std::max(facts_.approach_speed * 0.1, braking) + 10.0 * facts_.unit;
  EXPECT_LE(std::abs(fixture_->now().at(0) - at), allowed) << "in 0.5 s";
  EXPECT_EQ(backend_->health(), BackendHealth::kStandby);
  driver_->set_emergency_stop(false);
  ASSERT_TRUE(reaches(BackendHealth::kOpen));
  EXPECT_TRUE(arrives()) << off();
}

TEST_P(Contract, EndsWhileTheDeviceIsAway) {
  if (!facts_.pluggable) GTEST_SKIP() << "skipped: this plug cannot be pulled";
  open();
  driver_->leave();
  fixture_->unplug();
  ASSERT_TRUE(reaches(BackendHealth::kLost));
  driver_->end();
  const auto begin = std::chrono::steady_clock::now();
  backend_->close();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20));
  EXPECT_EQ(backend_->health(), BackendHealth::kClosed);
}

TEST_P(Contract, HoldsOrRelaxesAtTheEnd) {
  open();
  driver_->move(pose(1400.0), 0.2);
  ASSERT_TRUE(arrives()) << off();
  driver_->end();
  backend_->close();
  const auto are_off = [&] {
    const std::vector<double> found = fixture_->now();
    return std::all_of(found.begin(), found.end(), [](double value) { return std::isnan(value); });
  };
  if (facts_.at_end == "relax") {
    EXPECT_TRUE(wait_until(within(20), are_off));
  } else {
    EXPECT_LE(off(), half_a_unit());
  }
}

INSTANTIATE_TEST_SUITE_P(Backends, Contract, ::testing::ValuesIn(all_fixtures()),
                         [](const auto& test) { return test.param.name; });
INSTANTIATE_TEST_SUITE_P(Slides, Contract, ::testing::ValuesIn(sliding_fixtures()),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace corbot::test
