// SPDX-License-Identifier: Apache-2.0
// Arms of three kinds carry out one program as a reader of README runs it: `corbot up`, then the program.
#include <gmock/gmock.h>
#include <signal.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/core.h>

#include "cli_rig.h"
#include "support/paths.h"
#include "support/ports.h"

namespace corbot::test {
namespace {

using testing::HasSubstr;
using Point = std::array<double, 3>;

constexpr double kBelow_m = 0.06, kAbove_m = 0.04, kPitch_m = 0.04;
constexpr double kExact_m = 1e-6;

/// The tool in every cycle of a recording.
std::vector<Point> read_track(const std::string& file) {
  std::ifstream stream(file);
  std::string line;
  while (std::getline(stream, line) && line.starts_with('#')) {
  }
  const auto fields = [](const std::string& text) {
    std::vector<std::string> all;
    std::istringstream in(text);
    for (std::string field; std::getline(in, field, ',');) all.push_back(field);
    return all;
  };
  const std::vector<std::string> names = fields(line);
  const auto x = static_cast<std::size_t>(std::find(names.begin(), names.end(), "x_m") - names.begin());
  std::vector<Point> track;
  while (std::getline(stream, line)) {
    const std::vector<std::string> row = fields(line);
    if (row.size() != names.size() || x + 2 >= row.size()) return {};
    track.push_back({std::stod(row[x]), std::stod(row[x + 1]), std::stod(row[x + 2])});
  }
  return track;
}

double level_m(const Point& a, const Point& b) { return std::hypot(a[0] - b[0], a[1] - b[1]); }

class Tray : public CliRig, public testing::WithParamInterface<const char*> {};

TEST_P(Tray, IsCarriedOutAndEveryPlaceIsReached) {
  up({}, std::string(CORBOT_TEST_PROFILES) + "/" + GetParam() + ".toml");
  if (HasFatalFailure()) return;
  const auto at = status().at("tool");
  const Point ready{at.at("x_m"), at.at("y_m"), at.at("z_m")};
  const std::string file = (directory_ / "run.csv").string();
  const auto recorder = begin({"record", file});
  ASSERT_TRUE(wait_until(within(20), [&] { return std::filesystem::exists(file); }));
  const RunResult result = run(
      {CORBOT_BINARY_DIR "/examples/tray", fmt::format("corbaloc::127.0.0.1:{}/{}", port_, name_)}, 100.0);
  recorder->signal(SIGINT);
  EXPECT_EQ(recorder->wait(within(20)), 0);
  ASSERT_EQ(result.code, 0) << result.output << result.errors;
  EXPECT_THAT(result.output, HasSubstr("done"));

  const std::vector<Point> track = read_track(file);
  ASSERT_GT(track.size(), 1000u);
  const double tray_z = ready[2] - kBelow_m;
  std::vector<Point> reached;
  double highest_m = 0.0;
  std::size_t on_the_way = 0;
  for (const Point& p : track) {
    highest_m = std::max(highest_m, p[2] - ready[2]);
    EXPECT_GE(p[2], tray_z - kExact_m);
    if (p[2] > tray_z + kAbove_m - 1e-3) continue;
    // Below the approach's upper end the tool is over one of the four places: it goes straight down and up.
    double nearest_m = 1.0;
    for (const double column : {0.0, 1.0}) {
      for (const double row : {1.0, 2.0}) {
        const Point place{ready[0] - row * kPitch_m, ready[1] - column * kPitch_m, tray_z};
        nearest_m = std::min(nearest_m, level_m(place, p));
      }
    }
    ASSERT_LT(nearest_m, kExact_m) << p[0] << ", " << p[1] << ", " << p[2];
    ++on_the_way;
    const bool is_there = p[2] < tray_z + kExact_m;
    if (is_there && (reached.empty() || level_m(reached.back(), p) > kPitch_m / 2)) reached.push_back(p);
  }
  EXPECT_GT(on_the_way, 200u);
  ASSERT_EQ(reached.size(), 4u) << "places of the tray, in order";
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(reached[i][0], ready[0] - kPitch_m * static_cast<double>(1 + i % 2), kExact_m);
    EXPECT_NEAR(reached[i][1], ready[1] - kPitch_m * static_cast<double>(i / 2), kExact_m);
  }
  EXPECT_LT(highest_m, kExact_m) << "above the ready arm, which a SCARA's shaft and a gantry cannot go";
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(track.back()[i], ready[i], kExact_m) << "at the end";
}

INSTANTIATE_TEST_SUITE_P(Arms, Tray, testing::Values("puma560", "scara_gx4", "cartesian_ppp"),
                         [](const auto& arm) { return std::string(arm.param); });

TEST(TrayAlone, SaysThatNobodyIsThere) {
  const RunResult result =
      run({CORBOT_BINARY_DIR "/examples/tray", fmt::format("corbaloc::127.0.0.1:{}/arm", free_port())});
  EXPECT_EQ(result.code, 1);
  EXPECT_THAT(result.errors, HasSubstr("is the robot up?"));
}

}  // namespace
}  // namespace corbot::test
