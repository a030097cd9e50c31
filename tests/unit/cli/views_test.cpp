// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "cli/record.h"
#include "cli/run_program.h"
#include "cli/show.h"
#include "corbot/backend/backend.h"

namespace corbot::cli {

namespace {

using testing::HasSubstr;
using testing::Not;

StatusReport sample() {
  StatusReport report;
  report.name = "lynx1";
  report.address = "corbaloc::h:1/lynx1";
  report.state = Corbot::Error;
  report.joints = {10, -1e-12, 0, 5};
  report.ranges = {{-90, 90}, {-30, 130}, {0, 1}, {0, 1}};
  report.pose = {0.25, -0.1, 0.05, 10, 0, 0};
  report.gripper = Corbot::Close;
  report.override_percent = 50;
  report.active_alarms = {{121, "backend lost"}};
  report.device.backend = "ssc32";
  report.device.health = Corbot::DeviceOpen;
  report.device.positionUncertain = true;
  report.device.emergencyStop = false;
  report.servant.version = "1.2";
  report.servant.profile = "0123456789abcdef";
  report.servant.started = 1.7e9;
  return report;
}

TEST(Status, ShowsStateAlarmsAndNoMinusZero) {
  const std::string text = status_text(sample());
  EXPECT_THAT(text, HasSubstr("Error"));
  EXPECT_THAT(text, HasSubstr("corbot clear"));
  EXPECT_THAT(text, HasSubstr("121 the servo device was lost and is connected again"));
  EXPECT_THAT(text, HasSubstr("(-90 to 90)"));
  EXPECT_THAT(text, HasSubstr("closed"));
  EXPECT_THAT(text, HasSubstr("ssc32, open\n"));
  EXPECT_THAT(text, HasSubstr("UNVERIFIED, the servos may have moved"));
  EXPECT_THAT(text, HasSubstr("corbot 1.2, profile 0123456789abcdef, up since "));
  EXPECT_THAT(text, Not(HasSubstr("-0.00 ")));
  const std::string line = status_line(sample());
  EXPECT_EQ(std::count(line.begin(), line.end(), '\n'), 1);
}

TEST(Status, ThePitchOfTheNextMoveIsTold) {
  StatusReport report = sample();
  report.kind = Corbot::Anthropomorphic;
  report.pose.b = -35;
  EXPECT_THAT(status_text(report), HasSubstr("pitch     0 deg for the next move\n"));
  report.kind = Corbot::Scara;
  EXPECT_THAT(status_text(report), HasSubstr("pitch     kept by the next move\n"));
  report.tool_pitch_deg = 20;
  EXPECT_THAT(status_text(report), HasSubstr("pitch     20 deg for the next move\n"));
  report.tool_orientation = Corbot::Quaternion{1, 0, 0, 0};
  EXPECT_THAT(status_text(report), HasSubstr("pitch     that of the set orientation\n"));
}

TEST(Status, ADeviceThatIsBackNeedsAClearOnly) {
  StatusReport report = sample();
  report.active_alarms = {{121, "the servo device is lost: the line was cut; set-points are held"}};
  EXPECT_THAT(
      status_text(report),
      HasSubstr("alarm     121 the servo device was lost and is connected again: 'corbot clear' ends the "
                "Error (alarm: the servo device is lost: the line was cut; set-points are held)\n"));
  EXPECT_THAT(status_text(report), Not(HasSubstr("fix the cause")));
  report.device.health = Corbot::DeviceClosed;
  EXPECT_THAT(status_text(report), Not(HasSubstr("is back"))) << "no task";
  report.device.causeText = "no energy until Clear";
  EXPECT_THAT(status_text(report),
              AllOf(HasSubstr("is connected again: 'corbot clear'"), Not(HasSubstr("fix the cause")),
                    HasSubstr("ssc32, closed: no energy until Clear")));
  report.active_alarms.push_back({130, "emergency stop"});
  report.device.emergencyStop = true;
  EXPECT_THAT(status_text(report), HasSubstr("fix the cause"));
  report.device.emergencyStop = false;
  EXPECT_THAT(status_text(report), AllOf(HasSubstr("the cause is gone"), Not(HasSubstr("fix the cause"))));
  report.device.causeText = "";
  report.device.health = Corbot::DeviceLost;
  EXPECT_THAT(status_text(report), AllOf(HasSubstr("set-points are held\n"), HasSubstr("fix the cause")));
}

TEST(Status, AHoldIsNoFault) {
  StatusReport report = sample();
  report.active_alarms = {{133, "held"}};
  report.control.held = true;
  EXPECT_THAT(status_text(report),
              AllOf(HasSubstr("held by 'hold', no fault: 'corbot clear'"), Not(HasSubstr("faulted"))));
  report.active_alarms.push_back({131, "inherited"});
  EXPECT_THAT(status_text(report), HasSubstr("held by 'hold', as the last task ended"));
  report.active_alarms.push_back({130, "emergency stop"});
  report.device.emergencyStop = true;
  EXPECT_THAT(status_text(report), HasSubstr("fix the cause"));
  report.active_alarms = {{131, "inherited"}};
  EXPECT_THAT(status_text(report), HasSubstr("fix the cause"));
}

TEST(Status, WithoutATaskNobodyNeedsToClear) {
  StatusReport report = sample();
  report.state = Corbot::Error;
  report.active_alarms = {{150, "the real-time task is gone"}};
  EXPECT_THAT(status_text(report), AllOf(HasSubstr("no real-time task runs"), Not(HasSubstr("clear"))));
}

TEST(Status, ServosThatAreBroughtBackAreNoMotion) {
  StatusReport report = sample();
  report.state = Corbot::Waiting;
  report.device.health = Corbot::DeviceClosed;
  report.device.causeText = "its servos are being energised";
  EXPECT_THAT(status_text(report), HasSubstr("busy: the servos are being brought back"));
}

TEST(Status, APausedArmIsNotABusyOne) {
  StatusReport report = sample();
  report.state = Corbot::Waiting;
  EXPECT_THAT(status_text(report), AllOf(HasSubstr("busy: moving or delaying"), Not(HasSubstr("paused"))));
  EXPECT_THAT(status_line(report), Not(HasSubstr("paused")));
  report.paused = true;
  EXPECT_THAT(status_text(report),
              AllOf(HasSubstr("paused"), HasSubstr("corbot resume"), Not(HasSubstr("busy"))));
  EXPECT_THAT(status_line(report), HasSubstr("paused"));
  EXPECT_THAT(status_json(report), HasSubstr("\"paused\": true"));
}

TEST(Status, ShowsTheSpeedsInForce) {
  StatusReport report = sample();
  EXPECT_THAT(status_text(report), HasSubstr("speed     not known"));
  EXPECT_THAT(status_json(report), HasSubstr("\"speed_percent\": null"));
  report.speeds.emplace();
  report.speeds->tool = 5.0;
  report.speeds->joints.length(2);
  report.speeds->joints[0] = 100.0;
  report.speeds->joints[1] = 50.0;
  EXPECT_THAT(status_text(report), HasSubstr("  speed     5 %, joint 1 50 %\n"));
  EXPECT_THAT(status_json(report), HasSubstr("\"tool\": 5.0"));
}

TEST(Status, WhatIsOldIsShownWithItsAge) {
  StatusReport report = sample();
  for (const std::optional<double> fresh : {std::optional<double>{}, std::optional<double>{0.04}}) {
    report.cycle_age_s = fresh;
    EXPECT_THAT(status_text(report), Not(HasSubstr("since the last cycle")));
    EXPECT_THAT(status_line(report), Not(HasSubstr("age")));
  }
  report.cycle_age_s.reset();
  EXPECT_THAT(status_json(report), HasSubstr("\"cycle_age_s\": null")) << "a servant that does not say";
  report.cycle_age_s = 3.25;
  EXPECT_THAT(status_text(report), HasSubstr("  age       3.2 s since the last cycle"));
  EXPECT_THAT(status_line(report), HasSubstr("  age 3.2 s"));
  EXPECT_THAT(status_json(report), HasSubstr("\"cycle_age_s\": 3.25"));
}

TEST(Status, TheGripperIsShownAsFarAsItIsKnown) {
  StatusReport report = sample();
  EXPECT_THAT(status_text(report), HasSubstr("gripper   closed\n")) << "of an earlier version";
  EXPECT_THAT(status_json(report), HasSubstr("\"gripper_opening\": null"));
  report.gripper_info = Corbot::GripperInfo{-1e-12, false, -1e-12, Corbot::HoldingUnknown};
  EXPECT_THAT(status_text(report), HasSubstr("gripper   closed, at 0 %\n"));
  report.gripper_info = Corbot::GripperInfo{0.0, true, 41.2, Corbot::HoldingYes};
  EXPECT_THAT(status_text(report), HasSubstr("gripper   closed, at 0 %, measured 41 %, holds something\n"));
  EXPECT_THAT(status_json(report), HasSubstr("\"holding\": \"yes\""));
  report.gripper_info->holding = Corbot::HoldingNo;
  EXPECT_THAT(status_text(report), HasSubstr("measured 41 %, holds nothing\n"));
  report.gripper_info->holding = Corbot::HoldingUnknown;
  EXPECT_THAT(status_text(report), HasSubstr("measured 41 %\n"));
  EXPECT_THAT(status_json(report), HasSubstr("\"holding\": \"unknown\""));
}

TEST(Status, SoftLimitsAreShownWhereTheyAreSet) {
  StatusReport report = sample();
  report.soft_limits = report.ranges;
  EXPECT_THAT(status_text(report), Not(HasSubstr("limited to")));
  report.soft_limits[1] = {-5, 45.5};
  EXPECT_THAT(status_text(report), HasSubstr("(-30 to 130)   limited to -5 to 45.5\n"));
  report.soft_limits.clear();
  EXPECT_THAT(status_text(report), Not(HasSubstr("limited to"))) << "not known, or of an earlier version";
}

TEST(Status, AFrameThatMovesPositionsIsShown) {
  StatusReport report = sample();
  EXPECT_THAT(status_text(report), Not(HasSubstr("  frame ")));
  EXPECT_THAT(status_json(report), HasSubstr("\"frames\": null")) << "not known";
  const Corbot::Pose none{{0, 0, 0}, {1, 0, 0, 0}};
  report.frames = {none, none};
  EXPECT_THAT(status_text(report), Not(HasSubstr("  frame ")));
  report.frames->tool.orientation = {0, 1, 0, 0};
  EXPECT_THAT(status_text(report), Not(HasSubstr("  frame "))) << "the profile turns the tool";
  report.frames->tool = {{0.05, 0, 0}, {1, 0, 0, 0}};
  report.reach_m = 0.34;
  EXPECT_THAT(status_text(report), HasSubstr("0.340 m from the shoulder, with the profile's tool\n"));
  EXPECT_THAT(status_text(report), HasSubstr("  frame     tool  0.05 0 0 m, orientation 1 0 0 0\n"));
  report.frames->base.orientation = {0, 0, 0, 1};
  EXPECT_THAT(status_text(report), HasSubstr("  frame     base  0 0 0 m, orientation 0 0 0 1\n"));
  EXPECT_THAT(status_json(report), HasSubstr("\"x_m\": 0.05"));
}

TEST(Status, AMotionUnderWayIsShownWithItsProgress) {
  StatusReport report = sample();
  EXPECT_THAT(status_text(report), Not(HasSubstr("  motion ")));
  EXPECT_THAT(status_json(report), HasSubstr("\"motion\": null"));
  report.motion = 17;
  report.progress = 0.421;
  EXPECT_THAT(status_text(report), HasSubstr("motion    17, 42 % done\n"));
  EXPECT_THAT(status_json(report), HasSubstr("\"ticket\": 17"));
}

TEST(Status, JsonHasUnitsInItsKeys) {
  const std::string text = status_json(sample());
  for (const char* key : {"\"value_deg\"", "\"x_m\"", "\"state\": \"Error\"", "\"gripper\": \"closed\"",
                          "\"reach_m\"", "\"override_percent\": 50", "\"version\": \"1.2\""}) {
    EXPECT_THAT(text, HasSubstr(key));
  }
}

TEST(Status, AnArmWithoutAShoulderHasNoReach) {
  StatusReport report = sample();
  EXPECT_THAT(status_text(report), Not(HasSubstr("reach")));
  report.reach_m = 0.34;
  EXPECT_THAT(status_text(report), HasSubstr("  reach     0.340 m from the shoulder\n"));
}

TEST(Alarms, AreListedAndSafeToPrint) {
  Corbot::AlarmList alarms;
  EXPECT_EQ(alarms_text(alarms), "no alarms\n");
  alarms.length(1);
  alarms[0].time = 1.7e9;
  alarms[0].code = 121;
  alarms[0].active = true;
  alarms[0].text = "lost \x1b[2J";
  EXPECT_THAT(alarms_text(alarms), HasSubstr("121  active  lost ?[2J"));
}

TEST(Diagnostics, QuantilesComeFromTheHistogram) {
  Corbot::LoopInfo info;
  info.latencyMax = 1e-2;
  info.counts.length(3);
  info.edges.length(3);
  for (CORBA::ULong i = 0; i < 3; ++i) info.edges[i] = 1e-6 * (i + 1);
  info.counts[0] = 90;
  info.counts[1] = 9;
  info.counts[2] = 1;
  EXPECT_DOUBLE_EQ(latency_quantile(info, 0.5), 1e-6);
  EXPECT_DOUBLE_EQ(latency_quantile(info, 0.99), 2e-6);
  EXPECT_DOUBLE_EQ(latency_quantile(info, 0.999), 1e-2) << "the open bucket ends at the maximum";
  info.realTime = false;
  Corbot::DeviceInfo device;
  device.backend = "ssc32";
  device.health = Corbot::DeviceLost;
  device.causeText = "the line was cut";
  device.measured = false;
  device.positionUncertain = true;
  device.emergencyStop = false;
  EXPECT_THAT(diagnostics_text(info, device), HasSubstr("BEST EFFORT"));
  EXPECT_THAT(diagnostics_text(info, device), HasSubstr("beyond"));
  EXPECT_THAT(diagnostics_text(info, device), HasSubstr("ssc32, lost: the line was cut;"));
  EXPECT_THAT(diagnostics_text(info, device), HasSubstr("unverified"));
  EXPECT_THAT(diagnostics_json(info, device), HasSubstr("\"position_uncertain\": true"));
}

TEST(Bar, IsBounded) {
  EXPECT_EQ(bar(0, 4), "[    ]");
  EXPECT_EQ(bar(0.5, 4), "[##  ]");
  EXPECT_EQ(bar(7, 4), "[####]");
  EXPECT_EQ(bar(-1, 4), "[    ]");
  EXPECT_EQ(bar(std::numeric_limits<double>::quiet_NaN(), 4), "[    ]");
}

TEST(Recording, RowsFitTheHeader) {
  Snapshot snapshot{};
  snapshot.cycle = 7;
  snapshot.state = RtState::kMoving;
  snapshot.command_id = 3;
  snapshot.position_q[1] = std::numbers::pi / 2;
  snapshot.tool.position_m = {0.1, 0.2, 0.3};
  snapshot.pulse_us[4] = 1100;
  for (const std::size_t count : {4u, 6u}) {
    const std::vector<JointKind> joints(count);
    const std::string header = csv_header(joints);
    const std::string row = csv_row(snapshot, joints);
    EXPECT_EQ(std::count(header.begin(), header.end(), ','), std::count(row.begin(), row.end(), ','));
    EXPECT_EQ(row.back(), '\n');
  }
  const std::vector<JointKind> four(4);
  EXPECT_THAT(csv_row(snapshot, four), HasSubstr("7,0,0,moving,3,0,0.000000000,90.000000000,"));
  EXPECT_THAT(csv_row(snapshot, four),
              HasSubstr(",1100.000,closed,-,,,,,0.000000000,0.000000000,0.000000000,0.000000000\n"));
  snapshot.flags = kSnapshotMeasured;
  snapshot.measured_q[1] = std::numbers::pi;
  snapshot.velocity_q_s[3] = -std::numbers::pi / 4;
  EXPECT_THAT(csv_row(snapshot, four),
              HasSubstr(",measured,0.000000000,180.000000000,0.000000000,0.000000000,"
                        "0.000000000,0.000000000,0.000000000,-45.000000000\n"));
  snapshot.device_health = static_cast<std::uint32_t>(BackendHealth::kStandby);
  snapshot.flags = kSnapshotUnverified | kSnapshotPowerOff;
  EXPECT_THAT(csv_row(snapshot, four), HasSubstr(",standby,unverified+power_off,,"));
}

TEST(Recording, SlidesAreInMetres) {
  const std::vector<JointKind> joints{JointKind::kRotary, JointKind::kPrismatic};
  Snapshot snapshot{};
  snapshot.position_q = {std::numbers::pi, 0.25};
  EXPECT_THAT(csv_header(joints), HasSubstr(",theta0_deg,slide1_m,x_m"));
  EXPECT_THAT(csv_header(joints),
              HasSubstr(",measured_theta0_deg,measured_slide1_m,theta0_deg_s,slide1_m_s\n"));
  EXPECT_THAT(csv_row(snapshot, joints), HasSubstr(",180.000000000,0.250000000000,"));
}

}  // namespace
}  // namespace corbot::cli
