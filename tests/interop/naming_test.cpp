// SPDX-License-Identifier: Apache-2.0
// Robots/<name>.Robot in a naming service that comes and goes.
#include <signal.h>

#include <filesystem>
#include <omniORB4/Naming.hh>

#include <fmt/core.h>

#include "support/robot_rig.h"

namespace corbot::test {
namespace {

class Naming : public RobotRig {
 protected:
  void SetUp() override {
    naming_port_ = free_port();
    naming_ = fmt::format("corbaloc::127.0.0.1:{}/NameService", naming_port_);
    logs_ = fmt::format("{}/{}", CORBOT_SCRATCH_DIR, unique_name("naming"));
  }
  void TearDown() override {
    RobotRig::TearDown();
    service_.reset();
    std::filesystem::remove_all(logs_);
  }
  void start_service() {
    std::filesystem::remove_all(logs_);  // a new service, that knows of nothing
    std::filesystem::create_directories(logs_);
    service_ = std::make_unique<Process>(std::vector<std::string>{
        "omniNames", "-start", std::to_string(naming_port_), "-logdir", logs_, "-ORBendPoint",
        fmt::format("giop:tcp:127.0.0.1:{}", naming_port_), "-errlog", logs_ + "/errors"});
    ASSERT_TRUE(wait_until(within(30), [&] {
      return raised_by([&] { CORBA::Object_var found = resolve("nobody"); }) == "NotFound";
    }));
  }
  void kill_service() {
    service_->signal(SIGKILL);
    ASSERT_TRUE(service_->wait(within(10)));
  }
  /// Starts the robot, told of the naming service.
  void start_robot() {
    name_ = unique_name("rig");
    port_ = free_port();
    reference_ = fmt::format("corbaloc::127.0.0.1:{}/{}", port_, name_);
    start_rt();
    if (!HasFatalFailure()) start_servant({"--naming", naming_});
    if (!HasFatalFailure()) arm_ = connect();
  }
  CORBA::Object_ptr resolve(const std::string& robot) {
    CORBA::Object_var object = orb()->string_to_object(naming_.c_str());
    CosNaming::NamingContext_var root = CosNaming::NamingContext::_narrow(object);
    CosNaming::Name path;
    path.length(2);
    path[0].id = CORBA::string_dup("Robots");
    path[0].kind = CORBA::string_dup("");
    path[1].id = CORBA::string_dup(robot.c_str());
    path[1].kind = CORBA::string_dup("Robot");
    return root->resolve(path);
  }
  /// The robot is found by its name and answers.
  bool answers_by_name() {
    return raised_by([&] {
             CORBA::Object_var object = resolve(name_);
             Corbot::Arm_var arm = Corbot::Arm::_narrow(object);
             (void)arm->DoF();
           }) == "";
  }

  int naming_port_ = 0;
  std::string naming_;
  std::string logs_;
  std::unique_ptr<Process> service_;
};

TEST_F(Naming, BindsAndUnbindsAtTheEnd) {
  start_service();
  start_robot();
  ASSERT_TRUE(wait_until(within(30), [&] { return answers_by_name(); })) << servant_->errors();
  arm_ = Corbot::Arm::_nil();
  ASSERT_EQ(servant_->terminate(), 0);
  servant_.reset();
  EXPECT_EQ(raised_by([&] { CORBA::Object_var found = resolve(name_); }), "NotFound");
}

TEST_F(Naming, GoesOnWithoutAServiceAndFindsItLater) {
  start_robot();
  arm_->Ready();
  start_service();
  ASSERT_TRUE(wait_until(within(30), [&] { return answers_by_name(); })) << servant_->errors();
}

TEST_F(Naming, BindsAgainInARestartedService) {
  start_service();
  start_robot();
  ASSERT_TRUE(wait_until(within(30), [&] { return answers_by_name(); })) << servant_->errors();
  kill_service();
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
  start_servant({"--naming", naming_});
  ASSERT_TRUE(wait_until(within(30), [&] { return answers_by_name(); })) << servant_->errors();
}

TEST_F(Naming, UnbindsWhatAKilledServantLeftBound) {
  start_service();
  start_robot();
  ASSERT_TRUE(wait_until(within(30), [&] { return answers_by_name(); }));
  servant_->signal(SIGKILL);
  ASSERT_TRUE(servant_->wait(within(10)));
  start_servant({"--naming", naming_});  // at the same address: the name it finds is its own already
  ASSERT_TRUE(wait_until(within(30), [&] { return answers_by_name(); })) << servant_->errors();
  arm_ = Corbot::Arm::_nil();
  ASSERT_EQ(servant_->terminate(), 0);
  servant_.reset();
  EXPECT_EQ(raised_by([&] { CORBA::Object_var found = resolve(name_); }), "NotFound");
}

}  // namespace
}  // namespace corbot::test
