// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

#include "support/paths.h"
#include "support/process.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::StartsWith;

constexpr double kPatience_s = 20.0;

/// A host that has the simulated line open.
class Host {
 public:
  explicit Host(const std::string& link)
      : fd_(::open(link.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)) {
    termios line{};
    if (fd_ < 0 || ::tcgetattr(fd_, &line) != 0) return;
    ::cfmakeraw(&line);
    ::tcsetattr(fd_, TCSANOW, &line);
  }
  Host(const Host&) = delete;
  Host& operator=(const Host&) = delete;
  ~Host() { close(); }
  void close() {
    if (fd_ >= 0) ::close(std::exchange(fd_, -1));
  }

  [[nodiscard]] bool is_open() const { return fd_ >= 0; }
  [[nodiscard]] int fd() const { return fd_; }
  void send(const std::string& text) const {
    ASSERT_EQ(::write(fd_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  /// So many bytes, or what has come until patience ends.
  [[nodiscard]] std::string receive(std::size_t count) const {
    std::string text;
    const auto deadline = within(kPatience_s);
    while (text.size() < count && std::chrono::steady_clock::now() < deadline) {
      pollfd ready{fd_, POLLIN, 0};
      ::poll(&ready, 1, 100);
      char buffer[256];
      const ssize_t n = ::read(fd_, buffer, std::min(sizeof(buffer), count - text.size()));
      if (n > 0) text.append(buffer, static_cast<std::size_t>(n));
    }
    return text;
  }
  [[nodiscard]] std::string ask(const std::string& text, std::size_t count) const {
    send(text);
    return receive(count);
  }
  [[nodiscard]] bool is_hung_up() const {
    pollfd ready{fd_, POLLIN, 0};
    return wait_until(within(kPatience_s),
                      [&] { return ::poll(&ready, 1, 0) > 0 && (ready.revents & POLLHUP) != 0; });
  }

 private:
  int fd_;
};

class CorbotSim : public testing::Test {
 protected:
  CorbotSim() : link_(std::string(CORBOT_SCRATCH_DIR) + "/" + unique_name("sim")) {}
  ~CorbotSim() override {
    sim_.reset();
    std::error_code ignored;
    fs::remove(link_, ignored);
    fs::remove(record(), ignored);
  }

  void start(std::vector<std::string> words) {
    words.insert(words.begin(), CORBOT_BIN_DIR "/corbot-sim");
    words.insert(words.end(), {"--pty", link_});
    sim_.emplace(std::move(words));
    ASSERT_EQ(sim_->wait_line("ready", within(kPatience_s)), "ready " + link_) << sim_->errors();
  }
  /// The reply to a command.
  std::string command(const std::string& text, const std::string& begins_with) {
    sim_->send(text);
    return sim_->wait_line(begins_with, within(kPatience_s)).value_or("no answer to " + text);
  }
  void accepted(const std::string& text) { ASSERT_EQ(command(text, "ok"), "ok " + text); }
  /// Waits until the pulses are these.
  void expect_pulses(const std::string& pulses) {
    std::string last;
    EXPECT_TRUE(wait_until(within(kPatience_s), [&] {
      return (last = command("pulses", "pulses")) == pulses;
    })) << last;
  }
  [[nodiscard]] std::string record() const { return link_ + ".csv"; }

  std::string link_;
  std::optional<Process> sim_;
};

constexpr std::size_t kVersionLength = 15;

TEST_F(CorbotSim, IsAnSsc32UUntilItIsTerminated) {
  start({"ssc32"});
  ASSERT_TRUE(fs::is_symlink(link_));
  const Host host(link_);
  EXPECT_EQ(host.ask("VER\r", kVersionLength), "SSC32-V2.50USB\r");
  expect_pulses("pulses");
  EXPECT_EQ(host.ask("#5P1600#17P750T1000\rQP5 QP17\r", 2), (std::string{'\xA0', 'K'}));
  expect_pulses("pulses 5=1600 17=750");
  EXPECT_EQ(sim_->terminate(), 0);
  EXPECT_TRUE(host.is_hung_up());
  EXPECT_FALSE(fs::exists(fs::symlink_status(link_)));
}

TEST_F(CorbotSim, SaysByHowMuchItWasLate) {
  start({"ssc32", "--record", record()});
  (void)command("late", "late");
  constexpr auto kStopped = std::chrono::milliseconds(200);
  ASSERT_EQ(::kill(sim_->pid(), SIGSTOP), 0);
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_TRUE(
      wait_until(within(kPatience_s), [&] { return std::chrono::steady_clock::now() - begin > kStopped; }));
  ASSERT_EQ(::kill(sim_->pid(), SIGCONT), 0);
  EXPECT_GT(std::stoll(command("late", "late").substr(5)), 150'000'000);
}

TEST_F(CorbotSim, IsAnOlderSsc32) {
  start({"ssc32", "--model", "ssc32", "--baud", "38400"});
  const Host host(link_);
  EXPECT_EQ(host.ask("ver\r", 13), "SSC32-1.06XE\r");
  host.send("#1P2500S1\r");
  expect_pulses("pulses 1=500");
}

TEST_F(CorbotSim, IsAMaestro) {
  start({"maestro", "--detect-baud"});
  const Host host(link_);
  host.send("\x84\x03\x71\x2E\xA1");  // before its baud is known
  host.send({'\xAA'});
  EXPECT_EQ(host.ask("\x84\x02\x71\x2E\x90\x02", 2), "\x71\x17");
  expect_pulses("pulses 2=1500.25");
  EXPECT_EQ(command("input A 1", "error"), "error: the device has no input A");
}

TEST_F(CorbotSim, RefusesALineThatIsTooLongAsAWhole) {
  start({"ssc32"});
  for (const std::size_t size : {257U, 600U, 2000U}) {
    sim_->send(std::string(size, ' ') + "power off");  // the reads end somewhere in it
    EXPECT_EQ(sim_->wait_line("", within(kPatience_s)), "error: a line has 256 characters at most");
  }
  accepted("power off");
}

TEST_F(CorbotSim, IsAMaestroThatWantsACrc) {
  start({"maestro", "--crc"});
  const Host host(link_);
  host.send("\x84\x02\x71\x2E\x01\xA1");  // wrong, and A1 without one
  const std::string errors = host.ask("\x1B", 2);
  EXPECT_EQ(errors, (std::string{'\x08', '\0'}));
  expect_pulses("pulses");
}

TEST_F(CorbotSim, KeepsTheSpeedOfTheLineBothWays) {
  start({"ssc32", "--model", "ssc32", "--baud", "2400"});
  const Host host(link_);
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(host.ask("VER\r", 13), "SSC32-1.06XE\r");
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds((4 + 13) * 10'000 / 2400));
}

TEST_F(CorbotSim, TakesMoreThanTheLineHoldsAtOnce) {
  start({"ssc32"});
  const Host host(link_);
  std::string text;
  for (int i = 0; i < 300; ++i) text += "QP1\r";
  EXPECT_EQ(host.ask(text, 300), std::string(300, '\0'));
}

TEST_F(CorbotSim, DropsAndGarblesAndIsSilent) {
  start({"ssc32"});
  const Host host(link_);
  accepted("drop 2");
  EXPECT_EQ(host.ask("xyVER\r", kVersionLength), "SSC32-V2.50USB\r");
  accepted("garble 2");
  EXPECT_EQ(host.ask("VER\r", kVersionLength),
            "\xAC\xAC"
            "C32-V2.50USB\r");
  accepted("silent on");
  host.send("Q\r#1P1500\r");
  expect_pulses("pulses 1=1500");
  accepted("silent off");
  EXPECT_EQ(host.ask("VER\r", kVersionLength), "SSC32-V2.50USB\r");
}

TEST_F(CorbotSim, AnswersSomeQueriesAndNotOthers) {
  start({"ssc32"});
  const Host host(link_);
  EXPECT_EQ(host.ask("#1P1500\rQP1\r", 1), "\x96");
  accepted("deaf position on");
  EXPECT_EQ(host.ask("QP1\rA\r", 1), "1");
  accepted("deaf position off");
  accepted("garble input on");
  EXPECT_EQ(host.ask("A\rQP1\r", 2), "\xCE\x96");
  accepted("garble input off");
  accepted("half version on");
  EXPECT_EQ(host.ask("VER\rA\r", 8), "SSC32-V1");
  accepted("lose input 2");
  EXPECT_EQ(host.ask("A\rA\rQP1\r", 2), "1\x96");
  accepted("lose input 0");
  accepted("delay input 50");
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(host.ask("A\r", 1), "1");
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(50));
  EXPECT_EQ(command("deaf errors on", "error"),
            "error: the device has no query 'errors', but analog, input, moving, position, version");
  EXPECT_THAT(command("deaf input", "error"), StartsWith("error: 'deaf input' is none of"));
}

TEST_F(CorbotSim, HandsAnswersOverInBatches) {
  start({"ssc32"});
  const Host host(link_);
  accepted("batch 500");
  ASSERT_EQ(host.ask("A\r", 1), "1");  // now, an instant of the adapter has just passed
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(host.ask("A\r", 1), "1");
  EXPECT_EQ(host.ask("A\r", 1), "1");
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(500));
  accepted("batch 60000");
  host.send("VER\rVER\rVER\rVER\r");
  constexpr std::size_t kPacket = 62;  // of answers; how many go with it, the reads of the emulator decide
  std::string got = host.ask("VER\rA\r", kPacket);
  EXPECT_EQ(got.size(), kPacket) << "a full packet goes at once";
  accepted("batch 0");
  got += host.ask("Q\r", 5 * kVersionLength + 2 - got.size());
  EXPECT_EQ(got.size(), 5 * kVersionLength + 2);
  EXPECT_THAT(got, ::testing::EndsWith("1.")) << "and what it still had";
}

TEST_F(CorbotSim, LosesItsPowerAndGetsItBack) {
  start({"ssc32"});
  const Host host(link_);
  host.send("#1P1500\r");
  expect_pulses("pulses 1=1500");
  accepted("power off");
  EXPECT_EQ(command("pulses", "pulses"), "pulses");
  host.send("#1P1500\rVER\r");
  expect_pulses("pulses");
  accepted("power on");
  host.send("#1P1600\rQP1\r");
  // Bytes that were sent before may still have been on their way.
  EXPECT_TRUE(wait_until(within(kPatience_s), [&] { return host.receive(1) == "\xA0"; }));
  accepted("brownout 50");
  expect_pulses("pulses");
  EXPECT_TRUE(wait_until(within(kPatience_s), [&] {
    host.send("#1P1700\r");
    return command("pulses", "pulses") == "pulses 1=1700";
  }));
}

TEST_F(CorbotSim, HearsGarbageAtAnotherSpeed) {
  start({"ssc32", "--baud", "9600"});
  const Host host(link_);
  EXPECT_EQ(host.ask("VER\r", kVersionLength), "SSC32-V2.50USB\r");
  termios line{};
  ASSERT_EQ(::tcgetattr(host.fd(), &line), 0);
  EXPECT_EQ(::cfgetospeed(&line), static_cast<speed_t>(B9600)) << "as the line is until a program sets it";
  ::cfsetspeed(&line, B115200);
  ASSERT_EQ(::tcsetattr(host.fd(), TCSANOW, &line), 0);
  host.send("#1P1500\rVER\r");
  // It has read them before it answers a command.
  accepted("silent off");
  ::cfsetspeed(&line, B9600);
  ASSERT_EQ(::tcsetattr(host.fd(), TCSANOW, &line), 0);
  EXPECT_EQ(host.ask("\x1BVER\r", kVersionLength), "SSC32-V2.50USB\r");
  EXPECT_EQ(command("pulses", "pulses"), "pulses");
}

TEST_F(CorbotSim, ResetsAndTakesInputs) {
  start({"ssc32"});
  const Host host(link_);
  host.send("#1P1500\r");
  expect_pulses("pulses 1=1500");
  accepted("reset");
  EXPECT_EQ(command("pulses", "pulses"), "pulses");
  EXPECT_EQ(host.ask("A\r", 1), "1");
  accepted("input A 0");
  EXPECT_EQ(host.ask("A\r", 1), "0");
  accepted("input A 1");
  EXPECT_EQ(host.ask("A\r", 1), "1");
}

TEST_F(CorbotSim, UnplugsAndPlugsIn) {
  start({"ssc32"});
  const Host host(link_);
  EXPECT_EQ(host.ask("#1P1500\rQP1\r", 1), "\x96");
  accepted("unplug");
  EXPECT_TRUE(host.is_hung_up());
  char byte = 0;
  EXPECT_LE(::read(host.fd(), &byte, 1), 0);
  EXPECT_EQ(::write(host.fd(), "Q", 1), -1);
  EXPECT_EQ(errno, EIO);
  EXPECT_FALSE(fs::exists(fs::symlink_status(link_)));
  accepted("unplug");
  EXPECT_EQ(command("plug", "ready"), "ready " + link_);
  EXPECT_EQ(command("plug", "error"), "error: it is plugged in");
  const Host next(link_);
  EXPECT_EQ(next.ask("QP1\r", 1), "\x96");  // it had its power all the time
}

TEST_F(CorbotSim, ServesOneHostAfterAnother) {
  start({"ssc32"});
  for (int i = 0; i < 3; ++i) {
    Host host(link_);
    ASSERT_TRUE(host.is_open());
    EXPECT_EQ(host.ask("VER\r", kVersionLength), "SSC32-V2.50USB\r");
    // Dies without giving up its exclusive use, which keeps out all users but root.
    ASSERT_EQ(::ioctl(host.fd(), TIOCEXCL), 0);
    host.close();
    ASSERT_TRUE(wait_until(within(kPatience_s), [&] { return Host(link_).is_open(); }));
  }
}

TEST_F(CorbotSim, RefusesUnknownCommands) {
  start({"ssc32"});
  EXPECT_EQ(command("dance", "error").substr(0, 28), "error: 'dance' is none of: d");
  EXPECT_THAT(command("drop x", "error"), StartsWith("error: 'drop x'"));
  EXPECT_THAT(command("input A 2", "error"), StartsWith("error: 'input A 2'"));
  EXPECT_THAT(command("silent", "error"), StartsWith("error: 'silent'"));
  EXPECT_EQ(command("input Z 1", "error"), "error: the device has no input Z");
}

TEST_F(CorbotSim, ServesWithClosedInput) {
  sim_.emplace(std::vector<std::string>{"/bin/sh", "-c",
                                        "exec '" CORBOT_BIN_DIR "/corbot-sim"
                                        "' ssc32 --pty '" +
                                            link_ + "' < /dev/null"});
  ASSERT_EQ(sim_->wait_line("ready", within(kPatience_s)), "ready " + link_);
  const Host host(link_);
  EXPECT_EQ(host.ask("VER\r", kVersionLength), "SSC32-V2.50USB\r");
  EXPECT_EQ(sim_->terminate(), 0);
}

TEST_F(CorbotSim, RecordsPulsesAndShafts) {
  start({"ssc32", "--record", record()});
  const Host host(link_);
  host.send("#3P1740\r");
  std::string text;
  EXPECT_TRUE(wait_until(within(kPatience_s), [&] {
    std::ifstream file(record());
    text.assign(std::istreambuf_iterator<char>(file), {});
    return text.find(",3,1740.00,1740.00\n") != std::string::npos;
  })) << text;
  EXPECT_THAT(text, StartsWith("time_ns,channel,pulse_us,shaft_us\n"));
  EXPECT_THAT(text, HasSubstr(",3,1740.00,1500.00\n"));  // its first frame
  EXPECT_THAT(text, HasSubstr("0000000,3,1740.00,1548.00\n"));
}

TEST_F(CorbotSim, ReplacesALinkButNothingElse) {
  fs::create_symlink("/nowhere/at/all", link_);
  start({"ssc32"});
  EXPECT_TRUE(Host(link_).is_open());
  // The simulator leaves a link alone that another program has made.
  fs::remove(link_);
  fs::create_symlink("/nowhere/at/all", link_);
  EXPECT_EQ(sim_->terminate(), 0);
  EXPECT_EQ(fs::read_symlink(link_), "/nowhere/at/all");
  fs::remove(link_);

  std::ofstream(link_) << "precious";
  const RunResult refused = run({CORBOT_BIN_DIR "/corbot-sim", "ssc32", "--pty", link_});
  EXPECT_EQ(refused.code, 1);
  EXPECT_THAT(refused.errors, HasSubstr(link_ + " is no symbolic link"));
  EXPECT_TRUE(fs::is_regular_file(link_));
}

TEST_F(CorbotSim, RefusesAWrongCommandLine) {
  const std::vector<std::vector<std::string>> wrong{{},
                                                    {"pca9685", "--pty", link_},
                                                    {"ssc32"},
                                                    {"ssc32", "--pty", link_, "--model", "ssc64"},
                                                    {"ssc32", "--pty", link_, "--baud", "2400"},
                                                    {"ssc32", "--pty", link_, "--baud", "fast"},
                                                    {"ssc32", "--pty", link_, "--crc"},
                                                    {"maestro", "--pty", link_, "--baud", "0"},
                                                    {"maestro", "--pty", link_, "--model", "ssc32"}};
  for (std::vector<std::string> words : wrong) {
    words.insert(words.begin(), CORBOT_BIN_DIR "/corbot-sim");
    const RunResult result = run(words);
    EXPECT_EQ(result.code, 2) << testing::PrintToString(words);
    EXPECT_THAT(result.errors, StartsWith("corbot-sim: "));
    EXPECT_FALSE(fs::exists(fs::symlink_status(link_)));
  }
  EXPECT_EQ(
      run({CORBOT_BIN_DIR "/corbot-sim", "ssc32", "--pty", link_, "--record", "/nowhere/at/all.csv"}).code,
      1);
  EXPECT_THAT(run({CORBOT_BIN_DIR "/corbot-sim", "pca9685", "--pty", link_}).errors,
              HasSubstr("unknown device 'pca9685' (see"));
  EXPECT_THAT(run({CORBOT_BIN_DIR "/corbot-sim", "--help"}).output, HasSubstr("unplug"));
}

}  // namespace
}  // namespace corbot::test
