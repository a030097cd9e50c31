// SPDX-License-Identifier: Apache-2.0
// All programs of a cell share these: the state directory, the options, and a standard error that is full.
#include "cell/program.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <fstream>

#include "client/failure.h"
#include "support/paths.h"
#include "support/process.h"

namespace corbot::cell {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class ProgramTest : public testing::Test {
 protected:
  ProgramTest() {
    std::string path = (fs::temp_directory_path() / "corbot-program-XXXXXX").string();
    if (::mkdtemp(path.data()) == nullptr) throw std::runtime_error(path);
    directory_ = path;
  }
  ~ProgramTest() override { fs::remove_all(directory_); }
  static ::mode_t mode(const fs::path& path) {
    struct stat found {};
    EXPECT_EQ(::stat(path.c_str(), &found), 0) << path;
    return found.st_mode & 07777;
  }
  /// Why it is refused; empty where it is not.
  static std::string refusal(const fs::path& directory) {
    try {
      make_private_directory(directory);
      return "";
    } catch (const client::Failure& failure) {
      return failure.what();
    }
  }
  fs::path directory_;
};

TEST_F(ProgramTest, AStateDirectoryIsMadeForThisUserAlone) {
  EXPECT_EQ(refusal(directory_ / "a" / "b"), "");
  EXPECT_EQ(mode(directory_ / "a" / "b"), 0700U);
  EXPECT_EQ(refusal(directory_ / "a" / "b"), "") << "it is there";
  EXPECT_EQ(refusal(directory_ / "c/"), "");
  EXPECT_EQ(mode(directory_ / "c"), 0700U);
}

TEST_F(ProgramTest, AStateDirectoryThatOthersReachIsRefused) {
  for (const ::mode_t open : {0755U, 0710U, 0702U}) {
    const fs::path directory = directory_ / std::to_string(open);
    fs::create_directory(directory);
    ASSERT_EQ(::chmod(directory.c_str(), open), 0);
    EXPECT_THAT(refusal(directory), HasSubstr("chmod 700 " + directory.string()));
    ASSERT_EQ(::chmod(directory.c_str(), 0700), 0);
    EXPECT_EQ(refusal(directory), "");
  }
}

TEST_F(ProgramTest, AStateDirectoryOfAnotherUserOrNoDirectoryIsRefused) {
  std::ofstream(directory_ / "file") << "x";
  EXPECT_THAT(refusal(directory_ / "file"), HasSubstr("is no directory"));
  std::string foreign = "/usr";
  if (::geteuid() == 0) {
    foreign = directory_ / "foreign";
    fs::create_directory(foreign);
    ASSERT_EQ(::chown(foreign.c_str(), 65534, 65534), 0);
  }
  EXPECT_THAT(refusal(foreign), HasSubstr("belongs to another user"));
}

TEST_F(ProgramTest, ASeedBeyondItsRangeIsRefused) {
  for (const char* seed : {"-1", "4294967296"}) {
    CLI::App app;
    CellOptions options;
    options.add_to(app);
    EXPECT_THROW(app.parse(std::string("cell.toml --seed=") + seed), CLI::ParseError) << seed;
  }
  CLI::App app;
  CellOptions options;
  options.add_to(app);
  app.parse("cell.toml --seed 4294967295");
  EXPECT_EQ(options.overrides.seed, 4294967295U);
}

TEST_F(ProgramTest, AFullStandardErrorDoesNotAbortIt) {
  test::Process program({"/bin/sh", "-c", "exec \"$0\" no.toml 2>/dev/full", CORBOT_BIN_DIR "/corbot-store"});
  const auto status = program.wait(test::within(30));
  ASSERT_TRUE(status);
  EXPECT_TRUE(WIFEXITED(*status));
  EXPECT_EQ(WEXITSTATUS(*status), 2);
}

}  // namespace
}  // namespace corbot::cell
