// SPDX-License-Identifier: Apache-2.0
// Independent clients against the servant, all by one scenario (scenario.txt).
#include "interop/answers.h"
#include "interop/scenario.h"

namespace corbot::test {
namespace {

class Matrix : public Scenario, public ::testing::WithParamInterface<ClientKind> {};

TEST_P(Matrix, SeesWhatTheScenarioSays) {
  begin(GetParam(), "lynx5");
  if (HasFatalFailure() || IsSkipped()) return;
  run();
  EXPECT_GT(steps_, 150) << "the scenario was not found, or is cut";
}

INSTANTIATE_TEST_SUITE_P(Clients, Matrix, ::testing::ValuesIn(client_kinds()),
                         [](const auto& test) { return test.param.name; });

TEST(Answers, AreComparedByValue) {
  EXPECT_TRUE(matches("ok [0 1 2.5]", "ok [0.0 1 2.5000001]"));
  EXPECT_FALSE(matches("ok [0 1 2.5]", "ok [0 1 2.6]"));
  EXPECT_FALSE(matches("ok [0 1]", "ok [0 1 2]"));
  EXPECT_TRUE(matches("ok {id=* text=\"a*\"}", "ok {id={x=1 y=[2]} text=\"a b = c\"}"));
  EXPECT_FALSE(matches("ok {id=* text=\"a*\"}", "ok {id={x=1 y=[2]} text=\"b\"}"));
  EXPECT_TRUE(matches("value=nan", "value=nan"));
  EXPECT_FALSE(matches("value=nan", "value=0"));
  EXPECT_FALSE(matches("ok", "ok 1"));
}

}  // namespace
}  // namespace corbot::test
