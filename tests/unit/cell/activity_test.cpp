// SPDX-License-Identifier: Apache-2.0
#include "cell/activity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace corbot::cell {
namespace {

const ActivityChange kHolds{1700000000.25, "robot1", Activity::kWaitingForZone, 7, ""};
const ActivityChange kEnters{1700000001.5, "robot1", Activity::kMoving, 7, "store1"};

TEST(Activity, ALineHasAllOfAChange) {
  EXPECT_EQ(to_line(kEnters),
            R"({"time":1700000001.5,"robot":"robot1","activity":"move","piece":7,"zone":"store1"})");
  for (const Activity activity : {Activity::kIdle, Activity::kMoving, Activity::kWaitingForZone,
                                  Activity::kLooking, Activity::kWaitingForPiece}) {
    ActivityChange change = kEnters;
    change.activity = activity;
    EXPECT_EQ(parse_activity(to_line(change)), change);
  }
}

TEST(Activity, ACutOrForeignLineIsNone) {
  const std::string line = to_line(kEnters);
  for (std::size_t size = 0; size < line.size(); ++size)
    EXPECT_FALSE(parse_activity(line.substr(0, size))) << size;
  EXPECT_FALSE(parse_activity("[1, 2]"));
  EXPECT_FALSE(parse_activity(R"({"time":1,"robot":"r","activity":"dance","piece":7,"zone":""})"));
  EXPECT_FALSE(parse_activity(R"({"time":"1","robot":"r","activity":"move","piece":7,"zone":""})"));
}

TEST(Activity, ARecordIsReadBackByTimeWithoutWhatIsNoLine) {
  const std::string file = testing::TempDir() + "corbot_activity.jsonl";
  std::filesystem::remove(file);
  EXPECT_THAT(read_activity(file), testing::IsEmpty());
  ActivityRecord record(file);
  record.add(kEnters);
  std::ofstream(file, std::ios::app) << "{\"time\":17000\n";
  record.add(kHolds);
  EXPECT_THAT(read_activity(file), testing::ElementsAre(kHolds, kEnters));
  std::filesystem::remove(file);
}

TEST(Activity, AFileThatTakesNothingIsNoError) {
  ActivityRecord record("/nonexistent/activity.jsonl");
  EXPECT_NO_THROW(record.add(kHolds));
}

}  // namespace
}  // namespace corbot::cell
