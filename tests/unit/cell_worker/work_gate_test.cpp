// SPDX-License-Identifier: Apache-2.0
#include "cell/coordinator/work_gate.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

namespace corbot::test {
namespace {

TEST(WorkGate, KeepsAHoldInRoomThatItHasFromTheBeginning) {
  std::string pattern = std::filesystem::temp_directory_path() / "corbot-XXXXXX";
  const std::filesystem::path directory = ::mkdtemp(pattern.data());
  const std::filesystem::path file = directory / "hold";
  cell::WorkGate gate(file);
  ASSERT_TRUE(std::filesystem::exists(file)) << "a full disk would lose the first Stop";
  const auto size = std::filesystem::file_size(file);
  gate.set_stopped(true);
  EXPECT_EQ(std::filesystem::file_size(file), size);
  EXPECT_TRUE(cell::WorkGate(file).is_stopped());
  EXPECT_FALSE(cell::WorkGate(file).is_paused());
  gate.set_paused(true);
  gate.set_stopped(false);
  EXPECT_EQ(std::filesystem::file_size(file), size);
  EXPECT_TRUE(cell::WorkGate(file).is_paused());
  EXPECT_FALSE(cell::WorkGate(file).is_stopped());
  gate.set_paused(false);
  EXPECT_TRUE(cell::WorkGate(file).is_open());
  std::ofstream(file) << "stop\n";  // written by an older version
  EXPECT_TRUE(cell::WorkGate(file).is_stopped());
  std::filesystem::remove_all(directory);
}

}  // namespace
}  // namespace corbot::test
