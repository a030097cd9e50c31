// SPDX-License-Identifier: Apache-2.0
#include "robot/self_check.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "support/wait_until.h"

namespace corbot::self_check_test {
namespace {

bool becomes(SelfCheck& check, bool passes) {
  return test::wait_until([&] { return check.passes() == passes; });
}

TEST(SelfCheck, PassesWhereThereIsNone) {
  SelfCheck check;
  EXPECT_TRUE(check.passes());
  EXPECT_FALSE(check.is_started());
}

TEST(SelfCheck, FailsAfterAWhileWithoutAnAnswerAndRecovers) {
  std::atomic<bool> answers{true};
  SelfCheck check;
  check.start([&] { return answers.load(); });
  EXPECT_TRUE(check.is_started());
  answers = false;
  EXPECT_TRUE(becomes(check, false));
  answers = true;
  EXPECT_TRUE(becomes(check, true));
  check.close();
  EXPECT_TRUE(becomes(check, false)) << "asked no more";
}

TEST(SelfCheck, ACallThatIsStuckIsNoAnswer) {
  std::atomic<bool> go_on{false};
  SelfCheck check;
  check.start([&] {
    go_on.wait(false);
    return true;
  });
  EXPECT_TRUE(becomes(check, false));
  go_on = true;
  go_on.notify_all();
  EXPECT_TRUE(becomes(check, true));
}

/// A time without a look, as on a stalled machine, does not count.
TEST(SelfCheck, TimeInWhichNobodyLookedDoesNotCount) {
  std::atomic<bool> answers{true};
  SelfCheck check;
  check.start([&] { return answers.load(); });
  EXPECT_TRUE(check.passes());
  answers = false;
  std::this_thread::sleep_for(2 * SelfCheck::kHolds);
  EXPECT_TRUE(check.passes());
  EXPECT_TRUE(becomes(check, false));
}

}  // namespace
}  // namespace corbot::self_check_test
