// SPDX-License-Identifier: Apache-2.0
// Asking nodes that answer late, or without end.
#include <thread>

#include "unit/can/drives_fixture.h"

namespace corbot::rt {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using Clock = CanPort::Clock;

/// Node 9, on the bus of the emulated drives.
class SlowNode : public Drives {
 protected:
  static constexpr std::uint8_t kNode = 9;

  void SetUp() override {
    Drives::SetUp();
    node_.open(emulator_.bus(), {kSdoRequest + kNode});
    port_.open(emulator_.bus(), {kSdoAnswer + kNode});
  }
  /// The next request whose first byte is one of these.
  std::optional<CanFrame> wait_for(std::initializer_list<int> commands) {
    while (auto request = node_.read(Clock::now() + 10s)) {
      if (std::find(commands.begin(), commands.end(), request->data[0]) != commands.end()) return request;
    }
    return std::nullopt;
  }
  void answer(std::initializer_list<int> bytes) {
    CanFrame frame{};
    frame.can_id = kSdoAnswer + kNode;
    frame.can_dlc = CAN_MAX_DLEN;
    std::copy(bytes.begin(), bytes.end(), std::begin(frame.data));
    node_.write(frame, Clock::now() + 1s);
  }

  CanPort node_;
  CanPort port_;
  DriveWatch watch_{{kNode}};
  SdoClient sdo_{port_, watch_, kNode};
};

TEST_F(SlowNode, MayAnswerBothTriesOfAWrite) {
  std::jthread node([this] {
    for (int i = 0; i < 2; ++i) wait_for({0x2B});
    answer({0x60, 0x17, 0x10});
    wait_for({0x40});
    answer({0x60, 0x17, 0x10});
    answer({0x4B, 0x17, 0x10, 0, 200});
  });
  EXPECT_NO_THROW(sdo_.write({0x1017}, 200, 2));
  EXPECT_NO_THROW(sdo_.check({0x1017}, 200, 2));
}

TEST_F(SlowNode, IsGivenUpWhenItsTextHasNoEnd) {
  std::jthread node([this] {
    if (!wait_for({0x40})) return;
    answer({0x41, 0x08, 0x10});
    while (const auto request = wait_for({0x60, 0x70, 0x80})) {
      if (request->data[0] == 0x80) return;
      if (node_.read(Clock::now() + 100ms)) return;  // it is given up
      answer({(request->data[0] & 0x10) | 6 << 1, 'x'});
    }
  });
  const auto begin = Clock::now();
  try {
    (void)sdo_.read_text({0x1008});
    FAIL() << "read";
  } catch (const DeviceError& error) {
    EXPECT_EQ(error.cause(), DeviceCause::kNoAnswer);
    EXPECT_THAT(error.what(), HasSubstr("node 9: SDO transfer of 1008h timed out"));
  }
  EXPECT_LT(Clock::now() - begin, 30s);
}

}  // namespace
}  // namespace corbot::rt
