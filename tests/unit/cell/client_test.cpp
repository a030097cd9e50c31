// SPDX-License-Identifier: Apache-2.0
#include "cli/cell/cell_client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "cell/orb_server.h"
#include "cell/store_refusal.h"
#include "cli/cell/cell_directory.h"
#include "client/failure.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;

Corbot::BadParameter bad(const char* parameter, double value, const char* reason) {
  return {parameter, value, reason};
}

TEST(CellRefusal, OfANameHasNoNumber) {
  EXPECT_EQ(cell::refusal_text(bad("place", 7, "'pallet9' is no place of cell 'demo'")),
            "'pallet9' is no place of cell 'demo'");
  EXPECT_EQ(cell::refusal_text(bad("robot", 6, "'robot7' is no robot of cell 'demo'")),
            "'robot7' is no robot of cell 'demo'");
}

TEST(CellRefusal, OfANumberHasTheNumber) {
  EXPECT_EQ(cell::refusal_text(bad("piece", 99, "is not in the ledger")), "piece 99: is not in the ledger");
  EXPECT_EQ(cell::refusal_text(bad("slot", 99, "must be 0 to 11 at pallet2")),
            "slot 99: must be 0 to 11 at pallet2");
}

TEST(CellRefusal, OfASlotThatWasNotGivenNamesTheWord) {
  EXPECT_EQ(cell::refusal_text(bad("slot", -1, "must be 0 to 11 at pallet2")),
            "give a SLOT: it must be 0 to 11 at pallet2");
}

TEST(SilentCell, IsOneThatRunsWhereItsDirectoryIsHeld) {
  std::string pattern = fs::temp_directory_path() / "corbot-XXXXXX";
  const fs::path directory = ::mkdtemp(pattern.data());
  const auto text = [&] {
    return cli::silence_text("the coordinator", "corbaloc::h:1/Coordinator", "TIMEOUT", directory);
  };
  EXPECT_EQ(text(),
            "the coordinator at corbaloc::h:1/Coordinator does not reply (CORBA TIMEOUT); "
            "'corbot cell up CELL' starts a cell; to one that runs, write the --name, --ports and "
            "--state-dir of its 'up'");
  {
    const cli::DirectoryLock lock(directory);
    EXPECT_EQ(
        text(),
        "the coordinator at corbaloc::h:1/Coordinator does not reply (CORBA TIMEOUT); a cell is up in " +
            directory.string() +
            ", which starts it again: repeat the command, with the --ports of its 'up'; 'corbot hold' stops "
            "an arm at once, until 'corbot clear'");
  }
  fs::remove_all(directory);
}

TEST(CellPorts, AnAddressOfAnotherMachineNeedsNoOtherPort) {
  try {
    cell::check_listen("192.0.2.1", 12820);
    FAIL() << "listens at an address of no machine";
  } catch (const client::Failure& failure) {
    EXPECT_STREQ(failure.what(),
                 "'192.0.2.1' is not an address of this machine: check cell.host in cell.toml");
  }
}

}  // namespace
}  // namespace corbot::test
