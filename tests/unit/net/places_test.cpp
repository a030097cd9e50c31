// SPDX-License-Identifier: Apache-2.0
#include "net/places.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <regex>
#include <string>
#include <thread>
#include <vector>

#include "support/paths.h"
#include "unit/net/accepted_pair.h"

namespace corbot::test {
namespace {

class Places : public ::testing::Test {
 protected:
  ~Places() override {
    for (const int place : taken_) corbot_place_free(place);
  }
  int take(corbot_place_kind kind, const AcceptedPair& from) {
    const int place = corbot_place_take(kind, corbot_connection_used(from.server), &capacity_);
    if (place >= 0) taken_.push_back(place);
    return place;
  }
  int take(corbot_place_kind kind) { return take(kind, client_); }
  void free(int place) {
    corbot_place_free(place);
    taken_.erase(std::find(taken_.begin(), taken_.end(), place));
  }
  /// Asks as a call does that lasts, until that is decided.
  bool lasts(int place) {
    bool stays = true;
    for (int i = 0; i < 20 && stays; ++i) {
      stays = corbot_place_may_stay(place);
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return stays;
  }

  Listener listener_;
  AcceptedPair client_{listener_};
  int capacity_{};
  std::vector<int> taken_;
};

TEST(PlaceNeeded, ByEveryOperationThatWaitsForAMotionOrStartsOne) {
  corbot_place_kind kind{};
  for (const char* waits : {"Move", "MoveC", "MoveJoints", "MovePose", "MovePoseS", "MoveRelative",
                            "MoveRelativeS", "SetGripper", "Wait"}) {
    EXPECT_TRUE(corbot_place_needed(waits, &kind)) << waits;
    EXPECT_EQ(kind, CORBOT_PLACE_TO_WAIT) << waits;
  }
  for (const char* starts : {"StartMove", "StartMovePose", "StartMoveRelativeS"}) {
    EXPECT_TRUE(corbot_place_needed(starts, &kind)) << starts;
    EXPECT_EQ(kind, CORBOT_PLACE_TO_START) << starts;
  }
  for (const char* at_once : {"SetToolPitch", "SetToolOrientation", "ResetToolOrientation", "Speed"})
    EXPECT_FALSE(corbot_place_needed(at_once, &kind)) << at_once;
}

/// The servant on ORBit2 lets these run in a place only.
TEST(PlaceNeeded, ByEveryOperationThatTheServantOnOrbit2Bounds) {
  std::ifstream source(CORBOT_SOURCE_DIR "/src/orb/orbit2/arm_bounded.c");
  const std::regex bounded("  arm->(\\w+) = \\w+;");
  int count = 0;
  for (std::string line; std::getline(source, line);) {
    std::smatch match;
    if (!std::regex_match(line, match, bounded)) continue;
    corbot_place_kind kind{};
    EXPECT_TRUE(corbot_place_needed(match.str(1).c_str(), &kind)) << line;
    ++count;
  }
  EXPECT_GE(count, 13);
}

TEST_F(Places, OfAHostFourCallsMayLastOfWhateverKinds) {
  EXPECT_GE(take(CORBOT_PLACE_TO_WAIT), 0);
  EXPECT_GE(take(CORBOT_PLACE_TO_WAIT), 0);
  const int start = take(CORBOT_PLACE_TO_START);
  const int change = take(CORBOT_PLACE_TO_CHANGE);
  const int fifth = take(CORBOT_PLACE_TO_CHANGE);
  EXPECT_TRUE(lasts(start));
  EXPECT_TRUE(lasts(change));
  EXPECT_FALSE(lasts(fifth));
  EXPECT_EQ(take(CORBOT_PLACE_TO_WAIT), -1);
  EXPECT_EQ(capacity_, CORBOT_HOST_PLACES);
  free(start);
  EXPECT_TRUE(lasts(fifth)) << "one is free again";
  EXPECT_EQ(take(CORBOT_PLACE_TO_WAIT), -1);
}

TEST_F(Places, ACallThatTakesAMomentTakesNoneFromThoseThatWait) {
  const int change = take(CORBOT_PLACE_TO_CHANGE);
  EXPECT_TRUE(corbot_place_may_stay(change));
  for (int i = 0; i < CORBOT_HOST_PLACES; ++i) EXPECT_GE(take(CORBOT_PLACE_TO_WAIT), 0);
  EXPECT_GE(take(CORBOT_PLACE_TO_START), 0);
  EXPECT_FALSE(lasts(change));
}

TEST_F(Places, OfAMomentOnlyThatCountsInWhichTheCallHasLooked) {
  for (int i = 0; i < CORBOT_HOST_PLACES; ++i) EXPECT_GE(take(CORBOT_PLACE_TO_WAIT), 0);
  const int change = take(CORBOT_PLACE_TO_CHANGE);
  std::this_thread::sleep_for(
      std::chrono::milliseconds(2 * CORBOT_BRIEF_MS));  // as a machine that stands still
  EXPECT_TRUE(corbot_place_may_stay(change));
  EXPECT_FALSE(lasts(change));
}

TEST_F(Places, AStopLastsAsLongAsItTakes) {
  for (int i = 0; i < CORBOT_HOST_PLACES; ++i) EXPECT_GE(take(CORBOT_PLACE_TO_WAIT), 0);
  EXPECT_TRUE(lasts(take(CORBOT_PLACE_TO_STOP)));
}

TEST_F(Places, OfOneHostAreNotThoseOfAnother) {
  const AcceptedPair other(listener_, AcceptedPair::From{"127.0.0.2"});
  for (int i = 0; i < CORBOT_HOST_PLACES; ++i) EXPECT_GE(take(CORBOT_PLACE_TO_WAIT), 0);
  EXPECT_EQ(take(CORBOT_PLACE_TO_WAIT), -1);
  EXPECT_GE(take(CORBOT_PLACE_TO_WAIT, other), 0);
  EXPECT_TRUE(lasts(take(CORBOT_PLACE_TO_CHANGE, other)));
}

}  // namespace
}  // namespace corbot::test
