// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "segment_fixture.h"

namespace corbot {
namespace {

using Kind = SegmentError::Kind;
using testing::AllOf;
using testing::HasSubstr;

/// What each of the three ways in says about the same file.
class SegmentErrors : public SegmentTest {
 protected:
  void expect_all(Kind kind, const std::string& text) {
    expect([&] { (void)task(); }, kind, text, "task");
    expect([&] { (void)servant(); }, kind, text, "servant");
    expect([&] { (void)Segment::observe(name()); }, kind, text, "observer");
  }
  void expect(const std::function<void()>& action, Kind kind, const std::string& text, const char* who) {
    const auto error = error_of(action);
    ASSERT_TRUE(error) << who << " was let in";
    EXPECT_EQ(static_cast<int>(error->kind()), static_cast<int>(kind)) << who << ": " << error->what();
    EXPECT_THAT(error->what(), AllOf(HasSubstr(path()), HasSubstr(text))) << who;
  }
  /// Leaves a valid segment behind, then lets `change` spoil its bytes.
  void spoil(const std::function<void(SegmentLayout&)>& change) {
    Segment rt = task();
    change(rt.layout());
  }
  void write_file(std::size_t size, char fill) {
    const int fd = ::shm_open(("/corbot." + name()).c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    ASSERT_GE(fd, 0);
    const std::string bytes(size, fill);
    ASSERT_EQ(::write(fd, bytes.data(), size), static_cast<ssize_t>(size));
    ::close(fd);
  }
};

TEST_F(SegmentErrors, Absent) {
  expect([&] { (void)servant(); }, Kind::kAbsent, "corbot up", "servant");
  expect([&] { (void)Segment::observe(name()); }, Kind::kAbsent, "corbot up", "observer");
}

TEST_F(SegmentErrors, ForeignByItsFirstBytes) {
  write_file(100, 'x');
  expect_all(Kind::kForeign, "another program");
  write_file(sizeof(SegmentLayout), 'x');
  expect_all(Kind::kForeign, "another program");
  write_file(100, '\0');  // zero magic, but not a size that any creator leaves
  expect_all(Kind::kForeign, "another program");
  EXPECT_EQ(std::filesystem::file_size(path()), 100u) << "what is foreign is left as it was";
}

TEST_F(SegmentErrors, ForeignByTheRobotsName) {
  spoil([](SegmentLayout& layout) { layout.header.name[0] = '#'; });
  expect_all(Kind::kForeign, "another name");
}

TEST_F(SegmentErrors, NameWithoutItsEnd) {
  spoil([](SegmentLayout& layout) { std::memset(layout.header.name, 'a', sizeof(layout.header.name)); });
  expect_all(Kind::kForeign, "another name");
}

TEST_F(SegmentErrors, Truncated) {
  { const Segment rt = task(); }
  for (const std::uintmax_t size :
       {sizeof(SegmentLayout) - 1, sizeof(SegmentHeader), std::size_t{9}, std::size_t{3}}) {
    std::filesystem::resize_file(path(), size);
    expect_all(Kind::kTruncated, "truncated");
  }
}

TEST_F(SegmentErrors, WrongVersion) {
  spoil([](SegmentLayout& layout) { layout.header.abi = kSegmentAbi + 1; });
  expect_all(Kind::kWrongVersion, "version " + std::to_string(kSegmentAbi + 1) +
                                      ", this program speaks version " + std::to_string(kSegmentAbi));
}

TEST_F(SegmentErrors, WrongSizeInTheHeader) {
  spoil([](SegmentLayout& layout) { layout.header.total_size += 8; });
  expect_all(Kind::kWrongSize, "not built from the same source");
}

TEST_F(SegmentErrors, FileLongerThanTheLayout) {
  { const Segment rt = task(); }
  std::filesystem::resize_file(path(), sizeof(SegmentLayout) + 1);
  expect_all(Kind::kWrongSize, "expected");
}

TEST_F(SegmentErrors, WrongFingerprint) {
  spoil([](SegmentLayout& layout) { layout.header.fingerprint ^= 1; });
  expect([&] { (void)task(); }, Kind::kWrongFingerprint, "same profile", "task");
  expect([&] { (void)servant(); }, Kind::kWrongFingerprint, "same profile", "servant");
  EXPECT_FALSE(error_of([&] { (void)Segment::observe(name()); }))
      << "an observer has no model to compare with";
}

TEST_F(SegmentErrors, InUseNamesThePid) {
  Child rt([&] { new Segment(task()); });
  Child user([&] { new Segment(servant()); });
  ASSERT_TRUE(rt.ready());
  ASSERT_TRUE(user.ready());
  expect([&] { (void)task(); }, Kind::kInUse, "real-time task, pid " + std::to_string(rt.pid()) + ";",
         "task");
  expect([&] { (void)servant(); }, Kind::kInUse, "servant, pid " + std::to_string(user.pid()) + ";",
         "servant");
}

TEST_F(SegmentErrors, WrongMode) {
  { const Segment rt = task(); }
  for (const mode_t mode : {0640u, 0606u, 0660u, 0700u, 0400u}) {
    ASSERT_EQ(::chmod(path().c_str(), mode), 0);
    const auto error = error_of([&] { (void)servant(); });
    ASSERT_TRUE(error) << mode;
    EXPECT_EQ(error->kind(), Kind::kPermission) << error->what();
    EXPECT_THAT(error->what(), HasSubstr(path()));
  }
  ASSERT_EQ(::chmod(path().c_str(), 0644), 0);
  expect_all(Kind::kPermission, "mode 00644; must be a file of uid");
}

TEST_F(SegmentErrors, WrongOwner) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can give a file away";
  { const Segment rt = task(); }
  ASSERT_EQ(::chown(path().c_str(), 12345, static_cast<gid_t>(-1)), 0);
  expect_all(Kind::kPermission, "owned by uid 12345");
}

TEST_F(SegmentErrors, SymbolicLink) {
  ASSERT_EQ(::symlink("/etc/passwd", path().c_str()), 0);
  expect_all(Kind::kPermission, "");
}

TEST_F(SegmentErrors, BadNames) {
  const std::string kBad[] = {
      "", "..", "a/b", "a b", "a.b", "é", std::string(49, 'a'), std::string("a\0b", 3), "a\n"};
  for (const std::string& bad : kBad) {
    for (const auto& action : {std::function<void()>([&] { (void)Segment::create_or_adopt(bad, 1); }),
                               std::function<void()>([&] { (void)Segment::attach(bad, 1); }),
                               std::function<void()>([&] { (void)Segment::observe(bad); })}) {
      const auto error = error_of(action);
      ASSERT_TRUE(error) << bad;
      EXPECT_EQ(error->kind(), Kind::kBadName) << error->what();
      EXPECT_THAT(error->what(), HasSubstr("letters, digits"));
    }
  }
}

TEST_F(SegmentErrors, TheLongestNameWorks) {
  std::string longest = name() + "_";
  longest.resize(kMaxSegmentName, 'Z');
  Segment rt = Segment::create_or_adopt(longest, 1);
  Segment user = Segment::attach(longest, 1);
  EXPECT_EQ(user.layout().header.name, longest);
  user.leave();
  rt.leave();
  EXPECT_FALSE(std::filesystem::exists("/dev/shm/corbot." + longest));
}

}  // namespace
}  // namespace corbot
