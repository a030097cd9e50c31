// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/gantt.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>

#include "unit/cell/made_history.h"

namespace corbot::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

/// Left ends and widths of the bars of a class, "40.00+200.00", of all lanes in their order. The last is the
/// legend's.
std::vector<std::string> bars(const std::string& svg, const std::string& kind) {
  std::vector<std::string> found;
  const std::regex path("<path class=\"" + kind + "\" d=\"([^\"]*)\"");
  const std::regex box("M([0-9.]+) [0-9.]+h([0-9.]+)v");
  for (std::sregex_iterator at(svg.begin(), svg.end(), path), end; at != end; ++at) {
    const std::string d = (*at)[1];
    for (std::sregex_iterator bar(d.begin(), d.end(), box); bar != end; ++bar)
      found.push_back(fmt::format("{}+{}", (*bar)[1].str(), (*bar)[2].str()));
  }
  if (!found.empty()) found.pop_back();
  return found;
}

TEST(Gantt, BarsAreAtTheTimesOfTheirActivities) {
  const std::string svg = cli::gantt_svg(made_history());
  EXPECT_THAT(bars(svg, "move"), ElementsAre("40.00+200.00", "260.00+280.00", "600.00+560.00"));
  EXPECT_THAT(bars(svg, "look"), ElementsAre("240.00+20.00"));
  EXPECT_THAT(bars(svg, "zone"), ElementsAre("540.00+60.00"));
  EXPECT_THAT(bars(svg, "piece-bar"), ElementsAre("40.00+500.00"));
  EXPECT_THAT(bars(svg, "inside"), ElementsAre("260.00+280.00", "600.00+140.00"));
}

TEST(Gantt, HairlinesAndNumbersBelongToTheirPieces) {
  const std::string svg = cli::gantt_svg(made_history());
  EXPECT_THAT(svg, HasSubstr("<path class=\"held\" d=\"M240.00 "));    // robot1
  EXPECT_THAT(svg, HasSubstr("<path class=\"placed\" d=\"M530.00 "));  // robot1
  EXPECT_THAT(svg, HasSubstr("<path class=\"held\" d=\"M740.00 "));    // robot2
  EXPECT_THAT(svg, HasSubstr("<path class=\"placed\" d=\"M1160.00 "));
  EXPECT_THAT(svg, HasSubstr("<text class=\"piece\" x=\"290.0\" y=\"114.0\">1</text>"));
  EXPECT_THAT(svg, HasSubstr("<text class=\"piece\" x=\"850.0\" y=\"290.0\">1</text>"));
}

TEST(Gantt, TicksAreSecondsFromTheBegin) {
  const std::string svg = cli::gantt_svg(made_history());
  EXPECT_THAT(svg, HasSubstr("<text class=\"tick\" x=\"40.0\" y=\"442.0\">0</text>"));
  EXPECT_THAT(svg, HasSubstr("<text class=\"tick\" x=\"1140.0\" y=\"442.0\">110</text>"));
  EXPECT_THAT(svg, HasSubstr("time in seconds"));
}

TEST(Gantt, ServesReadersWhoHearItAndBothGrounds) {
  const std::string svg = cli::gantt_svg(made_history());
  EXPECT_THAT(svg, HasSubstr("<title id=\"title\">What each robot did: 1 piece in 112.0 s</title>"));
  EXPECT_THAT(svg, HasSubstr("robot1: moves or grips 48.0 s, waits for the zone 0.0 s"));
  EXPECT_THAT(svg, HasSubstr("prefers-color-scheme:dark"));
  EXPECT_THAT(svg, Not(HasSubstr("<script")));
}

TEST(Gantt, AShortLookAtTheEndStaysInsideTheChart) {
  cli::WorkHistory history = made_history();
  history.activities.insert(history.activities.end() - 1,
                            {1700000111.99, "robot2", cell::Activity::kLooking, 1, ""});
  EXPECT_THAT(bars(cli::gantt_svg(history), "look"), ElementsAre("240.00+20.00", "1157.00+3.00"));
}

TEST(Gantt, ManyPiecesStayBelow300Kilobytes) {
  cli::WorkHistory history;
  history.robots = {"robot1", "robot2"};
  for (std::uint64_t piece = 1; piece <= 2000; ++piece) {
    const double at_s = 6.8 * static_cast<double>(piece);
    for (const std::string& robot : history.robots) {
      const auto from = [&](double more_s, cell::Activity activity, const char* zone) {
        history.activities.push_back({at_s + more_s, robot, activity, piece, zone});
      };
      from(0, cell::Activity::kLooking, "");
      from(0.02, cell::Activity::kMoving, "");
      from(3, cell::Activity::kWaitingForZone, "store1");
      from(4, cell::Activity::kWaitingForPiece, "");
      history.milestones.push_back({at_s, robot, piece, cli::Milestone::kReserved});
      history.milestones.push_back({at_s + 3, robot, piece, cli::Milestone::kHeld});
      history.milestones.push_back({at_s + 6, robot, piece, cli::Milestone::kPlaced, true});
    }
  }
  EXPECT_LT(cli::gantt_svg(history).size(), 300'000U);
}

TEST(Gantt, IsEmptyWithoutTheRecordOrWithoutAPiece) {
  cli::WorkHistory unknown = made_history();
  unknown.activities.clear();
  EXPECT_EQ(cli::gantt_svg(unknown), "");
  cli::WorkHistory none = made_history();
  none.milestones.resize(2);
  EXPECT_EQ(cli::gantt_svg(none), "");
}

}  // namespace
}  // namespace corbot::test
