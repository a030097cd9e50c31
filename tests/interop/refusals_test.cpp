// SPDX-License-Identifier: Apache-2.0
// Bad input: the typed exception with its fields, the arm where it was, the servant alive.
#include <cmath>
#include <limits>

#include "support/escaped_exception.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

class Refusals : public RobotRig {
 protected:
  void SetUp() override {
    RobotRig::SetUp();
    if (HasFatalFailure()) return;
    arm_->Move(0.20, 0.05, 0.10, 0.0, 0.0);
    before_ = arm_->ArtiCoord();
  }
  void TearDown() override {
    if (!CORBA::is_nil(arm_)) {
      EXPECT_EQ(arm_->Status(), Corbot::Standby);
      Corbot::JointCoord_var after = arm_->ArtiCoord();
      EXPECT_EQ(distance_deg(before_, after), 0.0) << "the arm moved";
    }
    RobotRig::TearDown();
  }

  template <class Call>
  Corbot::BadParameter bad_parameter(Call&& call) {
    try {
      call();
    } catch (const Corbot::BadParameter& error) {
      EXPECT_STRNE(error.reason, "");
      return error;
    } catch (const CORBA::Exception& error) {
      ADD_FAILURE() << "not BadParameter but " << described(error);
      return {};
    }
    ADD_FAILURE() << "nothing raised";
    return {};
  }
  template <class Call>
  Corbot::LimitExceeded limit_exceeded(Call&& call) {
    try {
      call();
    } catch (const Corbot::LimitExceeded& error) {
      return error;
    } catch (const CORBA::Exception& error) {
      ADD_FAILURE() << "not LimitExceeded but " << described(error);
      return {};
    }
    ADD_FAILURE() << "nothing raised";
    return {};
  }
  template <class Call>
  Corbot::Unreachable unreachable(Call&& call) {
    try {
      call();
    } catch (const Corbot::Unreachable& error) {
      EXPECT_STRNE(error.reason, "");
      return error;
    } catch (const CORBA::Exception& error) {
      ADD_FAILURE() << "not Unreachable but " << described(error);
      return {};
    }
    ADD_FAILURE() << "nothing raised";
    return {};
  }

  Corbot::JointCoord_var before_;
};

TEST_F(Refusals, CoordinatesThatAreNoNumbers) {
  for (const double bad : {kNan, kInf, -kInf, 1e308, -1e308}) {
    SCOPED_TRACE(bad);
    const auto same = [&](double value) { return std::isnan(bad) ? std::isnan(value) : value == bad; };
    auto error = bad_parameter([&] { arm_->Move(bad, 0.0, 0.1, 0.0, 0.0); });
    EXPECT_STREQ(error.parameter, "Px");
    EXPECT_TRUE(same(error.value));
    EXPECT_STREQ(bad_parameter([&] { arm_->MoveS(0.2, bad, 0.1, 0.0, 0.0); }).parameter, "Py");
    EXPECT_STREQ(bad_parameter([&] { arm_->Move(0.2, 0.0, bad, 0.0, 0.0); }).parameter, "Pz");
    EXPECT_STREQ(bad_parameter([&] { arm_->Move(0.2, 0.0, 0.1, bad, 0.0); }).parameter, "d");
    error = bad_parameter([&] { arm_->MoveS(0.2, 0.0, 0.1, 0.0, bad); });
    EXPECT_STREQ(error.parameter, "t");
    EXPECT_TRUE(same(error.value));
    bad_parameter([&] { arm_->MoveC({bad, 0, 0.1}, {0.2, 0, 0.1}, {0.2, 0.03, 0.1}); });
    bad_parameter([&] { arm_->MoveC({0.2, 0, 0.1}, {0.2, bad, 0.1}, {0.2, 0.03, 0.1}); });
    bad_parameter([&] { arm_->MoveC({0.2, 0, 0.1}, {0.2, 0, 0.1}, {0.2, 0.03, bad}); });
    bad_parameter([&] { arm_->Delay(bad); });
    bad_parameter(
        [&] { arm_->Drive(0, 1.0, bad > 0 && std::isfinite(bad) ? -1.0 : (bad == kInf ? kNan : bad)); });
    bad_parameter([&] { arm_->SetToolPitch(bad); });
    bad_parameter([&] { arm_->SetToolOrientation({bad, 0, 0, 0}); });
    error = bad_parameter([&] { arm_->MovePose({{bad, 0, 0.1}, {1, 0, 0, 0}}, 0.0); });
    EXPECT_STREQ(error.parameter, "target");
    EXPECT_TRUE(same(error.value));
    bad_parameter([&] { arm_->MovePoseS({{0.2, 0, 0.1}, {1, bad, 0, 0}}, 0.0); });
    bad_parameter([&] { arm_->StartMovePose({{0.2, 0, 0.1}, {1, 0, 0, 0}}, bad); });
    error = bad_parameter([&] {
      arm_->MoveRelative({{0, 0, bad}, {1, 0, 0, 0}}, Corbot::OffsetInTool, 0.0);
    });
    EXPECT_STREQ(error.parameter, "offset");
    EXPECT_TRUE(same(error.value));
    bad_parameter([&] { arm_->StartMoveRelativeS({{}, {bad, 0, 0, 0}}, Corbot::OffsetInBase, 0.0); });
  }
}

TEST_F(Refusals, NegativeTimes) {
  EXPECT_STREQ(bad_parameter([&] { arm_->Move(0.2, 0, 0.1, 0, -1.0); }).parameter, "t");
  EXPECT_EQ(bad_parameter([&] { arm_->MoveS(0.2, 0, 0.1, 0, -1e-9); }).value, -1e-9);
  EXPECT_STREQ(bad_parameter([&] { arm_->Delay(-0.5); }).parameter, "t");
  EXPECT_STREQ(bad_parameter([&] { Corbot::MotionInfo_var info = arm_->Wait(1, -1.0); }).parameter,
               "timeout");
}

TEST_F(Refusals, Percentages) {
  for (const double bad : {0.0, -1.0, 101.0, 100.0000001, kNan, kInf}) {
    SCOPED_TRACE(bad);
    EXPECT_STREQ(bad_parameter([&] { arm_->Speed(bad); }).parameter, "percent");
    EXPECT_STREQ(bad_parameter([&] { arm_->AllSpeed(bad); }).parameter, "percent");
    EXPECT_STREQ(bad_parameter([&] { arm_->ArtSpeed(0, bad); }).parameter, "percent");
    EXPECT_STREQ(bad_parameter([&] { arm_->Override(bad); }).parameter, "percent");
  }
}

TEST_F(Refusals, JointNumbers) {
  for (const CORBA::Long bad : {-1, 4, 1000, std::numeric_limits<CORBA::Long>::min()}) {
    SCOPED_TRACE(bad);
    const auto error = bad_parameter([&] { arm_->Drive(bad, 1.0, 10.0); });
    EXPECT_STREQ(error.parameter, "articulation");
    EXPECT_EQ(error.value, static_cast<double>(bad));
    EXPECT_STREQ(bad_parameter([&] { arm_->ArtSpeed(bad, 50.0); }).parameter, "articulation");
  }
}

TEST_F(Refusals, DriveBeyondRangeAndSpeed) {
  auto error = limit_exceeded([&] { arm_->Drive(0, 170.0, 10.0); });
  EXPECT_EQ(error.articulation, 0);
  EXPECT_NEAR(error.value, before_[0] + 170.0, 1e-6);
  EXPECT_NEAR(error.lower, -90.0, 1e-6);
  EXPECT_NEAR(error.upper, 90.0, 1e-6);
  error = limit_exceeded([&] { arm_->Drive(0, 1.0, 1e4); });
  EXPECT_STREQ(error.quantity, "speed");
  EXPECT_EQ(error.value, 1e4);
  EXPECT_GT(error.upper, 0.0);
  bad_parameter([&] { arm_->Drive(0, 1.0, 0.0); });
  bad_parameter([&] { arm_->Drive(0, 1.0, -10.0); });
}

TEST_F(Refusals, JointTargets) {
  Corbot::JointCoord target;
  target.length(3);
  for (CORBA::ULong i = 0; i < 3; ++i) target[i] = 0.0;
  EXPECT_STREQ(bad_parameter([&] { arm_->MoveJoints(target, 0.0); }).parameter, "target");
  target.length(4);
  target[3] = 0.0;
  target[2] = kNan;
  bad_parameter([&] { arm_->MoveJoints(target, 0.0); });
  target[2] = 1000.0;
  EXPECT_EQ(limit_exceeded([&] { arm_->MoveJoints(target, 0.0); }).articulation, 2);
}

TEST_F(Refusals, OutOfReachAndInsideTheBase) {
  auto error = unreachable([&] { arm_->Move(0.5, 0.0, 0.1, 0.0, 0.0); });
  EXPECT_EQ(error.target.x, 0.5);
  EXPECT_EQ(error.target.z, 0.1);
  unreachable([&] { arm_->MoveS(0.2, 0.0, 0.9, 0.0, 0.0); });
  EXPECT_NE(raised_by([&] { arm_->Move(0.0, 0.0, 0.03, 0.0, 0.0); }), "") << "inside the base";
  EXPECT_NE(raised_by([&] { arm_->Move(0.01, 0.0, 0.06, 0.0, 0.0); }), "");
}

TEST_F(Refusals, ALineWhoseMiddleIsOutOfReach) {
  // Both ends are within reach; the chord between them leads past the base, where the arm cannot go.
  arm_->Move(0.05, 0.24, 0.12, 0.0, 0.0);
  before_ = arm_->ArtiCoord();
  const std::string raised = raised_by([&] { arm_->MoveS(0.05, -0.24, 0.12, 0.0, 0.0); });
  EXPECT_TRUE(raised == "Unreachable" || raised == "LimitExceeded") << raised;
  arm_->Move(0.05, -0.24, 0.12, 0.0, 0.0);  // but the end itself is reached
  before_ = arm_->ArtiCoord();
}

TEST_F(Refusals, ArcsThatAreNone) {
  bad_parameter([&] { arm_->MoveC({0.20, 0.0, 0.10}, {0.21, 0.0, 0.10}, {0.22, 0.0, 0.10}); });
  bad_parameter([&] { arm_->MoveC({0.20, 0.0, 0.10}, {0.20, 0.0, 0.10}, {0.22, 0.0, 0.10}); });
  bad_parameter([&] { arm_->MoveC({0.20, 0.0, 0.10}, {0.21, 0.01, 0.10}, {0.20, 0.0, 0.10}); });
  bad_parameter([&] { arm_->MoveC({0.20, 0.0, 0.10}, {0.20, 0.0, 0.10}, {0.20, 0.0, 0.10}); });
}

TEST_F(Refusals, AnArcThatLeavesTheWorkspaceMovesNothingEither) {
  // The line to P1 would be possible; all of the call is refused.
  EXPECT_NE(raised_by([&] { arm_->MoveC({0.20, -0.03, 0.10}, {0.60, 0.0, 0.10}, {0.20, 0.03, 0.10}); }), "");
}

TEST_F(Refusals, UnknownTickets) {
  EXPECT_STREQ(bad_parameter([&] { Corbot::MotionInfo_var info = arm_->Progress(999999); }).parameter, "id");
  EXPECT_STREQ(bad_parameter([&] { Corbot::MotionInfo_var info = arm_->Wait(0, 0.0); }).parameter, "id");
}

TEST_F(Refusals, QueueFull) {
  // The profile's queue is 16 motions.
  std::vector<Corbot::Ticket> tickets;
  const std::string raised = raised_by([&] {
    for (int i = 0; i < 17; ++i) tickets.push_back(arm_->StartDelay(5.0));
  });
  EXPECT_EQ(raised, "QueueFull");
  EXPECT_EQ(tickets.size(), 16u);
  try {
    (void)arm_->StartReady();
    ADD_FAILURE() << "accepted";
  } catch (const Corbot::QueueFull& error) {
    EXPECT_EQ(error.capacity, 16);
  }
  arm_->Stop();
  for (const Corbot::Ticket ticket : tickets) {
    Corbot::MotionInfo_var info = arm_->Progress(ticket);
    EXPECT_EQ(info->state, Corbot::MotionStopped);
  }
}

}  // namespace
}  // namespace corbot::test
