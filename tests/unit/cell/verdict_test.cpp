// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/verdict.h"
#include "support/paths.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

namespace corbot::cli {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

cell::CellConfig shipped() {
  cell::CellOverrides overrides;
  overrides.state_directory = "/tmp/cell-state";
  overrides.pieces = 3;
  return cell::load_cell(CORBOT_CELL "/cell.toml", overrides);
}

constexpr const char* kSceneEnd =
    "end pallet1=0 store1=0 pallet2=3 elsewhere=0 held=0 fallen=0 touches=0 nearest_mm=54.6 overruns=2";

CellEnd good() {
  CellEnd end;
  end.expected = 3;
  end.in_ledger = {{"pallet1", 0}, {"store1", 0}, {"pallet2", 3}};
  end.arrivals = {{1, 1}, {2, 1}, {3, 1}};
  end.seen = {{"pallet2", 3}};
  end.has_scene = true;
  end.scene = parse_scene_end(kSceneEnd);
  return end;
}

TEST(CellVerdict, NamesWhatThreeWitnessesAgreeOn) {
  const Verdict verdict = judge(shipped(), good());
  EXPECT_THAT(verdict.faults, ElementsAre());
  EXPECT_EQ(
      verdict.summary,
      "3 of 3 pieces on pallet2, each once; the camera sees 3 there, 0 elsewhere; arms never nearer than 55 "
      "mm, 0 touches, 0 fallen");
}

struct Planted {
  const char* name;
  std::function<void(CellEnd&)> plant;
  const char* fault;
};
void PrintTo(const Planted& planted, std::ostream* out) { *out << planted.name; }

class PlantedEnd : public testing::TestWithParam<Planted> {};

TEST_P(PlantedEnd, IsNamed) {
  CellEnd end = good();
  GetParam().plant(end);
  const Verdict verdict = judge(shipped(), end);
  ASSERT_FALSE(verdict.faults.empty());
  EXPECT_THAT(verdict.faults, testing::Contains(HasSubstr(GetParam().fault)));
}

const Planted kPlanted[] = {
    {"piece_removed_before_the_last_look", [](CellEnd& end) { end.seen["pallet2"] = 2; },
     "the camera sees 2 pieces on pallet2, not 3"},
    {"piece_seen_between_the_places", [](CellEnd& end) { end.seen[""] = 1; },
     "the camera sees 1 piece elsewhere"},
    {"ledger_row_too_many", [](CellEnd& end) { end.in_ledger["pallet2"] = 4; },
     "the ledger has 4 pieces on pallet2"},
    {"ledger_row_at_the_store", [](CellEnd& end) { end.in_ledger["store1"] = 1; },
     "the ledger has 1 piece on store1"},
    {"piece_twice",
     [](CellEnd& end) {
       end.arrivals = {{1, 1}, {2, 2}};
     },
     "piece 2 arrived 2 times"},
    {"arrival_missing", [](CellEnd& end) { end.arrivals.erase(3); }, "2 pieces arrived on pallet2"},
    {"touch", [](CellEnd& end) { end.scene->touches = 1; }, "the arms touched 1 time"},
    {"fallen", [](CellEnd& end) { end.scene->fallen = 1; }, "1 piece fell"},
    {"held", [](CellEnd& end) { end.scene->standing["held"] = 1; }, "the scene has 1 piece held"},
    {"scene_silent", [](CellEnd& end) { end.scene.reset(); }, "no counts"},
};
INSTANTIATE_TEST_SUITE_P(All, PlantedEnd, testing::ValuesIn(kPlanted),
                         [](const auto& each) { return each.param.name; });

TEST(CellVerdict, ACellWithoutASceneExpectsWhatItsLedgerHas) {
  CellEnd end = good();
  end.expected.reset();
  end.has_scene = false;
  end.scene.reset();
  const Verdict verdict = judge(shipped(), end);
  EXPECT_THAT(verdict.faults, ElementsAre());
  EXPECT_THAT(verdict.summary, HasSubstr("3 of 3 pieces"));
}

TEST(CellVerdict, OtherLinesAreNoEndOfTheScene) {
  for (const char* line :
       {"", "ready", "end", "end pallet2", "end pallet2=x nearest_mm=1", "end pallet2=-1 nearest_mm=1",
        "end pallet2=3 fallen=0", "end pallet2=3 nearest_mm=far"}) {
    EXPECT_FALSE(parse_scene_end(line)) << line;
  }
  const auto one_arm = parse_scene_end("end pallet2=3 fallen=0 touches=0 nearest_mm=-");
  ASSERT_TRUE(one_arm);
  EXPECT_FALSE(one_arm->nearest_mm);
}

}  // namespace
}  // namespace corbot::cli
