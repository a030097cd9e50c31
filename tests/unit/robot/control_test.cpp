// SPDX-License-Identifier: Apache-2.0
#include "robot/control.h"

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "robot/call_error.h"
#include "support/wait_until.h"

namespace corbot::control_test {
namespace {

constexpr double kLong_s = 60.0;
constexpr std::chrono::milliseconds kShortest(500);
static_assert(kShortestLease_s == 0.5);

/// For what must not happen meanwhile.
void wait_for(std::chrono::milliseconds time) { std::this_thread::sleep_for(time); }

void any_time() {}

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
    return test::wait_until([&] { return ends_ >= times; }) && ends_ == times;
  }
  /// Returns the record of the present holder, as if its lease were the shortest one and had run out long
  /// ago.
  ControlRecord record_of_a_lease_that_ran_out() {
    ControlRecord record{};
    EXPECT_EQ(kept_.load(record), DurableCell<ControlRecord>::Content::kRecord);
    record.lease_ns = std::chrono::nanoseconds(kShortest).count();
    record.until_ns = 0;
    EXPECT_TRUE(Control::is_valid(record));
    return record;
  }
  /// As the servant after this one does with what this one kept.
  std::unique_ptr<Control> next_servant() {
    ControlRecord record{};
    EXPECT_EQ(kept_.load(record), DurableCell<ControlRecord>::Content::kRecord);
    EXPECT_TRUE(Control::is_valid(record));
    control_.close();
    auto next = std::make_unique<Control>(kept_after_, [this](const Control::Ending&) { return count(); });
    next->inherit(record);
    return next;
  }
  std::string count() {
    ++ends_;
    return failure_;
  }
  std::atomic<int> ends_{0};
  std::string failure_;  ///< of the stops
  DurableCell<ControlRecord> kept_;
  DurableCell<ControlRecord> kept_after_;
  Control control_{kept_, [this](const Control::Ending&) { return count(); }};
};

TEST_F(ControlTest, WithoutAHolderEveryoneMay) {
  EXPECT_FALSE(control_.holder());
  EXPECT_NO_THROW((void)control_.use(""));
}

TEST_F(ControlTest, OnlyTheHolderMay) {
  const std::string key = control_.acquire("cell", kLong_s, any_time);
  EXPECT_NO_THROW((void)control_.use(key));
  const corbot_error refused = refusal([&] { (void)control_.use(""); });
  EXPECT_EQ(refused.status, CORBOT_NOT_READY);
  EXPECT_NE(std::string(refused.text).find("'cell' has control of the arm, for another"), std::string::npos)
      << refused.text;
  EXPECT_EQ(refusal([&] { (void)control_.use(std::string(32, '0')); }).status, CORBOT_NOT_READY);
  EXPECT_EQ(refusal([&] { (void)control_.acquire("other", 1.0, any_time); }).status, CORBOT_NOT_READY);
  EXPECT_EQ(control_.holder()->who, "cell");
}

TEST_F(ControlTest, KeysDiffer) {
  std::set<std::string> keys;
  for (int i = 0; i < 100; ++i) {
    const std::string key = control_.acquire("cell", kLong_s, any_time);
    EXPECT_EQ(key.size(), 32u);
    keys.insert(key);
    control_.release(key);
  }
  EXPECT_EQ(keys.size(), 100u);
  EXPECT_EQ(ends_, 100);
}

TEST_F(ControlTest, ReleaseStopsTheArmAndFreesIt) {
  const std::string key = control_.acquire("cell", kLong_s, any_time);
  control_.release(key);
  EXPECT_EQ(ends_, 1);
  EXPECT_NO_THROW((void)control_.use(""));
  EXPECT_EQ(refusal([&] { (void)control_.use(key); }).status, CORBOT_NOT_READY);
  EXPECT_EQ(refusal([&] { control_.release(key); }).status, CORBOT_NOT_READY);
  EXPECT_EQ(refusal([&] { control_.renew(key); }).status, CORBOT_NOT_READY);
}

TEST_F(ControlTest, AnExpiredLeaseStopsTheArmAndFreesIt) {
  const auto begin = Control::Clock::now();
  const std::string key = control_.acquire("cell", kShortestLease_s, any_time);
  ASSERT_TRUE(ended(1));
  EXPECT_GE(Control::Clock::now() - begin, kShortest);
  EXPECT_EQ(refusal([&] { control_.renew(key); }).status, CORBOT_NOT_READY);
}

TEST_F(ControlTest, ALeaseDoesNotRunWhileACallOfTheHolderIsUnderWay) {
  const std::string key = control_.acquire("cell", kLong_s, any_time);
  Control next(kept_after_, [this](const Control::Ending&) { return count(); });
  next.inherit(record_of_a_lease_that_ran_out());
  std::optional<Control::Use> call(next.use(key));
  next.allow_expiry();
  EXPECT_EQ(next.holder()->left_s, kShortestLease_s);
  wait_for(std::chrono::milliseconds(200));
  EXPECT_EQ(ends_, 0);
  const auto begin = Control::Clock::now();
  call.reset();
  ASSERT_TRUE(ended(1));
  EXPECT_GE(Control::Clock::now() - begin, kShortest) << "the lease begins anew with the end of the call";
}

TEST_F(ControlTest, ACallThatOutlivesItsControlLeavesTheNextHolderAlone) {
  const std::string first = control_.acquire("first", kLong_s, any_time);
  std::optional<Control::Use> late(control_.use(first));
  control_.release(first);
  const std::string second = control_.acquire("second", kLong_s, any_time);
  const Control::Use use = control_.use(second);
  late.reset();
  EXPECT_EQ(control_.holder()->left_s, kLong_s) << "the second holder's call is still under way";
  EXPECT_EQ(ends_, 1);
}

TEST_F(ControlTest, BadLeasesAndNamesAreRefused) {
  for (const double lease_s : {0.0, -1.0, 0.4, 3601.0, std::numeric_limits<double>::quiet_NaN()}) {
    const corbot_error error = refusal([&] { (void)control_.acquire("cell", lease_s, any_time); });
    EXPECT_EQ(error.status, CORBOT_BAD_PARAMETER) << lease_s;
    EXPECT_STREQ(error.parameter, "lease");
  }
  for (const std::string& who :
       {std::string(), std::string(65, 'x'), std::string("a\nb"), std::string("\xc3\xa4")}) {
    const corbot_error error = refusal([&] { (void)control_.acquire(who, 1.0, any_time); });
    EXPECT_EQ(error.status, CORBOT_BAD_PARAMETER) << who;
    EXPECT_STREQ(error.parameter, "who");
  }
  EXPECT_FALSE(control_.holder());
}

TEST_F(ControlTest, AcquireWaitsForCallsThatWereAdmittedBefore) {
  std::optional<Control::Use> earlier(control_.use(""));
  std::atomic<bool> has_control{false};
  std::thread holder([&] {
    (void)control_.acquire("cell", kLong_s, any_time);
    has_control = true;
  });
  ASSERT_TRUE(test::wait_until([&] { return control_.holder().has_value(); }));
  EXPECT_EQ(refusal([&] { (void)control_.use(""); }).status, CORBOT_NOT_READY) << "others are refused by now";
  EXPECT_FALSE(has_control);
  earlier.reset();
  holder.join();
  EXPECT_TRUE(has_control);
}

TEST_F(ControlTest, WhatIsNotAdmittedLeavesNoControlBehind) {
  std::optional<Control::Use> earlier(control_.use(""));
  std::atomic<int> asked{0};
  corbot_error error{};
  std::thread attempt([&] {
    error = refusal([&] {
      (void)control_.acquire("cell", kLong_s, [&] {
        if (++asked > 1) throw not_ready("motions are pending");
      });
    });
  });
  ASSERT_TRUE(test::wait_until([&] { return control_.holder().has_value(); }));
  EXPECT_EQ(asked, 1) << "again only when the calls of others are over";
  earlier.reset();
  attempt.join();
  EXPECT_EQ(asked, 2);
  EXPECT_EQ(error.status, CORBOT_NOT_READY);
  EXPECT_STREQ(error.text, "motions are pending");
  EXPECT_FALSE(control_.holder());
  EXPECT_NO_THROW((void)control_.use(""));
  ControlRecord record{};
  EXPECT_FALSE(kept_.load(record) == DurableCell<ControlRecord>::Content::kRecord && record.who[0] != '\0');
  EXPECT_EQ(ends_, 0) << "and stops nothing";
  EXPECT_NO_THROW((void)control_.acquire("next", kLong_s, any_time));
}

TEST_F(ControlTest, AHopelessAttemptDisturbsNobody) {
  EXPECT_EQ(refusal([&] {
              (void)control_.acquire("cell", kLong_s, [&] {
                EXPECT_NO_THROW((void)control_.use(""));
                throw not_ready("motions are pending");
              });
            }).status,
            CORBOT_NOT_READY);
}

TEST_F(ControlTest, AReleaseWhoseStopFailedSaysSoAndHasEnded) {
  const std::string key = control_.acquire("cell", kLong_s, any_time);
  failure_ = "the task is frozen";
  const corbot_error error = refusal([&] { control_.release(key); });
  EXPECT_EQ(error.status, CORBOT_NOT_READY);
  EXPECT_STREQ(
      error.text,
      "control has ended, but the servant cannot confirm that the arm has stopped: the task is frozen");
  EXPECT_FALSE(control_.holder());
  EXPECT_NO_THROW((void)control_.use(""));
}

/// The thread that ends it has to wake up first, on a machine that stood still long after the key is used
/// again.
TEST_F(ControlTest, ALeaseThatHasRunOutIsNotRenewed) {
  const std::string key = control_.acquire("cell", kLong_s, any_time);
  for (int round = 1; round <= 20; ++round) {
    Control next(kept_after_, [this](const Control::Ending&) { return count(); });
    next.inherit(record_of_a_lease_that_ran_out());
    next.allow_expiry();
    EXPECT_EQ(refusal([&] { next.renew(key); }).status, CORBOT_NOT_READY);
    EXPECT_FALSE(next.try_use(key));
    ASSERT_TRUE(ended(round));
  }
}

TEST_F(ControlTest, OnlyTheHoldersKeyHasItsName) {
  const std::string key = control_.acquire("cell", kLong_s, any_time);
  EXPECT_EQ(control_.name_of(key), "cell");
  EXPECT_EQ(control_.name_of(""), "");
  EXPECT_EQ(control_.name_of(std::string(32, '0')), "");
  EXPECT_TRUE(control_.try_use(key));
  EXPECT_FALSE(control_.try_use("")) << "but refuses nobody";
  control_.release(key);
  EXPECT_EQ(control_.name_of(key), "");
  EXPECT_FALSE(control_.try_use(key));
}

TEST_F(ControlTest, TheNextServantGoesOnWithTheHolderAndItsLease) {
  const std::string key = control_.acquire("cell", kLong_s, any_time);
  const double left_s = control_.holder()->left_s;
  const auto next = next_servant();
  ASSERT_TRUE(next->holder());
  EXPECT_EQ(next->holder()->who, "cell");
  EXPECT_LE(next->holder()->left_s, left_s);
  EXPECT_GT(next->holder()->left_s, 0.0);
  EXPECT_EQ(refusal([&] { (void)next->use(""); }).status, CORBOT_NOT_READY);
  EXPECT_NO_THROW((void)next->use(key));
  next->release(key);
  EXPECT_FALSE(next->holder());
  EXPECT_EQ(ends_, 1);
}

TEST_F(ControlTest, WhatIsKeptDoesNotHoldTheKey) {
  const std::string key = control_.acquire("cell", kLong_s, any_time);
  ControlRecord record{};
  ASSERT_EQ(kept_.load(record), DurableCell<ControlRecord>::Content::kRecord);
  const std::string bytes(reinterpret_cast<const char*>(&record), sizeof(record));
  EXPECT_EQ(bytes.find(key), std::string::npos);
  std::string raw;
  for (std::size_t i = 0; i < key.size(); i += 2)
    raw += static_cast<char>(std::stoi(key.substr(i, 2), nullptr, 16));
  EXPECT_EQ(bytes.find(raw), std::string::npos);
}

/// Or the stop would find no task to stop.
TEST_F(ControlTest, ALeaseThatRanOutMeanwhileEndsWhenTheArmCanBeStopped) {
  (void)control_.acquire("cell", kLong_s, any_time);
  Control next(kept_after_, [this](const Control::Ending& ending) {
    EXPECT_FALSE(ending.is_released);
    EXPECT_EQ(ending.who, "cell");
    return count();
  });
  next.inherit(record_of_a_lease_that_ran_out());
  wait_for(std::chrono::milliseconds(50));
  EXPECT_EQ(ends_, 0);
  EXPECT_EQ(refusal([&] { (void)next.use(""); }).status, CORBOT_NOT_READY);
  next.allow_expiry();
  EXPECT_TRUE(ended(1));
}

/// The call's connection went with its servant; the lease begins anew with that.
TEST_F(ControlTest, ALeaseThatACallKeptFromRunningOutBeginsAnew) {
  const std::string key = control_.acquire("cell", kLong_s, any_time);
  const Control::Use use = control_.use(key);
  const ControlRecord record = record_of_a_lease_that_ran_out();
  Control next(kept_after_, [this](const Control::Ending&) { return count(); });
  const auto begin = Control::Clock::now();
  next.inherit(record);
  next.allow_expiry();
  ASSERT_TRUE(ended(1));
  EXPECT_GE(Control::Clock::now() - begin, kShortest);
}

TEST_F(ControlTest, NobodyInheritsAnEndedControl) {
  control_.release(control_.acquire("cell", kLong_s, any_time));
  EXPECT_FALSE(next_servant()->holder());
}

TEST_F(ControlTest, WhatNoServantWroteIsInvalid) {
  (void)control_.acquire("cell", kLong_s, any_time);
  ControlRecord good{};
  ASSERT_EQ(kept_.load(good), DurableCell<ControlRecord>::Content::kRecord);
  ControlRecord bad = good;
  bad.who.fill('x');
  EXPECT_FALSE(Control::is_valid(bad)) << "no end";
  bad = good;
  bad.who[1] = '\n';
  EXPECT_FALSE(Control::is_valid(bad));
  for (const std::int64_t lease_ns :
       {std::int64_t{0}, std::int64_t{-1}, std::numeric_limits<std::int64_t>::max(),
        std::numeric_limits<std::int64_t>::min()}) {
    bad = good;
    bad.lease_ns = lease_ns;
    EXPECT_FALSE(Control::is_valid(bad)) << lease_ns;
  }
  for (const std::int64_t until_ns :
       {std::numeric_limits<std::int64_t>::max(), std::numeric_limits<std::int64_t>::min()}) {
    bad = good;
    bad.until_ns = until_ns;
    Control next(kept_after_, [](const Control::Ending&) { return std::string(); });
    next.inherit(bad);
    EXPECT_LE(next.holder()->left_s, kLong_s) << "no lease is longer than it was asked for";
  }
}

TEST_F(ControlTest, OfManyAtOnceOneHasControl) {
  std::atomic<int> winners{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 16; ++i) {
    threads.emplace_back([&] {
      try {
        (void)control_.acquire("one of many", kLong_s, any_time);
        ++winners;
      } catch (const CallError&) {
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(winners, 1);
}

}  // namespace
}  // namespace corbot::control_test
