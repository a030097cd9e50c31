// SPDX-License-Identifier: Apache-2.0
// Tests the serial backends with emulated controllers that restart, fall silent or garble their replies. Each
// runs in emulated time.
#include <gmock/gmock.h>

#include "unit/backends/serial_bench.h"

namespace corbot::rt {
namespace {

using ::testing::HasSubstr;

template <class Any>
void expect_to_notice_silence(Any& bench) {
  (void)bench.device.has_answered();
  bench.wire.is_silent = true;
  int misses = 0;
  const auto begin = SerialPort::Clock::now();
  while (misses < 3 && SerialPort::Clock::now() - begin < std::chrono::seconds(20)) {
    const DeviceCause cause = bench.cause_of(1600.0);
    if (cause != DeviceCause::kNone) {
      EXPECT_EQ(cause, DeviceCause::kNoAnswer);
      ++misses;
    }
    EXPECT_FALSE(bench.device.has_answered());
  }
  EXPECT_EQ(misses, 3) << "enough for the backend to call it lost";
  EXPECT_GE(SerialPort::Clock::now() - begin, std::chrono::milliseconds(300))
      << "not for a short disturbance";
  EXPECT_EQ(bench.wire.pulse_us(0), 1500.0) << "no frame to what does not answer";
  bench.wire.is_silent = false;
  EXPECT_EQ(bench.cause_of(1600.0), DeviceCause::kNone);
  EXPECT_TRUE(bench.device.has_answered());
  EXPECT_FALSE(bench.device.has_answered());
}

TEST(SerialControllers, ThatFallSilentAreNoticed) {
  for (const int baud : {9600, 115200}) {
    for (const Ssc32Model model : {Ssc32Model::kSsc32, Ssc32Model::kSsc32U}) {
      Ssc32Bench ssc32(model, baud);
      ssc32.begin();
      expect_to_notice_silence(ssc32);
    }
  }
  MaestroBench maestro;
  maestro.begin();
  expect_to_notice_silence(maestro);
}

TEST(SerialControllers, OneLostOrGarbledAnswerIsNoLoss) {
  Ssc32Bench ssc32(Ssc32Model::kSsc32);
  ssc32.begin();
  MaestroBench maestro;
  maestro.begin();
  for (int i = 0; i < 5; ++i) {
    ssc32.wire.lose = maestro.wire.lose = 1;
    EXPECT_EQ(ssc32.cause_of(1520.0), DeviceCause::kNone);
    EXPECT_EQ(maestro.cause_of(1520.0), DeviceCause::kNone);
    EXPECT_EQ(ssc32.cause_of(1510.0), DeviceCause::kNone);
    EXPECT_EQ(maestro.cause_of(1510.0), DeviceCause::kNone);
    ssc32.wire.garble = maestro.wire.garble = 2;
    EXPECT_EQ(ssc32.cause_of(1520.0), DeviceCause::kNone);
    EXPECT_EQ(maestro.cause_of(1520.0), DeviceCause::kNone);
  }
}

TEST(SerialControllers, AnAnswerThatIsMissingDoesNotHoldUpTheFrames) {
  const auto expect_short = [](auto& bench) {
    EXPECT_GE(bench.wire.longest_wait, std::chrono::milliseconds(200)) << "while it is opened";
    bench.begin();
    bench.wire.longest_wait = {};
    bench.device.send(all_at(1500.0), false);
    (void)bench.device.emergency_stop();
    (void)bench.device.measure(all_at(1500.0));
    // The bound is the exchange under way, which here costs no time, and 30 ms.
    EXPECT_LT(bench.wire.longest_wait, std::chrono::milliseconds(100));
  };
  Ssc32Bench ssc32(Ssc32Model::kSsc32U, 115200, true, 'A');
  expect_short(ssc32);
  MaestroBench maestro(true);
  expect_short(maestro);
}

/// Until a person has cleared it.
void expect_no_pulses(auto& bench) {
  bench.wire.pass(0.1);
  for (std::size_t i = 0; i < kServos; ++i)
    EXPECT_EQ(bench.emulated.pulse_us(i, bench.wire.now_ns), 0.0) << i;
}

TEST(SerialControllers, ASsc32ThatHasRestartedIsNoticedAtTheNextFrame) {
  for (const bool readback : {false, true}) {
    for (const Ssc32Model model : {Ssc32Model::kSsc32, Ssc32Model::kSsc32U}) {
      Ssc32Bench bench(model, 115200, readback);
      bench.begin();
      bench.emulated.power_cycle(bench.wire.now_ns);
      std::string why;
      try {
        bench.device.send(all_at(1500.0), false);
        (void)bench.device.measure(all_at(1500.0));
      } catch (const DeviceError& error) {
        why = error.what();
        EXPECT_EQ(error.cause(), DeviceCause::kDeviceFault);
      }
      EXPECT_THAT(why, HasSubstr("has restarted"));
      expect_no_pulses(bench);
    }
  }
}

TEST(SerialControllers, ASsc32ThatHasRestartedGetsNoFrame) {
  Ssc32Bench bench(Ssc32Model::kSsc32, 9600);
  bench.begin();
  EXPECT_THAT(bench.wire.written, HasSubstr("P1500T")) << "a slow line";
  for (const bool is_silent : {false, true}) {
    bench.wire.is_silent = is_silent;
    bench.emulated.power_cycle(bench.wire.now_ns);
    bench.wire.written.clear();
    EXPECT_EQ(bench.cause_of(1500.0), is_silent ? DeviceCause::kNone : DeviceCause::kDeviceFault);
    EXPECT_EQ(bench.wire.written.find('#'), std::string::npos) << bench.wire.written;
    bench.wire.is_silent = false;
    (void)bench.device.open();
    bench.begin();
  }
}

TEST(SerialControllers, AStopInputAndReadbackShareTheLineWithTheQuestionOfEveryFrame) {
  Ssc32Bench bench(Ssc32Model::kSsc32U, 115200, true, 'A');
  bench.begin();
  for (const bool is_pressed : {false, true, false}) {
    bench.emulated.set_input('A', is_pressed);
    for (int i = 0; i < 10; ++i) {
      ASSERT_EQ(bench.cause_of(1700.0), DeviceCause::kNone);
      if (i < 6) (void)bench.device.emergency_stop();
    }
    bench.device.send(all_at(1700.0), false);
    EXPECT_EQ(bench.device.emergency_stop(),
              is_pressed ? StopInputLevel::kPressed : StopInputLevel::kReleased);
    EXPECT_EQ(bench.device.measure(all_at(1700.0)).value[4], 1700.0);
  }
}

TEST(SerialControllers, AFrameIsKeptBackWhereNothingAnswers) {
  const auto expect_kept_back = [](auto& bench) {
    bench.begin();
    bench.wire.is_silent = true;
    EXPECT_FALSE(bench.device.send(all_at(1600.0), false));
    bench.wire.is_silent = false;
    EXPECT_TRUE(bench.device.send(all_at(1600.0), false));
  };
  Ssc32Bench ssc32(Ssc32Model::kSsc32U);
  expect_kept_back(ssc32);
  MaestroBench maestro;
  expect_kept_back(maestro);
}

TEST(SerialControllers, AMaestroThatHasRestartedIsNoticedAtTheNextFrame) {
  for (const bool readback : {false, true}) {
    MaestroBench bench(readback);
    bench.begin();
    bench.emulated.power_cycle(bench.wire.now_ns);
    std::string why;
    try {
      bench.device.send(all_at(1500.0), false);
      (void)bench.device.measure(all_at(1500.0));
    } catch (const DeviceError& error) {
      why = error.what();
      EXPECT_EQ(error.cause(), DeviceCause::kDeviceFault);
    }
    EXPECT_THAT(why, HasSubstr("has restarted"));
    expect_no_pulses(bench);
  }
}

TEST(SerialControllers, AGarbledReplyOfAnSsc32IsNoRestart) {
  Ssc32Bench bench(Ssc32Model::kSsc32U, 115200, true);
  bench.begin(2050.0);  // garbled, it is the 500 us of a servo that was never commanded
  for (int i = 0; i < 5; ++i) {
    bench.wire.garble = 1;
    EXPECT_EQ(bench.cause_of(2050.0), DeviceCause::kNone);
    bench.wire.garble = 1;
    EXPECT_NO_THROW((void)bench.device.measure(all_at(2050.0)));
  }
}

TEST(SerialControllers, AMaestroThatRestartsDuringAnApproachGetsNoTarget) {
  for (const std::size_t servos : {std::size_t{2}, kServos}) {
    MaestroBench bench;
    bench.begin();
    (void)bench.device.open();
    ServoFrame first = all_at(1500.0);
    first.servo_count = static_cast<std::uint32_t>(servos);  // the next ones get their pulses a moment later
    bench.device.send(first, true);
    bench.wire.pass(0.1);
    bench.emulated.power_cycle(bench.wire.now_ns);
    std::string why;
    try {
      bench.device.send(all_at(1600.0), true);
    } catch (const DeviceError& error) {
      why = error.what();
    }
    EXPECT_THAT(why, HasSubstr("has restarted"));
    expect_no_pulses(bench);
    (void)bench.device.open();
    EXPECT_NO_THROW(bench.begin()) << "after a Clear";
  }
}

TEST(SerialControllers, AMaestroThatHasRestartedInTheMiddleOfACommandIsNoticed) {
  MaestroBench bench;
  bench.begin();
  const std::array<std::uint8_t, 4> target{0x84, 0x05, 0x70, 0x2E};
  bench.emulated.receive(std::span(target).first(2), bench.wire.now_ns);
  bench.emulated.power_cycle(bench.wire.now_ns);
  bench.emulated.receive(std::span(target).last(2), bench.wire.now_ns);
  std::string why;
  EXPECT_EQ(bench.cause_of(1500.0, &why), DeviceCause::kDeviceFault);
  EXPECT_THAT(why, AllOf(HasSubstr("has restarted"), HasSubstr("serial protocol")));
}

TEST(SerialControllers, ARestartDuringASilenceIsLogged) {
  const auto expect_logged = [](auto& bench) {
    EXPECT_EQ(bench.device.drain_log(), "") << "power-up is no restart";
    bench.begin();
    bench.emulated.power_cycle(bench.wire.now_ns);
    (void)bench.device.open();
    bench.device.send(all_at(1500.0), true);
    EXPECT_THAT(bench.device.drain_log(), HasSubstr("has restarted"));
    bench.wait_for_approach();
    (void)bench.device.open();
    bench.device.send(all_at(1500.0), true);
    EXPECT_EQ(bench.device.drain_log(), "") << "once";
  };
  MaestroBench maestro;
  expect_logged(maestro);
}

TEST(SerialControllers, AMaestroThatWentHomeSaysWhy) {
  MaestroBench bench;
  bench.begin();
  const std::uint8_t nonsense = 0x83;
  bench.emulated.receive({&nonsense, 1}, bench.wire.now_ns);
  std::string why;
  EXPECT_EQ(bench.cause_of(1500.0, &why), DeviceCause::kDeviceFault);
  EXPECT_THAT(why, HasSubstr("serial protocol"));
}

/// Sends a frame every 20 ms. Returns the first fault's text, or nothing after so many frames.
std::string first_fault(MaestroBench& bench, int frames) {
  std::string why;
  for (int i = 0; i < frames; ++i) {
    if (bench.cause_of(1500.0, &why) == DeviceCause::kDeviceFault) return why;
    bench.wire.pass(0.02);
  }
  return {};
}

TEST(SerialControllers, AMaestroThatRepliesToAllQueriesExceptThoseForItsErrorsIsNoticed) {
  MaestroBench bench;
  bench.begin();
  (void)bench.emulated.faults().execute({"deaf", "errors", "on"});
  EXPECT_EQ(first_fault(bench, 200), "") << "a disturbed line may lose a few";
  (void)bench.emulated.faults().execute({"deaf", "errors", "off"});
  EXPECT_EQ(first_fault(bench, 100), "");
  (void)bench.emulated.faults().execute({"deaf", "errors", "on"});
  EXPECT_EQ(first_fault(bench, 200), "") << "those before do not count";
  EXPECT_EQ(first_fault(bench, 100), "/dev/maestro: replies, but not to 5 queries in a row for its errors");
}

TEST(SerialControllers, AMaestroWhoseRepliesAreLateHasNotRestarted) {
  for (int delay_ms = 5; delay_ms < 120; delay_ms += 5) {
    MaestroBench bench;
    bench.begin();
    for (int i = 0; i < 50; ++i) {
      const std::string delay = std::to_string(delay_ms);
      for (const char* query : {"errors", "position"})
        (void)bench.emulated.faults().execute({"delay", query, delay});
      EXPECT_EQ(first_fault(bench, 3), "") << delay_ms << " ms late";
      for (const char* query : {"errors", "position"})
        (void)bench.emulated.faults().execute({"delay", query, "0"});
      EXPECT_EQ(first_fault(bench, 8), "") << delay_ms << " ms late before";
    }
  }
}

TEST(SerialControllers, AreHaltedThoughAnswersAreLostOrGarbled) {
  for (const int fault : {0, 1, 2}) {
    MaestroBench maestro;
    const auto expect_halt = [&](auto& bench) {
      bench.begin(1200.0);
      bench.device.send(all_at(1800.0), true);
      bench.wire.pass(0.5);
      if (fault == 1) bench.wire.lose = 1;
      if (fault == 2) bench.wire.garble = 1;
      const double before_us = bench.wire.pulse_us(0);
      EXPECT_NO_THROW(bench.device.halt());
      bench.wire.pass(0.3);
      const double halted_us = bench.wire.pulse_us(0);
      EXPECT_NEAR(halted_us, before_us, 50.0) << fault;
      bench.wire.pass(5.0);
      EXPECT_EQ(bench.wire.pulse_us(0), halted_us) << fault;
    };
    expect_halt(maestro);
  }
}

TEST(SerialControllers, AHalfReceivedGroupIsNotExecutedAtTheNextOpen) {
  for (const Ssc32Model model : {Ssc32Model::kSsc32, Ssc32Model::kSsc32U}) {
    Ssc32Bench bench(model);
    bench.begin();
    const std::string half = "#0P2400T2";
    bench.emulated.receive({reinterpret_cast<const std::uint8_t*>(half.data()), half.size()},
                           bench.wire.now_ns);
    bench.wire.lose = 1;  // and the first answer is spoilt
    EXPECT_NO_THROW((void)bench.device.open());
    bench.wire.pass(0.1);
    EXPECT_EQ(bench.wire.pulse_us(0), 1500.0);
  }
}

TEST(SerialControllers, AnApproachIsAsLongAsItsWay) {
  const auto expect_slow = [](auto& bench) {
    bench.begin(600.0);
    bench.device.send(all_at(1900.0), true);
    bench.wire.pass(0.1);
    const double early_us = bench.wire.pulse_us(0);
    EXPECT_LT(early_us, 660.0);
    bench.wire.pass(static_cast<double>(bench.device.approach_ns()) * 1e-9 - 0.1);
    const double late_us = bench.wire.pulse_us(0);
    EXPECT_NEAR(late_us, 1900.0, 10.0) << "there before the limit is lifted";
  };
  MaestroBench maestro;
  expect_slow(maestro);
}

TEST(SerialControllers, AMicroMaestroIsToldItsTargetsOneByOne) {
  MaestroBench bench(false, {.channels = 6, .multi_target = false});
  bench.begin(1600.0);
  EXPECT_EQ(bench.wire.pulse_us(4), 1600.0);
  EXPECT_EQ(bench.emulated.errors(), 0u);
}

TEST(SerialControllers, AServoThatLostItsPulsesBeginsWhereItWasSentLast) {
  const auto expect_slow = [](auto& bench) {
    bench.begin(1200.0);
    bench.emulated.power_cycle(bench.wire.now_ns);
    (void)bench.device.open();
    bench.device.send(all_at(1700.0), true);
    bench.wire.pass(0.1);
    const double early_us = bench.wire.pulse_us(0);
    EXPECT_NEAR(early_us, 1200.0, 60.0);
    bench.wait_for_approach();
    const double late_us = bench.wire.pulse_us(0);
    EXPECT_EQ(late_us, 1700.0);
  };
  MaestroBench maestro;
  expect_slow(maestro);
}

TEST(SerialControllers, AGarbledAnswerDoesNotSayWhereAServoStarts) {
  Ssc32Bench bench(Ssc32Model::kSsc32);
  bench.begin(2050.0);  // garbled, it is the 500 us of a servo that was never commanded
  (void)bench.device.open();
  bench.wire.garble = static_cast<int>(kServos);
  EXPECT_EQ(bench.device.measure(all_at(1250.0)).value[0], 2050.0);
}

/// An SSC-32 ignores the time of a servo's first pulse: such a command throws the arm to 500 us.
TEST(SerialControllers, AnSsc32GivesAFirstPulseWithoutATime) {
  for (const Ssc32Model model : {Ssc32Model::kSsc32, Ssc32Model::kSsc32U}) {
    Ssc32Bench bench(model, 9600);  // too slow for 50 Hz: frames have times
    ServoFrame first = all_at(1500.0);
    first.servo_count = 2;  // one after another
    bench.device.send(first, false);
    bench.wire.pass(0.5);
    for (int i = 0; i < 3; ++i) {
      const std::size_t before = bench.wire.written.size();
      bench.device.send(all_at(1500.0 + i), false);
      bench.wire.pass(0.5);
      const bool has_time = bench.wire.written.find('T', before) != std::string::npos;
      EXPECT_EQ(has_time, i > 0) << i;
    }
    EXPECT_EQ(bench.wire.pulse_us(4), 1502.0);
    bench.emulated.power_cycle(bench.wire.now_ns);
    (void)bench.device.open();
    const std::size_t before = bench.wire.written.size();
    EXPECT_EQ(bench.cause_of(1500.0), DeviceCause::kNone);
    EXPECT_EQ(bench.wire.written.find('T', before), std::string::npos) << "again";
  }
}

TEST(SerialControllers, AMaestroThatMissedItsSpeedLimitIsNotMoved) {
  MaestroBench bench;
  bench.begin(1000.0);
  const std::uint8_t cut = 0x87;  // a command without its data, as of one that was garbled
  bench.emulated.receive({&cut, 1}, bench.wire.now_ns);
  EXPECT_THROW(bench.device.send(all_at(2000.0), true), DeviceError);
  bench.wire.pass(1.0);
  EXPECT_EQ(bench.wire.pulse_us(0), 1000.0);
}

}  // namespace
}  // namespace corbot::rt
