// SPDX-License-Identifier: Apache-2.0
#include "robot/audit_log.h"
#include "robot/audit_file.h"
#include "support/full_disk.h"
#include "support/paths.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

namespace corbot::audit_log_test {
namespace {

namespace fs = std::filesystem;

class AuditLogTest : public ::testing::Test {
 protected:
  AuditLogTest() {
    std::string path = CORBOT_SCRATCH_DIR "/audit-XXXXXX";
    directory_ = ::mkdtemp(path.data());
  }
  ~AuditLogTest() override { fs::remove_all(directory_); }

  static std::vector<nlohmann::json> lines(const fs::path& file) {
    std::ifstream stream(file);
    std::vector<nlohmann::json> result;
    for (std::string line; std::getline(stream, line);) result.push_back(nlohmann::json::parse(line));
    return result;
  }

  fs::path directory_;
};

TEST_F(AuditLogTest, KeepsWhoFromWhereWhatTicketAndOutcome) {
  fs::path file;
  {
    AuditLog log(directory_ / "state", "lynx5", {});
    file = log.file();
    log.record({"cell", "giop:tcp:127.0.0.1:40000", "Drive(0, 20, 90)", 7, "ok"});
    log.record({"", "giop:tcp:10.0.0.7:40001", "Move(9, 0, 0, 0, 0)", 0, "Unreachable: \"far\"\n out"});
  }
  const auto entries = lines(file);
  ASSERT_EQ(entries.size(), 2u);
  EXPECT_EQ(entries[0]["who"], "cell");
  EXPECT_EQ(entries[0]["from"], "giop:tcp:127.0.0.1:40000");
  EXPECT_EQ(entries[0]["call"], "Drive(0, 20, 90)");
  EXPECT_EQ(entries[0]["ticket"], 7);
  EXPECT_EQ(entries[0]["outcome"], "ok");
  EXPECT_EQ(entries[0]["time"].get<std::string>().size(), std::string("2026-01-01T00:00:00.000Z").size());
  EXPECT_FALSE(entries[1].contains("ticket"));
  EXPECT_EQ(entries[1]["outcome"], "Unreachable: \"far\"\n out") << "one line, whatever the text";
}

TEST_F(AuditLogTest, AFloodOfRefusedCallsDoesNotRotateAwayWhatMovedTheArm) {
  fs::path file;
  {
    AuditLog log(directory_, "lynx5", {});
    file = log.file();
    log.record({"cell", "127.0.0.1:40000", "Drive(0, 20, 90)", 7, "ok"});
    for (int i = 0; i < 100'000; ++i)
      log.record({"", "10.0.0.7:40001", "Pause()", 0, "NotReady: held", true});
    for (int i = 0; i < 3; ++i) log.record({"cell", "", "the lease has run out", 0, "the arm was stopped"});
    log.record({"cell", "127.0.0.1:40000", "Stop()", 0, "ok"});
  }
  const auto entries = lines(file);
  EXPECT_EQ(entries.front()["ticket"], 7);
  EXPECT_EQ(entries.back()["call"], "Stop()");
  EXPECT_EQ(entries[entries.size() - 4]["call"], "the lease has run out") << "no refusal, so each is there";
  EXPECT_GT(entries.size(), 100u);
  EXPECT_LT(entries.size(), 1'000u);
}

TEST(RefusalBudget, IsABurstAndThenOneASecond) {
  using namespace std::chrono_literals;
  RefusalBudget budget;
  RefusalBudget::Clock::time_point now{1000s};
  for (int i = 0; i < RefusalBudget::kBurst; ++i) ASSERT_EQ(budget.take(now), 0u) << i;
  for (int i = 0; i < 5; ++i) EXPECT_EQ(budget.take(now), std::nullopt);
  now += 1s;
  EXPECT_EQ(budget.take(now), 5u) << "left out before it";
  EXPECT_EQ(budget.take(now), std::nullopt);
  now += 1h;
  EXPECT_EQ(budget.take(now), 1u);
  for (int i = 1; i < RefusalBudget::kBurst; ++i) ASSERT_EQ(budget.take(now), 0u) << i;
  EXPECT_EQ(budget.take(now), std::nullopt) << "no more than the burst, however long it was quiet";
}

TEST_F(AuditLogTest, KeepsHowAMotionEnded) {
  { AuditLog(directory_, "lynx5", {}).record_end(7, "failed: the robot went into Error"); }
  const auto entries = lines(directory_ / "lynx5.audit");
  ASSERT_EQ(entries.size(), 1u);
  EXPECT_EQ(entries[0]["ticket"], 7);
  EXPECT_EQ(entries[0]["end"], "failed: the robot went into Error");
}

/// A disk that is full: each call returns all the same, and there is one warning.
TEST_F(AuditLogTest, WarnsOnceWhenEntriesCannotBeWritten) {
  fs::create_symlink("/dev/full", directory_ / "lynx5.audit");
  std::vector<std::string> warnings;
  {
    AuditLog log(directory_, "lynx5", [&](const std::string& text) { warnings.push_back(text); });
    for (int i = 0; i < 100; ++i) log.record({"", "", "Stop()", 0, "ok"});
  }
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("lynx5.audit is incomplete"), std::string::npos) << warnings[0];
}

/// A disk stalls while more calls come than the log keeps: a pipe without a reader plays the disk.
TEST_F(AuditLogTest, WarnsOnceWhenEntriesWereDropped) {
  ASSERT_EQ(::mkfifo((directory_ / "lynx5.audit").c_str(), 0600), 0);
  const int pipe = ::open((directory_ / "lynx5.audit").c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  ASSERT_GE(pipe, 0);
  ASSERT_EQ(::fcntl(pipe, F_SETFL, 0), 0);
  constexpr std::size_t kInAPipe = 16'384;  // more lines than fit
  std::vector<std::string> warnings;
  std::thread reader;
  {
    AuditLog log(
        directory_, "lynx5", [&](const std::string& text) { warnings.push_back(text); }, SIZE_MAX / 2);
    for (std::size_t i = 0; i < AuditLog::kQueued + kInAPipe; ++i) log.record({"", "", "Stop()", 0, "ok"});
    reader = std::thread([pipe] {
      std::vector<char> buffer(65'536);
      while (::read(pipe, buffer.data(), buffer.size()) > 0) {
      }
    });
  }
  reader.join();
  ::close(pipe);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("lynx5.audit is incomplete: entries were dropped"), std::string::npos)
      << warnings[0];
}

TEST_F(AuditLogTest, IsClosedToOthers) {
  const AuditLog log(directory_ / "state", "lynx5", {});
  struct stat status {};
  ASSERT_EQ(::stat(log.file().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777u, 0600u);
  ASSERT_EQ(::stat(log.file().parent_path().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777u, 0700u);
}

TEST_F(AuditLogTest, ContinuesAfterARestart) {
  for (int i = 0; i < 3; ++i) AuditLog(directory_, "lynx5", {}).record({"", "", "Stop()", 0, "ok"});
  EXPECT_EQ(lines(directory_ / "lynx5.audit").size(), 3u);
}

TEST_F(AuditLogTest, Rotates) {
  constexpr std::size_t kLargest = 2000;
  {
    AuditLog log(directory_, "lynx5", {}, kLargest);
    for (int i = 0; i < 1000; ++i) log.record({"", "", "Stop()", static_cast<std::uint64_t>(i + 1), "ok"});
  }
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(directory_)) {
    ++files;
    EXPECT_LE(entry.file_size(), kLargest);
    struct stat status {};
    ASSERT_EQ(::stat(entry.path().c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777u, 0600u);
  }
  EXPECT_EQ(files, AuditLog::kFiles);
  EXPECT_EQ(lines(directory_ / "lynx5.audit").back()["ticket"], 1000);
}

/// The oldest file cannot be replaced, so none can be renamed: the newest grows, and nothing is lost.
TEST_F(AuditLogTest, KeepsEveryEntryWhereItCannotRotate) {
  constexpr std::size_t kLargest = 2000;
  constexpr std::uint64_t kEntries = 100;
  for (std::size_t i = 1; i + 1 < AuditLog::kFiles; ++i)
    std::ofstream(directory_ / ("lynx5." + std::to_string(i) + ".audit")) << "{}\n";
  fs::create_directories(directory_ / ("lynx5." + std::to_string(AuditLog::kFiles - 1) + ".audit") / "full");
  std::vector<std::string> warnings;
  {
    AuditLog log(
        directory_, "lynx5", [&](const std::string& text) { warnings.push_back(text); }, kLargest);
    for (std::uint64_t i = 1; i <= kEntries; ++i) log.record({"", "", "Stop()", i, "ok"});
  }
  const auto entries = lines(directory_ / "lynx5.audit");
  ASSERT_EQ(entries.size(), kEntries);
  for (std::uint64_t i = 1; i <= kEntries; ++i) EXPECT_EQ(entries[i - 1]["ticket"], i);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("lynx5.audit cannot be rotated and grows: "), std::string::npos) << warnings[0];
}

/// A line is torn if the machine lost its power, or if the servant was killed, while it was written.
TEST_F(AuditLogTest, MarksALineThatIsTorn) {
  { AuditLog(directory_, "lynx5", {}).record({"", "", "Stop()", 1, "ok"}); }
  std::ofstream(directory_ / "lynx5.audit", std::ios::app) << R"({"time":"2026-11-22T09:00)";
  { AuditLog(directory_, "lynx5", {}).record({"", "", "Stop()", 2, "ok"}); }
  std::ifstream stream(directory_ / "lynx5.audit");
  std::vector<std::string> read;
  for (std::string line; std::getline(stream, line);) read.push_back(line);
  ASSERT_EQ(read.size(), 4u);
  EXPECT_EQ(nlohmann::json::parse(read[0])["ticket"], 1);
  EXPECT_EQ(nlohmann::json::parse(read[2])["note"], "the line before is incomplete");
  EXPECT_EQ(nlohmann::json::parse(read[3])["ticket"], 2);
}

/// The log takes back the part of an entry that a full disk has accepted. The next entry is a line of its
/// own.
TEST_F(AuditLogTest, LeavesNoTornLineOnAFullDisk) {
  const fs::path file = directory_ / "lynx5.audit";
  std::atomic<int> warnings{0};
  {
    AuditLog log(directory_, "lynx5", [&](const std::string&) { ++warnings; });
    const auto wait_for = [](auto&& condition) {
      for (int looks = 0; looks < 30'000 && !condition(); ++looks) ::usleep(1000);
      return condition();
    };
    log.record({"", "", "Stop()", 1, "ok"});
    ASSERT_TRUE(wait_for([&] { return fs::file_size(file) > 20; }));
    {
      const test::FullDisk full(fs::file_size(file) + 20);
      log.record({"", "", "Stop()", 2, "ok"});
      EXPECT_TRUE(wait_for([&] { return warnings > 0; }));
    }
    log.record({"", "", "Stop()", 3, "ok"});
  }
  const auto entries = lines(file);
  ASSERT_EQ(entries.size(), 2u);
  EXPECT_EQ(entries[0]["ticket"], 1);
  EXPECT_EQ(entries[1]["ticket"], 3);
}

TEST_F(AuditLogTest, ARotationThatFailsAgainAndAgainCostsTheOldestFileOnly) {
  const fs::path file = directory_ / "a.audit";
  constexpr std::size_t kFiles = 4;
  int reports = 0;
  AuditFile log(file, 20, kFiles, [&](const std::string&) { ++reports; });
  for (const char* line : {"the first one", "the second one", "the third one", "the fourth one"})
    log.append(line);
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  rlimit none = before;
  none.rlim_cur = 3;
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &none), 0);
  for (int i = 0; i < 10; ++i) log.append("one of those after");
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &before), 0);
  EXPECT_EQ(reports, 10);
  std::string all;
  for (const char* name : {"a.audit", "a.1.audit", "a.2.audit", "a.3.audit"}) {
    std::ifstream in(directory_ / name);
    all.append(std::istreambuf_iterator<char>(in), {});
  }
  for (const char* line : {"the second one", "the third one", "the fourth one", "one of those after"})
    EXPECT_NE(all.find(line), std::string::npos) << line;
}

TEST_F(AuditLogTest, SaysWhyItCannotBeWritten) {
  std::ofstream(directory_ / "taken") << "a file";
  try {
    const AuditLog log(directory_ / "taken", "lynx5", {});
    FAIL() << "a file is no directory";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("taken/lynx5.audit cannot be written"), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace corbot::audit_log_test
