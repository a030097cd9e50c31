// SPDX-License-Identifier: Apache-2.0
// The last position on disk: read back as written, accepted only if every byte is right, replaced at once.
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <system_error>

#include "config/load_profile.h"
#include "state/position_store.h"
#include "support/full_disk.h"
#include "support/paths.h"

namespace corbot {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Position : public ::testing::Test {
 protected:
  Position() : arm_(load_profile(fs::path(CORBOT_PROFILES) / "lynx5.toml").arm) {
    std::string path = CORBOT_SCRATCH_DIR "/position-XXXXXX";
    directory_ = ::mkdtemp(path.data());
  }
  ~Position() override { fs::remove_all(directory_); }

  [[nodiscard]] LastPosition sample(double base_q = 0.3) const {
    Snapshot snapshot{};
    snapshot.position_q = {base_q, 1.0, -0.25, 0.125};
    snapshot.gripper = 0.75;
    snapshot.position_fingerprint = position_fingerprint(arm_);
    return position_of(snapshot, "lynx5", "ssc32");
  }
  [[nodiscard]] PositionStore store() const { return {directory_, "lynx5", "ssc32", "test"}; }
  [[nodiscard]] std::string refusal(const std::string& text) const {
    try {
      (void)parse_position(text, "lynx5", "ssc32", arm_);
    } catch (const PositionError& error) {
      return error.what();
    }
    return "";
  }
  /// The sample's text, one part of it replaced.
  [[nodiscard]] std::string changed(const std::string& from, const std::string& to) const {
    std::string text = position_text(sample(), arm_);
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from << " in " << text;
    return text.replace(at, from.size(), to);
  }
  void put(const std::string& text) const { std::ofstream(store().file()) << text; }

  ArmModel arm_;
  fs::path directory_;
};

TEST_F(Position, IsReadAsWritten) {
  EXPECT_FALSE(store().load(arm_).has_value()) << "no file, no position";
  store().save(sample(), arm_);
  const auto read = store().load(arm_);
  ASSERT_TRUE(read);
  for (std::size_t i = 0; i < kMaxJoints; ++i)
    EXPECT_NEAR(read->position_q[i], sample().position_q[i], 1e-15);
  EXPECT_EQ(read->opening, 0.75);
  EXPECT_TRUE(read->at_rest);
  EXPECT_EQ(read->boot_id, boot_id());
  EXPECT_EQ(read->fingerprint, position_fingerprint(arm_));
  EXPECT_NEAR(static_cast<double>(read->saved_s), static_cast<double>(std::time(nullptr)), 60.0);
  EXPECT_EQ(fs::status(store().file()).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_EQ(std::distance(fs::directory_iterator(directory_), fs::directory_iterator()), 1);
}

TEST_F(Position, SaysWhetherTheArmIsHeld) {
  EXPECT_FALSE(parse_position(position_text(sample(), arm_), "lynx5", "ssc32", arm_).held);
  Snapshot snapshot{};
  snapshot.flags = kSnapshotHeld;
  snapshot.position_fingerprint = position_fingerprint(arm_);
  const std::string text = position_text(position_of(snapshot, "lynx5", "ssc32"), arm_);
  EXPECT_TRUE(parse_position(text, "lynx5", "ssc32", arm_).held);
  EXPECT_THAT(refusal(changed("held = false", "held = 0")), HasSubstr("held"));
  EXPECT_THAT(refusal(changed("held = false", "")), HasSubstr("held is missing"));
}

/// The person who requested the hold may still stand at the arm, however its profile was changed meanwhile.
TEST_F(Position, IsHeldWhereThePositionItselfIsRejected) {
  const auto held_in = [&](const std::string& text, const ArmModel& arm) {
    put(text);
    try {
      return store().load(arm)->held;
    } catch (const PositionError& error) {
      return error.held();
    }
  };
  Snapshot snapshot{};
  snapshot.flags = kSnapshotHeld;
  snapshot.position_fingerprint = position_fingerprint(arm_);
  const std::string held = position_text(position_of(snapshot, "lynx5", "ssc32"), arm_);
  const std::string free = position_text(sample(), arm_);
  ArmModel other = arm_;
  other.servos[2].zero_us += 1.0;
  EXPECT_TRUE(held_in(held, arm_));
  EXPECT_TRUE(held_in(held, other));
  EXPECT_FALSE(held_in(free, other));
  std::string another = held;
  another.replace(another.find("lynx5"), 5, "lynx6");
  EXPECT_FALSE(held_in(another, other)) << "another robot's";
}

TEST_F(Position, SaysWhetherTheArmIsInErrorAlsoWhereItIsRejected) {
  EXPECT_FALSE(parse_position(position_text(sample(), arm_), "lynx5", "ssc32", arm_).in_error);
  Snapshot snapshot{};
  snapshot.state = RtState::kError;
  snapshot.position_fingerprint = position_fingerprint(arm_);
  const std::string text = position_text(position_of(snapshot, "lynx5", "ssc32"), arm_);
  put(text);
  EXPECT_TRUE(store().load(arm_)->in_error);
  EXPECT_FALSE(store().load(arm_)->held);
  ArmModel other = arm_;
  other.servos[2].zero_us += 1.0;
  try {
    (void)store().load(other);
    ADD_FAILURE() << "of another profile";
  } catch (const PositionError& error) {
    EXPECT_TRUE(error.in_error());
    EXPECT_FALSE(error.held());
  }
  EXPECT_THAT(refusal(changed("in_error = false", "in_error = 0")), HasSubstr("in_error"));
  EXPECT_THAT(refusal(changed("in_error = false", "")), HasSubstr("in_error is missing"));
}

TEST_F(Position, OfTheSimulatorHasAFileOfItsOwn) {
  const PositionStore simulator(directory_, "lynx5", "loopback", "test");
  EXPECT_EQ(simulator.file(), directory_ / "lynx5.loopback.position");
  EXPECT_EQ(store().file(), directory_ / "lynx5.position");
  Snapshot snapshot{};
  snapshot.flags = kSnapshotHeld;
  snapshot.state = RtState::kError;
  snapshot.position_fingerprint = position_fingerprint(arm_);
  simulator.save(position_of(snapshot, "lynx5", "loopback"), arm_);
  EXPECT_FALSE(store().load(arm_)) << "neither position nor hold nor Error";
  store().save(sample(), arm_);
  EXPECT_TRUE(simulator.load(arm_)->held);
  EXPECT_FALSE(store().load(arm_)->held);
}

/// Two controllers are likely to have one arm: what holds it back stays.
TEST_F(Position, OfAnotherDeviceIsRejectedButItsHoldAndErrorStay) {
  for (const bool stays : {false, true}) {
    LastPosition position = sample();
    position.device = "maestro";
    position.held = position.in_error = stays;
    put(position_text(position, arm_));
    try {
      (void)store().load(arm_);
      ADD_FAILURE() << "accepted";
    } catch (const PositionError& error) {
      EXPECT_THAT(error.what(), HasSubstr("another device"));
      EXPECT_EQ(error.held(), stays);
      EXPECT_EQ(error.in_error(), stays);
    }
  }
  EXPECT_THAT(refusal(changed("device = ", "# ")), HasSubstr("device is missing"));
}

/// No record shows whether the arm was in Error.
TEST_F(Position, WhoseFileIsDamagedProvesNothing) {
  Snapshot snapshot{};
  snapshot.flags = kSnapshotHeld;
  snapshot.state = RtState::kError;
  snapshot.position_fingerprint = position_fingerprint(arm_);
  const std::string good = position_text(position_of(snapshot, "lynx5", "ssc32"), arm_);
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  };
  ArmModel other = arm_;
  other.servos[2].zero_us += 1.0;
  const auto expect_in_error = [&](const std::string& text) {
    put(text);
    for (const ArmModel* arm : {&arm_, &other}) {
      try {
        (void)store().load(*arm);
        ADD_FAILURE() << text;
      } catch (const PositionError& error) {
        EXPECT_TRUE(error.in_error()) << error.what();
        EXPECT_THAT(error.what(), HasSubstr("lynx5.position: "));
      }
    }
  };
  for (const std::size_t bytes : {std::size_t{0}, std::size_t{100}, good.size() / 2, good.find("in_error"),
                                  good.find("joints"), good.find("joints") + 16, good.find("gripper")})
    expect_in_error(good.substr(0, bytes));
  expect_in_error(std::string(300, '\0'));
  expect_in_error(good + "\xff\xfe\n");
  expect_in_error(with("robot = \"lynx5\"", "robot = \"other\""));
  expect_in_error(with("format = 3", "format = 4"));
  std::string ones = with("in_error = true", "in_error = 1");
  expect_in_error(ones.replace(ones.find("held = true"), 11, "held = 1"));
  expect_in_error(with("in_error = true", "in_error = \"true\""));
  expect_in_error(with("gripper = ", "gripper = \"\" # "));
  put(with("joints = [", "joints = [nan, 0, 0, 0] # "));
  try {
    (void)store().load(arm_);
    ADD_FAILURE();
  } catch (const PositionError& error) {
    EXPECT_TRUE(error.held() && error.in_error());
  }
  fs::remove(store().file());
  fs::create_directory(store().file());
  try {
    (void)store().load(arm_);
    ADD_FAILURE();
  } catch (const PositionError& error) {
    EXPECT_TRUE(error.in_error()) << "it is there";
  }
  fs::remove(store().file());
  EXPECT_FALSE(store().load(arm_)) << "a file that was deleted";
  EXPECT_FALSE(PositionStore("/dev/null/nowhere", "lynx5", "ssc32", "test").load(arm_))
      << "that was never there";
}

TEST_F(Position, OfAnotherFormatIsHeldAllTheSame) {
  LastPosition position = sample();
  position.held = true;
  std::string text = position_text(position, arm_);
  const std::size_t format = text.find("format = ");
  text.replace(format, text.find('\n', format) - format, "format = 2");
  try {
    (void)parse_position(text, "lynx5", "ssc32", arm_);
    FAIL() << "accepted";
  } catch (const PositionError& error) {
    EXPECT_TRUE(error.held() && error.in_error());
  }
}

TEST_F(Position, AtTheVeryEndsOfTheRangesIsAccepted) {
  LastPosition position = sample();
  for (std::size_t i = 0; i < arm_.dof; ++i) position.position_q[i] = arm_.joints[i].upper_q;
  const LastPosition read = parse_position(position_text(position, arm_), "lynx5", "ssc32", arm_);
  for (std::size_t i = 0; i < arm_.dof; ++i) EXPECT_LE(read.position_q[i], arm_.joints[i].upper_q);
}

TEST_F(Position, IsRefusedWhereAnythingIsWrong) {
  EXPECT_EQ(refusal(position_text(sample(), arm_)), "");
  EXPECT_THAT(refusal(changed("\"lynx5\"", "\"lynx6\"")), HasSubstr("another robot"));
  EXPECT_THAT(refusal(changed("format = 3", "format = 4")), HasSubstr("does not know the format"));
  EXPECT_THAT(refusal(changed("format = 3", "")), HasSubstr("format is missing"));
  EXPECT_THAT(refusal(changed("profile = \"", "profile = \"f")), HasSubstr("profile"));
  EXPECT_THAT(refusal(changed("profile = \"", "profile = \"x")), HasSubstr("hexadecimal"));
  EXPECT_THAT(refusal(changed("at_rest = true", "at_rest = 1")), HasSubstr("at_rest"));
  EXPECT_THAT(refusal(changed("gripper = 0.75", "gripper = 1.01")), HasSubstr("gripper"));
  EXPECT_THAT(refusal(changed("gripper = 0.75", "gripper = nan")), HasSubstr("finite"));
  EXPECT_THAT(refusal(changed("gripper = 0.75", "gripper = \"0.75\"")), HasSubstr("finite"));
  EXPECT_THAT(refusal(changed("joints = [", "joints = [0, ")), HasSubstr("4 numbers"));
  EXPECT_THAT(refusal(changed("joints = [", "joints = [inf] # ")), HasSubstr("4 numbers"));
  EXPECT_THAT(refusal(changed("joints = [", "joints = [nan, 0, 0, 0] # ")), HasSubstr("finite"));
  EXPECT_THAT(refusal(changed("joints = [", "joints = [90.001, 0, 0, 0] # ")),
              HasSubstr("outside the range of joint 0, -90 to 90"));
  EXPECT_THAT(refusal(changed("joints = [", "joints = [0, -30.001, 0, 0] # ")),
              HasSubstr("outside the range of joint 1, -30 to 130"));
  EXPECT_THAT(refusal(changed("boot = \"", "boot = \"" + std::string(100, 'x'))), HasSubstr("boot"));
  EXPECT_THAT(refusal(""), HasSubstr("robot is missing"));
  EXPECT_THAT(refusal("format = "), HasSubstr("line 1"));
  EXPECT_THAT(refusal(std::string(kMaxPositionBytes + 1, ' ')), HasSubstr("larger"));
  EXPECT_THAT(refusal(std::string("\0\xff\xfe", 3)), HasSubstr("line 1"));
  ArmModel other = arm_;
  other.servos[2].zero_us += 1.0;
  EXPECT_THROW((void)parse_position(position_text(sample(), arm_), "lynx5", "ssc32", other), PositionError);
}

TEST_F(Position, AFileThatOthersCouldHaveWrittenIsRefused) {
  store().save(sample(), arm_);
  fs::permissions(store().file(), fs::perms::others_write, fs::perm_options::add);
  EXPECT_THROW((void)store().load(arm_), PositionError);
  fs::remove(store().file());
  put(position_text(sample(), arm_));
  fs::rename(store().file(), directory_ / "elsewhere");
  fs::create_symlink(directory_ / "elsewhere", store().file());
  EXPECT_THROW((void)store().load(arm_), PositionError);
  fs::remove(store().file());
  ASSERT_EQ(::mkfifo(store().file().c_str(), 0600), 0);
  EXPECT_THROW((void)store().load(arm_), PositionError) << "and it does not hang";
  fs::remove(store().file());
  fs::create_directory(store().file());
  EXPECT_THROW((void)store().load(arm_), PositionError);
}

/// The arm is no longer where the old file says, and may be in Error.
TEST_F(Position, AWriteThatFailsLeavesAFileThatCountsAsInError) {
  const auto is_in_error = [&] {
    try {
      return store().load(arm_).has_value() && false;
    } catch (const PositionError& error) {
      return error.in_error();
    }
  };
  store().save(sample(0.1), arm_);
  const fs::path in_the_way = store().file().string() + ".test";
  fs::create_directory(in_the_way);
  EXPECT_THROW(store().save(sample(0.2), arm_), std::system_error);
  EXPECT_TRUE(is_in_error());
  fs::remove(store().file());
  EXPECT_THROW(store().save(sample(0.2), arm_), std::system_error);
  EXPECT_TRUE(is_in_error()) << "without an old file, too";
  fs::remove(in_the_way);
  store().save(sample(0.1), arm_);
  EXPECT_NEAR(store().load(arm_)->position_q[0], 0.1, 1e-12);

  {
    const test::FullDisk full(20);
    EXPECT_THROW(store().save(sample(0.2), arm_), std::system_error);
  }
  EXPECT_TRUE(is_in_error());
}

TEST_F(Position, IsNotWrittenWhereNoFileCanBe) {
  store().save(sample(0.1), arm_);
  EXPECT_THROW(PositionStore(store().file(), "lynx5", "ssc32", "test").save(sample(), arm_),
               std::system_error);
  EXPECT_THROW(PositionStore("/dev/null/x", "lynx5", "ssc32", "test").save(sample(), arm_),
               std::system_error);
  EXPECT_THROW(PositionStore(directory_, "../lynx5", "ssc32", "test"), std::invalid_argument);
  EXPECT_THROW(PositionStore(directory_, "", "ssc32", "test"), std::invalid_argument);
}

TEST_F(Position, AWriterThatIsKilledLeavesTheOldOrTheNewOne) {
  store().save(sample(0.1), arm_);
  std::mt19937 random(std::random_device{}());
  int others = 0;
  for (int round = 0; round < 100; ++round) {
    std::array<int, 2> written{};
    ASSERT_EQ(::pipe(written.data()), 0);
    const pid_t child = ::fork();
    if (child == 0) {
      for (int i = 0;; ++i) {
        store().save(sample(i % 2 == 0 ? 0.2 : 0.1), arm_);
        if (i == 0) (void)!::write(written[1], "w", 1);
      }
    }
    ::close(written[1]);
    char first{};
    EXPECT_EQ(::read(written[0], &first, 1), 1);
    ::close(written[0]);
    ::usleep(std::uniform_int_distribution<useconds_t>(0, 5000)(random));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    const auto read = store().load(arm_);
    ASSERT_TRUE(read);
    const double base = read->position_q[0];
    ASSERT_TRUE(std::abs(base - 0.1) < 1e-12 || std::abs(base - 0.2) < 1e-12) << base;
    if (std::abs(base - 0.2) < 1e-12) ++others;
  }
  EXPECT_GT(others, 0) << "each child was killed at a save of the old one";
}

TEST(StateDirectory, ComesFromTheEnvironment) {
  ::unsetenv("CORBOT_STATE_DIR");
  ::unsetenv("XDG_STATE_HOME");
  ::setenv("HOME", "/home/me", 1);
  EXPECT_EQ(default_state_directory(), "/home/me/.local/state/corbot");
  ::setenv("XDG_STATE_HOME", "/state", 1);
  EXPECT_EQ(default_state_directory(), "/state/corbot");
  ::setenv("XDG_STATE_HOME", "relative", 1);
  EXPECT_EQ(default_state_directory(), "/home/me/.local/state/corbot");
  ::setenv("CORBOT_STATE_DIR", "/var/lib/corbot", 1);
  EXPECT_EQ(default_state_directory().lexically_normal(), "/var/lib/corbot/");
  for (const char* name : {"CORBOT_STATE_DIR", "XDG_STATE_HOME", "HOME"}) ::unsetenv(name);
  EXPECT_TRUE(default_state_directory().empty());
}

}  // namespace
}  // namespace corbot
