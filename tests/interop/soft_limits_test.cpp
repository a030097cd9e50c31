// SPDX-License-Identifier: Apache-2.0
// Soft limits, as an ordinary client sets and feels them, and across restarts.
#include <gmock/gmock.h>
#include <signal.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include <fmt/core.h>

#include "support/paths.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class SoftLimits : public RobotRig {
 protected:
  void SetUp() override {
    take_name("limits");
    directory_ = fmt::format("{}/{}", CORBOT_SCRATCH_DIR, name_);
    fs::create_directory(directory_);
    start_both();
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
  void start_both() {
    start_rt({"--state-dir", directory_});
    if (!HasFatalFailure()) start_servant_here();
  }
  void end_servant() {
    servant_->signal(SIGKILL);
    ASSERT_TRUE(servant_->wait(within(30)));
  }
  void end_task() {
    rt_->signal(SIGKILL);
    ASSERT_TRUE(rt_->wait(within(30)));
  }
  [[nodiscard]] fs::path file() const { return directory_ + "/" + name_ + ".loopback.limits"; }

  /// MovRange, but for one joint.
  Corbot::JointRanges with(CORBA::ULong joint, double lower, double upper) {
    Corbot::JointRanges_var all = arm_->MovRange();
    all[joint] = {lower, upper};
    return all.in();
  }
  void set(CORBA::ULong joint, double lower, double upper) { arm_->SetSoftLimits(with(joint, lower, upper)); }
  void expect_limits(CORBA::ULong joint, double lower, double upper) {
    Corbot::JointRanges_var now = arm_->SoftLimits();
    ASSERT_EQ(now->length(), 4u);
    EXPECT_NEAR(now[joint].lower, lower, 1e-9);
    EXPECT_NEAR(now[joint].upper, upper, 1e-9);
  }
  template <class Call>
  void expect_exceeded(Call&& call, const char* quantity, CORBA::Long joint, double value, double lower,
                       double upper) {
    try {
      call();
      ADD_FAILURE() << "nothing raised";
    } catch (const Corbot::LimitExceeded& refused) {
      EXPECT_STREQ(refused.quantity, quantity);
      EXPECT_EQ(refused.articulation, joint);
      EXPECT_NEAR(refused.value, value, 1e-6);
      EXPECT_NEAR(refused.lower, lower, 1e-6);
      EXPECT_NEAR(refused.upper, upper, 1e-6);
    }
  }
  void expect_in_force() {
    expect_limits(0, -20.0, 30.0);
    arm_->Ready();  // after a restart it stands where the servos' resolution has it
    expect_exceeded([&] { arm_->Drive(0, 40.0, 30.0); }, "joint range", 0, 40.0, -20.0, 30.0);
    arm_->Drive(0, 25.0, 60.0);
    arm_->Ready();
  }
  template <class Call>
  static std::string reason_of(Call&& call) {
    try {
      call();
    } catch (const Corbot::NotReady& refused) {
      return refused.reason.in();
    }
    return "";
  }

  std::string directory_;
};

TEST_F(SoftLimits, AreTheRangesUntilTheyAreSetAndAfterTheyAreReset) {
  expect_limits(0, -90.0, 90.0);
  set(0, -20.0, 30.0);
  expect_in_force();
  Corbot::JointRanges_var range = arm_->MovRange();
  EXPECT_EQ(range[0].upper, 90.0) << "what the arm can do stays";
  arm_->ResetSoftLimits();
  expect_limits(0, -90.0, 90.0);
  arm_->Drive(0, 40.0, 60.0);
}

TEST_F(SoftLimits, ReadySaysThatTheyExcludeTheInitialPosition) {
  arm_->Drive(0, 25.0, 60.0);
  set(0, 20.0, 30.0);
  const auto excluded = HasSubstr("joint 0 would be at 0 degrees");
  EXPECT_THAT(reason_of([&] { arm_->Ready(); }), excluded);
  EXPECT_THAT(reason_of([&] { (void)arm_->StartReady(); }), excluded);
  arm_->ResetSoftLimits();
  arm_->Ready();
}

TEST_F(SoftLimits, ReadySaysThatItWouldTakeTooLong) {
  arm_->Drive(0, 25.0, 60.0);
  arm_->AllSpeed(1e-6);
  EXPECT_THAT(reason_of([&] { arm_->Ready(); }), HasSubstr("this motion takes"));
  arm_->AllSpeed(100.0);
  arm_->Ready();
}

TEST_F(SoftLimits, PathsKeepThemToo) {
  arm_->Move(0.20, 0.10, 0.10, 0.0, 0.0);
  set(0, -10.0, 90.0);
  EXPECT_EQ(raised_by([&] { arm_->MoveS(0.20, -0.10, 0.10, 0.0, 0.0); }), "LimitExceeded");
  EXPECT_EQ(raised_by([&] { arm_->Move(0.20, -0.10, 0.10, 0.0, 0.0); }), "LimitExceeded");
  EXPECT_EQ(raised_by([&] {
              arm_->MoveC({0.20, 0.10, 0.10}, {0.24, 0.0, 0.10}, {0.20, -0.10, 0.10});
            }),
            "LimitExceeded");
  arm_->MoveS(0.20, 0.0, 0.10, 0.0, 0.0);
}

TEST_F(SoftLimits, RefuseWhatNoArmHas) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  for (const double wrong : {kNaN, HUGE_VAL, -HUGE_VAL}) {
    EXPECT_EQ(raised_by([&] { set(1, wrong, 90.0); }), "BadParameter") << wrong;
    EXPECT_EQ(raised_by([&] { set(1, 0.0, wrong); }), "BadParameter") << wrong;
  }
  EXPECT_EQ(raised_by([&] { set(1, 10.0, 9.0); }), "BadParameter") << "inverted";
  Corbot::JointRanges few = with(0, 0, 0);
  few.length(3);
  EXPECT_EQ(raised_by([&] { arm_->SetSoftLimits(few); }), "BadParameter");
  few.length(0);
  EXPECT_EQ(raised_by([&] { arm_->SetSoftLimits(few); }), "BadParameter");
  expect_exceeded([&] { set(2, -30.5, 90.0); }, "joint range", 2, -30.5, -30.0, 150.0);
  expect_exceeded([&] { set(2, 0.0, 151.0); }, "joint range", 2, 151.0, -30.0, 150.0);
  expect_exceeded([&] { set(3, 5.0, 90.0); }, "joint position", 3, 0.0, 5.0, 90.0);
  expect_limits(2, -30.0, 150.0);
  EXPECT_FALSE(fs::exists(file())) << "nothing that was refused is saved";
  set(3, 0.0, 0.0);
  expect_limits(3, 0.0, 0.0);
}

TEST_F(SoftLimits, AreNotChangedUnderAMotion) {
  const Corbot::Ticket ticket = arm_->StartDrive(0, 60.0, 10.0);
  EXPECT_THAT(reason_of([&] { set(0, -20.0, 90.0); }), HasSubstr("motions are under way"));
  expect_limits(0, -90.0, 90.0);
  arm_->Cancel(ticket);
  set(0, -20.0, 90.0);
}

TEST_F(SoftLimits, NeedControl) {
  Corbot::Arm_var mine = arm_->Acquire("cell 7", 60.0);
  EXPECT_THAT(reason_of([&] { set(0, -20.0, 30.0); }), HasSubstr("'cell 7' has control"));
  EXPECT_THAT(reason_of([&] { arm_->ResetSoftLimits(); }), HasSubstr("'cell 7' has control"));
  mine->SetSoftLimits(with(0, -20.0, 30.0));
  expect_limits(0, -20.0, 30.0);
}

TEST_F(SoftLimits, OutliveServantTaskAndBoth) {
  set(0, -20.0, 30.0);
  end_servant();
  start_servant_here();
  ASSERT_TRUE(wait_for(Corbot::Standby));
  expect_in_force();

  end_task();
  start_rt({"--state-dir", directory_});
  ASSERT_TRUE(wait_until(within(30), [&] { return raised_by([&] { arm_->Clear(); }).empty(); }));
  ASSERT_TRUE(wait_for(Corbot::Standby));
  expect_in_force();

  end_servant();
  end_task();
  start_both();
  ASSERT_TRUE(wait_until(within(30), [&] { return raised_by([&] { arm_->Clear(); }).empty(); }));
  ASSERT_TRUE(wait_for(Corbot::Standby));
  expect_in_force();
  arm_->ResetSoftLimits();
  end_servant();
  start_servant_here();
  expect_limits(0, -90.0, 90.0);
}

TEST_F(SoftLimits, ThatCannotBeReadLetNoJointMove) {
  set(0, -20.0, 30.0);
  end_servant();
  std::ofstream(file(), std::ios::app) << "damaged";
  start_servant_here();
  ASSERT_TRUE(wait_for(Corbot::Standby));
  Corbot::JointRanges_var none = arm_->SoftLimits();
  EXPECT_EQ(none->length(), 0u) << "not known";
  EXPECT_THAT(reason_of([&] { arm_->Drive(0, 5.0, 30.0); }), HasSubstr("soft limits are not known"));
  EXPECT_THAT(reason_of([&] { arm_->Ready(); }), HasSubstr("set or reset them"));
  arm_->Open();
  arm_->Delay(0.0);
  bool is_told = false;
  for (const Corbot::AlarmInfo& alarm : alarms()) is_told |= alarm.code == 156;
  EXPECT_TRUE(is_told);
  arm_->ResetSoftLimits();
  arm_->Drive(0, 40.0, 30.0);
}

TEST_F(SoftLimits, OfAnotherProfileAreSetAnew) {
  set(0, -20.0, 30.0);
  arm_ = Corbot::Arm::_nil();
  ASSERT_EQ(servant_->terminate(), 0);
  ASSERT_EQ(rt_->terminate(), 0);
  std::ifstream from(profile_);
  std::stringstream text;
  text << from.rdbuf();
  std::string all = text.str();
  const std::string was = "speed_deg_s = 180";
  ASSERT_NE(all.find(was), std::string::npos);
  profile_ = directory_ + "/other.toml";
  std::ofstream(profile_) << all.replace(all.find(was), was.size(), "speed_deg_s = 170");
  start_both();
  ASSERT_TRUE(wait_until(within(30), [&] { return raised_by([&] { arm_->Clear(); }).empty(); }));
  EXPECT_THAT(reason_of([&] { arm_->Drive(0, 5.0, 30.0); }), HasSubstr("profile has changed"));
  set(0, -25.0, 25.0);
  arm_->Drive(0, 5.0, 30.0);
  end_servant();
  start_servant_here();
  expect_limits(0, -25.0, 25.0);
}

TEST_F(SoftLimits, ThatCannotBeSavedAreNotTaken) {
  fs::create_directory(file());
  std::ofstream(file() / "x") << "";  // not to be replaced
  EXPECT_THAT(reason_of([&] { set(0, -20.0, 30.0); }), HasSubstr("cannot be saved"));
  expect_limits(0, -90.0, 90.0);
  arm_->Drive(0, 40.0, 60.0);
}

}  // namespace
}  // namespace corbot::test
