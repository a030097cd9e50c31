// SPDX-License-Identifier: Apache-2.0
// Planes and boxes that a client sets beside the profile's, and across restarts.
#include <gmock/gmock.h>
#include <signal.h>

#include <filesystem>

#include <fmt/core.h>

#include "support/paths.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

Corbot::WorkspaceShape shape(const char* name, Corbot::ShapeKind kind) {
  Corbot::WorkspaceShape made{};
  made.name = name;
  made.kind = kind;
  made.parts = Corbot::PartTool;
  return made;
}
Corbot::WorkspaceShapes floor_at(double height_m) {
  Corbot::WorkspaceShapes shapes;
  shapes.length(1);
  shapes[0] = shape("low", Corbot::ShapePlane);
  shapes[0].normal = {0.0, 0.0, 1.0};
  shapes[0].offset = height_m;
  return shapes;
}

class Workspace : public RobotRig {
 protected:
  void SetUp() override {
    take_name("workspace");
    directory_ = fmt::format("{}/{}", CORBOT_SCRATCH_DIR, name_);
    fs::create_directory(directory_);
    start_rt({"--state-dir", directory_});
    if (!HasFatalFailure()) start_servant_here();
    if (HasFatalFailure()) return;
    ASSERT_TRUE(wait_for(Corbot::Standby)) << servant_->errors() << rt_->errors();
  }
  void TearDown() override {
    RobotRig::TearDown();
    fs::remove_all(directory_);
  }
  void start_servant_here() {
    start_servant({"--state-dir", directory_});
    if (HasFatalFailure()) return;
    ASSERT_TRUE(wait_until(within(30), [&] { return raised_by([&] { arm_ = connect(); }).empty(); }));
  }
  /// Lowers the tool below `low`.
  std::string refused_quantity() {
    try {
      arm_->Drive(1, -6.0, 60.0);
    } catch (const Corbot::LimitExceeded& refused) {
      return refused.quantity.in();
    }
    return "";
  }

  std::string directory_;
};

TEST_F(Workspace, HoldsWhatAClientSetsUntilTheReset) {
  const double here_m = arm_->CartCoord().z;
  Corbot::WorkspaceShapes both = floor_at(here_m - 0.02);
  both.length(2);
  both[1] = shape("post", Corbot::ShapeOutside);
  both[1].least = {1.0, 1.0, 0.0};
  both[1].greatest = {1.5, 1.25, 1.0};
  arm_->SetWorkspace(both);
  Corbot::WorkspaceInfo_var now = arm_->Workspace();
  EXPECT_TRUE(now->known);
  ASSERT_EQ(now->further.length(), 2u);
  EXPECT_STREQ(now->further[0].name, "low");
  EXPECT_EQ(now->further[0].offset, both[0].offset);
  EXPECT_EQ(now->further[1].kind, Corbot::ShapeOutside);
  EXPECT_EQ(now->further[1].greatest.y, 1.25);
  EXPECT_THAT(refused_quantity(), HasSubstr("workspace: the tool would be"));
  arm_->Drive(1, -2.0, 60.0);
  arm_->ResetWorkspace();
  now = arm_->Workspace();
  EXPECT_EQ(now->further.length(), 0u);
  arm_->Drive(1, -6.0, 60.0);
}

TEST_F(Workspace, IsRefusedByATypedException) {
  const double here_m = arm_->CartCoord().z;
  Corbot::WorkspaceShapes shapes = floor_at(here_m + 0.02);
  EXPECT_EQ(raised_by([&] { arm_->SetWorkspace(shapes); }), "LimitExceeded");
  shapes[0].normal = {0.0, 0.0, 0.0};
  EXPECT_EQ(raised_by([&] { arm_->SetWorkspace(shapes); }), "BadParameter");
  shapes = floor_at(-1.0);
  shapes[0].name = "a name that is much longer than thirty-two letters";
  EXPECT_EQ(raised_by([&] { arm_->SetWorkspace(shapes); }), "BadParameter");
  shapes = floor_at(-1.0);
  shapes.length(9);
  for (CORBA::ULong i = 0; i < 9; ++i) {
    shapes[i] = shapes[0];
    shapes[i].name = fmt::format("low{}", i).c_str();
  }
  EXPECT_EQ(raised_by([&] { arm_->SetWorkspace(shapes); }), "BadParameter");
  shapes.length(8);
  arm_->SetWorkspace(shapes);
  arm_->ResetWorkspace();
}

TEST_F(Workspace, OutlivesTheServant) {
  arm_->SetWorkspace(floor_at(arm_->CartCoord().z - 0.02));
  servant_->signal(SIGKILL);
  ASSERT_TRUE(servant_->wait(within(30)));
  start_servant_here();
  ASSERT_TRUE(wait_for(Corbot::Standby));
  EXPECT_THAT(refused_quantity(), HasSubstr("below 'low'"));
  arm_->Drive(1, -2.0, 60.0);
}

}  // namespace
}  // namespace corbot::test
