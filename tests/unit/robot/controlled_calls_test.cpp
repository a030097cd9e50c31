// SPDX-License-Identifier: Apache-2.0
// Exclusive control where the calls come in: what is refused, what is free, what becomes of the arm when
// control ends; and what the audit log says of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "robot/alarm_log.h"
#include "robot/called_robot.h"

namespace corbot::test::controlled_calls_test {
namespace {

class ControlledCalls : public CalledRobot {
 protected:
  std::vector<nlohmann::json> log() {
    std::ifstream stream(std::filesystem::path(directory_) / (name_ + ".audit"));
    std::vector<nlohmann::json> lines;
    for (std::string line; std::getline(stream, line);) lines.push_back(nlohmann::json::parse(line));
    return lines;
  }
  std::string text_of(const corbot_error& error) { return error.text; }
  /// With the shortest lease, which the machine may stand still for between any two calls; what follows is
  /// tried until it gets done within it. The key; empty: another try.
  std::string acquire_briefly() {
    char key[CORBOT_KEY] = "";
    const corbot_caller anyone = caller(public_);
    (void)corbot_robot_acquire(called_.get(), &anyone, "cell", 0.5, key, &error_);
    return key;
  }
  bool begin_long_motion_briefly() {
    const std::string key = acquire_briefly();
    return !key.empty() && drive(key, 80.0, 2.0) == CORBOT_OK;
  }
  using Call = std::function<corbot_status(const corbot_caller*, corbot_error*)>;
  /// The calls that are refused to all but the holder.
  std::map<std::string, Call> calls_of_a_holder() {
    corbot_robot* const robot = called_.get();
    const double p_m[3] = {0.2, 0.0, 0.2};
    const double joints_deg[4] = {0.0, 60.0, 60.0, 0.0};
    const corbot_tool_pose pose = {{0.0, 0.0, -0.01}, {1.0, 0.0, 0.0, 0.0}};
    const corbot_tool_pose frame{{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}};
    return {
        {"Move",
         [=, this](auto* c, auto* e) { return corbot_robot_move(robot, c, p_m, 0.0, 0.0, &ticket_, e); }},
        {"MoveS",
         [=, this](auto* c, auto* e) { return corbot_robot_move_s(robot, c, p_m, 0.0, 0.0, &ticket_, e); }},
        {"MoveC",
         [=, this](auto* c, auto* e) { return corbot_robot_move_c(robot, c, p_m, p_m, p_m, &ticket_, e); }},
        {"MoveJoints",
         [=, this](auto* c, auto* e) {
           return corbot_robot_move_joints(robot, c, joints_deg, 4, 0.0, &ticket_, e);
         }},
        {"Drive",
         [=, this](auto* c, auto* e) { return corbot_robot_drive(robot, c, 0, 1.0, 10.0, &ticket_, e); }},
        {"Ready", [=, this](auto* c, auto* e) { return corbot_robot_ready(robot, c, &ticket_, e); }},
        {"Delay", [=, this](auto* c, auto* e) { return corbot_robot_delay(robot, c, 0.01, &ticket_, e); }},
        {"Open", [=, this](auto* c, auto* e) { return corbot_robot_open_gripper(robot, c, &ticket_, e); }},
        {"Close", [=, this](auto* c, auto* e) { return corbot_robot_close_gripper(robot, c, &ticket_, e); }},
        {"Cancel", [=, this](auto* c, auto* e) { return corbot_robot_cancel(robot, c, ticket_, e); }},
        {"Pause", [=](auto* c, auto* e) { return corbot_robot_pause(robot, c, e); }},
        {"Resume", [=](auto* c, auto* e) { return corbot_robot_resume(robot, c, e); }},
        {"Override", [=](auto* c, auto* e) { return corbot_robot_set_override(robot, c, 50.0, e); }},
        {"Speed", [=](auto* c, auto* e) { return corbot_robot_speed(robot, c, 50.0, e); }},
        {"ArtSpeed", [=](auto* c, auto* e) { return corbot_robot_art_speed(robot, c, 0, 50.0, e); }},
        {"AllSpeed", [=](auto* c, auto* e) { return corbot_robot_all_speed(robot, c, 50.0, e); }},
        {"SetToolFrame", [=](auto* c, auto* e) { return corbot_robot_set_tool_frame(robot, c, &frame, e); }},
        {"SetBaseFrame", [=](auto* c, auto* e) { return corbot_robot_set_base_frame(robot, c, &frame, e); }},
        {"ResetFrames", [=](auto* c, auto* e) { return corbot_robot_reset_frames(robot, c, e); }},
        {"SetToolPitch", [=](auto* c, auto* e) { return corbot_robot_set_tool_pitch(robot, c, -30.0, e); }},
        {"MovePose",
         [=, this](auto* c, auto* e) { return corbot_robot_move_pose(robot, c, &pose, 0.0, &ticket_, e); }},
        {"MovePoseS",
         [=, this](auto* c, auto* e) { return corbot_robot_move_pose_s(robot, c, &pose, 0.0, &ticket_, e); }},
        {"MoveRelative",
         [=, this](auto* c, auto* e) {
           return corbot_robot_move_relative(robot, c, &pose, CORBOT_OFFSET_IN_TOOL, 0.0, &ticket_, e);
         }},
        {"MoveRelativeS",
         [=, this](auto* c, auto* e) {
           return corbot_robot_move_relative_s(robot, c, &pose, CORBOT_OFFSET_IN_BASE, 0.0, &ticket_, e);
         }},
        {"SetToolOrientation",
         [=](auto* c, auto* e) { return corbot_robot_set_tool_orientation(robot, c, pose.orientation, e); }},
        {"ResetToolOrientation",
         [=](auto* c, auto* e) { return corbot_robot_reset_tool_orientation(robot, c, e); }},
    };
  }
};

TEST_F(ControlledCalls, OnlyTheHolderMovesAndSets) {
  open_at_rest();
  const std::string key = acquire("cell", kLong_s);
  corbot_robot* const robot = called_.get();
  const std::map<std::string, Call> calls = calls_of_a_holder();
  corbot_caller anyone = caller(public_);
  const std::string wrong(32, 'f');
  corbot_caller guesser = caller(wrong);
  for (const auto& [name, call] : calls) {
    if (name == "MoveC") continue;  // the points are on one line: refused before all else
    SCOPED_TRACE(name);
    for (const corbot_caller* other : {static_cast<const corbot_caller*>(nullptr), &std::as_const(anyone)}) {
      corbot_error error{};
      ASSERT_EQ(call(other, &error), CORBOT_NOT_READY);
      ASSERT_NE(text_of(error).find("'cell' has control of the arm, for another"), std::string::npos)
          << error.text;
    }
    corbot_error error{};
    ASSERT_EQ(call(&guesser, &error), CORBOT_NOT_READY);
    ASSERT_NE(text_of(error).find("control has ended"), std::string::npos) << error.text;
  }
  EXPECT_EQ(corbot_robot_state(robot), CORBOT_STATE_STANDBY) << "nothing of it was begun";
  EXPECT_EQ(corbot_robot_override(robot), 100.0);
  EXPECT_EQ(corbot_robot_tool_pitch(robot), 0.0);
  EXPECT_EQ(corbot_robot_paused(robot), 0);

  corbot_caller holder = caller(key);
  ASSERT_EQ(drive(key, 1.0), CORBOT_OK) << error_.text;
  ASSERT_EQ(end_of(ticket_).state, CORBOT_MOTION_DONE);
  for (const char* name : {"Speed", "AllSpeed", "ArtSpeed", "SetToolPitch", "SetToolFrame", "SetBaseFrame",
                           "ResetFrames", "Override", "Pause", "Resume", "Delay", "Cancel"}) {
    corbot_error error{};
    EXPECT_EQ(calls.at(name)(&holder, &error), CORBOT_OK) << name << error.text;
  }
  EXPECT_EQ(corbot_robot_tool_pitch(robot), -30.0);
}

TEST_F(ControlledCalls, ReadsWaitsStopHoldAndClearAreFree) {
  open_at_rest();
  const std::string key = acquire("cell", kLong_s);
  corbot_holder holder{};
  corbot_robot_holder(called_.get(), &holder);
  EXPECT_STREQ(holder.who, "cell");
  EXPECT_GT(holder.left_s, kLong_s - 60.0);
  ASSERT_EQ(drive(key, 60.0, 5.0), CORBOT_OK);
  corbot_caller anyone = caller(public_);
  corbot_motion_info info{};
  EXPECT_EQ(corbot_robot_wait(called_.get(), ticket_, 0.0, nullptr, &info, &error_), CORBOT_OK);
  EXPECT_EQ(corbot_robot_stop(called_.get(), &anyone, &error_), CORBOT_OK) << error_.text;
  EXPECT_EQ(end_of(ticket_).state, CORBOT_MOTION_STOPPED);
  EXPECT_EQ(corbot_robot_stop_and_hold(called_.get(), &anyone, &error_), CORBOT_OK) << error_.text;
  EXPECT_EQ(corbot_robot_clear(called_.get(), &anyone, &error_), CORBOT_OK) << error_.text;
  corbot_robot_holder(called_.get(), &holder);
  EXPECT_STREQ(holder.who, "cell") << "a Stop takes control from nobody";
}

TEST_F(ControlledCalls, ReleaseStopsTheArmOnItsPathAndFreesIt) {
  open_at_rest();
  const std::string key = acquire("cell", kLong_s);
  ASSERT_EQ(drive(key, 60.0, 5.0), CORBOT_OK);
  ASSERT_TRUE(wait_until(within(30), [&] { return joint_0_deg() > 2.0; }));
  const corbot_caller holder = caller(key);
  ASSERT_EQ(corbot_robot_release(called_.get(), &holder, &error_), CORBOT_OK) << error_.text;
  EXPECT_EQ(end_of(ticket_).state, CORBOT_MOTION_STOPPED);
  EXPECT_EQ(corbot_robot_state(called_.get()), CORBOT_STATE_STANDBY)
      << "at rest when it returns, and no Error";
  EXPECT_LT(joint_0_deg(), 59.0);
  EXPECT_EQ(drive(key, 1.0), CORBOT_NOT_READY);
  EXPECT_EQ(drive(public_, 1.0), CORBOT_OK) << error_.text;
}

TEST_F(ControlledCalls, ALeaseThatRunsOutStopsTheArmOnItsPath) {
  open_at_rest();
  ASSERT_TRUE(wait_until(within(60), [&] { return begin_long_motion_briefly(); })) << error_.text;
  EXPECT_EQ(end_of(ticket_).state, CORBOT_MOTION_STOPPED);
  ASSERT_TRUE(wait_until(within(30), [&] { return drive(public_, 1.0) == CORBOT_OK; })) << error_.text;
  EXPECT_LT(joint_0_deg(), 79.0);
}

TEST_F(ControlledCalls, AWaitOfTheHolderKeepsTheLease) {
  open_at_rest();
  EXPECT_TRUE(wait_until(within(60), [&] {
    const std::string key = acquire_briefly();
    const corbot_caller holder = caller(key);
    return !key.empty() && corbot_robot_delay(called_.get(), &holder, 1.5, &ticket_, &error_) == CORBOT_OK &&
           corbot_robot_finish(called_.get(), ticket_, &holder, &error_) == CORBOT_OK;
  })) << error_.text;
}

/// A call that was admitted just before: what it planned is older than the stop of the Release.
TEST_F(ControlledCalls, NothingOfTheHolderBeginsAfterItsRelease) {
  open_at_rest();
  for (int round = 0; round < 15; ++round) {
    const std::string key = acquire("cell", kLong_s);
    std::atomic<int> accepted{0};
    std::vector<std::thread> clients;
    for (int i = 0; i < 3; ++i) {
      clients.emplace_back([&, sign = (round + i) % 2 == 0 ? 1.0 : -1.0] {
        const corbot_caller holder = caller(key);
        corbot_ticket ticket = 0;
        corbot_status status = CORBOT_OK;
        corbot_error error{};
        do {
          status = corbot_robot_drive(called_.get(), &holder, 0, 0.5 * sign, 40.0, &ticket, &error);
          if (status == CORBOT_OK) ++accepted;
        } while (std::string(error.text).find("control has ended") == std::string::npos);
      });
    }
    EXPECT_TRUE(wait_until(within(30), [&] { return accepted > 4; }));
    const corbot_caller holder = caller(key);
    ASSERT_EQ(corbot_robot_release(called_.get(), &holder, &error_), CORBOT_OK) << error_.text;
    const double rest_deg = joint_0_deg();
    for (std::thread& client : clients) client.join();
    ASSERT_TRUE(until_state(CORBOT_STATE_STANDBY));
    EXPECT_EQ(joint_0_deg(), rest_deg);
  }
}

TEST_F(ControlledCalls, TheHolderOutlivesItsServant) {
  open_at_rest();
  const std::string key = acquire("cell", kLong_s);
  restart_servant();
  EXPECT_EQ(drive(public_, 1.0), CORBOT_NOT_READY);
  EXPECT_NE(text_of(error_).find("'cell' has control"), std::string::npos) << error_.text;
  EXPECT_EQ(drive(key, 1.0), CORBOT_OK) << error_.text;
  const corbot_caller holder = caller(key);
  EXPECT_EQ(corbot_robot_release(called_.get(), &holder, &error_), CORBOT_OK) << error_.text;
  restart_servant();
  EXPECT_EQ(drive(key, 1.0), CORBOT_NOT_READY) << "an ended control stays so";
  EXPECT_EQ(drive(public_, 1.0), CORBOT_OK) << error_.text;
}

TEST_F(ControlledCalls, ALeaseThatRanOutWithoutAServantStopsTheArmWhenThereIsOne) {
  Snapshot now{};
  ASSERT_TRUE(wait_until(within(60), [&] {
    called_.reset();
    open_at_rest();
    if (!begin_long_motion_briefly()) return false;
    called_.reset();
    std::this_thread::sleep_for(std::chrono::milliseconds(700));
    return last_snapshot(task_->task(), now) && now.state == RtState::kMoving;
  })) << "the motion outlives its servant";
  open();
  ASSERT_TRUE(wait_until(
      within(30), [&] { return last_snapshot(task_->task(), now) && now.state == RtState::kStandby; }));
  EXPECT_LT(now.position_q[0], 1.3) << "on its path, before its end";
  ASSERT_TRUE(wait_until(within(30), [&] { return drive(public_, 1.0) == CORBOT_OK; })) << error_.text;
}

TEST_F(ControlledCalls, MotionsOfOthersAreLeftAloneAndNobodyTakesControlMeanwhile) {
  open_at_rest();
  for (int i = 0; i < 3; ++i) ASSERT_EQ(drive(public_, 10.0, 2.0), CORBOT_OK) << error_.text;
  const auto refused = [&] {
    char key[CORBOT_KEY];
    EXPECT_EQ(corbot_robot_acquire(called_.get(), nullptr, "cell", kLong_s, key, &error_), CORBOT_NOT_READY);
    corbot_holder holder{};
    corbot_robot_holder(called_.get(), &holder);
    EXPECT_STREQ(holder.who, "");
    return text_of(error_);
  };
  EXPECT_EQ(refused(),
            "3 motions of others are still under way: call again when the arm is at rest, or Stop it");
  restart_servant();
  EXPECT_EQ(refused(),
            "3 motions of others are still under way: call again when the arm is at rest, or Stop it");
  corbot_motion_info info{};
  ASSERT_EQ(corbot_robot_wait(called_.get(), ticket_, 0.0, nullptr, &info, &error_), CORBOT_OK);
  EXPECT_EQ(info.state, CORBOT_MOTION_QUEUED) << "nothing was stopped";
  const corbot_caller anyone = caller(public_);
  ASSERT_EQ(corbot_robot_stop(called_.get(), &anyone, &error_), CORBOT_OK) << error_.text;
  const std::string key = acquire("cell", kLong_s);
  EXPECT_EQ(drive(key, 1.0), CORBOT_OK) << error_.text;
}

/// Others call at the same moment: what was admitted before is waited for, and then it is pending.
TEST_F(ControlledCalls, NothingOfOthersBeginsAfterAnAcquire) {
  open_at_rest();
  for (int round = 0; round < 15; ++round) {
    std::vector<std::thread> others;
    for (int i = 0; i < 3; ++i) {
      others.emplace_back([&, sign = (round + i) % 2 == 0 ? 1.0 : -1.0] {
        const corbot_caller anyone = caller(public_);
        corbot_ticket ticket = 0;
        corbot_error error{};
        (void)corbot_robot_drive(called_.get(), &anyone, 0, 0.5 * sign, 40.0, &ticket, &error);
      });
    }
    char given[CORBOT_KEY];
    ASSERT_TRUE(wait_until(within(30), [&] {
      return corbot_robot_acquire(called_.get(), nullptr, "cell", kLong_s, given, &error_) == CORBOT_OK;
    })) << error_.text;
    const double rest_deg = joint_0_deg();
    const std::string key = given;
    const corbot_caller holder = caller(key);
    EXPECT_EQ(corbot_robot_delay(called_.get(), &holder, 0.05, &ticket_, &error_), CORBOT_OK) << error_.text;
    EXPECT_EQ(corbot_robot_finish(called_.get(), ticket_, &holder, &error_), CORBOT_OK) << error_.text;
    EXPECT_EQ(joint_0_deg(), rest_deg);
    EXPECT_EQ(corbot_robot_release(called_.get(), &holder, &error_), CORBOT_OK) << error_.text;
    for (std::thread& other : others) other.join();
  }
}

TEST_F(ControlledCalls, NobodyWhoIsGoneIsGivenControl) {
  open_at_rest();
  corbot_caller gone = caller(public_);
  gone.present = [](void*) { return 0; };
  char key[CORBOT_KEY];
  EXPECT_EQ(corbot_robot_acquire(called_.get(), &gone, "cell", kLong_s, key, &error_), CORBOT_NOT_READY);
  EXPECT_EQ(text_of(error_), "the connection of the caller is lost");
  corbot_holder holder{};
  corbot_robot_holder(called_.get(), &holder);
  EXPECT_STREQ(holder.who, "");
  EXPECT_EQ(drive(public_, 1.0), CORBOT_OK) << error_.text;
}

TEST_F(ControlledCalls, WithoutATaskThereIsNoControl) {
  task_.reset();
  open();
  char key[CORBOT_KEY];
  EXPECT_EQ(corbot_robot_acquire(called_.get(), nullptr, "cell", 1.0, key, &error_), CORBOT_NOT_READY);
}

TEST_F(ControlledCalls, TheLogHasCallsTheirOutcomesAndTheEndOfMotions) {
  open_at_rest();
  corbot_robot_keep_state(called_.get(), directory_.c_str(), nullptr);
  const std::string key = acquire("cell", kLong_s);
  const corbot_ticket none = ticket_;
  EXPECT_EQ(drive(public_, 1.0), CORBOT_NOT_READY);
  ASSERT_EQ(drive(key, 2.5), CORBOT_OK);
  const corbot_ticket done = ticket_;
  EXPECT_EQ(end_of(done).state, CORBOT_MOTION_DONE);
  ASSERT_EQ(drive(key, 60.0, 5.0), CORBOT_OK);
  const corbot_ticket stopped = ticket_;
  const corbot_caller anyone = caller(public_);
  ASSERT_EQ(corbot_robot_stop(called_.get(), &anyone, &error_), CORBOT_OK);
  (void)joint_0_deg();
  called_.reset();

  const std::vector<nlohmann::json> lines = log();
  const auto find = [&](const std::string& call, const std::string& outcome) {
    return std::find_if(lines.begin(), lines.end(), [&](const nlohmann::json& line) {
      return line.value("call", "") == call && line.value("outcome", "").rfind(outcome, 0) == 0;
    });
  };
  const auto acquired = find("Acquire(\"cell\", 600)", "ok");
  ASSERT_NE(acquired, lines.end());
  const auto refused = find("Drive(0, 1, 20)", "NotReady: 'cell' has control");
  ASSERT_NE(refused, lines.end());
  EXPECT_EQ((*refused)["who"], "");
  EXPECT_EQ((*refused)["from"], "127.0.0.1:40000");
  EXPECT_FALSE(refused->contains("ticket"));
  const auto accepted = find("Drive(0, 2.5, 20)", "ok");
  ASSERT_NE(accepted, lines.end());
  EXPECT_EQ((*accepted)["who"], "cell");
  EXPECT_EQ((*accepted)["ticket"], done);
  ASSERT_NE(find("Stop()", "ok"), lines.end());
  std::map<corbot_ticket, std::string> ends;
  for (const nlohmann::json& line : lines) {
    if (line.contains("end")) ends[line["ticket"]] = line["end"];
    EXPECT_EQ(line.dump().find(key), std::string::npos) << "the key is in no line";
  }
  EXPECT_EQ(ends.size(), 2u);
  EXPECT_EQ(ends[done], "done");
  EXPECT_EQ(ends[stopped].rfind("stopped", 0), 0u) << ends[stopped];
  EXPECT_EQ(none, 0u);
}

TEST_F(ControlledCalls, ALogThatCannotBeWrittenHoldsUpNoCall) {
  std::ofstream(directory_ + "/taken") << "a file";
  std::filesystem::create_symlink("/dev/full", directory_ + "/" + name_ + ".audit");
  std::size_t warnings = 0;  // those of the servant before are inherited
  for (const std::string& where : {directory_ + "/taken", directory_}) {
    ++warnings;
    open_at_rest();
    corbot_robot_keep_state(called_.get(), where.c_str(), nullptr);
    for (int i = 0; i < 10; ++i) ASSERT_EQ(drive(public_, i % 2 == 0 ? 0.1 : -0.1), CORBOT_OK) << error_.text;
    EXPECT_TRUE(wait_until(within(30), [&] { return alarms_of(kAlarmAuditLogIncomplete) == warnings; }))
        << where;
    ASSERT_TRUE(until_state(CORBOT_STATE_STANDBY));
    EXPECT_EQ(alarms_of(kAlarmAuditLogIncomplete), warnings) << "once";
    called_.reset();
  }
}

}  // namespace
}  // namespace corbot::test::controlled_calls_test
