// SPDX-License-Identifier: Apache-2.0
// Tests the supervisor's output to readers that do not read.
#include "log/line_output.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <string>
#include <utility>

namespace corbot::cli {
namespace {

using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;

/// All that is there to be read.
std::string drained(int fd) {
  std::string text;
  std::array<char, 4096> buffer{};
  for (pollfd more{fd, POLLIN, 0}; ::poll(&more, 1, 0) == 1 && (more.revents & POLLIN) != 0;) {
    const ssize_t n = ::read(fd, buffer.data(), buffer.size());
    if (n <= 0) break;
    text.append(buffer.data(), static_cast<std::size_t>(n));
  }
  return text;
}

/// Ends only if no write waits; then what is read says how many lines are missing.
void expect_no_wait(int write_end, int read_end) {
  LineOutput output(write_end);
  const std::string line(100, 'x');
  while (output.left_out() < 10) output.write(line);
  EXPECT_EQ(::fcntl(write_end, F_GETFL) & O_NONBLOCK, 0) << "it is others' as well";
  std::string text = drained(read_end);
  EXPECT_THAT(text, HasSubstr(line));
  output.write("the last");
  text = drained(read_end);
  EXPECT_THAT(text, AllOf(HasSubstr("(10 lines were left out, because no program read the output)\n"),
                          EndsWith("the last\n")));
  EXPECT_EQ(output.left_out(), 0u);
}

TEST(LineOutput, DoesNotWaitForAPipe) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe2(ends.data(), O_CLOEXEC), 0);
  expect_no_wait(ends[1], ends[0]);
  for (const int fd : ends) ::close(fd);
}

TEST(LineOutput, DoesNotWaitForASocket) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()), 0);
  expect_no_wait(ends[1], ends[0]);
  for (const int fd : ends) ::close(fd);
}

/// A terminal, and the end at which a person reads.
struct Terminal {
  Terminal() {
    termios raw{};
    EXPECT_EQ(::tcgetattr(terminal.get(), &raw), 0);
    ::cfmakeraw(&raw);
    EXPECT_EQ(::tcsetattr(terminal.get(), TCSANOW, &raw), 0);
  }
  static Descriptor open_terminal(int person) {
    EXPECT_EQ(::grantpt(person) | ::unlockpt(person), 0);
    return Descriptor(::open(::ptsname(person), O_RDWR | O_NOCTTY | O_CLOEXEC));
  }
  const Descriptor person{::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)};
  const Descriptor terminal{open_terminal(person.get())};
};

TEST(LineOutput, ALineTakesThePlaceOfADrawnOne) {
  ::setenv("TERM", "xterm", 1);
  const Terminal at;
  LineOutput output(at.terminal.get());
  output.draw("1 of 3");
  output.draw("2 of 3");
  output.write("robot1 stopped");
  output.write("the end");
  output.draw("");
  EXPECT_EQ(drained(at.person.get()), "\r\x1b[K1 of 3\r\x1b[K2 of 3\r\x1b[Krobot1 stopped\nthe end\n");
}

TEST(LineOutput, DrawsNothingWhereItCannotBeErased) {
  const Terminal at;
  std::array<int, 2> pipe{};
  ASSERT_EQ(::pipe2(pipe.data(), O_CLOEXEC), 0);
  for (const auto& [fd, kind] : {std::pair{at.terminal.get(), "dumb"}, std::pair{pipe[1], "xterm"}}) {
    ::setenv("TERM", kind, 1);
    LineOutput output(fd);
    EXPECT_FALSE(output.can_redraw());
    output.draw("1 of 3");
    output.write("the end");
  }
  EXPECT_EQ(drained(at.person.get()), "the end\n");
  EXPECT_EQ(drained(pipe[0]), "the end\n");
  for (const int fd : pipe) ::close(fd);
}

TEST(LineOutput, DoesNotWaitForATerminalThatIsStopped) {
  const Terminal at;
  const Descriptor& person = at.person;
  const Descriptor& terminal = at.terminal;
  LineOutput output(terminal.get());
  ASSERT_EQ(::tcflow(terminal.get(), TCOOFF), 0);  // Ctrl-S
  for (int i = 0; i < 3; ++i) output.write("stopped");
  EXPECT_EQ(output.left_out(), 3u);
  ASSERT_EQ(::tcflow(terminal.get(), TCOON), 0);
  output.write("going on");
  EXPECT_THAT(drained(person.get()), AllOf(HasSubstr("(3 lines were left out"), EndsWith("going on\n")));
}

TEST(LineOutput, AppendsToAFile) {
  std::string path = testing::TempDir() + "corbot-report-XXXXXX";
  const Descriptor file(::mkstemp(path.data()));
  LineOutput output(file.get());
  output.write("one");
  output.write("two");
  std::array<char, 64> text{};
  EXPECT_EQ(::pread(file.get(), text.data(), text.size(), 0), 8);
  EXPECT_STREQ(text.data(), "one\ntwo\n");
  ::unlink(path.c_str());
}

}  // namespace
}  // namespace corbot::cli
