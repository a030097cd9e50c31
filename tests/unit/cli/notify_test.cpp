// SPDX-License-Identifier: Apache-2.0
// The supervisor's side of sd_notify(3), with a child that has libsystemd's.
#include <gmock/gmock.h>
#include <signal.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>

#include "cli/supervise/back_off.h"
#include "cli/supervise/supervisor.h"
#include "client/failure.h"
#include "support/paths.h"
#include "support/process.h"

namespace corbot::cli {
namespace {

namespace fs = std::filesystem;
using client::Failure;
using test::wait_until;
using test::within;
using testing::AllOf;
using testing::HasSubstr;

class Notify : public testing::Test {
 protected:
  Notify() {
    std::string path = testing::TempDir() + "corbot-notify-XXXXXX";
    directory_ = ::mkdtemp(path.data());
    supervisor_ = std::make_unique<Supervisor>(Supervisor::Options{
        .notify_path = file("notify"), .attempts = 3, .on_change = [this] { ++changes_; }});
  }
  ~Notify() override {
    supervisor_.reset();
    EXPECT_FALSE(fs::exists(file("notify")));
    fs::remove_all(directory_);
  }

  [[nodiscard]] std::string file(const std::string& name) const { return (directory_ / name).string(); }
  [[nodiscard]] std::string text_of(const std::string& name) const {
    std::ifstream stream(file(name));
    return {std::istreambuf_iterator<char>{stream}, {}};
  }
  /// A child that performs `first` at its first start and `then` at each later one, where it is not the same.
  [[nodiscard]] Supervisor::Spec child(const std::string& first, const std::string& then = "") const {
    const std::string mark = file("started");
    const std::string program = CORBOT_TESTS_DIR
        "/notifying_child"
        " ";
    return {"child",
            {"/bin/sh", "-c",
             "if [ -e " + mark + " ]; then exec " + program + (then.empty() ? first : then) +
                 " \"$@\"; fi; : >" + mark + "; exec " + program + first,
             "sh"}};
  }
  bool step_until(const std::function<bool()>& condition) const {
    return wait_until(within(30), [&] { return condition() || !supervisor_->step() || condition(); }) &&
           condition();
  }

  fs::path directory_;
  int changes_{0};
  std::unique_ptr<Supervisor> supervisor_;
};

TEST_F(Notify, AChildReportsThatItIsReady) {
  ASSERT_TRUE(supervisor_->start(child("ready hang")));
  EXPECT_TRUE(supervisor_->all_ready());
  EXPECT_EQ(changes_, 1);
}

TEST_F(Notify, TheReportOfAnotherProcessDoesNotCount) {
  Supervisor::Spec spec = child("another-process-is-ready hang");
  spec.ready_within_s = 1;
  EXPECT_THROW((void)supervisor_->start(spec), Failure);
}

TEST_F(Notify, StoredDescriptorsComeBackUnderTheirNames) {
  const std::string stores = "store=one:" + file("a") + " store=two:" + file("b") +
                             " store=three:" + file("c") + " store='not\ta name':" + file("d") +
                             " remove=two ready exit=1";
  ASSERT_TRUE(supervisor_->start(child(stores, "report=" + file("got") + " ready hang")));
  ASSERT_TRUE(step_until([&] { return fs::exists(file("got")); }));
  EXPECT_EQ(text_of("got"), "one a\nthree c\nstored d\n");
}

TEST_F(Notify, NoMoreThanSixteenDescriptorsAreStored) {
  std::string stores;
  for (int i = 0; i < 20; ++i) stores += "store=x:" + file("f" + std::to_string(i)) + " ";
  ASSERT_TRUE(supervisor_->start(child(stores + "ready exit=0", "report=" + file("got") + " ready hang")));
  ASSERT_TRUE(step_until([&] { return fs::exists(file("got")); }));
  const std::string got = text_of("got");
  EXPECT_EQ(std::count(got.begin(), got.end(), '\n'), 16);
  EXPECT_THAT(got, AllOf(HasSubstr("x f0\n"), HasSubstr("x f15\n")));
}

TEST_F(Notify, StoredDescriptorsAreHandedUpToTheServiceManager) {
  NotifySocket systemd(file("systemd"));
  ASSERT_EQ(::setenv("NOTIFY_SOCKET", systemd.path().c_str(), 1), 0);
  ServiceManager manager;
  supervisor_ = std::make_unique<Supervisor>(Supervisor::Options{
      .notify_path = file("notify2"), .manager = &manager, .on_change = [this] { ++changes_; }});
  ASSERT_TRUE(supervisor_->start(child("store=one:" + file("a") + " remove=one ready hang")));
  const auto stored = systemd.receive();
  const auto removed = systemd.receive();
  ::unsetenv("NOTIFY_SOCKET");
  ASSERT_TRUE(stored && removed);
  EXPECT_TRUE(stored->store);
  EXPECT_EQ(stored->fd_name, "child/one");
  EXPECT_EQ(stored->sender, ::getpid());
  ASSERT_EQ(stored->descriptors.size(), 1u);
  EXPECT_EQ(fs::read_symlink("/proc/self/fd/" + std::to_string(stored->descriptors[0].get())), file("a"));
  EXPECT_TRUE(removed->remove);
  EXPECT_EQ(removed->fd_name, "child/one");
}

TEST_F(Notify, AChildThatDoesNotRespondIsReplaced) {
  Supervisor::Spec spec =
      child("store=kept:" + file("a") + " ready hang", "report=" + file("got") + " ready");
  spec.respond_s = 4;
  spec.after_unresponsive = {"feed"};  // without it, the second one ends at once
  ASSERT_TRUE(supervisor_->start(spec));
  const pid_t first = supervisor_->pid_of("child");
  ASSERT_TRUE(step_until([&] { return fs::exists(file("got")) && supervisor_->all_ready(); }));
  const pid_t second = supervisor_->pid_of("child");
  EXPECT_NE(second, first);
  EXPECT_EQ(text_of("got"), "kept a\n");
  EXPECT_EQ(changes_, 3) << "started, restarted, ready again";
}

/// The kernel ends a real-time task that computes without end by SIGXCPU: it made no cycle meanwhile.
TEST_F(Notify, AChildThatSpunIsReplacedLikeOneThatDidNotRespond) {
  for (const int signal : {SIGXCPU, SIGSEGV}) {
    const std::string mark = std::to_string(signal);
    fs::remove(file("started"));
    Supervisor::Spec spec = child("ready signal=" + mark, "report=" + file("again" + mark) + " ready");
    spec.title = mark;
    spec.after_unresponsive = {"report=" + file("got" + mark), "hang"};
    ASSERT_TRUE(supervisor_->start(spec));
    const auto is_again = [&] { return fs::exists(file("again" + mark)); };
    ASSERT_TRUE(step_until(is_again));
    if (signal == SIGXCPU) {
      EXPECT_TRUE(step_until([&] { return fs::exists(file("got" + mark)) && supervisor_->all_ready(); }));
    } else {
      fs::remove(file("again" + mark));
      ASSERT_TRUE(step_until(is_again));  // the child before has carried out all of its actions
      EXPECT_FALSE(fs::exists(file("got" + mark)));
    }
  }
}

/// As a real-time task's segments are stored: the next one's is there, under the other name, before the old
/// one goes.
TEST_F(Notify, ATasksSegmentsAreStoredUnderTwoNamesInTurn) {
  NotifySocket systemd(file("systemd"));
  ASSERT_EQ(::setenv("NOTIFY_SOCKET", systemd.path().c_str(), 1), 0);
  ASSERT_EQ(::setenv("CORBOT_RUN_DIR", directory_.c_str(), 1), 0);
  ServiceManager manager;
  supervisor_ = std::make_unique<Supervisor>(
      Supervisor::Options{.notify_path = file("notify2"), .manager = &manager, .on_change = [] {}});
  Supervisor::Spec task{.title = "task",
                        .command = {CORBOT_BIN_DIR "/corbot-rt", CORBOT_TEST_PROFILE, "--name", "stored",
                                    "--state-dir", directory_.string()}};
  ASSERT_TRUE(supervisor_->start(task));
  const auto stored = [&] {
    std::string names;
    while (auto message = systemd.receive()) {
      if (message->store || message->remove) names += (message->store ? " +" : " -") + message->fd_name;
    }
    return names;
  };
  std::string names;
  const std::vector<std::string> turns{" +task/corbot-task -task/corbot-task-2",
                                       " +task/corbot-task-2 -task/corbot-task",
                                       " +task/corbot-task -task/corbot-task-2"};
  for (const std::string& expected : turns) {
    ASSERT_TRUE(step_until([&] {
      names += stored();
      return names.size() >= expected.size() && supervisor_->all_ready();
    }));
    EXPECT_EQ(names, expected);
    names.clear();
    const pid_t now = supervisor_->pid_of("task");
    ASSERT_EQ(::kill(now, SIGKILL), 0);
    ASSERT_TRUE(step_until([&] { return !supervisor_->all_ready(); }));
  }
  supervisor_.reset();
  ::unsetenv("NOTIFY_SOCKET");
  ::unsetenv("CORBOT_RUN_DIR");
}

TEST_F(Notify, AChildThatRespondsIsLeftAlone) {
  Supervisor::Spec spec = child("ready feed");
  spec.respond_s = 4;  // a busy machine may let the child stand still for less than that
  ASSERT_TRUE(supervisor_->start(spec));
  const pid_t first = supervisor_->pid_of("child");
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_TRUE(step_until([&] { return std::chrono::steady_clock::now() - begin > std::chrono::seconds(5); }));
  EXPECT_EQ(supervisor_->pid_of("child"), first);
}

TEST_F(Notify, AChildThatDoesNotGetReadyAgainIsGivenUp) {
  Supervisor::Spec spec = child("ready exit=3", "exit=4");
  spec.last_lines = [] { return "\nthe ledger is a directory"; };
  ASSERT_TRUE(supervisor_->start(spec));
  try {
    (void)step_until([] { return false; });
    FAIL() << "it goes on for ever";
  } catch (const Failure& failure) {
    EXPECT_THAT(failure.what(), AllOf(HasSubstr("child died (exit code 4)"), HasSubstr("3 starts in a row"),
                                      HasSubstr("giving up\nthe ledger is a directory")));
  }
}

TEST_F(Notify, ARestartedChildThatHangsBeforeItIsReadyIsReplaced) {
  Supervisor::Spec spec = child("ready exit=3", "hang");
  spec.ready_within_s = 4;
  ASSERT_TRUE(supervisor_->start(spec));
  pid_t second = 0;
  ASSERT_TRUE(step_until([&] { return (second = supervisor_->pid_of("child")) != 0 && changes_ == 2; }));
  EXPECT_TRUE(step_until([&] { return changes_ == 3 && supervisor_->pid_of("child") != second; }));
}

TEST(BackOff, DoublesUpToFiveSecondsAndBeginsAnewAfterAHealthyRun) {
  BackOff back_off;
  for (const double expected_s : {0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 5.0, 5.0})
    EXPECT_DOUBLE_EQ(back_off.next_s(false), expected_s);
  EXPECT_DOUBLE_EQ(back_off.next_s(true), 0.1);
  EXPECT_DOUBLE_EQ(back_off.next_s(false), 0.2);
}

TEST(NotifyMessage, FieldsThatAreUnknownOrMalformedAreLeftOut) {
  const Notification message =
      parse_notification("READY=2\nFOO\n\nWATCHDOG=1\nSTATUS=a=b\nMAINPID=1\nFDNAME=n\nFDSTORE=1");
  EXPECT_FALSE(message.ready);
  EXPECT_TRUE(message.watchdog);
  EXPECT_TRUE(message.store);
  EXPECT_FALSE(message.remove);
  EXPECT_EQ(message.status, "a=b");
  EXPECT_EQ(message.fd_name, "n");
}

}  // namespace
}  // namespace corbot::cli
