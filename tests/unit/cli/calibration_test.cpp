// SPDX-License-Identifier: Apache-2.0
// The arithmetic of `corbot calibrate`.
#include <gmock/gmock.h>

#include <filesystem>
#include <random>

#include "cli/calibrate/calibration.h"
#include "config/load_profile.h"
#include "support/paths.h"

namespace corbot::cli {

namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

Calibration lynx5() {
  return Calibration(load_profile(std::filesystem::path(CORBOT_PROFILES) / "lynx5.toml"));
}

TEST(Line, GoesThroughBothMarks) {
  std::mt19937_64 random(7);
  for (int i = 0; i < 100'000; ++i) {
    const ServoLine truth{std::uniform_real_distribution<>(0, 3000)(random),
                          std::uniform_real_distribution<>(3, 50)(random), i % 2 == 0 ? 1 : -1};
    const double a = std::uniform_real_distribution<>(-90, 0)(random);
    const double b = a + std::uniform_real_distribution<>(20, 90)(random);
    const LineResult found =
        line_through({a, truth.pulse_us(a)}, {b, truth.pulse_us(b)}, unit_of(JointKind::kRotary));
    ASSERT_TRUE(found.line) << found.fault;
    EXPECT_EQ(found.line->direction, truth.direction);
    EXPECT_NEAR(found.line->us_per_unit, truth.us_per_unit, 0.00051);
    for (const double angle : {a, b}) EXPECT_NEAR(found.line->pulse_us(angle), truth.pulse_us(angle), 0.04);
  }
}

TEST(Line, IsRefusedWhereItIsNotPlausible) {
  EXPECT_THAT(line_through({0, 1500}, {0, 1500}, unit_of(JointKind::kRotary)).fault,
              HasSubstr("mark places at least"));
  EXPECT_THAT(line_through({0, 1500}, {9, 1600}, unit_of(JointKind::kRotary)).fault,
              HasSubstr("mark places at least"));
  EXPECT_THAT(line_through({0, 1500}, {90, 1549}, unit_of(JointKind::kRotary)).fault,
              HasSubstr("mark places at least"));
  EXPECT_THAT(line_through({0, 1500}, {90, 1600}, unit_of(JointKind::kRotary)).fault,
              HasSubstr("the marks give 1.111 us a degree, plausible are"));
  EXPECT_THAT(line_through({0, 500}, {20, 2500}, unit_of(JointKind::kRotary)).fault,
              HasSubstr("plausible are"));
}

TEST(Calibrate, TwoMarksGiveALineOneItsZeroNoneTheProfile) {
  Calibration calibration = lynx5();
  EXPECT_THAT(calibration.edits(), IsEmpty());
  EXPECT_THAT(calibration.faults(), IsEmpty());
  EXPECT_EQ(calibration.mark(0, {0.0, 1520.0}), "");
  EXPECT_EQ(calibration.line(0).zero_us, 1520.0);
  EXPECT_EQ(calibration.line(0).us_per_unit, 10.0);
  EXPECT_THAT(calibration.edits(), SizeIs(1));
  EXPECT_EQ(calibration.mark(0, {90.0, 665.0}), "");
  EXPECT_EQ(calibration.line(0).zero_us, 1520.0);
  EXPECT_EQ(calibration.line(0).us_per_unit, 9.5);
  EXPECT_EQ(calibration.line(0).direction, -1);
  EXPECT_EQ(calibration.mark(0, {90.0, 674.0}), "") << "seen better";
  EXPECT_EQ(calibration.line(0).us_per_unit, 9.4);
  EXPECT_EQ(calibration.mark(0, {-45.0, 1943.0}), "") << "a third one takes the place of the first";
  EXPECT_NE(calibration.mark(0, {-44.0, 1943.0}), "");
  EXPECT_EQ(calibration.line(0).us_per_unit, 9.4) << "what is refused changes nothing";
  std::vector<std::string> paths;
  for (const NumberEdit& edit : calibration.edits()) paths.push_back(edit.path);
  EXPECT_THAT(paths, testing::UnorderedElementsAre("joint[0].servo.zero_us", "joint[0].servo.us_per_degree",
                                                   "joint[0].servo.direction"));
}

TEST(Calibrate, NamesTheEndsThatCannotBeReached) {
  Calibration calibration = lynx5();
  ASSERT_EQ(calibration.mark(1, {0.0, 1200.0}), "");  // was 1000: 130 degrees would be 2500, now 2500 is 130
  EXPECT_THAT(calibration.faults(), IsEmpty());
  ASSERT_EQ(calibration.mark(1, {0.0, 1250.0}), "");
  ASSERT_THAT(calibration.faults(), SizeIs(1));
  EXPECT_THAT(calibration.faults()[0], HasSubstr("shoulder: its high end, 130 degrees, needs 2550 us"));
  EXPECT_THAT(calibration.faults()[0], HasSubstr("-75.0 to 125.0 degrees"));
  EXPECT_EQ(calibration.limit(1, true, 2456.0), "");
  EXPECT_THAT(calibration.faults(), IsEmpty());
  EXPECT_EQ(calibration.range(1)[1], 120.6);
  EXPECT_EQ(calibration.limit(1, false, 1254.0).substr(0, 7), "the low");
  EXPECT_EQ(calibration.limit(1, false, 1004.4), "");
  EXPECT_EQ(calibration.range(1)[0], -24.5) << "inwards";
}

TEST(Calibrate, UndoesOneByOne) {
  Calibration calibration = lynx5();
  EXPECT_FALSE(calibration.undo());
  ASSERT_EQ(calibration.mark(0, {0.0, 1520.0}), "");
  ASSERT_EQ(calibration.limit(0, true, 2000.0), "");
  calibration.mark_gripper(true, 1150.0);
  EXPECT_THAT(calibration.edits(), SizeIs(3));
  EXPECT_TRUE(calibration.undo());
  EXPECT_THAT(calibration.edits(), SizeIs(2));
  EXPECT_TRUE(calibration.undo());
  EXPECT_TRUE(calibration.undo());
  EXPECT_THAT(calibration.edits(), IsEmpty());
  EXPECT_FALSE(calibration.undo());
  calibration.mark_gripper(true, 1880.0);
  EXPECT_THAT(calibration.faults(), SizeIs(1)) << "20 us from closed";
}

Calibration slides() {
  return Calibration(
      load_profile(std::filesystem::path(CORBOT_PROFILES) / "../tests/profiles/servo_slides.toml"));
}

TEST(Line, OfASlideIsInMillimetres) {
  const MarkUnit& mm = unit_of(JointKind::kPrismatic);
  const LineResult found = line_through({0, 1010}, {300, 1640}, mm);
  ASSERT_TRUE(found.line) << found.fault;
  EXPECT_EQ(found.line->zero_us, 1010.0);
  EXPECT_EQ(found.line->us_per_unit, 2.1);
  EXPECT_THAT(line_through({0, 1000}, {4, 1600}, mm).fault,
              HasSubstr("the two marks are only 4 mm and 600 us apart"));
  EXPECT_THAT(line_through({0, 1000}, {300, 1100}, mm).fault, HasSubstr("0.333 us a mm, plausible are"));
  EXPECT_TRUE(line_through({0, 1000}, {6, 2000}, mm).line);
}

TEST(Calibrate, OfASlideWritesMetresAndMicrosecondsAMillimetre) {
  Calibration calibration = slides();
  EXPECT_THAT(calibration.edits(), IsEmpty());
  EXPECT_THAT(calibration.faults(), IsEmpty());
  EXPECT_NEAR(calibration.range(0)[1], 477.2, 1e-9);
  ASSERT_EQ(calibration.mark(0, {0.0, 1010.0}), "");
  ASSERT_EQ(calibration.mark(0, {300.0, 1640.0}), "");
  EXPECT_THAT(calibration.text(0),
              HasSubstr("zero_us 1010, us_per_mm 2.1, direction 1, range_m 0 to 0.4772; marked"));
  EXPECT_THAT(calibration.text(0), HasSubstr("300 mm at 1640 us"));
  ASSERT_EQ(calibration.limit(0, false, 1010.0), "") << "0 itself";
  EXPECT_EQ(calibration.range(0)[0], 0.0);
  ASSERT_EQ(calibration.limit(0, true, 1010.0 + 2.1 * 412.37), "");
  EXPECT_EQ(calibration.range(0)[1], 412.3) << "inwards";
  EXPECT_THAT(calibration.limit(1, true, 2100.0), HasSubstr("-50.0 mm, but the range must contain 0"));
  EXPECT_THAT(calibration.mark(2, {10'001.0, 1500.0}), HasSubstr("to 10000 mm"));
  std::vector<std::pair<std::string, double>> edits;
  for (const NumberEdit& edit : calibration.edits()) edits.emplace_back(edit.path, edit.value);
  EXPECT_THAT(edits, testing::UnorderedElementsAre(testing::Pair("joint[0].servo.zero_us", 1010.0),
                                                   testing::Pair("joint[0].servo.us_per_mm", 2.1),
                                                   testing::Pair("joint[0].range_m[1]", 0.4123)));
  ASSERT_EQ(calibration.mark(1, {0.0, 1900.0}), "");
  EXPECT_THAT(calibration.faults(), IsEmpty());
  ASSERT_EQ(calibration.mark(1, {0.0, 1450.0}), "");
  ASSERT_THAT(calibration.faults(), SizeIs(1));
  EXPECT_THAT(calibration.faults()[0], HasSubstr("y: its high end, 493.8 mm, needs 462 us"));
  EXPECT_THAT(calibration.faults()[0], HasSubstr("-525.0 to 475.0 mm"));
}

}  // namespace
}  // namespace corbot::cli
