// SPDX-License-Identifier: Apache-2.0
#include "motion/motion_results.h"

#include <gmock/gmock.h>

#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <stdexcept>

#include "support/paths.h"

namespace corbot::test {
namespace {

class ResultsInAFile : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string path = CORBOT_SCRATCH_DIR "/motions-XXXXXX";
    const int file = ::mkstemp(path.data());
    ASSERT_GE(file, 0);
    (void)::close(file);
    file_ = path;
  }
  void TearDown() override { std::filesystem::remove(file_); }

  std::filesystem::path file_;
};

TEST_F(ResultsInAFile, AddUp) {
  (void)add_to_file(file_, 1, {{{"arcs", 2}, {"breaches", 0}}, {{"joint_jerk", 0.5}, {"tool_jerk", 1.0}}});
  const MotionResults sum =
      add_to_file(file_, 2, {{{"arcs", 3}, {"lines", 4}}, {{"joint_jerk", 0.75}, {"tool_jerk", 0.25}}});
  EXPECT_EQ(to_string(sum), "arcs 5, breaches 0, lines 4; worst: joint_jerk 0.75, tool_jerk 1");
}

TEST_F(ResultsInAFile, AreRefusedWhereALineIsNone) {
  std::ofstream(file_) << "{\"seed\": 1}\n";
  try {
    (void)add_to_file(file_, 2, {});
    ADD_FAILURE() << "line 1 has no counts";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr(file_.string() + ":1 is no result"));
  }
  EXPECT_THROW((void)add_to_file("/proc/none", 2, {}), std::runtime_error);
}

}  // namespace
}  // namespace corbot::test
