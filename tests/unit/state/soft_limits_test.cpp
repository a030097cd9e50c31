// SPDX-License-Identifier: Apache-2.0
// Soft limits on disk: read back as written, accepted only if every byte is right.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <system_error>

#include "config/load_profile.h"
#include "corbot/units.h"
#include "state/soft_limits_store.h"
#include "support/paths.h"

namespace corbot {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class SoftLimitsFile : public ::testing::Test {
 protected:
  SoftLimitsFile() : arm_(load_profile(fs::path(CORBOT_PROFILES) / "lynx5.toml").arm) {
    std::string path = CORBOT_SCRATCH_DIR "/limits-XXXXXX";
    directory_ = ::mkdtemp(path.data());
    for (std::size_t i = 0; i < arm_.dof; ++i) {
      sample_.lower_q[i] = arm_.joints[i].lower_q + to_radians(1.1 + static_cast<double>(i));
      sample_.upper_q[i] = arm_.joints[i].upper_q - to_radians(10.7);
    }
    sample_.upper_q[3] = arm_.joints[3].upper_q;
  }
  ~SoftLimitsFile() override { fs::remove_all(directory_); }

  [[nodiscard]] SoftLimitsStore store() const { return {directory_, "lynx5", "ssc32"}; }
  [[nodiscard]] fs::path file() const { return directory_ / "lynx5.limits"; }
  [[nodiscard]] std::string text() const { return SoftLimitsText::write(sample_, {"lynx5", "ssc32"}, arm_); }
  [[nodiscard]] std::string refusal(const std::string& text) const {
    try {
      (void)SoftLimitsText::read(text, {"lynx5", "ssc32"}, arm_);
    } catch (const SettingError& error) {
      return error.what();
    }
    return "";
  }
  [[nodiscard]] std::string changed(const std::string& from, const std::string& to) const {
    std::string all = text();
    const std::size_t at = all.find(from);
    EXPECT_NE(at, std::string::npos) << from << " in " << all;
    return all.replace(at, from.size(), to);
  }
  void expect_sample(const JointRanges& read) const {
    for (std::size_t i = 0; i < kMaxJoints; ++i) {
      EXPECT_NEAR(read.lower_q[i], sample_.lower_q[i], 1e-12);
      EXPECT_NEAR(read.upper_q[i], sample_.upper_q[i], 1e-12);
    }
  }

  ArmModel arm_;
  fs::path directory_;
  JointRanges sample_{};
};

TEST_F(SoftLimitsFile, AreReadAsWrittenUntilTheyAreRemoved) {
  EXPECT_FALSE(store().load(arm_).has_value()) << "no file, no limits";
  store().save(std::nullopt, arm_);
  store().save(sample_, arm_);
  const auto read = store().load(arm_);
  ASSERT_TRUE(read);
  expect_sample(*read);
  store().save(std::nullopt, arm_);
  EXPECT_FALSE(store().load(arm_).has_value());
  EXPECT_FALSE(fs::exists(file()));
}

TEST_F(SoftLimitsFile, OfAnotherRobotOrProfileAreRejected) {
  EXPECT_THAT(refusal(changed("robot = \"lynx5\"", "robot = \"lynx6\"")), HasSubstr("another robot"));
  ArmModel other = arm_;
  other.joints[0].upper_q -= 0.1;
  EXPECT_THAT(refusal(SoftLimitsText::write(sample_, {"lynx5", "ssc32"}, other)),
              HasSubstr("profile has changed"));
  EXPECT_THAT(refusal(changed("format = 3", "format = 2")), HasSubstr("format"));
}

TEST_F(SoftLimitsFile, OfAnotherDeviceAreNotTaken) {
  const SoftLimitsStore simulator(directory_, "lynx5", "loopback");
  simulator.save(sample_, arm_);
  EXPECT_FALSE(store().load(arm_)) << "the simulator's";
  store().save(sample_, arm_);
  simulator.save(std::nullopt, arm_);
  EXPECT_TRUE(store().load(arm_));
  EXPECT_THROW((void)SoftLimitsStore(directory_, "lynx5", "maestro").load(arm_), SettingError);
}

TEST_F(SoftLimitsFile, ThatNoServantWritesAreRejected) {
  const std::string lower = text().substr(text().find("lower"), text().find("upper") - text().find("lower"));
  for (const char* const wrong :
       {"lower = [nan, -28, -27, -45]\n", "lower = [-inf, -28, -27, -45]\n", "lower = [-91, -28, -27, -45]\n",
        "lower = [85, -28, -27, -45]\n", "lower = [-80, -28, -27]\n", "lower = [-80, -28, -27, -45, 0]\n",
        "lower = [\"a\", -28, -27, -45]\n", "lower = 3\n", ""})
    EXPECT_NE(refusal(changed(lower, wrong)), "") << wrong;
  EXPECT_NE(refusal(std::string(SoftLimitsText::kMostBytes + 1, ' ')), "");
  EXPECT_NE(refusal(""), "");
  EXPECT_EQ(refusal(text()), "");
}

TEST_F(SoftLimitsFile, CutShortAnywhereAreRejected) {
  const std::string whole = text();
  const std::size_t enough = whole.find("whole = true") + std::string("whole = true").size();
  for (std::size_t length = 0; length < enough; ++length)
    EXPECT_NE(refusal(whole.substr(0, length)), "") << length << " bytes of " << whole.size();
}

TEST_F(SoftLimitsFile, WithAnyByteChangedAreRejectedOrWithinTheProfile) {
  const auto seed = std::random_device{}();
  RecordProperty("seed", static_cast<int>(seed));
  std::mt19937 random(seed);
  const std::string whole = text();
  for (int i = 0; i < 20'000; ++i) {
    std::string damaged = whole;
    damaged[random() % damaged.size()] = static_cast<char>(random());
    JointRanges read;
    try {
      read = SoftLimitsText::read(damaged, {"lynx5", "ssc32"}, arm_);
    } catch (const SettingError&) {
      continue;
    }
    for (std::size_t j = 0; j < arm_.dof; ++j) {
      ASSERT_GE(read.lower_q[j], arm_.joints[j].lower_q) << damaged;
      ASSERT_LE(read.upper_q[j], arm_.joints[j].upper_q) << damaged;
      ASSERT_LE(read.lower_q[j], read.upper_q[j]) << damaged;
    }
  }
}

TEST_F(SoftLimitsFile, ThatOthersMayWriteOrThatIsNoFileIsRejected) {
  store().save(sample_, arm_);
  ASSERT_EQ(::chmod(file().c_str(), 0666), 0);
  EXPECT_THROW((void)store().load(arm_), SettingError);
  fs::remove(file());
  fs::create_directory(file());
  EXPECT_THROW((void)store().load(arm_), SettingError);
  EXPECT_THROW(store().save(sample_, arm_), std::system_error);
  EXPECT_THROW(SoftLimitsStore(directory_, "../lynx5", "ssc32"), std::invalid_argument);
}

}  // namespace
}  // namespace corbot
