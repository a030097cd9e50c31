// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "cli/supervise/child.h"
#include "cli/supervise/state_lock.h"
#include "cli/supervise/up.h"
#include "client/client.h"
#include "client/explain.h"
#include "client/failure.h"
#include "config/profile.h"

namespace corbot::cli {

using client::ExitCode;
using client::Failure;
using client::find_robot;
using client::is_up;
using client::read_state;
using client::robots_up;
using client::RobotState;

namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

/// Each test has a runtime directory of its own.
class State : public testing::Test {
 protected:
  State() {
    std::string path = testing::TempDir() + "corbot-state-XXXXXX";
    runtime_ = ::mkdtemp(path.data());
    ::setenv("XDG_RUNTIME_DIR", runtime_.c_str(), 1);
    ::unsetenv("CORBOT_ROBOT");
  }
  ~State() override { fs::remove_all(runtime_); }

  static RobotState sample(const std::string& name) {
    RobotState state;
    state.name = name;
    state.pid = ::getpid();
    state.endpoint = "127.0.0.1:12810";
    state.address = "corbaloc::127.0.0.1:12810/" + name;
    return state;
  }

  fs::path runtime_;
};

/// As in two shells, of which one has XDG_RUNTIME_DIR.
TEST_F(State, ARobotOfAnotherRuntimeDirectoryIsPointedTo) {
  const std::string name = "two-shells-" + std::to_string(::getpid());
  ::unsetenv("XDG_RUNTIME_DIR");
  const fs::path there = client::state_directory(false);
  auto lock = StateLock::acquire(name);
  ASSERT_TRUE(lock);
  lock->write(sample(name));
  ::setenv("XDG_RUNTIME_DIR", runtime_.c_str(), 1);
  for (const std::string& asked : {std::string(), name}) {
    try {
      (void)find_robot(asked);
      ADD_FAILURE() << "found";
    } catch (const Failure& failure) {
      EXPECT_THAT(failure.what(), HasSubstr("looked in " + (runtime_ / "corbot").string()));
      EXPECT_THAT(
          failure.what(),
          HasSubstr("'" + name + "' is up with its files in " + there.string() +
                    ", that is, with another XDG_RUNTIME_DIR: --robot corbaloc::127.0.0.1:12810/" + name));
    }
  }
  try {
    (void)find_robot(name + "b");
    ADD_FAILURE() << "found";
  } catch (const Failure& failure) {
    EXPECT_THAT(failure.what(), testing::Not(HasSubstr("is up with its files"))) << "another one's name";
  }
  ::unsetenv("XDG_RUNTIME_DIR");
  lock.reset();
  ::setenv("XDG_RUNTIME_DIR", runtime_.c_str(), 1);
  try {
    (void)find_robot(name);
    ADD_FAILURE() << "found";
  } catch (const Failure& failure) {
    EXPECT_THAT(failure.what(), testing::Not(HasSubstr("is up with its files")));
  }
}

TEST_F(State, IsFoundWhileItsSupervisorLives) {
  {
    auto lock = StateLock::acquire("a1");
    ASSERT_TRUE(lock);
    lock->write(sample("a1"));
    EXPECT_TRUE(is_up("a1"));
    EXPECT_THAT(robots_up(), ElementsAre("a1"));
    EXPECT_EQ(read_state("a1")->address, "corbaloc::127.0.0.1:12810/a1");
    EXPECT_EQ(find_robot("").where, "127.0.0.1:12810");
    EXPECT_EQ(find_robot("a1").name, "a1");
    EXPECT_FALSE(StateLock::acquire("a1")) << "already running";
  }
  EXPECT_FALSE(is_up("a1"));
  EXPECT_TRUE(fs::is_empty(runtime_ / "corbot")) << "both files are gone";
}

TEST_F(State, ThePortOfARobotIsKnown) {
  auto lynx = StateLock::acquire("lynx5");
  lynx->write(sample("lynx5"));
  EXPECT_EQ(client::robot_at_port(12810), "'lynx5' is up at 127.0.0.1:12810");
  EXPECT_EQ(client::robot_at_port(2810), "");
  EXPECT_THAT(client::endpoint_fault("192.0.2.1", 12810),
              testing::HasSubstr("not an address of this machine"));
}

TEST_F(State, AWrongNameAtAnAddressIsAnsweredWithTheRobotThere) {
  auto lynx = StateLock::acquire("lynx5");
  lynx->write(sample("lynx5"));
  const auto told = [](const std::string& where) {
    const std::string uri = "corbaloc::" + where + "/lynx";
    const CORBA::OBJECT_NOT_EXIST unknown(0, CORBA::COMPLETED_NO);
    return std::string(client::explain(unknown, client::Address{uri, "lynx", where}).what());
  };
  EXPECT_EQ(told("127.0.0.1:12810"),
            "the server at 127.0.0.1:12810 has no robot named 'lynx': it has 'lynx5'");
  EXPECT_THAT(told("localhost:12810"), testing::EndsWith("it has 'lynx5'"));
  EXPECT_THAT(told("192.0.2.1:12810"), testing::EndsWith("no robot named 'lynx'"));
  EXPECT_THAT(told("127.0.0.1:2810"), testing::EndsWith("no robot named 'lynx'"));
}

TEST_F(State, AnUnknownNameIsAnsweredWithThoseThatAreUp) {
  auto puma = StateLock::acquire("puma560");
  auto lynx = StateLock::acquire("lynx5");
  puma->write(sample("puma560"));
  lynx->write(sample("lynx5"));
  try {
    (void)find_robot("puma");
    ADD_FAILURE() << "found";
  } catch (const Failure& failure) {
    EXPECT_THAT(failure.what(), HasSubstr("); these are up: lynx5, puma560; did you mean 'puma560'?"));
  }
}

/// Somebody has removed the directory, and another supervisor has begun in the new one.
TEST_F(State, WhatIsAnothersIsNotRemoved) {
  auto first = StateLock::acquire("a1");
  ASSERT_TRUE(first);
  first->write(sample("a1"));
  fs::remove_all(runtime_ / "corbot");
  auto second = StateLock::acquire("a1");
  ASSERT_TRUE(second);
  second->write(sample("a1"));
  first.reset();
  EXPECT_TRUE(is_up("a1"));
  EXPECT_TRUE(read_state("a1"));
  second.reset();
  EXPECT_TRUE(fs::is_empty(runtime_ / "corbot"));
}

TEST_F(State, IsPrivate) {
  auto lock = StateLock::acquire("a1");
  lock->write(sample("a1"));
  EXPECT_EQ(fs::status(runtime_ / "corbot").permissions(), fs::perms::owner_all);
  EXPECT_EQ(fs::status(runtime_ / "corbot/a1.json").permissions(),
            fs::perms::owner_read | fs::perms::owner_write);
}

TEST_F(State, ADirectoryOpenToOthersIsRefused) {
  fs::create_directory(runtime_ / "corbot");
  ::chmod((runtime_ / "corbot").c_str(), 0777);
  EXPECT_THROW((void)StateLock::acquire("a1"), Failure);
  EXPECT_THROW((void)robots_up(), Failure);
}

TEST_F(State, ALinkInItsPlaceIsRefused) {
  fs::create_directory(runtime_ / "elsewhere");
  fs::create_directory_symlink(runtime_ / "elsewhere", runtime_ / "corbot");
  EXPECT_THROW((void)StateLock::acquire("a1"), Failure);
}

TEST_F(State, StaleFilesAreNotARobot) {
  fs::create_directory(runtime_ / "corbot");
  ::chmod((runtime_ / "corbot").c_str(), 0700);
  std::ofstream(runtime_ / "corbot/a1.json") << R"({"name":"a1","pid":1})";
  std::ofstream(runtime_ / "corbot/a1.lock");
  EXPECT_FALSE(is_up("a1"));
  EXPECT_TRUE(robots_up().empty());
  EXPECT_NO_THROW(down("a1", ""));  // cleans up, and signals no process
  EXPECT_TRUE(fs::is_empty(runtime_ / "corbot"));
  EXPECT_THROW(down("a1", ""), Failure) << "now there is nothing to end";
}

TEST_F(State, ABrokenFileIsNoState) {
  auto lock = StateLock::acquire("a1");
  for (const char* text : {"", "{", "[]", R"({"name":1,"pid":"x"})", R"({"pid":1})"}) {
    std::ofstream(runtime_ / "corbot/a1.json") << text;
    EXPECT_FALSE(read_state("a1")) << text;
  }
}

TEST_F(State, SeveralRobotsNeedAName) {
  auto first = StateLock::acquire("a1");
  auto second = StateLock::acquire("b2");
  first->write(sample("a1"));
  second->write(sample("b2"));
  try {
    (void)find_robot("");
    FAIL();
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.code(), ExitCode::kUsage);
    EXPECT_THAT(failure.what(), HasSubstr("a1 | b2"));
  }
  EXPECT_THROW(down("", ""), Failure);
}

TEST_F(State, NamesCannotLeaveTheDirectory) {
  for (const char* name : {"", "..", "a/b", "../a", "a b", "a.b"}) {
    EXPECT_FALSE(is_name(name)) << name;
    EXPECT_FALSE(is_up(name)) << name;
    EXPECT_FALSE(read_state(name)) << name;
  }
  EXPECT_FALSE(is_name(std::string(33, 'a')));
  EXPECT_TRUE(is_name("lynx-5_b"));
}

TEST(ChildProcess, ReportsLinesAndHowItEnded) {
  Child child("helper", {"/bin/sh", "-c", "echo one; echo two; exit 3"});
  child.start();
  siginfo_t info{};
  ASSERT_EQ(::waitid(P_PID, static_cast<id_t>(child.pid()), &info, WEXITED | WNOWAIT), 0);
  EXPECT_THAT(child.read_lines(), ElementsAre("one", "two"));
  EXPECT_EQ(describe_end(child.reap().value()), "exit code 3");
}

TEST(ChildProcess, ASignalIsNamed) {
  Child child("helper", {"/bin/sleep", "60"});
  child.start();
  child.send(SIGKILL);
  siginfo_t info{};
  ASSERT_EQ(::waitid(P_PID, static_cast<id_t>(child.pid()), &info, WEXITED | WNOWAIT), 0);
  EXPECT_THAT(describe_end(child.reap().value()), HasSubstr("signal 9"));
}

TEST(ChildProcess, AMissingProgramIsReported) {
  Child child("servant", {"/nonexistent/corbot-servant"});
  try {
    child.start();
    FAIL();
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.code(), ExitCode::kInternal);
    EXPECT_THAT(failure.what(), HasSubstr("cannot start servant: /nonexistent/corbot-servant"));
  }
}

}  // namespace
}  // namespace corbot::cli
