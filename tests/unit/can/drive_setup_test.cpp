// SPDX-License-Identifier: Apache-2.0
// Drives as they are sold: what is right already is left alone, what differs is written when they take it,
// and what cannot be had is named.
#include "unit/can/drives_fixture.h"

namespace corbot::rt {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class SoldDrives : public Drives {
 protected:
  void command(std::initializer_list<const char*> commands) {
    for (const char* text : commands) emulator_.command(text);
  }
  void expect_works() {
    open();
    EXPECT_EQ(backend_->health(), BackendHealth::kOpen) << log_;
    EXPECT_TRUE(arrives());
  }
};

TEST_F(SoldDrives, MayHaveAReadOnlyInterpolationTimeThatIsRight) {
  command({"store 60C2:1 1", "store 60C2:2 fd", "writable 60C2 never"});
  expect_works();
}

TEST_F(SoldDrives, MayHaveAFixedMappingThatIsTheWantedOne) {
  command(
      {"mapping wanted", "store 1400:2 1", "store 1800:2 1", "writable 1400 never", "writable 1800 never"});
  expect_works();
}

TEST_F(SoldDrives, MayHaveAFixedMappingAndOtherParameters) {
  command({"mapping wanted"});
  expect_works();
}

TEST_F(SoldDrives, MayHaveAllRightAndReadOnly) {
  command({"mapping wanted", "store 1400:2 1", "store 1800:2 1", "writable 1400 never", "writable 1800 never",
           "writable 1005 never", "store 1006 3e8", "writable 1006 never", "store 1017 c8",
           "writable 1017 never", "store 6060 8", "writable 6060 never", "writable 60C2 never"});
  expect_works();
}

TEST_F(SoldDrives, NeedNotHaveASyncPeriod) {
  command({"writable 1006 never", "missing 1006 on 2"});
  expect_works();
}

TEST_F(SoldDrives, MayTakeAnInterpolationTimeOnlyWithoutAMode) {
  command({"store 6060 8", "store 60C2:1 5", "writable 60C2 mode-0"});
  expect_works();
}

TEST_F(SoldDrives, MayTakeASyncPeriodOnlyWithoutPdos) {
  command({"writable 1006 pdo-off", "writable 1017 pre-operational"});
  expect_works();
}

TEST_F(SoldDrives, AreSetUpAgainWhileTheyHold) {
  command({"writable 60C2 disabled", "writable 1600 disabled", "writable 1A00 disabled",
           "writable 6060 disabled"});
  expect_works();
  backend_->close();
  expect_works();  // nothing differs, nothing is written
}

TEST_F(SoldDrives, KeepTheirModeWhileTheyHold) {
  open();
  backend_->close();
  command({"store 60C2:1 5 2", "writable 60C2 mode-0 2"});
  EXPECT_THAT(refused().what(),
              AllOf(HasSubstr("node 2: 60C2h:1 is 0x05, 0x01 is needed"),
                    HasSubstr("while the drive holds its load; take its voltage off first")));
  EXPECT_EQ(state_of_node(2), DriveState::kOperationEnabled);
}

TEST_F(SoldDrives, AreRefusedWithAnotherReadOnlyValue) {
  command({"store 60C2:1 5 2", "writable 60C2 never 2"});
  EXPECT_EQ(std::string(refused().what()),
            emulator_.bus() +
                ": node 2: 60C2h:1 is 0x05, 0x01 is needed: attempt to write a read-only object "
                "(0x06010002); set it with its maker's tool");
}

TEST_F(SoldDrives, AreRefusedWithAnotherFixedMapping) {
  command({"mapping other 2"});
  EXPECT_THAT(refused().what(),
              HasSubstr("node 2: 1600h maps 0x60400010, 0x60400010 0x607A0020 is needed: writing "
                        "1600h: attempt to write a read-only object (0x06010002)"));
}

TEST_F(SoldDrives, AreRefusedWithoutAnObjectThatIsNeeded) {
  command({"missing 60C2 on 3"});
  EXPECT_THAT(refused().what(), HasSubstr("node 3: has no 60C2h:1, where 0x01 is needed"));
  command({"missing 60C2 off 3", "unanswered 6061 on 3"});
  EXPECT_THAT(refused().what(), HasSubstr("node 3: does not answer"));
}

TEST_F(SoldDrives, AreTheOnesThatTheProfileNames) {
  command({"store 1018:1 2a", "store 1018:4 3039 1"});
  settings_.joints[0].identity = {42u, {}, {}, 12'345u};
  settings_.gripper->identity = {42u, {}, {}, {}};
  expect_works();
  backend_.reset();
  command({"store 1018:4 303a 1"});
  EXPECT_THAT(refused().what(),
              HasSubstr("node 1: is another drive: its serial (1018h:4) is 0x0000303A, the profile has "
                        "0x00003039"));
  command({"missing 1018:1 on 3", "store 1018:4 3039 1"});
  EXPECT_THAT(refused().what(), HasSubstr("node 3: is another drive: its vendor (1018h:1) is not there"));
}

}  // namespace
}  // namespace corbot::rt
