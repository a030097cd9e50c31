// SPDX-License-Identifier: Apache-2.0
#include "support/robot_rig.h"
#include "support/paths.h"
#include "support/ports.h"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <sstream>

#include <fmt/core.h>

namespace corbot::test {

namespace {

/// The command that runs the servant: CORBOT_TEST_WRAPPER, for example valgrind and its options.
std::vector<std::string> wrapper() {
  const char* text = std::getenv("CORBOT_TEST_WRAPPER");
  std::istringstream words(text != nullptr ? text : "");
  return {std::istream_iterator<std::string>(words), {}};
}

}  // namespace

CORBA::ORB_ptr client_orb() {
  static const CORBA::ORB_var instance = [] {
    int argc = 0;
    return CORBA::ORB_init(argc, nullptr);
  }();
  return instance;
}

void RobotRig::SetUp() {
  take_name("rig");
  start();
  if (HasFatalFailure()) return;
  ASSERT_TRUE(wait_for(Corbot::Standby)) << servant_->errors() << rt_->errors();
}

void RobotRig::TearDown() {
  arm_ = Corbot::Arm::_nil();
  if (servant_) {
    EXPECT_EQ(servant_->terminate(), 0) << servant_->errors();
  }
  if (rt_) {
    EXPECT_EQ(rt_->terminate(), 0) << rt_->errors();
  }
  EXPECT_FALSE(channel_exists(name_)) << channel_path(name_) << " was left behind";
}

void RobotRig::take_name(const std::string& stem) {
  name_ = unique_name(stem);
  port_ = free_port();
  reference_ = fmt::format("corbaloc::127.0.0.1:{}/{}", port_, name_);
}

void RobotRig::start() {
  start_rt();
  if (!HasFatalFailure()) start_servant();
  if (!HasFatalFailure()) arm_ = connect();
}

void RobotRig::start_rt(const std::vector<std::string>& more) {
  std::vector<std::string> command{std::string(CORBOT_BIN_DIR) + "/corbot-rt", profile_, "--name", name_};
  command.insert(command.end(), more.begin(), more.end());
  for (int tries = 1;; ++tries) {
    rt_ = std::make_unique<Process>(command);
    if (rt_->wait_line("ready", within(30))) return;
    // On a busy machine the bytes of a pseudo-terminal can stall for seconds. The task is then started again,
    // as by a supervisor. A stop input that does not answer counts as pressed.
    const bool is_starved = rt_->errors().find("no answer: is the controller powered") != std::string::npos ||
                            rt_->errors().find("the emergency stop was pressed") != std::string::npos;
    ASSERT_TRUE(is_starved && tries < 5) << rt_->errors();
    (void)rt_->terminate();
  }
}

void RobotRig::start_servant(const std::vector<std::string>& more) {
  std::vector<std::string> command = wrapper();
  command.insert(command.end(), {servant_program(CORBOT_BIN_DIR), profile_, "--name", name_, "--endpoint",
                                 fmt::format("127.0.0.1:{}", port_)});
  command.insert(command.end(), more.begin(), more.end());
  servant_ = std::make_unique<Process>(command);
  ASSERT_TRUE(servant_->wait_line("ready", within(30))) << servant_->errors();
}

Corbot::Arm_var RobotRig::connect() const { return connect(reference_); }

Corbot::Arm_var RobotRig::connect(const std::string& reference) const {
  CORBA::Object_var object = client_orb()->string_to_object(reference.c_str());
  return Corbot::Arm::_narrow(object);
}

bool RobotRig::wait_for(Corbot::RobotState state, double seconds) {
  return wait_until(within(seconds), [&] {
    try {
      return arm_->Status() == state;
    } catch (const CORBA::SystemException&) {
      return false;  // the connection to a servant that died; the next call makes a new one
    }
  });
}

std::vector<Corbot::AlarmInfo> RobotRig::alarms() const {
  constexpr CORBA::Long kOverrun = 140;
  Corbot::AlarmList_var list = arm_->Alarms();
  std::vector<Corbot::AlarmInfo> kept;
  for (CORBA::ULong i = 0; i < list->length(); ++i)
    if (list[i].code != kOverrun) kept.push_back(list[i]);
  return kept;
}

void RobotRig::expect_no_motion_accepted() {
  Corbot::JointCoord target;
  target.length(4);
  for (CORBA::ULong i = 0; i < 4; ++i) target[i] = 1.0;
  EXPECT_EQ(raised_by([&] { arm_->Move(0.2, 0, 0.1, 0, 0); }), "NotReady");
  EXPECT_EQ(raised_by([&] { arm_->MoveS(0.2, 0, 0.1, 0, 0); }), "NotReady");
  EXPECT_EQ(raised_by([&] { arm_->MoveC({0.2, -0.03, 0.1}, {0.22, 0, 0.1}, {0.2, 0.03, 0.1}); }), "NotReady");
  EXPECT_EQ(raised_by([&] { arm_->Drive(0, 1, 1); }), "NotReady");
  EXPECT_EQ(raised_by([&] { arm_->MoveJoints(target, 0); }), "NotReady");
  EXPECT_EQ(raised_by([&] { arm_->Ready(); }), "NotReady");
  EXPECT_EQ(raised_by([&] { arm_->Delay(1); }), "NotReady");
  EXPECT_EQ(raised_by([&] { arm_->Open(); }), "NotReady");
  EXPECT_EQ(raised_by([&] { arm_->Close(); }), "NotReady");
}

double distance_deg(const Corbot::JointCoord& a, const Corbot::JointCoord& b) {
  double largest = a.length() == b.length() ? 0.0 : HUGE_VAL;
  for (CORBA::ULong i = 0; i < std::min(a.length(), b.length()); ++i)
    largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

}  // namespace corbot::test
