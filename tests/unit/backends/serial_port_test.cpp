// SPDX-License-Identifier: Apache-2.0
// The line itself: whose it is, and how it ends.
#include "rt/backends/serial/serial_port.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <vector>

namespace corbot::rt {
namespace {

using namespace std::chrono_literals;

class SerialPortTest : public ::testing::Test {
 protected:
  void SetUp() override {
    far_ = ::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    ASSERT_GE(far_, 0);
    ASSERT_EQ(::grantpt(far_), 0);
    ASSERT_EQ(::unlockpt(far_), 0);
    std::array<char, 64> name{};
    ASSERT_EQ(::ptsname_r(far_, name.data(), name.size()), 0);
    path_ = name.data();
    other_ = ::open(path_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    ASSERT_GE(other_, 0);
  }
  void TearDown() override {
    ::close(other_);
    ::close(far_);
  }
  /// Whether another program could open it.
  [[nodiscard]] bool is_exclusive() const {
    int exclusive = -1;
    return ::ioctl(other_, TIOCGEXCL, &exclusive) == 0 && exclusive == 1;
  }
  [[nodiscard]] bool has_come_through() const {
    pollfd ready{far_, POLLIN, 0};
    return ::poll(&ready, 1, 0) == 1 && (ready.revents & POLLIN) != 0;
  }

  int far_{-1};    ///< the controller's end
  int other_{-1};  ///< another program that has the line open
  std::string path_;
};

TEST_F(SerialPortTest, IsForOneProgramWhileItIsOpen) {
  SerialPort port;
  port.open(path_, 115200);
  EXPECT_TRUE(is_exclusive());
  port.close();
  EXPECT_FALSE(is_exclusive());
}

TEST_F(SerialPortTest, ARefusedProgramLeavesTheLineToItsOwner) {
  ASSERT_EQ(::flock(other_, LOCK_EX | LOCK_NB), 0);
  ASSERT_EQ(::ioctl(other_, TIOCEXCL), 0);
  SerialPort second;
  try {
    second.open(path_, 115200);
    FAIL();
  } catch (const DeviceError& error) {
    EXPECT_EQ(error.cause(), DeviceCause::kInUse);
  }
  EXPECT_TRUE(is_exclusive());
}

TEST_F(SerialPortTest, WhatAStuckLineDidNotTakeIsDropped) {
  SerialPort port;
  port.open(path_, 115200);
  const std::vector<std::uint8_t> much(100'000, 'x');
  try {
    port.write(much, SerialPort::Clock::now() + 10ms);
    FAIL();
  } catch (const DeviceError& error) {
    EXPECT_EQ(error.cause(), DeviceCause::kWriteTimeout);
  }
  port.close();
  // The far end has taken some, as a controller has; a terminal keeps that much for its reader.
  constexpr std::size_t kTaken = 4096;
  std::size_t count = 0;
  std::array<char, 1024> bytes{};
  for (ssize_t n = 0; (n = ::read(far_, bytes.data(), bytes.size())) > 0;)
    count += static_cast<std::size_t>(n);
  EXPECT_GT(count, 0u);
  EXPECT_LE(count, kTaken);
}

TEST_F(SerialPortTest, ADeadlineThatPassedUnseenIsNoSilenceOfTheDevice) {
  SerialPort port;
  port.open(path_, 115200);
  std::uint8_t answer = 0;
  const auto begin = SerialPort::Clock::now();
  EXPECT_THROW(port.read_exactly({&answer, 1}, begin - 1s), DeviceError);
  EXPECT_GE(SerialPort::Clock::now() - begin, 20ms) << "it looks for a while all the same";
}

TEST_F(SerialPortTest, WhatIsUnderWayAtAnOrderlyEndArrives) {
  SerialPort port;
  port.open(path_, 115200);
  const std::array<std::uint8_t, 1> last{'x'};
  port.write(last, SerialPort::Clock::now() + 10s);
  std::uint8_t answer = 0;
  EXPECT_THROW(port.read_exactly({&answer, 1}, SerialPort::Clock::now()), DeviceError);
  port.close();
  pollfd ready{far_, POLLIN, 0};
  EXPECT_EQ(::poll(&ready, 1, 20'000), 1);
  EXPECT_TRUE(has_come_through());
}

}  // namespace
}  // namespace corbot::rt
