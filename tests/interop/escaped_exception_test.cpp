// SPDX-License-Identifier: Apache-2.0
// Tests the output of a test program if a CORBA exception escapes a test.
#include <gmock/gmock.h>

#include <cell.hh>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <regex>
#include <robot.hh>
#include <thread>

#include "support/paths.h"
#include "support/process.h"

namespace corbot::test {
namespace {

constexpr const char* kPlanted = "CORBOT_PLANTED_ESCAPES";

/// A test that throws; `in_set_up`: before its body.
class Escape : public ::testing::Test {
 public:
  Escape(std::function<void()> thrower, bool in_set_up)
      : thrower_(std::move(thrower)), in_set_up_(in_set_up) {}
  void SetUp() override {
    if (in_set_up_) thrower_();
  }
  void TestBody() override { thrower_(); }

 private:
  std::function<void()> thrower_;
  bool in_set_up_;
};

template <class Exception>
void plant(const Exception& exception, bool in_set_up = false) {
  const auto make = [exception, in_set_up]() -> ::testing::Test* {
    return new Escape([exception] { throw exception; }, in_set_up);
  };
  ::testing::RegisterTest("Escape", exception._name(), nullptr, nullptr, __FILE__, __LINE__, make);
}

template <class Exception>
void plant_in_thread(const Exception& exception) {
  const auto make = [exception]() -> ::testing::Test* {
    return new Escape([exception] { std::thread([exception] { throw exception; }).join(); }, false);
  };
  ::testing::RegisterTest("EscapeOfAThread", "EndsTheProgram", nullptr, nullptr, __FILE__, __LINE__, make);
}

/// These tests are there in the child process alone.
const bool is_planted = [] {
  if (std::getenv(kPlanted) == nullptr) return false;
  plant(CORBA::TRANSIENT(omni::TRANSIENT_ConnectFailed, CORBA::COMPLETED_NO));
  plant(CORBA::COMM_FAILURE(omni::COMM_FAILURE_WaitingForReply, CORBA::COMPLETED_MAYBE), true);
  plant(CORBA::NO_PERMISSION(0x43425401, CORBA::COMPLETED_YES));
  plant(Corbot::BadParameter("t", -1.5, "negative"));
  plant(Corbot::Unreachable({1.5, 2.5, -3.5}, "too far"));
  plant(Corbot::LimitExceeded("speed", 2, 50.5, -40.5, 40.5));
  plant(Corbot::NotReady("in Error"), true);
  plant(Corbot::Stopped("by a client"));
  plant(Corbot::QueueFull(8));
  plant(Corbot::Claimed("left", "shift 2", 7, 12.5));
  plant(Corbot::Superseded(7, 8));
  plant(Corbot::WrongStep(Corbot::StepHeld, Corbot::StepUnclear));
  plant(Corbot::Empty("tray"));
  plant(Corbot::Full("tray", 12));
  plant(Corbot::Occupied("press", "right", 12.5));
  plant_in_thread(CORBA::TRANSIENT(omni::TRANSIENT_ConnectFailed, CORBA::COMPLETED_NO));
  return true;
}();

RunResult run_planted(const std::string& tests) {
  const std::string program = std::filesystem::read_symlink("/proc/self/exe");
  return run({program, "--gtest_filter=" + tests}, 60.0, {std::string(kPlanted) + "=1"});
}

std::string idl(const char* name) {
  std::ifstream file(std::string(CORBOT_SOURCE_DIR "/idl/") + name);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(EscapedException, IsPrintedWithItsFields) {
  if (is_planted) GTEST_SKIP() << "skipped: the child has only what was planted";
  const RunResult done = run_planted("Escape.*");
  EXPECT_EQ(done.code, 1) << done.output << done.errors;
  for (const char* line : {
           "TRANSIENT {minor = TRANSIENT_ConnectFailed (0x41540002), completed = COMPLETED_NO}",
           "COMM_FAILURE {minor = COMM_FAILURE_WaitingForReply (0x41540007), completed = COMPLETED_MAYBE}",
           "NO_PERMISSION {minor = 0x43425401, completed = COMPLETED_YES}",
           R"(BadParameter {parameter = "t", value = -1.5, reason = "negative"})",
           R"(Unreachable {target = (1.5, 2.5, -3.5), reason = "too far"})",
           R"(LimitExceeded {quantity = "speed", articulation = 2, value = 50.5, )"
           "lower = -40.5, upper = 40.5}",
           R"(NotReady {reason = "in Error"})",
           R"(Stopped {reason = "by a client"})",
           "QueueFull {capacity = 8}",
           R"(Claimed {robot = "left", who = "shift 2", token = 7, since = 12.5})",
           "Superseded {token = 7, present = 8}",
           "WrongStep {present = StepHeld, wanted = StepUnclear}",
           R"(Empty {place = "tray"})",
           R"(Full {place = "tray", capacity = 12})",
           R"(Occupied {place = "press", robot = "right", since = 12.5})",
       }) {
    EXPECT_THAT(done.output, ::testing::HasSubstr(std::string("The exception is CORBA's ") + line + "\n"));
  }
  // The printer also covers exceptions that the interfaces may raise one day.
  const std::regex declared("\n *exception +([A-Za-z]+)");
  for (const char* file : {"robot.idl", "arm.idl", "cell.idl"}) {
    const std::string text = idl(file);
    ASSERT_FALSE(text.empty()) << file;
    for (std::sregex_iterator found(text.begin(), text.end(), declared), end; found != end; ++found) {
      EXPECT_THAT(done.output, ::testing::HasSubstr("CORBA's " + (*found)[1].str() + " {"))
          << "not planted: " << file;
    }
  }
}

TEST(EscapedException, OfAThreadIsPrintedToo) {
  if (is_planted) GTEST_SKIP() << "skipped: the child has only what was planted";
  const RunResult done = run_planted("EscapeOfAThread.*");
  EXPECT_NE(done.code, 0);
  EXPECT_THAT(done.output, ::testing::HasSubstr("The exception is CORBA's TRANSIENT {minor = "
                                                "TRANSIENT_ConnectFailed (0x41540002), "));
}

}  // namespace
}  // namespace corbot::test
