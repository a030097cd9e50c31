// SPDX-License-Identifier: Apache-2.0
// Independent clients against the servant, all by one scenario (scenario.txt).
#include <signal.h>

#include <fstream>
#include <map>
#include <regex>

#include <fmt/core.h>

#include "interop/answers.h"
#include "interop/matrix_client.h"
#include "support/naming_service.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

class Matrix : public RobotRig, public ::testing::WithParamInterface<ClientKind> {
 protected:
  void SetUp() override {
    if (const std::string why = client_.prepare(GetParam()); !why.empty()) GTEST_SKIP() << "skipped: " << why;
    service_ = std::make_unique<NamingService>();
    take_name("matrix");
    start_rt();
    if (!HasFatalFailure()) start_servant({"--naming", service_->reference()});
    if (HasFatalFailure()) return;
    arm_ = connect();
    client_.start(fmt::format("{}/{}", CORBOT_SCRATCH_DIR, name_));
    values_ = {{"corbaloc", reference_}, {"naming", service_->reference()}, {"name", name_}};
    ASSERT_TRUE(wait_until(within(30), [&] { return service_->knows(name_); })) << servant_->errors();
  }
  void TearDown() override {
    client_.stop();
    if (servant_) RobotRig::TearDown();
  }

  /// The answer, without alarms that only say that this machine is busy.
  std::string ask(const std::string& command) {
    static const std::regex kOverrun("\\{time=[^{}]* code=140 [^{}]*\\} ?");
    return std::regex_replace(client_.ask(command), kOverrun, "");
  }
  /// $NAME by its value.
  std::string filled_in(std::string line) const {
    for (const auto& [name, value] : values_) {
      line = std::regex_replace(line, std::regex("\\$" + name + "\\b"), value);
    }
    return line;
  }
  bool cannot(const std::string& answer) {
    const std::string& text = GetParam().cannot;
    if (text.empty() || !answer.starts_with(text)) return false;
    fmt::print("{}\n", answer);
    return true;
  }

  void step(const std::string& line, const std::optional<std::string>& expected) {
    std::smatch match;
    if (std::regex_match(line, match, std::regex("device (lost|found)"))) {
      rt_->signal(match[1] == "lost" ? SIGUSR1 : SIGUSR2);
    } else if (std::regex_match(line, match, std::regex("until (.*): (\\w.*)"))) {
      std::string answer;
      const bool came = wait_until(within(60), [&] {
        answer = ask(match[2]);
        return matches(match[1], answer);
      });
      EXPECT_TRUE(came) << line << "\n  last answer " << answer;
    } else if (std::regex_match(line, match, std::regex("let (\\w+) = (.*)"))) {
      const std::string answer = ask(match[2]);
      ASSERT_TRUE(answer.starts_with("ok ")) << line << "\n  " << answer;
      values_[match[1]] = answer.substr(3);
    } else {
      const std::string answer = ask(line);
      const bool good = expected ? matches(*expected, answer) : answer.starts_with("ok");
      EXPECT_TRUE(good || cannot(answer))
          << line << "\n  answered " << answer << "\n  expected " << expected.value_or("ok");
    }
    ++steps_;
  }

  std::unique_ptr<NamingService> service_;
  MatrixClient client_;
  std::map<std::string, std::string> values_;
  int steps_ = 0;
};

TEST_P(Matrix, SeesWhatTheScenarioSays) {
  std::vector<std::string> lines;
  std::ifstream file(CORBOT_SCENARIO);
  for (std::string line; std::getline(file, line);) {
    if (!line.empty() && line[0] != '#') lines.push_back(line);
  }
  for (std::size_t i = 0; i < lines.size() && !HasFatalFailure(); ++i) {
    std::optional<std::string> expected;
    const std::string command = filled_in(lines[i]);
    if (i + 1 < lines.size() && lines[i + 1].starts_with("= ")) expected = filled_in(lines[++i].substr(2));
    step(command, expected);
  }
  EXPECT_GT(steps_, 100) << "the scenario was not found, or is cut";
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
