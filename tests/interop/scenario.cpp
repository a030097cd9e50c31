// SPDX-License-Identifier: Apache-2.0
#include "interop/scenario.h"

#include <signal.h>

#include <fstream>
#include <regex>
#include <sstream>

#include <fmt/core.h>

#include "interop/answers.h"
#include "support/paths.h"

namespace corbot::test {
namespace {

/// `NAME = VALUE`, a line each.
std::map<std::string, std::string> values_of(const std::string& arm) {
  std::ifstream file(fmt::format("{}/{}.txt", CORBOT_SOURCE_DIR "/tests/interop/arms", arm));
  std::map<std::string, std::string> values;
  for (std::string line; std::getline(file, line);) {
    const std::size_t at = line.find(" = ");
    if (line[0] != '#' && at != std::string::npos) values[line.substr(0, at)] = line.substr(at + 3);
  }
  return values;
}

}  // namespace

void Scenario::begin(const ClientKind& kind, const std::string& arm) {
  kind_ = kind;
  if (const std::string why = client_.prepare(kind); !why.empty()) GTEST_SKIP() << "skipped: " << why;
  values_ = values_of(arm);
  ASSERT_TRUE(has_part("every")) << "no values of " << arm;
  profile_ = fmt::format("{}/{}.toml", CORBOT_TEST_PROFILES, arm);
  service_ = std::make_unique<NamingService>();
  take_name("matrix");
  start_rt();
  if (!HasFatalFailure()) start_servant({"--naming", service_->reference()});
  if (HasFatalFailure()) return;
  arm_ = connect();
  client_.start(fmt::format("{}/{}", CORBOT_SCRATCH_DIR, name_));
  values_.insert({{"corbaloc", reference_}, {"naming", service_->reference()}, {"name", name_}});
  ASSERT_TRUE(wait_until(within(30), [&] { return service_->knows(name_); })) << servant_->errors();
}

void Scenario::TearDown() {
  client_.stop();
  if (servant_) RobotRig::TearDown();
}

/// The answer, without alarms that only say that this machine is busy.
std::string Scenario::ask(const std::string& command) {
  static const std::regex kOverrun("\\{time=[^{}]* code=140 [^{}]*\\} ?");
  return std::regex_replace(client_.ask(command), kOverrun, "");
}

/// $NAME by its value.
std::string Scenario::filled_in(std::string line) const {
  static const std::regex kName("\\$(\\w+)");
  std::string filled;
  for (std::smatch match; std::regex_search(line, match, kName); line = match.suffix()) {
    const auto value = values_.find(match[1]);
    EXPECT_NE(value, values_.end()) << "no value of " << match[0];
    filled += match.prefix().str() + (value != values_.end() ? value->second : "");
  }
  return filled + line;
}

bool Scenario::has_part(const std::string& part) const {
  const auto parts = values_.find("parts");
  std::istringstream words(parts != values_.end() ? parts->second : "");
  for (std::string word; words >> word;) {
    if (word == part) return true;
  }
  return false;
}

bool Scenario::cannot(const std::string& answer) const {
  if (kind_.cannot.empty() || !answer.starts_with(kind_.cannot)) return false;
  fmt::print("{}\n", answer);
  return true;
}

void Scenario::step(const std::string& line, const std::optional<std::string>& expected) {
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

void Scenario::run() {
  std::vector<std::string> lines;
  std::ifstream file(CORBOT_SOURCE_DIR "/tests/interop/scenario.txt");
  bool is_for_this_arm = true;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("for ")) {
      is_for_this_arm = has_part(line.substr(4));
    } else if (is_for_this_arm && !line.empty() && line[0] != '#') {
      lines.push_back(line);
    }
  }
  for (std::size_t i = 0; i < lines.size() && !HasFatalFailure(); ++i) {
    std::optional<std::string> expected;
    const std::string command = filled_in(lines[i]);
    if (i + 1 < lines.size() && lines[i + 1].starts_with("= ")) expected = filled_in(lines[++i].substr(2));
    step(command, expected);
  }
}

}  // namespace corbot::test
