// SPDX-License-Identifier: Apache-2.0
#include "config/similar.h"

#include <gtest/gtest.h>

#include <array>
#include <string>

namespace corbot::similar_test {
namespace {

constexpr std::array<std::string_view, 4> kKeys{"speed_deg_s", "range_deg", "name", "readback"};
constexpr std::array<std::string_view, 5> kCommands{"up", "open", "move", "movec", "status"};

std::string_view key(std::string_view typed) { return most_similar(typed, kKeys, kSimilarKey); }
std::string_view command(std::string_view typed) { return most_similar(typed, kCommands, kSimilarCommand); }

TEST(Similar, AKeyMayHaveAnEditForEachThreeLetters) {
  EXPECT_EQ(key("nam"), "name");
  EXPECT_EQ(key("nome"), "name");
  EXPECT_EQ(key("nmae"), "") << "an exchange of neighbours is two edits, one too many for four letters";
  EXPECT_EQ(key("raedback"), "readback") << "and not for eight";
  EXPECT_EQ(key("reedbakk"), "readback");
  EXPECT_EQ(key("reedbokk"), "");
}

TEST(Similar, AKeyMayLackItsUnit) {
  EXPECT_EQ(key("speed"), "speed_deg_s");
  EXPECT_EQ(key("s"), "") << "a letter alone says nothing";
}

TEST(Similar, ACommandMayHaveTwoEditsButNotAsManyAsLetters) {
  EXPECT_EQ(command("moev"), "move");
  EXPECT_EQ(command("mve"), "move");
  EXPECT_EQ(command("opne"), "open");
  EXPECT_EQ(command("u"), "up");
  EXPECT_EQ(command("xy"), "") << "two edits make any word of two letters";
  EXPECT_EQ(command("oxn"), "") << "of three letters, two edits leave one";
  EXPECT_EQ(command("xyve"), "move");
  EXPECT_EQ(command("xyze"), "");
}

TEST(Similar, ACommandIsNotGuessedFromItsBeginning) { EXPECT_EQ(command("st"), ""); }

TEST(Similar, NothingIsNearAVeryLongWord) {
  EXPECT_EQ(key(std::string(1000, 'x')), "");
  EXPECT_EQ(command(std::string(1000, 'x')), "");
}

}  // namespace
}  // namespace corbot::similar_test
