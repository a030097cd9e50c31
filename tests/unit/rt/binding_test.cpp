// SPDX-License-Identifier: Apache-2.0
#include <elf.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "support/paths.h"
#include "support/process.h"
#include "support/test_arms.h"

// The cycle makes no call to the loader: everything that it calls is bound when the program starts.

namespace corbot::test {
namespace {

using ::testing::IsEmpty;
using ::testing::Not;

/// Returns the bindings of the loader between the probe's two marks, a line each.
std::vector<std::string> bound_in_the_cycle(const std::string& probe, const std::string& arm) {
  const RunResult result = run({probe, arm}, 60.0, {"LD_DEBUG=bindings"});
  EXPECT_EQ(result.code, 0) << "the probe's motions did not end";
  std::istringstream lines(result.errors);
  std::vector<std::string> bound;
  bool in_cycle = false;
  bool has_begun = false;
  bool has_ended = false;
  for (std::string line; std::getline(lines, line);) {
    if (line == "cycle begins") in_cycle = has_begun = true;
    if (line == "cycle ends") in_cycle = false, has_ended = true;
    if (in_cycle && line.find("binding file") != std::string::npos) bound.push_back(line);
  }
  EXPECT_TRUE(has_begun && has_ended) << result.errors.substr(0, 1000);
  return bound;
}

class Binding : public ::testing::TestWithParam<const char*> {};

TEST_P(Binding, NothingIsBoundInsideTheCycle) {
  EXPECT_THAT(bound_in_the_cycle(CORBOT_TESTS_DIR "/binding_probe", GetParam()), IsEmpty());
}
TEST_P(Binding, LazyBindingWouldBeSeen) {
  EXPECT_THAT(bound_in_the_cycle(CORBOT_TESTS_DIR "/binding_probe_lazy", GetParam()), Not(IsEmpty()));
}

INSTANTIATE_TEST_SUITE_P(Arms, Binding, ::testing::ValuesIn(kTestArms),
                         [](const auto& arm) { return std::string(arm.param); });

/// The protections of a 64-bit ELF program.
struct Hardening {
  bool is_pie{false};
  bool binds_now{false};
  bool is_relro{false};
  bool guards_stack{false};
  bool is_fortified{false};
};

template <class T>
T at(const std::string& image, std::size_t offset) {
  T value{};
  if (offset + sizeof(T) <= image.size()) std::memcpy(&value, image.data() + offset, sizeof(T));
  return value;
}

Hardening hardening_of(const std::string& program) {
  std::ifstream file(program, std::ios::binary);
  const std::string image{std::istreambuf_iterator<char>(file), {}};
  Hardening found;
  const auto header = at<Elf64_Ehdr>(image, 0);
  EXPECT_EQ(std::memcmp(header.e_ident, ELFMAG, SELFMAG), 0) << program;
  for (std::size_t i = 0; i < header.e_phnum; ++i) {
    const auto segment = at<Elf64_Phdr>(image, header.e_phoff + i * header.e_phentsize);
    if (segment.p_type == PT_GNU_RELRO) found.is_relro = true;
    if (segment.p_type != PT_DYNAMIC) continue;
    for (std::size_t offset = 0; offset < segment.p_filesz; offset += sizeof(Elf64_Dyn)) {
      const auto entry = at<Elf64_Dyn>(image, segment.p_offset + offset);
      if (entry.d_tag == DT_FLAGS_1 && (entry.d_un.d_val & DF_1_NOW) != 0) found.binds_now = true;
      if (entry.d_tag == DT_FLAGS_1 && (entry.d_un.d_val & DF_1_PIE) != 0) found.is_pie = true;
    }
  }
  found.guards_stack = image.find("__stack_chk_fail") != std::string::npos;
  // memcpy and its kin, checked; of the names with this ending, __stack_chk_fail is another matter.
  found.is_fortified =
      image.find("_chk@") != std::string::npos || image.find("_chk\0", 0, 5) != std::string::npos;
  return found;
}

TEST(Hardening, EveryProgramHasIt) {
  std::istringstream programs(CORBOT_PROGRAMS);
  int count = 0;
  for (std::string program; std::getline(programs, program, ','); ++count) {
    const Hardening found = hardening_of(program);
    EXPECT_TRUE(found.is_pie) << program;
    EXPECT_TRUE(found.binds_now) << program;
    EXPECT_TRUE(found.is_relro) << program;
    EXPECT_TRUE(found.guards_stack) << program;
    EXPECT_TRUE(found.is_fortified) << program;
  }
  EXPECT_GE(count, 2);
}

TEST(Hardening, ItsLackWouldBeSeen) {
  EXPECT_FALSE(hardening_of(CORBOT_TESTS_DIR "/binding_probe_lazy").binds_now);
}

}  // namespace
}  // namespace corbot::test
