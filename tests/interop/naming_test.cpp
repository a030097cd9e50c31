// SPDX-License-Identifier: Apache-2.0
// Robots/<name>.Robot in a naming service that comes and goes.
#include <signal.h>

#include <fmt/core.h>

#include "support/naming_service.h"
#include "support/paths.h"
#include "support/ports.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

class Naming : public RobotRig {
 protected:
  void SetUp() override { naming_port_ = free_port(); }
  void TearDown() override {
    RobotRig::TearDown();
    service_.reset();
  }
  /// A new and empty service, always at the same address.
  void start_service() { service_ = std::make_unique<NamingService>(naming_port_); }
  [[nodiscard]] std::string naming() const {
    return fmt::format("corbaloc::127.0.0.1:{}/NameService", naming_port_);
  }
  /// Starts the robot with the naming service.
  void start_robot(const std::vector<std::string>& more = {}) {
    take_name("rig");
    start_rt();
    std::vector<std::string> options{"--naming", naming()};
    options.insert(options.end(), more.begin(), more.end());
    if (!HasFatalFailure()) start_servant(options);
    if (!HasFatalFailure()) arm_ = connect();
  }
  /// The robot is found by its name and replies.
  bool answers_by_name() {
    return raised_by([&] {
             CORBA::Object_var object = service_->resolve(name_);
             Corbot::Arm_var arm = Corbot::Arm::_narrow(object);
             (void)arm->DoF();
           }) == "";
  }

  int naming_port_ = 0;
  std::unique_ptr<NamingService> service_;
};

TEST_F(Naming, BindsAndUnbindsAtTheEnd) {
  start_service();
  start_robot();
  ASSERT_TRUE(wait_until(within(30), [&] { return answers_by_name(); })) << servant_->errors();
  arm_ = Corbot::Arm::_nil();
  ASSERT_EQ(servant_->terminate(), 0);
  const std::string log = servant_->errors();
  servant_.reset();
  EXPECT_EQ(raised_by([&] { CORBA::Object_var found = service_->resolve(name_); }), "NotFound") << log;
}

TEST_F(Naming, PublishesOneAddressOnly) {
  // A client with a second address sends its call there when the connection to the first is lost.
  if (on_orbit2()) GTEST_SKIP() << "skipped: listens on one address anyway";
  const std::string path = fmt::format("{}/{}.socket", CORBOT_SCRATCH_DIR, unique_name("rig"));
  start_service();
  start_robot({"--unix", path});
  if (HasFatalFailure()) return;
  ASSERT_TRUE(wait_until(within(30), [&] { return answers_by_name(); })) << servant_->errors();
  CORBA::Object_var object = service_->resolve(name_);
  const CORBA::String_var ior = client_orb()->object_to_string(object);
  const auto contains = [&](const std::string& part) {
    std::string hex;
    for (const char c : part) hex += fmt::format("{:02x}", static_cast<unsigned char>(c));
    return std::string(ior).find(hex) != std::string::npos;
  };
  EXPECT_TRUE(contains(name_)) << ior;
  EXPECT_TRUE(contains("127.0.0.1")) << ior;
  EXPECT_FALSE(contains(path)) << ior;
}

TEST_F(Naming, RunsWithoutAServiceAndFindsItLater) {
  start_robot();
  arm_->Ready();
  start_service();
  ASSERT_TRUE(wait_until(within(30), [&] { return answers_by_name(); })) << servant_->errors();
}

TEST_F(Naming, BindsAgainInARestartedService) {
  start_service();
  start_robot();
  ASSERT_TRUE(wait_until(within(30), [&] { return answers_by_name(); })) << servant_->errors();
  service_.reset();
  arm_->Ready();
  start_service();
  ASSERT_TRUE(wait_until(within(30), [&] { return answers_by_name(); })) << servant_->errors();
}

TEST_F(Naming, ARestartedServantTakesItsNameAgain) {
  start_service();
  start_robot();
  ASSERT_TRUE(wait_until(within(30), [&] { return answers_by_name(); }));
  servant_->signal(SIGKILL);
  ASSERT_TRUE(servant_->wait(within(10)));
  port_ = free_port();  // elsewhere, so that the old reference leads nowhere
  start_servant({"--naming", naming()});
  ASSERT_TRUE(wait_until(within(30), [&] { return answers_by_name(); })) << servant_->errors();
}

TEST_F(Naming, UnbindsWhatAKilledServantLeftBound) {
  start_service();
  start_robot();
  ASSERT_TRUE(wait_until(within(30), [&] { return answers_by_name(); }));
  servant_->signal(SIGKILL);
  ASSERT_TRUE(servant_->wait(within(10)));
  start_servant({"--naming", naming()});  // at the same address: the name it finds is its own already
  ASSERT_TRUE(wait_until(within(30), [&] { return answers_by_name(); })) << servant_->errors();
  arm_ = Corbot::Arm::_nil();
  ASSERT_EQ(servant_->terminate(), 0);
  const std::string log = servant_->errors();
  servant_.reset();
  EXPECT_EQ(raised_by([&] { CORBA::Object_var found = service_->resolve(name_); }), "NotFound") << log;
}

}  // namespace
}  // namespace corbot::test
