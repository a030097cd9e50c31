// SPDX-License-Identifier: Apache-2.0
// Numbers of a profile are changed where they stand; every other byte stays.
#include "config/profile_edit.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>
#include <vector>

#include "config/load_profile.h"
#include "support/paths.h"

namespace corbot::profile_edit_test {
namespace {

namespace fs = std::filesystem;

std::string text_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

std::vector<fs::path> shipped() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(CORBOT_PROFILES)) {
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  }
  return files;
}

std::string edited(const std::string& text, const std::vector<NumberEdit>& edits) {
  return edit_numbers(text, edits);
}

TEST(ProfileEdit, ChangesTheNumberAndNothingElse) {
  const std::string text =
      "# zero_us = 1\n[[joint]]\nservo = { zero_us=1500 , direction = -1 }  # zero_us = 2\n"
      "[[joint]]\nrange_deg = [ -90,\n  +9_0.5e0 ]  # two lines\n[joint.servo]\nzero_us = 0x10\n";
  EXPECT_EQ(edited(text, {{"joint[0].servo.zero_us", 1487.25}, {"joint[1].servo.zero_us", 1500}}),
            "# zero_us = 1\n[[joint]]\nservo = { zero_us=1487.25 , direction = -1 }  # zero_us = 2\n"
            "[[joint]]\nrange_deg = [ -90,\n  +9_0.5e0 ]  # two lines\n[joint.servo]\nzero_us = 1500\n");
  EXPECT_EQ(edited(text, {{"joint[1].range_deg[0]", -12.5},
                          {"joint[1].range_deg[1]", 100},
                          {"joint[0].servo.direction", 1}}),
            "# zero_us = 1\n[[joint]]\nservo = { zero_us=1500 , direction = 1 }  # zero_us = 2\n"
            "[[joint]]\nrange_deg = [ -12.5,\n  100 ]  # two lines\n[joint.servo]\nzero_us = 0x10\n");
}

TEST(ProfileEdit, KeepsLineEndsAndLettersOfOtherAlphabets) {
  const std::string text =
      "\xef\xbb\xbf# \xc3\xa4\r\n\"\xe2\x82\xac\xf0\x9f\xa4\x96\" = 'x'\r\na = { \"\xc3\xa4\" = 1, b = 2 "
      "}\r\n";
  EXPECT_EQ(edited(text, {{"a.b", 3}}),
            "\xef\xbb\xbf# \xc3\xa4\r\n\"\xe2\x82\xac\xf0\x9f\xa4\x96\" = 'x'\r\na = { \"\xc3\xa4\" = 1, b = "
            "3 }\r\n");
}

TEST(ProfileEdit, SaysWhatIsNotThere) {
  EXPECT_THROW((void)edited("a = 1\n", {{"b", 1}}), std::runtime_error);
  EXPECT_THROW((void)edited("a = \"1\"\n", {{"a", 1}}), std::runtime_error);
  EXPECT_THROW((void)edited("a = [1]\n", {{"a[1]", 1}}), std::runtime_error);
  EXPECT_THROW((void)edited("a = \n", {{"a", 1}}), std::runtime_error);
}

TEST(ProfileEdit, EveryShippedProfileIsTheSameAfterThereAndBack) {
  std::size_t edited_files = 0;
  for (const fs::path& file : shipped()) {
    const std::string text = text_of(file);
    const Profile before = parse_profile(text, "before");
    if (!before.gripper_has_servo) continue;  // an arm without servos has nothing to calibrate
    ++edited_files;
    std::vector<NumberEdit> there;
    std::vector<NumberEdit> back;
    for (std::size_t i = 0; i < before.arm.dof; ++i) {
      const ServoMap& map = before.arm.servos[i];
      const std::string path = "joint[" + std::to_string(i) + "].servo.zero_us";
      there.push_back({path, map.zero_us + (map.zero_us > 1500.0 ? -0.25 : 0.25)});
      back.push_back({path, map.zero_us});
    }
    there.push_back({"gripper.open_us", before.arm.gripper.open_us + 1.5});
    back.push_back({"gripper.open_us", before.arm.gripper.open_us});
    const std::string changed = edited(text, there);
    EXPECT_EQ(edited(changed, back), text) << file;
    EXPECT_EQ(std::count(changed.begin(), changed.end(), '#'), std::count(text.begin(), text.end(), '#'));
    const std::string diff = changed_lines(text, changed);
    EXPECT_EQ(std::count(diff.begin(), diff.end(), '@'), 2 * static_cast<std::ptrdiff_t>(there.size()))
        << diff;
  }
  EXPECT_EQ(edited_files, 3u);
}

TEST(ChangedLines, NamesThem) {
  EXPECT_EQ(changed_lines("a\nb\nc\n", "a\nb\nc\n"), "");
  EXPECT_EQ(changed_lines("a\nb\nc\n", "a\nB\nc\n"), "@@ line 2\n-b\n+B\n");
}

TEST(ReplaceFile, KeepsTheOldOneAndItsPermissions) {
  std::string directory = ::testing::TempDir() + "corbot-edit-XXXXXX";
  ASSERT_NE(::mkdtemp(directory.data()), nullptr);
  const std::string file = directory + "/arm.toml";
  std::ofstream(file) << "old";
  ::chmod(file.c_str(), 0640);
  replace_file(file, "old", "new");
  EXPECT_EQ(text_of(file), "new");
  EXPECT_EQ(text_of(file + ".bak"), "old");
  struct stat status {};
  ASSERT_EQ(::stat(file.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0640u);
  EXPECT_FALSE(fs::exists(file + ".new"));
  fs::create_directory(file + ".new");
  EXPECT_THROW(replace_file(file, "new", "newer"), std::system_error);
  EXPECT_EQ(text_of(file), "new");
  fs::remove_all(directory);
}

}  // namespace
}  // namespace corbot::profile_edit_test
