// SPDX-License-Identifier: Apache-2.0
#include "robot/control.h"

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "robot/call_error.h"

namespace corbot {
namespace {

constexpr double kLong_s = 60.0;

corbot_error refusal(const std::function<void()>& call) {
  try {
    call();
  } catch (const CallError& error) {
    return error.error;
  }
  return {};
}

class ControlTest : public ::testing::Test {
 protected:
  bool ended(int times) {
    const auto deadline = Control::Clock::now() + std::chrono::seconds(20);
    while (ends_ < times && Control::Clock::now() < deadline) std::this_thread::yield();
    return ends_ == times;
  }
  std::atomic<int> ends_{0};
  Control control_{[this] { ++ends_; }};
};

TEST_F(ControlTest, WithoutAHolderEveryoneMay) {
  EXPECT_FALSE(control_.holder());
  EXPECT_NO_THROW((void)control_.use(""));
}

TEST_F(ControlTest, OnlyTheHolderMay) {
  const std::string key = control_.acquire("cell", kLong_s);
  EXPECT_NO_THROW((void)control_.use(key));
  const corbot_error refused = refusal([&] { (void)control_.use(""); });
  EXPECT_EQ(refused.status, CORBOT_NOT_READY);
  EXPECT_NE(std::string(refused.text).find("'cell' has control of the arm, for another"), std::string::npos)
      << refused.text;
  EXPECT_EQ(refusal([&] { (void)control_.use(std::string(32, '0')); }).status, CORBOT_NOT_READY);
  EXPECT_EQ(refusal([&] { (void)control_.acquire("other", 1.0); }).status, CORBOT_NOT_READY);
  EXPECT_EQ(control_.holder()->who, "cell");
}

TEST_F(ControlTest, KeysDiffer) {
  std::set<std::string> keys;
  for (int i = 0; i < 100; ++i) {
    const std::string key = control_.acquire("cell", kLong_s);
    EXPECT_EQ(key.size(), 32u);
    keys.insert(key);
    control_.release(key);
  }
  EXPECT_EQ(keys.size(), 100u);
  EXPECT_EQ(ends_, 100);
}

TEST_F(ControlTest, ReleaseStopsTheArmAndFreesIt) {
  const std::string key = control_.acquire("cell", kLong_s);
  control_.release(key);
  EXPECT_EQ(ends_, 1);
  EXPECT_NO_THROW((void)control_.use(""));
  EXPECT_EQ(refusal([&] { (void)control_.use(key); }).status, CORBOT_NOT_READY);
  EXPECT_EQ(refusal([&] { control_.release(key); }).status, CORBOT_NOT_READY);
  EXPECT_EQ(refusal([&] { control_.renew(key); }).status, CORBOT_NOT_READY);
}

TEST_F(ControlTest, AnExpiredLeaseStopsTheArmAndFreesIt) {
  const auto begin = Control::Clock::now();
  const std::string key = control_.acquire("cell", Control::kShortestLease_s);
  ASSERT_TRUE(ended(1));
  EXPECT_GE(Control::Clock::now() - begin, std::chrono::milliseconds(500));
  EXPECT_EQ(refusal([&] { control_.renew(key); }).status, CORBOT_NOT_READY);
}

TEST_F(ControlTest, ALeaseDoesNotRunWhileACallOfTheHolderIsUnderWay) {
  const std::string key = control_.acquire("cell", Control::kShortestLease_s);
  const auto begin = Control::Clock::now();
  {
    const Control::Use use = control_.use(key);
    while (Control::Clock::now() - begin < std::chrono::milliseconds(900)) std::this_thread::yield();
    EXPECT_EQ(ends_, 0);
  }
  EXPECT_TRUE(control_.holder()) << "the lease begins anew with the end of the call";
  EXPECT_TRUE(ended(1));
}

TEST_F(ControlTest, ACallThatOutlivesItsControlLeavesTheNextHolderAlone) {
  const std::string first = control_.acquire("first", kLong_s);
  {
    std::optional<Control::Use> late(control_.use(first));
    control_.release(first);
    const std::string second = control_.acquire("second", Control::kShortestLease_s);
    const Control::Use use = control_.use(second);
    late.reset();
    EXPECT_GT(control_.holder()->left_s, 0.0);
    const auto begin = Control::Clock::now();
    while (Control::Clock::now() - begin < std::chrono::milliseconds(700)) std::this_thread::yield();
    EXPECT_EQ(ends_, 1) << "the second holder's call is still under way";
  }
}

TEST_F(ControlTest, BadLeasesAndNamesAreRefused) {
  for (const double lease_s : {0.0, -1.0, 0.4, 3601.0, std::numeric_limits<double>::quiet_NaN()}) {
    const corbot_error error = refusal([&] { (void)control_.acquire("cell", lease_s); });
    EXPECT_EQ(error.status, CORBOT_BAD_PARAMETER) << lease_s;
    EXPECT_STREQ(error.parameter, "lease");
  }
  for (const std::string& who :
       {std::string(), std::string(65, 'x'), std::string("a\nb"), std::string("\xc3\xa4")}) {
    const corbot_error error = refusal([&] { (void)control_.acquire(who, 1.0); });
    EXPECT_EQ(error.status, CORBOT_BAD_PARAMETER) << who;
    EXPECT_STREQ(error.parameter, "who");
  }
  EXPECT_FALSE(control_.holder());
}

TEST_F(ControlTest, OfManyAtOnceOneHasControl) {
  std::atomic<int> winners{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 16; ++i) {
    threads.emplace_back([&] {
      try {
        (void)control_.acquire("one of many", kLong_s);
        ++winners;
      } catch (const CallError&) {
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(winners, 1);
}

}  // namespace
}  // namespace corbot
