// SPDX-License-Identifier: Apache-2.0
// The layout of the units corbot-rt@ and corbot-servant@: the task is one user, the servant another, both in
// a group whose members may stop the robot. Only root can run it, to start processes of other users.
#include <fcntl.h>
#include <fmt/core.h>
#include <grp.h>
#include <gtest/gtest.h>
#include <pwd.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "shm/channel_client.h"
#include "support/paths.h"
#include "support/ports.h"
#include "support/process.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;

/// Users that every Debian has, and that own nothing.
constexpr const char* kTask = "daemon";
constexpr const char* kServant = "bin";
constexpr const char* kMember = "games";
constexpr const char* kStranger = "nobody";
constexpr const char* kGroup = "users";

/// Whether that user's processes may start what was built here; the first directory that they may not enter.
std::string closed_directory(const fs::path& file) {
  for (fs::path each = file.parent_path(); each.has_relative_path(); each = each.parent_path()) {
    struct stat status {};
    if (::stat(each.c_str(), &status) != 0 || (status.st_mode & S_IXOTH) == 0) return each.string();
  }
  return "";
}

class TwoUsers : public ::testing::Test {
 protected:
  void SetUp() override {
    if (::geteuid() != 0) GTEST_SKIP() << "skipped: not root, so there is one user only";
    for (const char* user : {kTask, kServant, kMember, kStranger}) {
      if (::getpwnam(user) == nullptr) GTEST_SKIP() << "skipped: no user " << user << " here";
    }
    if (::getgrnam(kGroup) == nullptr) GTEST_SKIP() << "skipped: no group " << kGroup << " here";
    if (::access("/usr/bin/setpriv", X_OK) != 0) GTEST_SKIP() << "skipped: setpriv not found";
    const std::string closed = closed_directory(std::string(CORBOT_BIN_DIR) + "/corbot");
    if (!closed.empty()) GTEST_SKIP() << "skipped: other users may not enter " << closed;
    group_ = ::getgrnam(kGroup)->gr_gid;
    name_ = unique_name("users");
    address_ = fmt::format("127.0.0.1:{}/{}", free_port(), name_);
    make_directories();
    ::setenv("CORBOT_RUN_DIR", (directory_ / "run").c_str(), 1);
    start();
  }
  void TearDown() override {
    if (directory_.empty()) return;
    if (servant_) {
      servant_->signal(SIGCONT);
      EXPECT_EQ(servant_->terminate(), 0) << servant_->errors();
    }
    if (task_) {
      EXPECT_EQ(task_->terminate(), 0) << task_->errors();
    }
    EXPECT_FALSE(fs::exists(directory_ / "run" / (name_ + ".sock")));
    ::unsetenv("CORBOT_RUN_DIR");
    fs::remove_all(directory_);
  }

  /// A command of that user, with the group or without.
  [[nodiscard]] std::vector<std::string> as(const char* user, bool in_group,
                                            std::vector<std::string> command) const {
    const std::string groups = in_group ? fmt::format("--groups={}", group_) : "--clear-groups";
    command.insert(command.begin(), {"/usr/bin/setpriv", fmt::format("--reuid={}", user), "--regid=nogroup",
                                     groups, "--no-new-privs", "--pdeathsig=KILL", "--"});
    command[7] = std::string(CORBOT_BIN_DIR) + "/" + command[7];
    return command;
  }
  [[nodiscard]] std::vector<std::string> environment(const char* user) const {
    return {"XDG_RUNTIME_DIR=" + (directory_ / "nothing").string(),
            "CORBOT_STATE_DIR=" + (directory_ / user).string()};
  }
  RunResult stop(const char* user, bool in_group) {
    return run(as(user, in_group, {"corbot", "stop", "--robot", name_}), 60, environment(user));
  }
  /// A motion of a minute, asked for over the network.
  std::unique_ptr<Process> begin_motion() {
    auto motion = std::make_unique<Process>(
        as(kStranger, false,
           {"corbot", "joints", "80", "20", "30", "40", "--time", "60", "--robot", address_}),
        environment(kStranger));
    EXPECT_TRUE(wait_until(within(30), [&] { return newest().state == RtState::kMoving; }))
        << motion->errors();
    return motion;
  }
  [[nodiscard]] Snapshot newest() const {
    Snapshot now{};
    const Observer observer = Observer::of(name_);
    (void)last_snapshot(observer.task(), now);
    return now;
  }

  fs::path directory_;
  std::string name_;
  std::string address_;
  gid_t group_{};
  std::unique_ptr<Process> task_;
  std::unique_ptr<Process> servant_;

 private:
  /// As RuntimeDirectory= and StateDirectory= make them.
  void make_directories() {
    std::string path = (fs::temp_directory_path() / "corbot-users-XXXXXX").string();
    ASSERT_NE(::mkdtemp(path.data()), nullptr);
    directory_ = path;
    ASSERT_EQ(::chmod(path.c_str(), 0755), 0);
    const auto make = [&](const std::string& name, const char* owner, gid_t group, mode_t mode) {
      const fs::path made = directory_ / name;
      fs::create_directory(made);
      ASSERT_EQ(::chown(made.c_str(), ::getpwnam(owner)->pw_uid, group), 0);
      ASSERT_EQ(::chmod(made.c_str(), mode), 0);
    };
    make("run", kTask, group_, 0750);
    for (const char* user : {kTask, kServant}) make(user, user, group_, 0700);
  }
  void start() {
    task_ = std::make_unique<Process>(as(kTask, true,
                                         {"corbot-rt", CORBOT_TEST_PROFILE, "--name", name_, "--servant-user",
                                          kServant, "--stop-group", kGroup}),
                                      environment(kTask));
    ASSERT_TRUE(task_->wait_line("ready", within(30))) << task_->errors();
    const std::string endpoint = address_.substr(0, address_.find('/'));
    servant_ = std::make_unique<Process>(as(kServant, true,
                                            {fs::path(servant_program(CORBOT_BIN_DIR)).filename(),
                                             CORBOT_TEST_PROFILE, "--name", name_, "--endpoint", endpoint}),
                                         environment(kServant));
    ASSERT_TRUE(servant_->wait_line("ready", within(30))) << servant_->errors();
  }
};

/// Runs `body` in a process of that user; its exit code.
int in_process_of(const char* user, std::optional<gid_t> group, const std::function<int()>& body) {
  const passwd* const account = ::getpwnam(user);
  const pid_t pid = ::fork();
  if (pid == 0) {
    int code = 99;
    const gid_t groups[] = {group.value_or(0)};
    if (::setgroups(group ? 1 : 0, groups) == 0 &&
        ::setresgid(account->pw_gid, account->pw_gid, account->pw_gid) == 0 &&
        ::setresuid(account->pw_uid, account->pw_uid, account->pw_uid) == 0) {
      try {
        code = body();
      } catch (const SegmentError& error) {
        code = 50 + static_cast<int>(error.kind());
      }
    }
    ::_exit(code);
  }
  int status = 0;
  ::waitpid(pid, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

/// Every way to write memory that one has a descriptor of; 0: none works.
int ways_to_write(const Descriptor& memory) {
  const std::string path = "/proc/self/fd/" + std::to_string(memory.get());
  if (const Descriptor again(::open(path.c_str(), O_RDWR | O_CLOEXEC)); again) return 1;
  if (::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED, memory.get(), 0) != MAP_FAILED) return 2;
  void* const mapped = ::mmap(nullptr, 4096, PROT_READ, MAP_SHARED, memory.get(), 0);
  if (mapped == MAP_FAILED || ::mprotect(mapped, 4096, PROT_READ | PROT_WRITE) == 0) return 3;
  if (::pwrite(memory.get(), "x", 1, 0) >= 0) return 4;
  if (::ftruncate(memory.get(), 0) == 0) return 5;
  if (::fchmod(memory.get(), 0666) == 0) return 6;
  return 0;
}

/// Asks in that role; a descriptor of the task's segment, where it gets one.
Descriptor task_memory(const std::string& robot, MessageType role) {
  const Descriptor connection = RunDirectory::open(false)->connect(robot);
  if (!send_message(connection, Message::make(role, robot))) return {};
  Message answer;
  if (!wait_until(within(30), [&] { return receive_message(connection, answer) != Received::kNothing; }))
    return {};
  return std::move(answer.task);
}

TEST_F(TwoUsers, TheServantCannotWriteWhatTheTaskGoesBy) {
  const std::string robot = name_;
  const std::string memory_of_task = fmt::format("/proc/{}/mem", task_->pid());
  const auto attempt = [&] {
    const Descriptor memory = task_memory(robot, MessageType::kObserverHello);
    if (!memory) return 20;
    if (const Descriptor whole(::open(memory_of_task.c_str(), O_RDWR | O_CLOEXEC)); whole) return 21;
    if (::kill(task_->pid(), SIGSTOP) == 0) return 22;
    return ways_to_write(memory);
  };
  EXPECT_EQ(in_process_of(kServant, group_, attempt), 0);
  const int stop_segment = in_process_of(kServant, group_, [&] {
    const Descriptor connection = RunDirectory::open(false)->connect(robot);
    const bool is_removed = ::unlink(RunDirectory::open(false)->socket_path(robot).c_str()) == 0;
    return is_removed ? 1 : 0;
  });
  EXPECT_EQ(stop_segment, 0) << "the task's socket is not the servant's to remove";
}

TEST_F(TwoUsers, AMemberOfTheStopGroupStopsAndSeesIt) {
  const auto motion = begin_motion();
  servant_->signal(SIGSTOP);
  const RunResult stopped = stop(kMember, true);
  EXPECT_EQ(stopped.code, 0) << stopped.errors;
  EXPECT_EQ(newest().state, RtState::kStandby);
  EXPECT_LT(newest().position_q[0], 1.3) << "on its path";
  servant_->signal(SIGCONT);
  const auto end = motion->wait(within(30));
  ASSERT_TRUE(end);
  EXPECT_EQ(WEXITSTATUS(*end), 4) << motion->errors();
}

TEST_F(TwoUsers, AMemberOfTheStopGroupMayDoNothingElse) {
  const std::string robot = name_;
  EXPECT_EQ(in_process_of(kMember, group_,
                          [&] {
                            const Descriptor memory = task_memory(robot, MessageType::kStopHello);
                            return memory ? ways_to_write(memory) : 20;
                          }),
            0);
  constexpr int kRefused = 50 + static_cast<int>(SegmentError::Kind::kPermission);
  EXPECT_EQ(in_process_of(kMember, group_,
                          [&] {
                            (void)Observer::of(robot);
                            return 1;
                          }),
            kRefused)
      << "the servant's segment is not for it";
  EXPECT_EQ(in_process_of(kMember, group_,
                          [&] {
                            ServantPort port(robot, 0, nullptr);
                            (void)port.connect([] { return false; });
                            return 1;
                          }),
            kRefused);
}

/// It holds whatever it can that is for the moment of starting and ending.
TEST_F(TwoUsers, AMemberOfTheStopGroupCannotKeepATaskFromEndingOrStarting) {
  const std::string run = (directory_ / "run").string();
  int from_holder[2];
  int to_holder[2];
  ASSERT_EQ(::pipe2(from_holder, O_CLOEXEC) | ::pipe2(to_holder, O_CLOEXEC), 0);
  std::thread holder([&] {
    (void)in_process_of(kMember, group_, [&] {
      for (const auto& entry : fs::directory_iterator(run)) {
        const int fd = ::open(entry.path().c_str(), O_RDONLY);
        if (fd >= 0) (void)::flock(fd, LOCK_EX | LOCK_NB);
      }
      const int fd = ::open(run.c_str(), O_RDONLY | O_DIRECTORY);
      (void)!::write(from_holder[1], ::flock(fd, LOCK_EX | LOCK_NB) == 0 ? "l" : "n", 1);
      ::close(to_holder[1]);
      char byte = 0;
      return static_cast<int>(::read(to_holder[0], &byte, 1));  // until the test closes its end
    });
  });
  char is_locked = 0;
  EXPECT_EQ(::read(from_holder[0], &is_locked, 1), 1);
  EXPECT_EQ(is_locked, 'l') << "or this proves nothing";
  EXPECT_EQ(servant_->terminate(), 0);
  EXPECT_EQ(task_->terminate(), 0) << task_->errors();
  EXPECT_FALSE(fs::exists(fs::path(run) / (name_ + ".sock")));
  ::close(to_holder[1]);
  holder.join();
  for (const int fd : {from_holder[0], from_holder[1], to_holder[0]}) ::close(fd);
}

TEST_F(TwoUsers, AStrangerCanNeitherStopNorSee) {
  const auto motion = begin_motion();
  const std::uint64_t stops = newest().stops_done;
  const RunResult stopped = stop(kStranger, false);
  EXPECT_NE(stopped.code, 0);
  EXPECT_NE(stopped.errors.find("ermission"), std::string::npos) << stopped.errors;
  for (const MessageType role : {MessageType::kObserverHello, MessageType::kStopHello}) {
    EXPECT_NE(in_process_of(kStranger, std::nullopt, [&] { return task_memory(name_, role) ? 0 : 1; }), 0);
  }
  EXPECT_EQ(newest().stops_done, stops);
  EXPECT_EQ(newest().state, RtState::kMoving);
  EXPECT_EQ(stop(kMember, true).code, 0);
  EXPECT_TRUE(motion->wait(within(30)));
}

}  // namespace
}  // namespace corbot::test
