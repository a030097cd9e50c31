// SPDX-License-Identifier: Apache-2.0
// Tests how a record is reduced and drawn, and which files are no record.
#include "cli/plot/plot.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <numbers>
#include <regex>
#include <string>
#include <vector>

#include "cli/plot/plan_plot.h"
#include "cli/record.h"
#include "cli/run_program.h"
#include "client/failure.h"
#include "client/program.h"
#include "client/write_file.h"
#include "config/load_profile.h"
#include "support/paths.h"

namespace corbot::cli::charts {
namespace {

using client::ExitCode;
using client::Failure;
using client::parse_program;
using client::Program;
using client::Statement;
using testing::HasSubstr;
using testing::Not;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// A directory of its own, which it removes.
class Plot : public testing::Test {
 protected:
  Plot() { std::filesystem::create_directories(folder_); }
  ~Plot() override { std::filesystem::remove_all(folder_); }

  std::string put(const std::string& text) const {
    std::ofstream(folder_ / "run.csv") << text;
    return folder_ / "run.csv";
  }
  /// Why the text is no record, without the path.
  std::string fault_of(const std::string& text) const {
    try {
      plot({put(text), ""});
    } catch (const Failure& failure) {
      EXPECT_EQ(failure.code(), ExitCode::kUsage);
      const std::string what = failure.what();
      return what.substr(what.find("run.csv"));
    }
    return "none";
  }

  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("plot_test." + std::to_string(::getpid()));
};

/// Joint 0 accelerates: its speed is 10 deg/s more from cycle to cycle, which are 20 ms apart.
std::string made_record(std::size_t cycles, bool has_notes = true) {
  const Profile profile = load_profile(CORBOT_TEST_PROFILE);
  std::vector<JointKind> joints;
  for (std::size_t i = 0; i < profile.arm.dof; ++i) joints.push_back(profile.arm.kinematics.joint_kind(i));
  std::string text = (has_notes ? csv_notes(profile) : "") + csv_header(joints);
  Snapshot snapshot{};
  for (std::size_t i = 0; i < cycles; ++i) {
    snapshot.cycle = 7 + i;
    snapshot.time_ns = 5'000'000'000 + static_cast<std::int64_t>(i) * 20'000'000;
    snapshot.flags = i < 2 ? 0 : kSnapshotMeasured;
    snapshot.measured_q[0] = 0.5;
    snapshot.velocity_q_s[0] = static_cast<double>(i) * 10.0 * std::numbers::pi / 180.0;
    text += csv_row(snapshot, joints);
  }
  return text;
}

std::string replaced(std::string text, const std::string& what, const std::string& with) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), with);
}

TEST(ReducedRows, KeepASpikeOfOneRowInAMillion) {
  ReducedRows rows(2);
  for (int i = 0; i < 1'000'000; ++i) {
    const std::vector<double> values{i == 70'001 ? 9.0 : i == 3 ? -9.0 : 0.0, kNan};
    rows.add(0.001 * i, values);
  }
  EXPECT_LE(rows.rows().size(), 4096U);
  EXPECT_GE(rows.rows().size(), 2048U);
  EXPECT_EQ(rows.range(0).low, -9.0);
  EXPECT_EQ(rows.range(0).high, 9.0);
  EXPECT_TRUE(rows.range(1).empty());
  EXPECT_EQ(rows.rows().back().end_s, 0.001 * 999'999);
  for (const auto& row : rows.rows()) {
    if (row.ranges[0].high == 9.0) {
      EXPECT_LE(row.begin_s, 70.001);
      EXPECT_GE(row.end_s, 70.001);
    }
  }
}

TEST_F(Plot, ARecordHasItsLimitsAndTheQuotientsOfItsSpeeds) {
  const Recording recording = read_recording(put(made_record(5)));
  EXPECT_EQ(recording.profile, load_profile(CORBOT_TEST_PROFILE).name);
  ASSERT_EQ(recording.joints.size(), 4U);
  ASSERT_TRUE(recording.joints[0].limits);
  EXPECT_EQ(recording.joints[0].name, load_profile(CORBOT_TEST_PROFILE).joint_names[0]);
  EXPECT_GT(recording.joints[0].limits->jerk, recording.joints[0].limits->acceleration);
  EXPECT_EQ(recording.cycles, 5U);
  EXPECT_EQ(recording.missing, 0U);
  EXPECT_NEAR(recording.duration_s(), 0.08, 1e-12);
  const Range acceleration = recording.rows.range(Recording::series_of(0, Quantity::kAcceleration));
  EXPECT_NEAR(acceleration.low, 500.0, 1e-4);
  EXPECT_NEAR(acceleration.high, 500.0, 1e-4);
  EXPECT_NEAR(recording.rows.range(Recording::series_of(0, Quantity::kJerk)).high, 0.0, 1e-2);
  EXPECT_TRUE(recording.rows.rows()[1].ranges[Recording::series_of(0, Quantity::kMeasured)].empty());
  EXPECT_NEAR(recording.rows.range(Recording::series_of(0, Quantity::kMeasured)).high,
              0.5 * 180.0 / std::numbers::pi, 1e-6);
}

TEST_F(Plot, ACycleThatIsMissingIsCountedAndGivesNoQuotient) {
  const std::string whole = made_record(6);
  const std::size_t begin = whole.find("\n10,") + 1;
  const Recording recording =
      read_recording(put(whole.substr(0, begin) + whole.substr(whole.find('\n', begin) + 1)));
  EXPECT_EQ(recording.cycles, 5U);
  EXPECT_EQ(recording.missing, 1U);
  EXPECT_TRUE(recording.rows.rows()[3].ranges[Recording::series_of(0, Quantity::kAcceleration)].empty());
  EXPECT_NEAR(recording.rows.range(Recording::series_of(0, Quantity::kAcceleration)).high, 500.0, 1e-4);
}

/// The loop missed periods. A late cycle moves the set-points by one period, or begins again from rest.
TEST_F(Plot, ALateCycleIsNamedAndInventsNoRates) {
  for (const bool is_gap : {false, true}) {
    const std::string time = is_gap ? "5260000000" : "5160000000";
    const std::string whole = made_record(6);
    const std::string late = replaced(replaced(whole, "11,5080000000", "11," + time), "12,5100000000",
                                      is_gap ? "12,5280000000" : "12,5180000000");
    const Recording recording = read_recording(put(late));
    EXPECT_EQ(recording.late, 1U);
    EXPECT_EQ(recording.missing, 0U);
    const std::size_t acceleration = Recording::series_of(0, Quantity::kAcceleration);
    EXPECT_EQ(recording.rows.rows()[4].ranges[acceleration].empty(), is_gap);
    EXPECT_NEAR(recording.rows.range(acceleration).low, 500.0, 1e-4);
    EXPECT_NEAR(recording.rows.range(acceleration).high, 500.0, 1e-4);
    EXPECT_FALSE(recording.rows.rows()[5].ranges[acceleration].empty());
    EXPECT_THAT(
        chart_svg(sheet_of(recording, "run.csv"), recording.rows),
        HasSubstr(fmt::format("6 cycles, 0 missing, 1 late by up to {} ms</text>", is_gap ? 180 : 80)));
  }
}

TEST_F(Plot, WhatIsNoRecordIsRefusedWithItsLine) {
  const std::string good = made_record(3);  // five lines before the rows
  EXPECT_EQ(fault_of(""),
            "run.csv: the file has no line with the names of columns, so it is no file of 'corbot record'");
  EXPECT_EQ(fault_of("x,y\n1,2\n"),
            "run.csv:1: column 'cycle' is missing, so this is no file of 'corbot record'");
  EXPECT_EQ(fault_of("# joint by joint\nx,y\n1,2\n"),
            "run.csv:2: column 'cycle' is missing, so this is no file of 'corbot record'");
  EXPECT_EQ(fault_of(made_record(1)),
            "run.csv: the file has 1 cycles, a drawing needs at least 2: record for longer");
  EXPECT_EQ(fault_of(replaced(good, ",theta1_deg,", ",other,")),
            "run.csv:6: the column of joint 1 is missing");
  EXPECT_EQ(fault_of(replaced(good, "time_ns", "time")),
            "run.csv:6: column 'time_ns' is missing, so this is no file of 'corbot record'");
  EXPECT_EQ(fault_of(replaced(good, "\n8,", "\n8,8,")),
            "run.csv:8: the line has 30 fields, but the file has 29 columns");
  EXPECT_EQ(fault_of(good + "10,50"), "run.csv:10: the line has 2 fields, but the file has 29 columns")
      << "cut by a full disk";
  EXPECT_EQ(fault_of(replaced(good, "\n8,", "\nx8,")), "run.csv:8: column 'cycle': 'x8' is not a number");
  EXPECT_EQ(fault_of(replaced(good, "\n8,5020000000", "\n8,5000000000")),
            "run.csv:8: time_ns 5000000000 is not after 5000000000 of the line before");
  EXPECT_THAT(fault_of(replaced(good, " deg/s2", "")),
              HasSubstr("run.csv:2: the line must have the name of a joint and five limits"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "run.svg"));
  EXPECT_EQ(fault_of(good), "none");
}

TEST_F(Plot, WritesTheWholePictureOrNone) {
  const std::string file = put(made_record(3));
  EXPECT_THROW(plot({folder_ / "none.csv", ""}), Failure);
  EXPECT_THROW(plot({file, file}), Failure) << "over the record";
  EXPECT_THROW(plot({file, folder_ / "no" / "run.svg"}), Failure);
  plot({file, ""});
  const std::string svg = text_of(folder_ / "run.svg");
  EXPECT_TRUE(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
  EXPECT_EQ(text_of(file), made_record(3));
  put("x\n");
  EXPECT_THROW(plot({file, ""}), Failure);
  EXPECT_EQ(text_of(folder_ / "run.svg"), svg);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "run.svg.new"));
  EXPECT_THROW(client::write_file("/dev/full", "text"), Failure);
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
}

TEST_F(Plot, HasTheChartsOfTheColumnsThatAreThere) {
  const Recording recording = read_recording(put(made_record(5)));
  const std::string svg = chart_svg(sheet_of(recording, "a<b&c.csv"), recording.rows);
  for (const char* title : {">a&lt;b&amp;c.csv</text>", ">joint 0 base, deg</text>", ">time, s</text>",
                            ">speed of the set-points, % of the limit</text>", ">pulses, us</text>",
                            "0.08 s, 5 cycles, 0 missing", "prefers-color-scheme:dark"})
    EXPECT_THAT(svg, HasSubstr(title));
  EXPECT_THAT(svg, Not(testing::ContainsRegex("nan|inf|<script")));

  const Recording bare = read_recording(put(made_record(5, false)));
  const std::string without = chart_svg(sheet_of(bare, "run.csv"), bare.rows);
  EXPECT_THAT(without, HasSubstr(">speed of the set-points, deg/s</text>"));
  EXPECT_THAT(without, Not(HasSubstr("m/s<"))) << "no joint slides";
  EXPECT_THAT(without, Not(HasSubstr("class=\"limit\"")));
}

TEST(ChartSvg, TellsMeasuredFromSetPointsAndLimits) {
  ReducedRows rows(3);
  for (int i = 0; i < 10; ++i) rows.add(0.1 * i, std::vector<double>{1.0 * i, i < 5 ? kNan : 2.0, kNan});
  const Chart chart{"angle, deg", {{"set-point", 0}, {"measured", 1, 1.0, true}, {"none", 2}}, {-50.0, 8.0}};
  const std::string svg = chart_svg({"run", "", {chart, {"empty, deg", {{"none", 2}}, {}}}}, rows);
  EXPECT_THAT(svg, HasSubstr("<path class=\"line c0\" d=\"M74 "));
  EXPECT_THAT(svg, HasSubstr("<path class=\"line c1 dashed\" d=\"M496.2 ")) << "from the fifth row on";
  EXPECT_THAT(svg, Not(HasSubstr("none</text>")));
  EXPECT_THAT(svg, Not(HasSubstr("empty, deg")));
  const std::regex limit("<path class=\"limit\" d=\"M[0-9.]+ [0-9.]+H[0-9.]+\"/>");
  std::smatch found;
  EXPECT_TRUE(std::regex_search(svg, found, limit)) << "one of the two, and the other is beyond the chart";
}

TEST(ChartSvg, KeepsTheSpikesOfAnHourInASmallFile) {
  constexpr std::size_t kSeries = 36;
  ReducedRows rows(kSeries);
  std::vector<double> values(kSeries);
  for (int i = 0; i < 180'000; ++i) {
    for (std::size_t k = 0; k < kSeries; ++k) values[k] = std::sin(0.01 * i * static_cast<double>(k + 1));
    values[0] = i == 90'000 ? 1000.0 : 0.0;
    rows.add(0.02 * i, values);
  }
  ChartSheet sheet{"hour.csv", "", {}};
  for (std::size_t k = 0; k < kSeries; ++k)
    sheet.charts.push_back({fmt::format("{}, deg", k), {{"a", k}}, {}});
  const std::string svg = chart_svg(sheet, rows);
  EXPECT_LT(svg.size(), 800'000U);
  // The middle of the time, from the lower edge of the chart to the upper one, and back.
  EXPECT_NE(svg.find("<path class=\"line c0\" d=\"M74.5 193.5h379.2v-91l0.9 91h378.9\"/>"),
            std::string::npos);
}

/// Returns the samples that a program plans for the arm of this profile.
PlanSamples samples_of(const std::string& program, const char* profile) {
  DryRun robot(profile);
  for (const Statement& statement : parse_program(program).statements)
    EXPECT_EQ(robot.refusal_of(statement.request).value_or(""), "");
  return sample(robot.profile(), robot.plans());
}

TEST(PlanSamples, FollowTheLineWithinTheLimits) {
  const PlanSamples samples = samples_of("move 0.22 -0.08 0.05\nmoves 0.2 0.08 0.05\ndelay 0.5\nclose\n",
                                         CORBOT_PROFILES "/lynx5.toml");
  EXPECT_EQ(samples.motion.joints[1].name, "shoulder");
  const Vector3& end_m = samples.points_m.back();
  EXPECT_NEAR(end_m[0], 0.2, 1e-4);
  EXPECT_NEAR(end_m[1], 0.08, 1e-4);
  double line_m = 0.0;  // how far the points after the first motion are from the line
  for (const Vector3& point_m : samples.points_m) {
    if (point_m[0] < 0.22 - 1e-6 && point_m[1] > -0.08 + 1e-6)
      line_m = std::max(
          {line_m, std::abs(point_m[2] - 0.05), std::abs(0.22 - 0.125 * (point_m[1] + 0.08) - point_m[0])});
  }
  EXPECT_LT(line_m, 1e-6);
  for (std::size_t i = 0; i < 4; ++i) {
    const RecordedLimits& limits = *samples.motion.joints[i].limits;
    const auto reached = [&](Quantity quantity) {
      const Range range = samples.motion.rows.range(Recording::series_of(i, quantity));
      return std::max(range.high, -range.low);
    };
    EXPECT_LE(reached(Quantity::kSpeed), 1.001 * limits.speed);
    EXPECT_LE(reached(Quantity::kAcceleration), 1.001 * limits.acceleration);
    EXPECT_LE(reached(Quantity::kJerk), 1.001 * limits.jerk);
    EXPECT_GT(reached(Quantity::kJerk), 0.01 * limits.jerk);
  }
  EXPECT_GT(samples.motion.rows.range(samples.rate()).high, 0.5);
  const auto& last = samples.motion.rows.rows().back();
  EXPECT_EQ(last.ranges[Recording::series_of(0, Quantity::kSpeed)].high, 0.0) << "it rests";
  EXPECT_TRUE(last.ranges[samples.rate()].empty()) << "the gripper has no rate";
}

TEST(PlanSamples, FollowTheLineOfAnArmWithoutAClosedForm) {
  const PlanSamples before = samples_of("joints 0 0 -60 0 60 0\n", CORBOT_PROFILES "/xarm6.toml");
  const PlanSamples samples =
      samples_of("joints 0 0 -60 0 60 0\nmoverelative 0 0 0.03 --line\n", CORBOT_PROFILES "/xarm6.toml");
  const Vector3& from_m = before.points_m.back();
  const Vector3& to_m = samples.points_m.back();
  EXPECT_NEAR(to_m[0], from_m[0], 1e-4);
  EXPECT_NEAR(to_m[1], from_m[1], 1e-4);
  EXPECT_NEAR(to_m[2], from_m[2] + 0.03, 2e-4);
}

TEST_F(Plot, ADryRunDrawsWhatItPlans) {
  const std::string file = folder_ / "plan.svg";
  Program program = parse_program("speed 50\nmove 0.22 -0.08 0.05\nmoves 0.2 0.08 0.05\n");
  program.name = "examples/p.corbot";
  check_reach(program, CORBOT_PROFILES "/lynx5.toml", file);
  const std::string svg = text_of(file);
  for (const char* title :
       {">p.corbot</text>", ">path from above: y over x, m</text>", ">path from the side: z over x, m</text>",
        ">joint 3 wrist, deg</text>", ">jerk of the set-points, % of the limit</text>",
        ">rate of lambda along lines and arcs, 1</text>", "s as planned"})
    EXPECT_NE(svg.find(title), std::string::npos) << title;
  EXPECT_EQ(svg.find("pulses"), std::string::npos) << "nothing has any";
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_LT(svg.size(), 200'000U);
  std::filesystem::remove(file);
  EXPECT_THROW(check_reach(parse_program("speed 50\n"), CORBOT_PROFILES "/lynx5.toml", file), Failure);
  EXPECT_THROW(check_reach(parse_program("open\nmove 2 2 2\n"), CORBOT_PROFILES "/lynx5.toml", file),
               Failure);
  EXPECT_FALSE(std::filesystem::exists(file));
}

}  // namespace
}  // namespace corbot::cli::charts
