// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "sim_devices/device_bench.h"

namespace corbot::sim::ssc32_commands_test {
namespace {

std::string bytes(std::initializer_list<int> values) { return {values.begin(), values.end()}; }

TEST(Ssc32Commands, CaseAndWhiteSpaceMeanNothing) {
  Ssc32Bench bench;
  bench.send("\n # 5 p 15\t00\n#6p1600 t 10 0\r", 0);
  EXPECT_EQ(bench.pulse_us(5, 20), 1500.0);
  EXPECT_EQ(bench.pulse_us(6, 20), 1600.0);
  EXPECT_EQ(bench.ask("ver\r", 20), "SSC32-V2.50USB\r");
  EXPECT_EQ(bench.device.bad_input_count(), 0u);
}

TEST(Ssc32Commands, ACommandEndsWithCrOnly) {
  Ssc32Bench bench;
  bench.send("#5P1500\n", 0);
  EXPECT_EQ(bench.pulse_us(5, 40), 0.0);
  bench.send("\r", 40);
  EXPECT_EQ(bench.pulse_us(5, 60), 1500.0);
  bench.send("\r\r\n\r", 60);
  EXPECT_EQ(bench.device.bad_input_count(), 0u);
}

TEST(Ssc32Commands, EscCancelsWhatIsBeingReceived) {
  Ssc32Bench bench;
  bench.send("#5P1500\x1B\r", 0);
  EXPECT_EQ(bench.pulse_us(5, 20), 0.0);
  bench.send(std::string(2000, 'x') + "\x1B#5P1600\r", 20);
  EXPECT_EQ(bench.pulse_us(5, 40), 1600.0);
  EXPECT_EQ(bench.device.bad_input_count(), 0u);
}

const char* const kBadLines[] = {"#1P1600#2H",
                                 "#1H#2P1600",
                                 "#1P1600#2PO5",
                                 "#1PO5#2P1600",
                                 "#1P1600Q",
                                 "Q#1P1600",
                                 "#0:255#1P1600",
                                 "#0:255#1H",
                                 "VERQ",
                                 "QVER",
                                 "QQP1",
                                 "QP1Q",
                                 "A#1P1600",
                                 "AVA",
                                 "VAA",  // kinds mixed
                                 "#",
                                 "#1",
                                 "#1P",
                                 "1P1600",
                                 "#P1600",
                                 "#32P1600",
                                 "#-1P1600",
                                 "#1P1600.5",
                                 "#1P-1600",
                                 "#1P0",
                                 "#1P99999999999999999999",
                                 "#1P1600T",
                                 "#1P1600S",
                                 "#1P1600S0",
                                 "#1P1600S65536",
                                 "#1P1600T-1",
                                 "#1P1600T100#2P1600",
                                 "#1P1600T100S100",
                                 "T100",
                                 "S100",
                                 "#1S100P1600",
                                 "#1P1600#",
                                 "#1X",
                                 "#1HL",
                                 "#1PO101",
                                 "#1PO-101",
                                 "#1PO",
                                 "#1PO+5",
                                 "#4:1",
                                 "#0:256",
                                 "#0:",
                                 "QP",
                                 "QP32",
                                 "Q1",
                                 "VEE",
                                 "VERS",
                                 "V",
                                 "VI",
                                 "STOP",
                                 "STOP32",
                                 "STOP1STOP2",
                                 "G",
                                 "H",
                                 "LA",
                                 "AAAAAAAAA",
                                 "VAVAVAVAVAVAVAVAVA",
                                 "hello",
                                 "?",
                                 "\xC3\xA9"};

TEST(Ssc32Commands, BadInputIsIgnoredWithoutAnswer) {
  Ssc32Bench bench;
  bench.send("#1P1500#2P1500\r", 0);
  std::uint64_t count = 0;
  double at_ms = 1000;
  for (const std::string text : kBadLines) {
    EXPECT_EQ(bench.ask(text + "\r", at_ms), "") << text;
    EXPECT_EQ(bench.device.bad_input_count(), ++count) << text;
    at_ms += 1000;
    EXPECT_EQ(bench.pulse_us(1, at_ms), 1500.0) << text;
    EXPECT_EQ(bench.pulse_us(2, at_ms), 1500.0) << text;
    EXPECT_FALSE(bench.device.output(1).has_value()) << text;
  }
}

TEST(Ssc32Commands, OverlongLineIsIgnoredAsAWhole) {
  Ssc32Bench bench;
  std::string line;
  for (int i = 0; i < 300; ++i) line += "#1P1500";
  bench.send(line + "\r", 0);
  EXPECT_EQ(bench.device.bad_input_count(), 1u);
  EXPECT_EQ(bench.pulse_us(1, 20), 0.0);
  bench.send("#1P1500\r", 20);
  EXPECT_EQ(bench.pulse_us(1, 40), 1500.0);
}

TEST(Ssc32Commands, AllThirtyTwoServosInOneGroup) {
  Ssc32Bench bench;
  std::string line;
  for (int i = 0; i < 32; ++i) line += "#" + std::to_string(i) + "P" + std::to_string(1000 + i) + "S65535";
  bench.send(line + "T65535\r", 0);
  for (int i = 0; i < 32; ++i) EXPECT_EQ(bench.pulse_us(static_cast<std::size_t>(i), 20), 1000.0 + i);
}

TEST(Ssc32Commands, QpAnswersOneByteAServoInTensOfMicroseconds) {
  Ssc32Bench bench;
  bench.send("#1P1500#2P2500#3P1509\r", 0);
  EXPECT_EQ(bench.ask("QP1\r", 100), bytes({150}));
  EXPECT_EQ(bench.ask("QP 3 QP2 QP1\r", 1200), bytes({150, 250, 150}));
  bench.send("#1P2500T1000\r", 3000);
  bench.send("QP1\r", 3500);
  EXPECT_EQ(bench.answers(3600), bytes({200}));
}

TEST(Ssc32Commands, QpBeforeTheFirstMoveTellsWhatTheModelBelieves) {
  EXPECT_EQ(Ssc32Bench().ask("QP1\r", 0), bytes({0}));
  EXPECT_EQ(Ssc32Bench(older()).ask("QP1\r", 0), bytes({50}));
}

TEST(Ssc32Commands, VersionIsThatOfTheModelOrAsSet) {
  EXPECT_EQ(Ssc32Bench().ask("VER\r", 0), "SSC32-V2.50USB\r");
  EXPECT_EQ(Ssc32Bench(older()).ask("VER\r", 0), "SSC32-1.06XE\r");
  EXPECT_EQ(Ssc32Bench({.version = "SSC32-V2.01XE"}).ask("VER\r", 0), "SSC32-V2.01XE\r");
}

TEST(Ssc32Commands, AnswersLeaveAtTheSpeedOfTheLine) {
  Ssc32Bench bench({.baud = 9600});  // a byte takes 1.0417 ms
  EXPECT_FALSE(bench.device.next_answer_ns().has_value());
  bench.send("VER\r", 0);
  ASSERT_TRUE(bench.device.next_answer_ns().has_value());
  EXPECT_NEAR(static_cast<double>(*bench.device.next_answer_ns() - Ssc32Bench::ns(0)), 1e10 / 9600, 1.0);
  EXPECT_EQ(bench.answers(1.0), "");
  EXPECT_EQ(bench.answers(1.1), "S");
  EXPECT_EQ(bench.answers(5.3), "SC32");
  bench.send("Q\r", 6);
  EXPECT_EQ(bench.answers(16.6), "-V2.50USB\r");
  EXPECT_EQ(bench.answers(16.7), ".");
  EXPECT_FALSE(bench.device.next_answer_ns().has_value());
}

TEST(Ssc32Commands, OutputsGoHighAndLow) {
  Ssc32Bench bench;
  bench.send("#3P1500\r", 0);
  EXPECT_FALSE(bench.device.output(3).has_value());
  bench.send("#3H #4L\r", 20);
  EXPECT_EQ(bench.device.output(3), true);
  EXPECT_EQ(bench.device.output(4), false);
  EXPECT_EQ(bench.pulse_us(3, 40), 0.0);
  bench.send("#3P1600T1000\r", 40);  // a first move again
  EXPECT_FALSE(bench.device.output(3).has_value());
  EXPECT_EQ(bench.pulse_us(3, 60), 1600.0);
}

TEST(Ssc32Commands, BankOutputSetsEightAtOnce) {
  Ssc32Bench bench;
  bench.send("#3:123\r", 0);
  for (std::size_t bit = 0; bit < 8; ++bit)
    EXPECT_EQ(bench.device.output(24 + bit), (123 >> bit & 1) != 0) << bit;
  EXPECT_FALSE(bench.device.output(23).has_value());
  bench.send("#0:255#1:0\r", 0);
  EXPECT_EQ(bench.device.output(7), true);
  EXPECT_EQ(bench.device.output(8), false);
}

TEST(Ssc32Commands, PulseOffsetShiftsWhatLeavesNotWhatIsTold) {
  Ssc32Bench bench;
  bench.send("#1PO100#2PO-100\r", 0);
  EXPECT_EQ(bench.pulse_us(1, 20), 0.0);
  bench.send("#1P1500#2P1500\r", 20);
  EXPECT_EQ(bench.pulse_us(1, 40), 1600.0);
  EXPECT_EQ(bench.pulse_us(2, 40), 1400.0);
  EXPECT_EQ(bench.ask("QP1QP2\r", 40), bytes({150, 150}));
  bench.send("#1PO0\r", 2000);
  EXPECT_EQ(bench.pulse_us(1, 2020), 1500.0);
}

TEST(Ssc32Commands, DigitalInputs) {
  Ssc32Bench bench;
  EXPECT_TRUE(bench.device.set_input('B', false));
  EXPECT_EQ(bench.ask("A B C\r", 0), "101");
  EXPECT_EQ(bench.ask("EF\r", 1000), "11");
  EXPECT_FALSE(bench.device.set_input('G', true));
  EXPECT_FALSE(bench.device.set_input('a', true));

  Ssc32Bench old(older());
  EXPECT_EQ(old.ask("ABCD\r", 0), "1111");
  EXPECT_FALSE(old.device.set_input('E', true));
  EXPECT_EQ(old.ask("E\r", 1000), "");
  EXPECT_EQ(old.device.bad_input_count(), 1u);
}

TEST(Ssc32Commands, LatchingInputsRememberALow) {
  Ssc32Bench bench;
  EXPECT_EQ(bench.ask("AL\r", 0), "1");
  bench.device.set_input('A', false);
  bench.device.set_input('A', true);
  EXPECT_EQ(bench.ask("A\r", 1000), "1");
  EXPECT_EQ(bench.ask("AL\r", 2000), "0");
  EXPECT_EQ(bench.ask("AL BL A\r", 3000), "111");
  bench.device.set_input('A', false);
  EXPECT_EQ(bench.ask("AL\r", 4000), "0");
  EXPECT_EQ(bench.ask("AL\r", 5000), "0");
  bench.device.set_input('A', true);
  EXPECT_EQ(bench.ask("AL\r", 6000), "0");
  EXPECT_EQ(bench.ask("AL\r", 7000), "1");
}

TEST(Ssc32Commands, AnalogInputsAreInvalidAtFirst) {
  Ssc32Bench bench;
  EXPECT_TRUE(bench.device.set_analog('A', 2.5));
  EXPECT_TRUE(bench.device.set_analog('H', 5.0));
  EXPECT_EQ(bench.ask("VA\r", 0), bytes({0}));
  EXPECT_EQ(bench.ask("VAVH\r", 1000), bytes({128, 0}));
  EXPECT_EQ(bench.ask("VH\r", 2000), bytes({255}));
  EXPECT_FALSE(bench.device.set_analog('I', 1.0));
  EXPECT_FALSE(bench.device.set_analog('A', 5.1));
  Ssc32Bench old(older());
  EXPECT_EQ(old.ask("VD\r", 0), bytes({0}));
  EXPECT_EQ(old.ask("VE\r", 1000), "");
}

TEST(Ssc32Commands, MiniSscCommandsAreUnderstood) {
  Ssc32Bench bench;
  bench.send({0xFF, 3, 127}, 0);
  EXPECT_EQ(bench.pulse_us(3, 20), 1500.0);
  bench.send({0xFF, 3, 0, 0xFF, 4, 254}, 20);
  EXPECT_EQ(bench.pulse_us(3, 40), 500.0);
  EXPECT_EQ(bench.pulse_us(4, 40), 2500.0);
  bench.send({0xFF, 0x0D, 0x1B}, 40);  // no CR, no ESC
  EXPECT_EQ(bench.pulse_us(13, 60), 713.0);
  EXPECT_EQ(bench.device.bad_input_count(), 0u);
  bench.send({0xFF, 3, 0xFF, 4, 127, 0xFF, 32, 10}, 60);
  EXPECT_EQ(bench.device.bad_input_count(), 2u);
  EXPECT_EQ(bench.pulse_us(3, 80), 500.0);
  EXPECT_EQ(bench.pulse_us(4, 80), 1500.0);
  bench.send(
      "#3P16\xFF\x03\x10"
      "00\r",
      100);  // within another command it is just nonsense
  EXPECT_EQ(bench.device.bad_input_count(), 3u);
  EXPECT_EQ(bench.pulse_us(3, 120), 500.0);
  EXPECT_EQ(bench.ask("Q\r", 120), ".");
}

TEST(ByteLine, TakesTenBitsAByteAndNoMoreThanFit) {
  ByteLine line(2400, 3);
  EXPECT_TRUE(line.push('a', 1000));
  EXPECT_TRUE(line.push('b', 1000));
  EXPECT_TRUE(line.push('c', 1'000'000'000));
  EXPECT_FALSE(line.push('d', 1'000'000'000));
  EXPECT_EQ(line.next_ns(), 1000 + 4'166'666);
  EXPECT_EQ(line.last_ns(), 1'000'000'000 + 4'166'666);
  EXPECT_FALSE(line.pop(4'167'665).has_value());
  EXPECT_EQ(line.pop(4'167'666)->value, 'a');
  EXPECT_EQ(line.pop(1'000'000'000)->time_ns, 1000 + 2 * 4'166'666);
  EXPECT_FALSE(line.pop(1'000'000'000).has_value());
  EXPECT_EQ(line.room(), 2u);
}

}  // namespace
}  // namespace corbot::sim::ssc32_commands_test
