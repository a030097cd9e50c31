// SPDX-License-Identifier: Apache-2.0
#include "sim/scene/servo_socket.h"

#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <string>

#include "rt/backends/serial/serial_port.h"
#include "support/paths.h"

namespace corbot::sim {
namespace {

using corbot::DeviceCause;
using rt::DeviceError;
using rt::SerialPort;
using namespace std::chrono_literals;

/// A controller in simulated time, and the robot's end of the line.
class ServoSocketTest : public ::testing::Test {
 protected:
  ServoSocketTest() {
    std::string directory = CORBOT_SCRATCH_DIR "/servos-XXXXXX";
    directory_ = ::mkdtemp(directory.data());
    path_ = directory_ / "robot.servos";
    servos_.emplace(path_, Ssc32Options{});
  }
  ~ServoSocketTest() override {
    servos_.reset();
    std::filesystem::remove_all(directory_);
  }
  void open(SerialPort& port) {
    port.open("unix:" + path_, 115200);
    servos_->step(now_ns_);
  }
  void send(SerialPort& port, const std::string& text) {
    port.write({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()},
               SerialPort::Clock::now() + 10s);
    servos_->step(now_ns_);
  }
  void pass(double time_s) {
    now_ns_ += static_cast<std::int64_t>(time_s * 1e9);
    servos_->step(now_ns_);
  }
  std::string read(SerialPort& port, std::size_t count) {
    std::string text(count, '\0');
    port.read_exactly({reinterpret_cast<std::uint8_t*>(text.data()), count}, SerialPort::Clock::now() + 10s);
    return text;
  }
  static DeviceCause cause_of_read(SerialPort& port) {
    std::uint8_t byte = 0;
    try {
      port.read_exactly({&byte, 1}, SerialPort::Clock::now() + 20ms);
    } catch (const DeviceError& error) {
      return error.cause();
    }
    return DeviceCause::kNone;
  }

  std::filesystem::path directory_;
  std::string path_;
  std::optional<ServoSocket> servos_;
  std::int64_t now_ns_{1'000'000'000};
};

TEST_F(ServoSocketTest, AnswersWhenTheyHaveLeftTheDevice) {
  SerialPort port;
  open(port);
  send(port, "VER\r");
  ASSERT_TRUE(servos_->next_answer_ns());
  EXPECT_GT(*servos_->next_answer_ns(), now_ns_);
  EXPECT_EQ(cause_of_read(port), DeviceCause::kNoAnswer) << "a line has a speed";
  pass(0.1);
  EXPECT_EQ(read(port, 15), "SSC32-V2.50USB\r");
  EXPECT_FALSE(servos_->next_answer_ns());
}

TEST_F(ServoSocketTest, TheServosHoldAfterACutAndTheNextClientFindsThem) {
  std::optional<SerialPort> first(std::in_place);
  open(*first);
  send(*first, "#0P1800\r");
  pass(1);
  EXPECT_EQ(servos_->device().shaft_us(0, now_ns_), 1800);
  send(*first, "#0P9");  // cut in the middle of a command
  first.reset();
  pass(1);
  EXPECT_FALSE(servos_->has_client());
  EXPECT_EQ(servos_->device().shaft_us(0, now_ns_), 1800);
  SerialPort second;
  open(second);
  EXPECT_TRUE(servos_->has_client());
  send(second, "\x1bQP0\r");
  pass(0.1);
  EXPECT_EQ(read(second, 1), "\xb4") << "1800 us in steps of 10";
}

TEST_F(ServoSocketTest, ASecondClientIsClosedAndTheFirstStays) {
  SerialPort first;
  SerialPort second;
  open(first);
  open(second);
  EXPECT_EQ(cause_of_read(second), DeviceCause::kHungUp);
  send(first, "VER\r");
  pass(0.1);
  EXPECT_EQ(read(first, 5), "SSC32");
}

TEST_F(ServoSocketTest, AClientThatTakesNoAnswersBlocksNothing) {
  SerialPort port;
  open(port);
  for (int i = 0; i < 20'000; ++i) {
    send(port, "VER\r");
    pass(0.01);
  }
  send(port, "#1P1600\r");
  pass(1);
  EXPECT_EQ(servos_->device().shaft_us(1, now_ns_), 1600);
}

TEST_F(ServoSocketTest, TheSocketIsPrivateAndReplacesOnlyADeadOne) {
  struct stat status {};
  ASSERT_EQ(::stat(path_.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777u, 0600u);
  EXPECT_THROW(ServoSocket(path_, {}), std::runtime_error) << "another program's";
  const std::string file = directory_ / "file";
  std::filesystem::create_directory(file);
  EXPECT_THROW(ServoSocket(file, {}), std::runtime_error) << "no socket";
  servos_.reset();
  EXPECT_FALSE(std::filesystem::exists(path_));
  const int dead = ::socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path_.copy(address.sun_path, sizeof(address.sun_path) - 1);
  ASSERT_EQ(::bind(dead, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  ::close(dead);
  EXPECT_NO_THROW(ServoSocket(path_, {})) << "left by a program that was killed";
}

}  // namespace
}  // namespace corbot::sim
