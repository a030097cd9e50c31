// SPDX-License-Identifier: Apache-2.0
// Checks the frames on the bus and how they are read: CiA 301 and CiA 402.
#include <gmock/gmock.h>
#include <linux/can/error.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <random>

#include "rt/backends/can/can_load.h"
#include "rt/backends/can/canopen_sdo.h"
#include "rt/backends/can/cia402.h"
#include "rt/backends/can/drive_watch.h"
#include "rt/backends/can/socketcan.h"
#include "support/paths.h"

namespace corbot::rt {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Step = SdoTransfer::Step;
using namespace std::chrono_literals;

CanFrame frame_of(canid_t id, std::initializer_list<int> bytes) {
  CanFrame frame{};
  frame.can_id = id;
  for (const int byte : bytes) frame.data[frame.can_dlc++] = static_cast<std::uint8_t>(byte);
  return frame;
}
std::vector<int> bytes_of(const CanFrame& frame) { return {frame.data, frame.data + frame.can_dlc}; }

TEST(Frames, AreThoseOfTheStandard) {
  EXPECT_EQ(nmt_frame(NmtCommand::kStart, 3).can_id, 0u);
  EXPECT_THAT(bytes_of(nmt_frame(NmtCommand::kPreOperational, 3)), ElementsAre(0x80, 3));
  EXPECT_EQ(sync_frame().can_id, 0x80u);
  EXPECT_EQ(sync_frame().can_dlc, 0);
  const CanFrame rpdo = rpdo_frame(5, 0x000F, -2);
  EXPECT_EQ(rpdo.can_id, 0x205u);
  EXPECT_THAT(bytes_of(rpdo), ElementsAre(0x0F, 0, 0xFE, 0xFF, 0xFF, 0xFF));
}

TEST(Frames, AreReadOnlyWithTheRightLength) {
  const auto process = process_data_of(frame_of(0x181, {0x37, 0x06, 0xFE, 0xFF, 0xFF, 0xFF}));
  ASSERT_TRUE(process);
  EXPECT_EQ(process->statusword, 0x0637);
  EXPECT_EQ(process->position, -2);
  EXPECT_FALSE(process_data_of(frame_of(0x181, {0x37, 0x06, 0, 0, 0})));
  EXPECT_FALSE(process_data_of(frame_of(0x181, {0x37, 0x06, 0, 0, 0, 0, 0})));
  EXPECT_EQ(emergency_of(frame_of(0x81, {0x10, 0x32, 5, 0, 0, 0, 0, 0}))->code, 0x3210);
  EXPECT_FALSE(emergency_of(frame_of(0x81, {0x10, 0x32})));
  EXPECT_EQ(heartbeat_of(frame_of(0x701, {0x85})), NmtState::kOperational);
  EXPECT_FALSE(heartbeat_of(frame_of(0x701, {6})));
  EXPECT_FALSE(heartbeat_of(frame_of(0x701, {})));
}

TEST(States, FollowTheStatusword) {
  const std::vector<std::pair<int, DriveState>> all{{0x0200, DriveState::kNotReadyToSwitchOn},
                                                    {0x0250, DriveState::kSwitchOnDisabled},
                                                    {0x0270, DriveState::kSwitchOnDisabled},
                                                    {0x0231, DriveState::kReadyToSwitchOn},
                                                    {0x0233, DriveState::kSwitchedOn},
                                                    {0x1237, DriveState::kOperationEnabled},
                                                    {0x0217, DriveState::kQuickStopActive},
                                                    {0x021F, DriveState::kFaultReactionActive},
                                                    {0x023F, DriveState::kFaultReactionActive},
                                                    {0x0218, DriveState::kFault},
                                                    {0x0004, DriveState::kUnknown}};
  for (const auto& [word, state] : all) {
    EXPECT_EQ(state_of(static_cast<std::uint16_t>(word)), state) << std::hex << word;
  }
}

TEST(States, LeadToOperation) {
  EXPECT_EQ(controlword_towards_operation(DriveState::kSwitchOnDisabled, 0), 0x06);
  EXPECT_EQ(controlword_towards_operation(DriveState::kReadyToSwitchOn, 6), 0x07);
  EXPECT_EQ(controlword_towards_operation(DriveState::kSwitchedOn, 7), 0x0F);
  EXPECT_EQ(controlword_towards_operation(DriveState::kOperationEnabled, 15), 0x0F);
  EXPECT_EQ(controlword_towards_operation(DriveState::kQuickStopActive, 15), 0);
  EXPECT_EQ(controlword_towards_operation(DriveState::kFault, 15), 0x80);
  EXPECT_EQ(controlword_towards_operation(DriveState::kFault, 0x80), 0) << "a reset is an edge";
}

TEST(Emergencies, AreFaultsOrWarnings) {
  for (const int code : {0x1000, 0x2310, 0x3210, 0x4310, 0x8130, 0x8611}) {
    EXPECT_TRUE(is_fault(static_cast<std::uint16_t>(code)));
  }
  for (const int code : {0x0000, 0x8120, 0x8140, 0x8210, 0xFF01}) {
    EXPECT_FALSE(is_fault(static_cast<std::uint16_t>(code)));
  }
  EXPECT_EQ(describe_emergency(0x3210), "EMCY 0x3210 (DC link over-voltage)");
  EXPECT_EQ(describe_emergency(0x3199), "EMCY 0x3199 (voltage)");
  EXPECT_EQ(describe_emergency(0x9000), "EMCY 0x9000 (unknown)");
}

TEST(InterpolationTimes, AreExactOrNone) {
  const auto expect = [](std::int64_t period_ns, int value, int exponent) {
    const auto time = interpolation_time(period_ns);
    ASSERT_TRUE(time) << period_ns;
    EXPECT_EQ(time->value, value);
    EXPECT_EQ(time->exponent, exponent);
  };
  expect(1'000'000, 1, -3);
  expect(20'000'000, 20, -3);
  expect(250'000, 25, -5);
  expect(1'500'000, 15, -4);
  EXPECT_FALSE(interpolation_time(2'750'000)) << "275 * 10^-5 does not fit into a byte";
  EXPECT_FALSE(interpolation_time(0));
}

TEST(Counts, StayWithin32Bits) {
  EXPECT_EQ(to_counts(1.5, 0), 2);
  EXPECT_EQ(to_counts(1e300, 0), INT32_MAX);
  EXPECT_EQ(to_counts(-INFINITY, 0), INT32_MIN);
  EXPECT_EQ(to_counts(NAN, 7), 7);
}

TEST(Load, IsComputedAndKeptBelowTheBitRate) {
  EXPECT_EQ(frame_bits(0), 55);
  EXPECT_EQ(frame_bits(8), 135)
      << "the longest classic frame with all its stuff bits, and the space after it";
  EXPECT_EQ(cycle_bits(4), 55 + 8 * 115);
  EXPECT_EQ(sync_period_ns(4, 1'000'000, 0), 1'000'000) << "unknown: enough";
  EXPECT_EQ(sync_period_ns(4, 1'000'000, 1'000'000), 2'000'000);
  EXPECT_EQ(sync_period_ns(1, 1'000'000, 1'000'000), 1'000'000);
  EXPECT_EQ(sync_period_ns(5, 1'000'000, 125'000), 13'000'000);
  EXPECT_EQ(sync_period_ns(8, 250'000, 1'000'000), 2'500'000)
      << "60C2h cannot express 2.75 ms, 2.5 are enough";
  EXPECT_FALSE(sync_period_ns(30, 1'000'000, 10'000));
}

TEST(Sdo, WritesUpToFourBytes) {
  SdoTransfer write = SdoTransfer::download(3, {0x6060}, 8, 1);
  EXPECT_EQ(write.request().can_id, 0x603u);
  EXPECT_THAT(bytes_of(write.request()), ElementsAre(0x2F, 0x60, 0x60, 0, 8, 0, 0, 0));
  EXPECT_EQ(write.take(frame_of(0x584, {0x60, 0x60, 0x60, 0, 0, 0, 0, 0})), Step::kIgnored) << "node 4's";
  EXPECT_EQ(write.take(frame_of(0x583, {0x60, 0x61, 0x60, 0, 0, 0, 0, 0})), Step::kIgnored)
      << "another object";
  EXPECT_EQ(write.take(frame_of(0x583, {0x60, 0x60, 0x60, 0, 0, 0, 0, 0})), Step::kDone);
  EXPECT_THAT(bytes_of(SdoTransfer::download(1, {0x1400, 1}, 0x80000201, 4).request()),
              ElementsAre(0x23, 0, 0x14, 1, 1, 2, 0, 0x80));
}

TEST(Sdo, IsAborted) {
  SdoTransfer write = SdoTransfer::download(3, {0x6060}, 8, 1);
  EXPECT_EQ(write.take(frame_of(0x583, {0x80, 0x60, 0x60, 0, 0x30, 0, 9, 6})), Step::kAborted);
  EXPECT_EQ(write.abort_code(), 0x06090030u);
  EXPECT_EQ(describe_abort(write.abort_code()), "value out of range (0x06090030)");
  EXPECT_EQ(describe_abort(0x12345678), "unknown reason (0x12345678)");
  EXPECT_EQ(to_string(ObjectAddress{0x60C2, 1}), "60C2h:1");
}

TEST(Sdo, ReadsAtOnceOrInSegments) {
  SdoTransfer read = SdoTransfer::upload(1, {0x1000});
  EXPECT_THAT(bytes_of(read.request()), ElementsAre(0x40, 0, 0x10, 0, 0, 0, 0, 0));
  EXPECT_EQ(read.take(frame_of(0x581, {0x4B, 0, 0x10, 0, 0x92, 1, 99, 99})), Step::kDone);
  EXPECT_THAT(read.data(), ElementsAre(0x92, 1));
  SdoTransfer text = SdoTransfer::upload(1, {0x1008});
  EXPECT_EQ(text.take(frame_of(0x581, {0x41, 8, 0x10, 0, 9, 0, 0, 0})), Step::kSend);
  EXPECT_THAT(bytes_of(text.request()), ElementsAre(0x60, 0, 0, 0, 0, 0, 0, 0));
  EXPECT_EQ(text.take(frame_of(0x581, {0x00, 1, 2, 3, 4, 5, 6, 7})), Step::kSend);
  EXPECT_EQ(text.request().data[0], 0x70) << "the toggle bit";
  EXPECT_EQ(text.take(frame_of(0x581, {0x1B, 8, 9, 0, 0, 0, 0, 0})), Step::kDone);
  EXPECT_THAT(text.data(), ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 9));
}

TEST(Sdo, PassesOverALateAnswerOfAnotherKind) {
  SdoTransfer read = SdoTransfer::upload(1, {0x1017});
  EXPECT_EQ(read.take(frame_of(0x581, {0x60, 0x17, 0x10, 0, 0, 0, 0, 0})), Step::kIgnored);
  EXPECT_EQ(read.take(frame_of(0x581, {0x4B, 0x17, 0x10, 0, 200, 0, 0, 0})), Step::kDone);
  SdoTransfer write = SdoTransfer::download(1, {0x1017}, 200, 2);
  EXPECT_EQ(write.take(frame_of(0x581, {0x4B, 0x17, 0x10, 0, 200, 0, 0, 0})), Step::kIgnored);
  EXPECT_EQ(write.take(frame_of(0x581, {0x60, 0x17, 0x10, 0, 0, 0, 0, 0})), Step::kDone);
  SdoTransfer text = SdoTransfer::upload(1, {0x1008});
  EXPECT_EQ(text.take(frame_of(0x581, {0x41, 8, 0x10, 0, 9, 0, 0, 0})), Step::kSend);
  EXPECT_EQ(text.take(frame_of(0x581, {0x41, 8, 0x10, 0, 9, 0, 0, 0})), Step::kIgnored);
}

TEST(Sdo, TrustsNoServer) {
  SdoTransfer text = SdoTransfer::upload(1, {0x1008});
  EXPECT_EQ(text.take(frame_of(0x581, {0x41, 8, 0x10, 0, 9, 0, 0, 0})), Step::kSend);
  EXPECT_EQ(text.take(frame_of(0x581, {0x10, 1, 2, 3, 4, 5, 6, 7})), Step::kProtocol) << "toggle";
  EXPECT_THAT(bytes_of(text.request()), ElementsAre(0x80, 8, 0x10, 0, 0, 0, 3, 5));
  SdoTransfer brief = SdoTransfer::upload(1, {0x1008});
  EXPECT_EQ(brief.take(frame_of(0x581, {0x41, 8})), Step::kProtocol);
  SdoTransfer empty = SdoTransfer::upload(1, {0x1008});
  EXPECT_EQ(empty.take(frame_of(0x581, {0x41, 8, 0x10, 0, 0, 0, 0, 0})), Step::kSend);
  EXPECT_EQ(SdoTransfer(empty).take(frame_of(0x581, {0x0E, 0, 0, 0, 0, 0, 0, 0})), Step::kProtocol)
      << "no byte, and more to come";
  EXPECT_EQ(empty.take(frame_of(0x581, {0x0F, 0, 0, 0, 0, 0, 0, 0})), Step::kDone);
  SdoTransfer endless = SdoTransfer::upload(1, {0x1008});
  EXPECT_EQ(endless.take(frame_of(0x581, {0x41, 8, 0x10, 0, 9, 0, 0, 0})), Step::kSend);
  std::size_t segments = 0;
  Step step = Step::kSend;
  for (; step == Step::kSend && segments < 1000; ++segments) {
    step = endless.take(frame_of(0x581, {segments % 2 == 0 ? 0x00 : 0x10, 1, 2, 3, 4, 5, 6, 7}));
  }
  EXPECT_EQ(step, Step::kProtocol);
  EXPECT_LE(endless.data().size(), SdoTransfer::kMostBytes);
}

TEST(Port, LetsFewFramesWait) {
  const std::string path = std::string(CORBOT_SCRATCH_DIR) + "/port-" + std::to_string(::getpid());
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  ASSERT_LT(path.size(), sizeof(address.sun_path));
  path.copy(address.sun_path, path.size());
  const int listener = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  ASSERT_EQ(::bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  ASSERT_EQ(::listen(listener, 1), 0);
  CanPort port;
  port.open("unix:" + path, {});
  port.limit_queue(12);
  std::size_t frames = 0;
  const auto fill = [&] {
    for (; frames < 10'000; ++frames) port.write(sync_frame(), {});
  };
  EXPECT_THROW(fill(), DeviceError);
  EXPECT_GE(frames, 6u);
  EXPECT_LE(frames, 24u);
  ::close(listener);
  (void)::unlink(path.c_str());
}

class Watching : public ::testing::Test {
 protected:
  Watching() {
    watch_.clear(now_);
    hear(0x701, {5});
    hear(0x702, {5});
    hear(0x181, {0x37, 0x12, 0, 0, 0, 0});
    hear(0x182, {0x37, 0x12, 1, 0, 0, 0});
  }
  void hear(canid_t id, std::initializer_list<int> bytes) { watch_.take(frame_of(id, bytes), now_); }
  /// The cause that check() gives, and its text.
  DeviceCause check() {
    try {
      watch_.check(now_, 600ms, 500ms);
    } catch (const DeviceError& error) {
      text_ = error.what();
      return error.cause();
    }
    return DeviceCause::kNone;
  }
  DriveWatch::Time now_{1000s};
  DriveWatch watch_{{1, 2}};
  std::string text_;
};

TEST_F(Watching, IsContentWithDrivesThatWork) {
  EXPECT_EQ(check(), DeviceCause::kNone);
  EXPECT_FALSE(watch_.warning(now_, 50ms));
  EXPECT_EQ(watch_.drives()[1].process.position, 1);
  watch_.expect_answers(now_);
  EXPECT_FALSE(watch_.has_all_answers());
}

TEST_F(Watching, MissesHeartbeats) {
  now_ += 500ms;
  hear(0x701, {5});
  now_ += 101ms;
  EXPECT_EQ(check(), DeviceCause::kHeartbeatLost);
  EXPECT_THAT(text_, HasSubstr("node 2"));
  watch_.forgive(now_);
  EXPECT_EQ(check(), DeviceCause::kNone);
}

TEST_F(Watching, ForgivesWhatWasMissedWhileNobodyListened) {
  watch_.expect_answers(now_);
  now_ += 3s;
  watch_.forgive(now_);
  EXPECT_EQ(check(), DeviceCause::kNone) << "process data, too";
  now_ += 501ms;
  EXPECT_EQ(check(), DeviceCause::kHeartbeatLost);
}

TEST_F(Watching, AwaitsProcessDataFromTheFirstSyncOn) {
  watch_.clear(now_);
  now_ += 550ms;
  EXPECT_FALSE(watch_.warning(now_, 50ms));
  watch_.expect_answers(now_);
  EXPECT_EQ(check(), DeviceCause::kNone);
  now_ += 1ms;
  hear(0x701, {5});
  hear(0x702, {5});
  watch_.expect_answers(now_);
  now_ += 500ms;
  EXPECT_EQ(check(), DeviceCause::kHeartbeatLost) << "501 ms after the first SYNC";
}

TEST_F(Watching, SeesFaultsRestartsAndStates) {
  hear(0x82, {0x10, 0x32, 1, 0, 0, 0, 0, 0});
  EXPECT_EQ(check(), DeviceCause::kDeviceFault);
  EXPECT_THAT(text_, HasSubstr("EMCY 0x3210"));
  hear(0x82, {0, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(check(), DeviceCause::kNone);
  hear(0x182, {0x18, 0x02, 0, 0, 0, 0});
  EXPECT_EQ(check(), DeviceCause::kDeviceFault);
  EXPECT_THAT(text_, HasSubstr("'fault'"));
  hear(0x182, {0x37, 0x12, 0, 0, 0, 0});
  hear(0x701, {127});
  EXPECT_EQ(check(), DeviceCause::kDeviceFault);
  EXPECT_THAT(text_, HasSubstr("pre-operational"));
  hear(0x701, {0});
  hear(0x701, {5});
  EXPECT_EQ(check(), DeviceCause::kDeviceFault);
  EXPECT_THAT(text_, HasSubstr("restarted"));
}

TEST_F(Watching, WarnsOfWhatCanBeLivedWith) {
  hear(0x81, {0x20, 0x81, 0x11, 0, 0, 0, 0, 0});
  EXPECT_EQ(check(), DeviceCause::kNone);
  EXPECT_THAT(watch_.warning(now_, 50ms)->what(), HasSubstr("EMCY 0x8120"));
  hear(0x81, {0, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_FALSE(watch_.warning(now_, 50ms));
  hear(0x181, {0xB7, 0x02, 0, 0, 0, 0});
  EXPECT_THAT(watch_.warning(now_, 50ms)->what(), HasSubstr("warns"));
  hear(0x181, {0x37, 0x0A, 0, 0, 0, 0});
  EXPECT_THAT(watch_.warning(now_, 50ms)->what(), HasSubstr("limit"));
  hear(0x181, {0x37, 0x12, 0, 0, 0, 0});
  now_ += 10s;
  EXPECT_FALSE(watch_.warning(now_, 50ms)) << "not requested yet";
  watch_.expect_answers(now_);
  now_ += 51ms;
  EXPECT_EQ(watch_.warning(now_, 50ms)->cause(), DeviceCause::kNoAnswer);
}

TEST_F(Watching, LosesADriveThatSendsHeartbeatsOnly) {
  for (int i = 0; i < 500; ++i) {
    watch_.expect_answers(now_);
    now_ += 1ms;
    hear(0x701, {5});
    hear(0x702, {5});
    hear(0x181, {0x37, 0x12, 0, 0, 0, 0});
    ASSERT_EQ(check(), DeviceCause::kNone) << i;
  }
  now_ += 1ms;
  EXPECT_EQ(check(), DeviceCause::kHeartbeatLost);
  EXPECT_THAT(text_, HasSubstr("node 2 sends no process data"));
}

TEST_F(Watching, ForgetsFaultsThatAreDealtWithNoWarnings) {
  hear(0x81, {0x10, 0x32, 1, 0, 0, 0, 0, 0});
  hear(0x82, {0x20, 0x81, 0x11, 0, 0, 0, 0, 0});
  hear(0x702, {0});
  watch_.settle_faults();
  EXPECT_EQ(watch_.drives()[0].emergency, 0);
  EXPECT_EQ(watch_.drives()[1].emergency, 0x8120);
  EXPECT_TRUE(watch_.drives()[1].has_restarted);
  watch_.settle_restart(1);
  EXPECT_FALSE(watch_.drives()[1].has_restarted);
}

TEST_F(Watching, SeesTheBusFail) {
  hear(CAN_ERR_FLAG | CAN_ERR_CRTL, {0, CAN_ERR_CRTL_TX_PASSIVE, 0, 0, 0, 0, 0, 0});
  EXPECT_THAT(watch_.warning(now_, 50ms)->what(), HasSubstr("error passive"));
  hear(CAN_ERR_FLAG | CAN_ERR_CRTL, {0, CAN_ERR_CRTL_ACTIVE, 0, 0, 0, 0, 0, 0});
  EXPECT_FALSE(watch_.warning(now_, 50ms));
  hear(CAN_ERR_FLAG | CAN_ERR_TX_TIMEOUT, {0, 0, 0, 0, 0, 0, 0, 0});
  now_ += 900ms;
  EXPECT_THAT(watch_.warning(now_, 50ms)->what(), HasSubstr("could not send"));
  now_ += 200ms;
  EXPECT_FALSE(watch_.warning(now_, 50ms)) << "it has sent since";
  hear(CAN_ERR_FLAG | CAN_ERR_BUSOFF, {0, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(check(), DeviceCause::kBusDown);
}

TEST_F(Watching, ReportsNonsenseOnceAndUsesNoneOfIt) {
  hear(0x181, {0xFF, 0xFF, 9, 9, 9, 9});
  EXPECT_EQ(check(), DeviceCause::kBadAnswer);
  EXPECT_EQ(check(), DeviceCause::kNone);
  EXPECT_EQ(watch_.drives()[0].process.position, 0);
  for (const canid_t id : {0x181u, 0x81u, 0x701u}) {
    hear(id, {1, 2, 3});
    EXPECT_EQ(check(), DeviceCause::kBadAnswer) << id;
  }
  hear(0x183, {1});
  hear(0x181 | CAN_EFF_FLAG, {1});
  EXPECT_EQ(check(), DeviceCause::kNone) << "not ours";
}

TEST(Scale, GoesThereAndBack) {
  Cia402Settings settings;
  settings.joints = {{1, 1000.0, 500.0, 1.0}, {2, 2000.0, 0.0, -1.0}};
  settings.gripper = GripperDrive{3, 100.0, 1100.0};
  settings.gripper_model = {4, 1900.0, 1100.0, 0.5};
  const Cia402Drives drives(settings);
  ServoFrame frame;
  frame.position_q[0] = 0.25;
  frame.position_q[1] = 0.5;
  frame.pulse_us[2] = 1500.0;
  const auto counts = drives.targets(frame);
  EXPECT_THAT(counts, ElementsAre(750, -1000, 600));
  const BusReading reading = drives.reading_of(counts);
  EXPECT_EQ(reading.unit, BusReading::Unit::kJoints);
  EXPECT_DOUBLE_EQ(reading.value[0], 0.25);
  EXPECT_DOUBLE_EQ(reading.value[1], 0.5);
  EXPECT_DOUBLE_EQ(reading.gripper_us.value(), 1500.0);
}

}  // namespace
}  // namespace corbot::rt
