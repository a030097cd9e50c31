// SPDX-License-Identifier: Apache-2.0
// Cuts the connection of a motion's call after the request has arrived and before the reply. The motion runs
// once, and its caller gets an error. A client's ORB that sent the call again would move the arm twice.
#include <filesystem>

#include <fmt/core.h>

#include "interop/matrix_client.h"
#include "support/cut_proxy.h"
#include "support/ior.h"
#include "support/paths.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

class AtMostOnce : public RobotRig, public ::testing::WithParamInterface<ClientKind> {
 protected:
  void SetUp() override {
    if (const std::string why = client_.prepare(GetParam()); !why.empty()) GTEST_SKIP() << "skipped: " << why;
    RobotRig::SetUp();
    if (HasFatalFailure()) return;
    proxy_ = std::make_unique<CutProxy>(port_);
    client_.start(fmt::format("{}/{}", CORBOT_SCRATCH_DIR, name_));
    ASSERT_EQ(client_.ask(fmt::format("connect corbaloc::1.2@127.0.0.1:{}/{}", proxy_->port(), name_)), "ok");
    EXPECT_EQ(client_.ask("get DoF"), "ok 4");  // some ask the server for the object first, and once
  }
  void TearDown() override {
    client_.stop();
    if (proxy_) {
      EXPECT_GT(proxy_->replies(), 0);
      EXPECT_EQ(proxy_->forwards(), 0) << "whose connection is lost may send a call again";
    }
    proxy_.reset();
    if (rt_) RobotRig::TearDown();
  }

  bool has_ticket(Corbot::Ticket id) {
    return raised_by([&] { Corbot::MotionInfo_var info = arm_->Progress(id); }).empty();
  }
  /// Cuts the connection as soon as the servant has accepted the motion of `call`. Returns the client's
  /// outcome.
  std::string cut_off(const std::string& call) {
    Corbot::Ticket next = 1;
    while (has_ticket(next)) ++next;
    proxy_->hold_replies();
    EXPECT_EQ(client_.ask("begin cut " + call), "ok");
    EXPECT_TRUE(wait_until(within(30), [&] { return has_ticket(next); }))
        << "the servant has got no " << call;
    proxy_->cut();
    const std::string heard = client_.ask("end cut");
    EXPECT_TRUE(heard.starts_with("exception SYSTEM")) << call << ": " << heard;
    // A request that was sent again would be here before the answer of this one.
    EXPECT_EQ(client_.ask("get DoF"), "ok 4") << "after " << call;
    EXPECT_TRUE(wait_until(within(30),
                           [&] {
                             Corbot::MotionInfo_var info = arm_->Progress(next);
                             return info->state == Corbot::MotionDone;
                           }))
        << call << ": a motion completes when its caller is gone";
    EXPECT_FALSE(has_ticket(next + 1)) << call << ": carried out twice";
    return heard;
  }
  double joint_0() {
    Corbot::JointCoord_var joints = arm_->ArtiCoord();
    return joints[0];
  }

  MatrixClient client_;
  std::unique_ptr<CutProxy> proxy_;
};

TEST_P(AtMostOnce, AMotionThatIsWaitedFor) {
  fmt::print("heard: {}\n", cut_off("Drive 0 20 60"));
  EXPECT_NEAR(joint_0(), 20.0, 1e-6);
}

TEST_P(AtMostOnce, AMotionAfterAConnectionWasLostBefore) {
  // The client finds its connection gone and opens another. JacORB may first wait its 20 s for a reply.
  proxy_->cut();
  EXPECT_TRUE(wait_until(within(120), [&] { return client_.ask("get DoF") == "ok 4"; }));
  fmt::print("heard: {}\n", cut_off("Drive 0 20 60"));
  EXPECT_NEAR(joint_0(), 20.0, 1e-6);
}

TEST_P(AtMostOnce, AMotionThatIsStarted) {
  fmt::print("heard: {}\n", cut_off("StartDrive 0 20 60"));
  EXPECT_NEAR(joint_0(), 20.0, 1e-6);
}

TEST_P(AtMostOnce, AMotionBesideThreeCallsThatWait) {
  for (int i = 0; i < 3; ++i) ASSERT_EQ(client_.ask(fmt::format("begin wait{} Delay 0.2", i)), "ok");
  ASSERT_TRUE(wait_until(within(30), [&] { return has_ticket(3); }));
  fmt::print("heard: {}\n", cut_off("Drive 0 20 60"));
  for (int i = 0; i < 3; ++i) (void)client_.ask(fmt::format("end wait{}", i));
  EXPECT_NEAR(joint_0(), 20.0, 1e-6);
}

TEST_P(AtMostOnce, AMotionUnderExclusiveControl) {
  Corbot::Arm_var control = arm_->Acquire("matrix", 600.0);
  CORBA::String_var text = client_orb()->object_to_string(control);
  Ior through_proxy = parse_ior(text.in());
  through_proxy.port = proxy_->port();
  ASSERT_EQ(client_.ask("connect " + to_string(through_proxy)), "ok");
  EXPECT_EQ(client_.ask("get DoF"), "ok 4");
  fmt::print("heard: {}\n", cut_off("Drive 0 20 60"));
  EXPECT_NEAR(joint_0(), 20.0, 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Clients, AtMostOnce, ::testing::ValuesIn(client_kinds()),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace corbot::test
