// SPDX-License-Identifier: Apache-2.0
// The line itself: whose it is, and how it ends.
#include "rt/backends/serial/serial_port.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <functional>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "rt/backends/serial/ssc32.h"
#include "support/paths.h"

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

/// A controller that listens at a socket.
class SerialSocketTest : public ::testing::Test {
 protected:
  SerialSocketTest() {
    std::string directory = CORBOT_SCRATCH_DIR "/line-XXXXXX";
    directory_ = ::mkdtemp(directory.data());
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::string path = directory_ / "servos";
    path.copy(address.sun_path, sizeof(address.sun_path) - 1);
    listener_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    EXPECT_EQ(::bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
    EXPECT_EQ(::listen(listener_, 1), 0);
    path_ = "unix:" + path;
  }
  ~SerialSocketTest() override {
    stop_listening();
    std::filesystem::remove_all(directory_);
  }
  void stop_listening() { ::close(std::exchange(listener_, -1)); }
  [[nodiscard]] int accepted() const { return ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC); }

  std::filesystem::path directory_;
  std::string path_;
  int listener_{-1};
};

DeviceCause cause_of(const std::function<void()>& what) {
  try {
    what();
  } catch (const DeviceError& error) {
    return error.cause();
  }
  return DeviceCause::kNone;
}

TEST_F(SerialSocketTest, CarriesBothWaysAndDropsWhatNobodyAskedFor) {
  SerialPort port;
  port.open(path_, 115200);
  const int far = accepted();
  const auto soon = [] { return SerialPort::Clock::now() + 10s; };
  const std::array<std::uint8_t, 3> sent{'V', 'E', 'R'};
  port.write(sent, soon());
  std::array<std::uint8_t, 3> got{};
  ASSERT_EQ(::recv(far, got.data(), got.size(), MSG_WAITALL), 3);
  EXPECT_EQ(got, sent);
  ASSERT_EQ(::send(far, "old", 3, 0), 3);
  port.discard_input();
  ASSERT_EQ(::send(far, "new", 3, 0), 3);
  port.read_exactly(got, soon());
  EXPECT_EQ(got, (std::array<std::uint8_t, 3>{'n', 'e', 'w'}));
  EXPECT_EQ(cause_of([&] { port.check(); }), DeviceCause::kNone);
  EXPECT_EQ(port.latency_ms(), std::nullopt);
  ::close(far);
}

TEST_F(SerialSocketTest, EveryFailureIsALostDeviceWithItsCause) {
  std::uint8_t byte = 'x';
  const auto read = [&byte](SerialPort& port) {
    port.read_exactly({&byte, 1}, SerialPort::Clock::now() + 20ms);
  };
  const auto write = [&byte](SerialPort& port) { port.write({&byte, 1}, SerialPort::Clock::now() + 20ms); };
  const auto fill = [](SerialPort& port) {
    port.write(std::vector<std::uint8_t>(10'000'000, 'x'), SerialPort::Clock::now() + 20ms);
  };
  const auto cut = [](int far) { ::close(far); };
  const auto cut_with_input_unread = [](int far) {
    pollfd ready{far, POLLIN, 0};
    (void)::poll(&ready, 1, 10'000);
    ::close(far);
  };
  const auto end_of_output = [](int far) { ::shutdown(far, SHUT_WR); };
  const auto nothing = [](int) {};
  struct Case {
    const char* name;
    std::function<void(int)> peer;
    std::function<void(SerialPort&)> use;
    DeviceCause cause;
  };
  const std::vector<Case> cases{
      {"cut, read", cut, read, DeviceCause::kHungUp},
      {"cut, write", cut, write, DeviceCause::kHungUp},
      {"cut, check", cut, [](SerialPort& port) { port.check(); }, DeviceCause::kHungUp},
      {"reset, read", cut_with_input_unread, read, DeviceCause::kHungUp},
      {"no more output, read", end_of_output, read, DeviceCause::kHungUp},
      {"silent, read", nothing, read, DeviceCause::kNoAnswer},
      {"full, write", nothing, fill, DeviceCause::kWriteTimeout}};
  for (const Case& test : cases) {
    SerialPort port;
    port.open(path_, 115200);
    const int far = accepted();
    write(port);
    test.peer(far);
    EXPECT_EQ(cause_of([&] { test.use(port); }), test.cause) << test.name;
  }
}

TEST_F(SerialSocketTest, WhatIsNotThereIsNamed) {
  SerialPort port;
  const auto open = [&](const std::string& path) { return cause_of([&] { port.open(path, 115200); }); };
  EXPECT_EQ(open("unix:" + std::string(directory_ / "absent")), DeviceCause::kNotThere);
  EXPECT_EQ(open("unix:/" + std::string(107, 'x')), DeviceCause::kNotThere) << "108 bytes";
  stop_listening();
  EXPECT_EQ(open(path_), DeviceCause::kNotThere) << "refused";
  EXPECT_FALSE(port.is_open());
}

TEST_F(SerialSocketTest, AForeignPeerIsALostDevice) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::thread peer([&] {
    std::minstd_rand random(seed);
    const int far = accepted();
    std::array<std::uint8_t, 512> noise{};
    do {
      for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random());
    } while (::send(far, noise.data(), noise.size(), MSG_NOSIGNAL) > 0);
    ::close(far);
  });
  {
    Ssc32 controller({path_, 115200, true, 5, 0, true});
    const DeviceCause cause = cause_of([&] { (void)controller.open(); });
    EXPECT_TRUE(is_noise(cause)) << static_cast<int>(cause);
  }
  peer.join();
}

}  // namespace
}  // namespace corbot::rt
