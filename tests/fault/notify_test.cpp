// SPDX-License-Identifier: Apache-2.0
// Tests the reports of task and servant to their supervisor: READY=1 once, WATCHDOG=1 only while they
// advance.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "net/endpoint.h"
#include "net/giop_probe.h"
#include "shm/channel_client.h"
#include "shm/run_directory.h"
#include "support/paths.h"
#include "support/robot_rig.h"
#include "support/traced_thread.h"

namespace corbot::test {
namespace {

using Clock = std::chrono::steady_clock;

/// A supervisor's socket, in the kernel's own name space; each message with the process that sent it.
class NotifySocket {
 public:
  NotifySocket() : name_("@" + unique_name("notify")) {
    fd_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    name_.copy(address.sun_path, sizeof(address.sun_path));
    address.sun_path[0] = '\0';
    const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name_.size());
    const int on = 1;
    if (::setsockopt(fd_, SOL_SOCKET, SO_PASSCRED, &on, sizeof(on)) != 0 ||
        ::bind(fd_, reinterpret_cast<const sockaddr*>(&address), size) != 0)
      throw std::runtime_error("no socket for notifications");
  }
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;
  ~NotifySocket() { ::close(fd_); }

  [[nodiscard]] const std::string& name() const { return name_; }
  /// How often this process has sent this so far.
  int count(pid_t pid, const std::string& text) {
    read();
    return counts_[{pid, text}];
  }

 private:
  void read() {
    for (;;) {
      std::array<char, 256> text{};
      alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(ucred))> control{};
      iovec part{text.data(), text.size()};
      msghdr message{};
      message.msg_iov = &part;
      message.msg_iovlen = 1;
      message.msg_control = control.data();
      message.msg_controllen = control.size();
      const ssize_t size = ::recvmsg(fd_, &message, 0);
      if (size <= 0) return;
      ucred sender{};
      const cmsghdr* header = CMSG_FIRSTHDR(&message);
      if (header == nullptr || header->cmsg_type != SCM_CREDENTIALS) continue;
      std::memcpy(&sender, CMSG_DATA(header), sizeof(sender));
      ++counts_[{sender.pid, std::string(text.data(), static_cast<std::size_t>(size))}];
    }
  }

  std::string name_;
  int fd_;
  std::map<std::pair<pid_t, std::string>, int> counts_;
};

class Notify : public RobotRig {
 protected:
  void SetUp() override {
    ::setenv("NOTIFY_SOCKET", socket_.name().c_str(), 1);
    ::setenv("WATCHDOG_USEC", "400000", 1);
    RobotRig::SetUp();
  }
  void TearDown() override {
    if (rt_) rt_->signal(SIGCONT);
    if (servant_) servant_->signal(SIGCONT);
    RobotRig::TearDown();
    remove_left_behind(name_);  // what a supervisor's next task would need
    ::unsetenv("NOTIFY_SOCKET");
    ::unsetenv("WATCHDOG_USEC");
  }
  /// Both do; for longer than a self-check's answer holds, and as often as the interval asks for.
  void expect_well(const Process& process) {
    const int before = socket_.count(process.pid(), "WATCHDOG=1");
    const Clock::time_point begin = Clock::now();
    EXPECT_TRUE(wait_until(within(30), [&] {
      return socket_.count(process.pid(), "WATCHDOG=1") >= before + 8 &&
             Clock::now() - begin > std::chrono::seconds(2);
    }));
  }
  /// One is frozen: it reports nothing while the other does many times.
  void expect_silence(const Process& frozen, const Process& other) {
    const int others = socket_.count(other.pid(), "WATCHDOG=1");
    const int own = socket_.count(frozen.pid(), "WATCHDOG=1");
    ASSERT_TRUE(
        wait_until(within(30), [&] { return socket_.count(other.pid(), "WATCHDOG=1") >= others + 8; }));
    EXPECT_LE(socket_.count(frozen.pid(), "WATCHDOG=1"), own + 1) << "but one that was on its way";
  }

  /// The same where the other threads of the process run on, so that what it reported last may be a second
  /// old.
  void expect_that_it_falls_silent(const Process& hanging, const Process& other) {
    EXPECT_TRUE(wait_until(within(60), [&] {
      const int own = socket_.count(hanging.pid(), "WATCHDOG=1");
      const int others = socket_.count(other.pid(), "WATCHDOG=1");
      return wait_until(within(30), [&] { return socket_.count(other.pid(), "WATCHDOG=1") >= others + 8; }) &&
             socket_.count(hanging.pid(), "WATCHDOG=1") == own;
    }));
  }

  NotifySocket socket_;
};

TEST_F(Notify, BothReportThatTheyAreReadyAndWell) {
  EXPECT_TRUE(wait_until(within(20), [&] {
    return socket_.count(rt_->pid(), "READY=1") == 1 && socket_.count(servant_->pid(), "READY=1") == 1;
  }));
  expect_well(*rt_);
  expect_well(*servant_);
  EXPECT_EQ(socket_.count(rt_->pid(), "READY=1"), 1);
  EXPECT_EQ(socket_.count(servant_->pid(), "READY=1"), 1);
}

TEST_F(Notify, AFrozenProcessDoesNot) {
  expect_well(*rt_);
  expect_well(*servant_);
  rt_->signal(SIGSTOP);
  expect_silence(*rt_, *servant_);
  rt_->signal(SIGCONT);
  expect_well(*rt_);
  servant_->signal(SIGSTOP);
  expect_silence(*servant_, *rt_);
  servant_->signal(SIGCONT);
  expect_well(*servant_);
}

TEST_F(Notify, ACycleThatHangsEndsTheReportsOfItsTask) {
  if (const std::string why = why_not_traceable(); !why.empty()) GTEST_SKIP() << why;
  expect_well(*rt_);
  {
    const TracedThread loop(rt_->pid(), rt_->pid());  // the task's first thread
    expect_that_it_falls_silent(*rt_, *servant_);
    EXPECT_NO_THROW((void)Observer::of(name_)) << "its other threads run";
  }
  expect_well(*rt_);
}

TEST_F(Notify, AnOrbThatHangsEndsTheReportsOfItsServant) {
  if (const std::string why = why_not_traceable(); !why.empty()) GTEST_SKIP() << why;
  expect_well(*servant_);
  {
    std::vector<TracedThread> orb;
    std::size_t others = 0;
    for (const pid_t thread : threads_of(servant_->pid())) {
      if (thread_name(servant_->pid(), thread).starts_with("robot.")) {
        ++others;
      } else {
        orb.emplace_back(servant_->pid(), thread);
      }
    }
    ASSERT_GE(orb.size(), 2u);
    ASSERT_GE(others, 3u)
        << "that to the task, the one that looks at the task, and the one that asks the ORB";
    expect_that_it_falls_silent(*servant_, *rt_);
  }
  expect_well(*servant_);
}

TEST_F(Notify, AServantWithoutATaskNamesTheSupervisor) {
  EXPECT_EQ(rt_->terminate(), 0);
  EXPECT_EQ(servant_->terminate(), 0);
  start_servant();
  arm_ = connect();
  try {
    arm_->Ready();
    ADD_FAILURE() << "there is no task";
  } catch (const Corbot::NotReady& refused) {
    EXPECT_STREQ(refused.reason.in(),
                 ("the real-time task of " + name_ + " is not running; its supervisor starts it").c_str());
  }
  start_rt();
}

/// No line waits for a reader of the log: those without room are left out and counted.
TEST_F(Notify, ATaskWhoseLogIsNotReadReportsAllTheSame) {
  EXPECT_EQ(servant_->terminate(), 0);
  EXPECT_EQ(rt_->terminate(), 0);
  const std::string log = std::string(CORBOT_SCRATCH_DIR) + "/" + name_ + ".log";
  ASSERT_EQ(::mkfifo(log.c_str(), 0600), 0);
  const int fifo = ::open(log.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  ASSERT_GE(fifo, 0);
  rt_ = std::make_unique<Process>(std::vector<std::string>{"/bin/sh", "-c", "exec \"$@\" 2>\"$0\"", log,
                                                           std::string(CORBOT_BIN_DIR) + "/corbot-rt",
                                                           profile_, "--name", name_});
  ASSERT_TRUE(rt_->wait_line("ready", within(30)));
  const std::array<char, 4096> line{};
  const auto fill = [&] {
    while (::write(fifo, line.data(), line.size()) > 0 || ::write(fifo, line.data(), 1) > 0) {
    }
  };
  fill();
  const auto replace_servant = [&] {
    servant_->signal(SIGKILL);
    ASSERT_TRUE(servant_->wait(within(30)));
    expect_well(*rt_);
    start_servant();
  };
  start_servant();  // "servant connected" has no room
  expect_well(*rt_);
  replace_servant();
  std::array<char, 4096> read{};
  std::string text;
  const auto drain = [&] {
    for (ssize_t n = 0; (n = ::read(fifo, read.data(), read.size())) > 0;)
      text.append(read.data(), static_cast<std::size_t>(n));
    return text.find(" lines were left out") != std::string::npos;
  };
  (void)drain();
  replace_servant();
  EXPECT_TRUE(wait_until(within(30), drain)) << text;
  arm_ = connect();
  EXPECT_TRUE(wait_for(Corbot::Standby));
  std::atomic<bool> ended{false};
  std::thread reader([&] {
    while (!ended) {
      drain();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  arm_ = Corbot::Arm::_nil();
  EXPECT_EQ(servant_->terminate(), 0);
  servant_.reset();
  rt_->signal(SIGTERM);
  EXPECT_EQ(rt_->wait(within(30)), 0);
  ended = true;
  reader.join();
  ::close(fifo);
  ::unlink(log.c_str());
}

TEST_F(Notify, TheProbeIsAnsweredByAnOrbAndByNothingElse) {
  corbot_giop_probe probe;
  corbot_giop_probe_init(&probe, "127.0.0.1", port_, nullptr, name_.c_str());
  for (int i = 0; i < 3; ++i) EXPECT_EQ(corbot_giop_probe_answers(&probe, 10'000), 1);
  // On the same connection, and on a new one once the ORB has closed it.
  const int kept = probe.fd;
  EXPECT_EQ(corbot_giop_probe_answers(&probe, 10'000), 1);
  EXPECT_EQ(probe.fd, kept);
  ::shutdown(probe.fd, SHUT_RDWR);
  EXPECT_EQ(corbot_giop_probe_answers(&probe, 10'000), 1);
  servant_->signal(SIGSTOP);
  const Clock::time_point begin = Clock::now();
  EXPECT_EQ(corbot_giop_probe_answers(&probe, 300), 0) << "connected, and no answer";
  EXPECT_LT(Clock::now() - begin, std::chrono::seconds(30));
  servant_->signal(SIGCONT);
  EXPECT_EQ(corbot_giop_probe_answers(&probe, 10'000), 1);
  corbot_giop_probe_close(&probe);

  int port = 0;
  std::array<char, CORBOT_WHY> why{};
  const int deaf = corbot_listen("127.0.0.1", 0, &port, why.data());
  ASSERT_GE(deaf, 0) << why.data();
  corbot_giop_probe_init(&probe, "127.0.0.1", port, nullptr, name_.c_str());
  EXPECT_EQ(corbot_giop_probe_answers(&probe, 200), 0) << "accepts, and says nothing";
  ::close(deaf);
  EXPECT_EQ(corbot_giop_probe_answers(&probe, 200), 0) << "nobody listens";
  corbot_giop_probe_close(&probe);
}

}  // namespace
}  // namespace corbot::test
