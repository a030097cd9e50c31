// SPDX-License-Identifier: Apache-2.0
#include "cell/pictures/cell_animation.h"

#include <gmock/gmock.h>
#include <tinyxml.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <set>
#include <sstream>

#include "corbot/units.h"
#include "support/paths.h"

namespace corbot::cell {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;
using testing::Not;

CellConfig demo() {
  CellOverrides overrides;
  overrides.state_directory = "/nowhere";
  return load_cell(CORBOT_PROFILES "/cell/cell.toml", overrides);
}

/// Both arms swing without rest, and carry one piece after the other.
SceneRecord busy_run(double duration_s) {
  SceneRecord record;
  record.cast.kinds.assign(12, "red");
  for (const char* name : {"robot1", "robot2"})
    record.cast.arms.push_back({name, {0.035, 0.02, 0.018, 0.022}});
  for (int i = 0; 0.05 * i <= duration_s; ++i) {
    SceneSample sample{.time_s = 0.05 * i, .arms = {}, .pieces = std::vector<RecordedPiece>(12)};
    for (const double side : {0.0, 1.0}) {
      const double yaw = 1.2 * std::sin(1.9 * sample.time_s + side) + 0.3 * std::sin(7 * sample.time_s);
      const double reach_m = 0.2 + 0.05 * std::cos(2.3 * sample.time_s);
      const Vector3d along((side > 0 ? -1 : 1) * std::cos(yaw), std::sin(yaw), 0);
      const Vector3d base(0.48 * side, 0, 0);
      const Vector3d up(0, 0, 0.15);
      sample.arms.push_back({.points_m = {base, base + up / 2, base + 0.3 * reach_m * along + up,
                                          base + 0.7 * reach_m * along + up, base + reach_m * along},
                             .opening_m = 0.016 + 0.016 * std::sin(sample.time_s),
                             .across_rad = yaw});
    }
    const auto held = static_cast<std::size_t>(12 * sample.time_s / (duration_s + 1));
    for (std::size_t piece = 0; piece < 12; ++piece) {
      sample.pieces[piece].foot_m = {0.02 + 0.03 * static_cast<double>(piece), piece < held ? -0.25 : 0.25,
                                     0};
      if (piece != held) continue;
      sample.pieces[piece] = {.foot_m = sample.arms[piece % 2].points_m.back(), .hand = piece % 2};
    }
    record.samples.push_back(std::move(sample));
  }
  return record;
}

/// Every element of a document, in order.
void visit(const TiXmlElement& element, const std::function<void(const TiXmlElement&)>& f) {
  f(element);
  for (const TiXmlElement* child = element.FirstChildElement(); child; child = child->NextSiblingElement())
    visit(*child, f);
}

std::vector<double> numbers(std::string text) {
  std::replace(text.begin(), text.end(), ';', ' ');
  std::istringstream stream(text);
  std::vector<double> found;
  for (double value{}; stream >> value;) found.push_back(value);
  return found;
}

TEST(CellAnimation, IsWellFormedSmallAndWithoutScriptForTwelvePiecesAndNinetySeconds) {
  const std::string text = cell_animation(demo(), busy_run(90));
  EXPECT_LT(text.size(), 300'000u);
  EXPECT_THAT(text, Not(HasSubstr("<script")));
  EXPECT_THAT(text, Not(HasSubstr("nan")));
  TiXmlDocument document;
  document.Parse(text.c_str());
  ASSERT_FALSE(document.Error()) << document.ErrorDesc() << " in line " << document.ErrorRow();
  std::set<std::string> ids;
  std::set<std::string> uses;
  int animations = 0;
  visit(*document.RootElement(), [&](const TiXmlElement& element) {
    if (const char* id = element.Attribute("id")) {
      EXPECT_TRUE(ids.insert(id).second) << id;
    }
    if (const char* href = element.Attribute("href")) uses.insert(href + 1);
    const char* const times_text = element.Attribute("keyTimes");
    if (times_text == nullptr) return;
    ++animations;
    const std::vector<double> times = numbers(times_text);
    const std::string values = element.Attribute("values");
    EXPECT_EQ(std::count(values.begin(), values.end(), ';') + 1, std::ssize(times));
    EXPECT_EQ(times.front(), 0);
    EXPECT_TRUE(std::is_sorted(times.begin(), times.end()));
    if (element.Attribute("calcMode") == nullptr) {
      EXPECT_EQ(times.back(), 1);
    }
    EXPECT_STREQ(element.Attribute("repeatCount"), "indefinite");
  });
  EXPECT_TRUE(std::includes(ids.begin(), ids.end(), uses.begin(), uses.end()));
  EXPECT_GE(animations, 12 + 2 * 4);
  EXPECT_THAT(text, HasSubstr("prefers-color-scheme:dark"));
  EXPECT_THAT(text, HasSubstr("90 s; both arms move"));
  EXPECT_THAT(text, HasSubstr("4 \xc3\x97 real time"));
}

TEST(CellAnimation, MovesAPieceFromItsFirstPlaceToItsLast) {
  SceneRecord record = busy_run(20);
  const std::string text = cell_animation(demo(), record);
  TiXmlDocument document;
  document.Parse(text.c_str());
  std::vector<double> values;
  visit(*document.RootElement(), [&](const TiXmlElement& element) {
    const char* const id = element.Attribute("id");
    if (id == nullptr || std::string(id) != "p3") return;
    values = numbers(element.FirstChildElement("animateTransform")->Attribute("values"));
  });
  ASSERT_GE(values.size(), 4u);
  // The cell is longer along y, so that goes to the left. The view box is 748 wide without its margins.
  EXPECT_GT(values[values.size() - 2], values[0] + 300) << "from y = 0.25 m to y = -0.25 m";
  EXPECT_NEAR(values.back(), values[1], 0.1) << "x is the same";
}

TEST(CellAnimation, ASquareTurnsByLessThanARightAngleAtOnce) {
  CellConfig cell = demo();
  cell.kinds[0].is_square = true;
  SceneRecord record = busy_run(20);
  for (SceneSample& sample : record.samples)
    sample.pieces[3].yaw_rad = std::remainder(0.5 * sample.time_s, 2 * std::numbers::pi);
  const std::string text = cell_animation(cell, record);
  TiXmlDocument document;
  document.Parse(text.c_str());
  ASSERT_FALSE(document.Error()) << document.ErrorDesc();
  std::vector<double> values;
  visit(*document.RootElement(), [&](const TiXmlElement& element) {
    const char* const id = element.Attribute("id");
    if (id == nullptr || std::string(id) != "p3") return;
    const TiXmlElement& turned = *element.FirstChildElement("g");
    values = numbers(turned.FirstChildElement("animateTransform")->Attribute("values"));
    EXPECT_NE(turned.FirstChildElement("rect"), nullptr);
  });
  ASSERT_FALSE(values.empty());
  EXPECT_NEAR(std::abs(values.back() - values.front()), to_degrees(10), 20) << "0.5 rad/s for 20 s";
  EXPECT_THAT(cell_animation(demo(), record), Not(HasSubstr("rotate"))) << "a round piece does not turn";
}

TEST(CellAnimation, OfNoRunShowsTheCell) {
  const std::string text = cell_animation(demo(), {});
  TiXmlDocument document;
  document.Parse(text.c_str());
  EXPECT_FALSE(document.Error());
  EXPECT_THAT(text, HasSubstr("pallet1"));
  EXPECT_THAT(text, Not(HasSubstr("nan")));
}

TEST(CellAnimation, ANameIsTextAndNothingElse) {
  CellConfig cell = demo();
  cell.name = "a<b>&c";
  const std::string text = cell_animation(cell, busy_run(2));
  EXPECT_THAT(text, HasSubstr("The cell a&lt;b&gt;&amp;c from above"));
}

TEST(CellAnimation, NamesARecordThatIsCut) {
  SceneRecord record = busy_run(10);
  record.is_cut = true;
  EXPECT_THAT(cell_animation(demo(), record), HasSubstr(">first 10 s;"));
}

}  // namespace
}  // namespace corbot::cell
