// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/cell_directory.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

namespace corbot::cli {
namespace {

namespace fs = std::filesystem;

TEST(CellDirectory, AHoldStaysWhereTheRestBeginsAnew) {
  std::string pattern = fs::temp_directory_path() / "corbot-XXXXXX";
  const fs::path directory = ::mkdtemp(pattern.data());
  for (const bool is_simulated : {true, false}) {
    cell::CellConfig cell;
    cell.state_directory = directory;
    if (is_simulated) cell.scene.emplace();
    EXPECT_EQ(hold_note(cell),
              is_simulated ? "" : "; a stop from before still holds the work: 'corbot cell start' begins it");
    std::ofstream(cell.hold_file()) << "      stop\n";
    std::ofstream(cell.activity_file()) << "{}\n";
    begin_anew(cell);
    EXPECT_TRUE(fs::exists(cell.hold_file())) << "a stopped cell would move";
    EXPECT_FALSE(fs::exists(cell.activity_file()));
  }
  fs::remove_all(directory);
}

}  // namespace
}  // namespace corbot::cli
