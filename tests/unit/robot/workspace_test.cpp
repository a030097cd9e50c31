// SPDX-License-Identifier: Apache-2.0
// Planes and boxes that clients set at run time: refused, saved, proved, and checked by the task.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include <fmt/core.h>

#include "robot/robot_handle.h"
#include "robot/task_fixture.h"
#include "support/paths.h"

namespace corbot::test::workspace_at_run_time {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

WantedShape plane(const std::string& name, double z, double offset_m, std::uint32_t parts = 1) {
  return {name, ShapeKind::kPlane, parts, {{0, 0, z}, offset_m, {}, {}}};
}
WantedShape box(const std::string& name, const Vector3& from_m, const Vector3& to_m) {
  return {name, ShapeKind::kOutside, 1, {{}, 0.0, from_m, to_m}};
}

class RunTimeWorkspace : public TaskTest {
 protected:
  explicit RunTimeWorkspace(const std::string& profile = CORBOT_TEST_PROFILES "/lynx5.toml")
      : TaskTest(profile.c_str()), task_(name_, profile_.arm) {}

  void SetUp() override {
    std::string path = CORBOT_SCRATCH_DIR "/workspace-XXXXXX";
    directory_ = ::mkdtemp(path.data());
    open();
  }
  void TearDown() override {
    robot_.reset();
    std::filesystem::remove_all(directory_);
  }
  void open() {
    open_robot();
    robot_->keep_state(directory_, [](const std::string&) {});
  }
  corbot_error set(const std::vector<WantedShape>& wanted) {
    try {
      robot_->set_workspace(wanted);
    } catch (const CallError& refused) {
      return refused.error;
    }
    return {};
  }
  template <class Call>
  std::string refusal_of(const Call& call) {
    try {
      call();
    } catch (const CallError& refused) {
      return refused.error.text;
    }
    return "";
  }
  /// Lowers the tool by joint 1.
  Outcome lower(double rad) { return try_accept(DriveRequest{1, rad, 1.0}); }
  double height_m() {
    const Joints q = robot_->view().snapshot().position_q;
    return profile_.arm.kinematics.forward(q).position_m[2];
  }

  LoopTask task_;
  std::string directory_;
};

TEST_F(RunTimeWorkspace, AMotionBeyondAPlaneIsRefusedUntilTheReset) {
  const double here_m = height_m();
  ASSERT_EQ(set({plane("low", 2.0, here_m - 0.05)}).status, CORBOT_OK);
  const auto shapes = robot_->further_shapes();
  ASSERT_TRUE(shapes);
  ASSERT_EQ(shapes->count, 1u);
  EXPECT_EQ(shapes->shapes[0].faces[0].normal[2], 1.0) << "of unit length";
  const Outcome refused = lower(-0.4);
  EXPECT_EQ(refused.status, CORBOT_LIMIT_EXCEEDED);
  EXPECT_THAT(refused.text, HasSubstr("below 'low'"));
  const Outcome begun = lower(-0.05);
  ASSERT_EQ(begun.status, CORBOT_OK) << begun.text;
  robot_->finish(begun.ticket);
  robot_->reset_workspace();
  EXPECT_EQ(robot_->further_shapes()->count, 0u);
  const Outcome free = lower(-0.4);
  ASSERT_EQ(free.status, CORBOT_OK) << free.text;
  robot_->finish(free.ticket);
}

TEST_F(RunTimeWorkspace, IsRefusedWithValueAndLimit) {
  const auto text = [&](const WantedShape& shape) {
    const corbot_error error = set({shape});
    EXPECT_EQ(error.status, CORBOT_BAD_PARAMETER);
    return std::string(error.text);
  };
  EXPECT_EQ(text(plane("a", 0.0, 0.0)), "'a': a normal of length 0, allowed 1e-06 to 1000");
  EXPECT_EQ(text(plane("a", kNan, 0.0)), "'a': a normal of length nan, allowed 1e-06 to 1000");
  EXPECT_EQ(text(plane("a", 1.0, -101.0)), "'a': the offset -101 m, allowed -100 to 100 m");
  EXPECT_EQ(text(plane("a", 1.0, kNan)), "'a': the offset nan m, allowed -100 to 100 m");
  EXPECT_THAT(text(plane("a", 1.0, -1.0, 0)), HasSubstr("parts 0"));
  EXPECT_EQ(
      text(plane("a", 1.0, -1.0, 1 + 16 + 32)),
      "'a': parts tool, forearm, hand: the profile gives no link_radius_m for links, so the parts of this "
      "arm are tool, wrist, elbow");
  EXPECT_THAT(text(plane("a", 1.0, -1.0, 64)), HasSubstr("parts 64: a sum of 1 tool"));
  EXPECT_THAT(text(plane("a b", 1.0, -1.0)), HasSubstr("1 to 32 ASCII letters"));
  EXPECT_EQ(text(box("a", {0, 0, 0.2}, {1, 1, 0.2})),
            "'a': a box from 0.2 to 0.2 m along z: the second must be greater");
  EXPECT_EQ(text(box("a", {0, kNan, 0}, {1, 1, 1})), "'a': a corner at nan m, allowed -100 to 100 m");
  EXPECT_THAT(set({plane("a", 1.0, -1.0), plane("a", 1.0, -2.0)}).text,
              HasSubstr("'a' is the name of another"));
  EXPECT_EQ(robot_->further_shapes()->count, 0u);
}

TEST_F(RunTimeWorkspace, AnArmThatStandsBeyondOrMovesRefusesIt) {
  const double here_m = height_m();
  const corbot_error beyond = set({plane("high", 1.0, here_m + 0.02)});
  EXPECT_EQ(beyond.status, CORBOT_LIMIT_EXCEEDED);
  EXPECT_STREQ(beyond.text, "the tool stands 20 mm beyond the wanted 'high'");
  const Outcome begun = try_accept(DwellRequest{60.0});
  ASSERT_EQ(begun.status, CORBOT_OK);
  const corbot_error moving = set({plane("low", 1.0, here_m - 0.05)});
  EXPECT_EQ(moving.status, CORBOT_NOT_READY);
  EXPECT_THAT(moving.text, HasSubstr("motions are under way"));
  EXPECT_EQ(status_of([&] { robot_->reset_workspace(); }), CORBOT_NOT_READY);
  robot_->cancel(begun.ticket);
  EXPECT_EQ(set({plane("low", 1.0, here_m - 0.05)}).status, CORBOT_OK);
}

TEST_F(RunTimeWorkspace, OutlivesTheServant) {
  const double here_m = height_m();
  ASSERT_EQ(set({plane("low", 1.0, here_m - 0.05), box("post", {1, 1, 1}, {2, 2, 2})}).status, CORBOT_OK);
  const auto before = robot_->further_shapes();
  robot_.reset();
  open();
  EXPECT_EQ(robot_->further_shapes(), before);
  EXPECT_THAT(lower(-0.4).text, HasSubstr("below 'low'"));
  const Outcome begun = lower(-0.05);
  ASSERT_EQ(begun.status, CORBOT_OK) << begun.text;
  robot_->finish(begun.ticket);
}

TEST_F(RunTimeWorkspace, ThatCannotBeReadLetsNoJointMove) {
  ASSERT_EQ(set({plane("low", 1.0, height_m() - 0.05)}).status, CORBOT_OK);
  robot_.reset();
  for (const auto& entry : std::filesystem::directory_iterator(directory_))
    if (entry.path().extension() == ".workspace") std::ofstream(entry.path(), std::ios::app) << "damaged";
  open();
  EXPECT_FALSE(robot_->further_shapes().has_value());
  EXPECT_THAT(lower(-0.05).text, AllOf(HasSubstr("workspace are not known"), HasSubstr("set or reset them")));
  EXPECT_EQ(try_accept(DwellRequest{0.0}).status, CORBOT_OK);
  ASSERT_TRUE(
      wait_until(within(30), [&] { return status_of([&] { robot_->reset_workspace(); }) == CORBOT_OK; }));
  EXPECT_EQ(lower(-0.05).status, CORBOT_OK);
}

TEST_F(RunTimeWorkspace, OfAnotherBaseFrameLetsNoJointMoveUntilThatBaseIsSet) {
  const Pose raised{{0.5, 0, 0.25}, {std::sqrt(0.5), 0, 0, std::sqrt(0.5)}};
  robot_->set_base_frame(raised);
  ASSERT_EQ(set({plane("low", 1.0, height_m() + 0.2)}).status, CORBOT_OK);
  const auto before = robot_->further_shapes();
  robot_.reset();
  open();
  robot_->reset_frames();  // as after a power-down
  EXPECT_FALSE(robot_->further_shapes().has_value());
  const Outcome refused = lower(-0.05);
  EXPECT_EQ(refused.status, CORBOT_NOT_READY);
  EXPECT_EQ(refused.text,
            "the planes and boxes of clients hold for base 0.5 0 0.25 0.7071068 0 0 0.7071068: set that "
            "base, or set or reset them; the base is 0 0 0 1 0 0 0");
  EXPECT_EQ(refusal_of([&] { (void)robot_->plan(DriveRequest{1, -0.05, 1.0}); }), refused.text);
  EXPECT_EQ(try_accept(DwellRequest{0.0}).status, CORBOT_OK);
  const double h = 0.7071068;  // as the text
  robot_->set_base_frame({{0.5, 0, 0.25}, {-h, 0, 0, -h}});
  EXPECT_EQ(robot_->further_shapes(), before);
  EXPECT_EQ(lower(-0.05).status, CORBOT_OK);
}

TEST_F(RunTimeWorkspace, OfAnotherBaseFrameIsSetOrResetForTheNewOne) {
  ASSERT_EQ(set({plane("low", 1.0, -1.0)}).status, CORBOT_OK);
  const auto raise = [&](double height_m) { robot_->set_base_frame({{0, 0, height_m}, {}}); };
  raise(0.5);
  EXPECT_EQ(lower(-0.02).status, CORBOT_NOT_READY);
  ASSERT_EQ(set({plane("low", 1.0, -1.0)}).status, CORBOT_OK);
  const Outcome begun = lower(-0.02);
  ASSERT_EQ(begun.status, CORBOT_OK) << begun.text;
  robot_->finish(begun.ticket);
  raise(0.25);
  EXPECT_EQ(lower(-0.02).status, CORBOT_NOT_READY);
  robot_->reset_workspace();
  const Outcome free = lower(-0.02);
  ASSERT_EQ(free.status, CORBOT_OK) << free.text;
  robot_->finish(free.ticket);
  ASSERT_EQ(set({}).status, CORBOT_OK);
  raise(0.0);
  EXPECT_EQ(lower(-0.02).status, CORBOT_OK) << "no planes and boxes hold for every base";
}

/// The same arm with thick links.
class ThickRunTimeWorkspace : public RunTimeWorkspace {
 protected:
  ThickRunTimeWorkspace() : RunTimeWorkspace(thick_profile()) { std::filesystem::remove(file()); }

 private:
  static std::string file() { return fmt::format("{}/thick-{}.toml", CORBOT_SCRATCH_DIR, ::getpid()); }
  static std::string thick_profile() {
    std::ofstream(file()) << std::ifstream(CORBOT_TEST_PROFILES "/lynx5.toml").rdbuf()
                          << "\n[workspace]\nlink_radius_m = [0.02, 0.02, 0.03]\n";
    return file();
  }
};

TEST_F(ThickRunTimeWorkspace, AShapeHoldsForALinkLessItsRadius) {
  const double here_m = height_m();  // the lowest point of the hand's axis
  constexpr std::uint32_t kHand = 32;
  EXPECT_STREQ(set({plane("low", 1.0, here_m - 0.02, kHand)}).text,
               "the hand stands 10 mm beyond the wanted 'low'");
  ASSERT_EQ(set({plane("low", 1.0, here_m - 0.04, kHand)}).status, CORBOT_OK);
  EXPECT_THAT(lower(-0.2).text, HasSubstr("the hand would be"));
  const Outcome begun = lower(-0.02);
  ASSERT_EQ(begun.status, CORBOT_OK) << begun.text;
  robot_->finish(begun.ticket);
  EXPECT_GT(height_m(), here_m - 0.01);
}

TEST_F(RunTimeWorkspace, TheCInterfaceNamesTheProfilesShapesFirstAndRefusesTooMany) {
  corbot_shape shapes[CORBOT_MAX_FURTHER_SHAPES + 1]{};
  for (std::size_t k = 0; k < std::size(shapes); ++k) {
    shapes[k].name[0] = static_cast<char>('a' + k);
    shapes[k].kind = CORBOT_SHAPE_PLANE;
    shapes[k].parts = 3;
    shapes[k].normal[2] = 1.0;
    shapes[k].offset_m = -1.0;
  }
  corbot_robot handle{profile_, name_ + "x"};
  corbot_error error{};
  corbot_caller caller{};
  EXPECT_EQ(corbot_robot_set_workspace(&handle, &caller, shapes, std::size(shapes), &error),
            CORBOT_BAD_PARAMETER);
  EXPECT_STREQ(error.text, "9 planes and boxes, allowed at most 8");
  corbot_workspace now;
  corbot_robot_workspace(&handle, &now);
  EXPECT_EQ(now.known, 1);
  EXPECT_EQ(now.profile_count + now.further_count, 0u);
}

}  // namespace
}  // namespace corbot::test::workspace_at_run_time
