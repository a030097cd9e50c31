// SPDX-License-Identifier: Apache-2.0
// Plants the faults that a run with devices must find, in made-up recordings and made-up records of devices.
#include <gmock/gmock.h>

#include "soak/device_checks.h"
#include "soak/gpio_soak.h"
#include "soak/judge_fixture.h"
#include "support/paths.h"

namespace corbot::soak {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class DeviceJudge : public Judge {
 protected:
  DeviceJudge() {
    recording_.tell([this](const Cycle& cycle) { track_.add(cycle); });
    for (std::size_t axis = 0; axis < DeviceLog::kAxes; ++axis) device(axis, 0.0, 0.0);
    rest(3);
  }
  /// Records a state both of drives and of a controller that sends pulses.
  void device(std::size_t axis, double target_deg, double shaft_deg, bool has_energy = true) {
    drives_.add(axis, {now_ns(), target_deg, shaft_deg, has_energy, false});
    pulses_.add(axis, {now_ns(), target_deg, shaft_deg, has_energy, false});
  }
  void energy(bool is_on) {
    for (std::size_t axis = 0; axis < DeviceLog::kAxes; ++axis)
      device(axis, base_deg(axis), base_deg(axis), is_on);
  }
  [[nodiscard]] double base_deg(std::size_t axis) const { return axis == 0 ? base_deg_ : 0.0; }
  void error(int cycles) {
    for (int i = 0; i < cycles; ++i) row(0, "error");
  }
  void clear(const std::string& cause) {
    clears_.push_back({{now_ns(), now_ns() + 20'000'000}, cause, true});
    rest(1);
  }
  void fault(const char* what, std::vector<std::string> alarms, double within_s = 0.0,
             const char* name = "") {
    DeviceFault made;
    made.begin_ns = made.end_ns = now_ns();
    made.what = what;
    made.alarms = std::move(alarms);
    made.error_within_s = within_s;
    made.name = name;
    troubles_.push_back(made);
  }
  /// Adds a Drive of the base that its caller gets as done. The device goes as far as `share` of it.
  void drive(std::uint64_t id, std::int64_t mark, double share = 1.0) {
    const double from_deg = base_deg_;
    const int number = begin("Drive", mark);
    move(id, sign_degrees(10, mark), [&](int) {
      device(0, from_deg + share * (base_deg_ - from_deg), from_deg + share * (base_deg_ - from_deg));
    });
    device(0, from_deg + share * (base_deg_ - from_deg), from_deg + share * (base_deg_ - from_deg));
    end(number, "ok");
    rest(200);
  }
  /// Returns the faults found on an arm with encoders, or on one without.
  [[nodiscard]] std::vector<std::string> found(bool measures = true) const {
    const Evidence base{profile_, ledger_, recording_, {}, stalls_, clears_, restarts_};
    return judge_devices({base, measures ? drives_ : pulses_, track_, troubles_, 1.0, {1.0, 1.0, 1.0, 1.0}})
        .faults;
  }

  DeviceLog drives_{DeviceLog::Kind::kCounts, profile_.arm};
  DeviceLog pulses_{DeviceLog::Kind::kPulses, profile_.arm};
  Track track_;
  std::vector<DeviceFault> troubles_;
};

TEST_F(DeviceJudge, FindsNothingInAGoodRun) {
  drive(1, 401);
  fault("STO", {"121 "}, 0.5, "STO");
  energy(false);
  rest(100);
  error(2000);
  troubles_.back().end_ns = now_ns();
  error(500);
  clear("121 the servo device is lost: safe torque off (STO)");
  rest(20);
  energy(true);
  rest(300);
  drive(2, 402);
  EXPECT_THAT(found(), IsEmpty());
}

TEST_F(DeviceJudge, SeesEnergyBeforeAClear) {
  fault("STO", {"121 "});
  energy(false);
  error(100);
  device(2, 0.0, 0.0, true);
  error(100);
  clear("121 STO");
  EXPECT_THAT(found(), Contains(HasSubstr("joint 2 gets energy 0.099 s after the begin of an Error")));
}

TEST_F(DeviceJudge, KnowsEnergyThatWasSentBeforeTheErrorToALateDevice) {
  fault("press", {"130 "});
  energy(false);
  rest(1);
  const std::int64_t begin_ns = now_ns();
  error(1000);
  stalls_ = {{begin_ns, now_ns()}};
  device(2, 0.0, 0.0, true);
  error(100);
  clear("130 emergency stop");
  EXPECT_THAT(found(false), Not(Contains(HasSubstr("gets energy"))));
  stalls_ = {{begin_ns, begin_ns + 300'000'000}};
  EXPECT_THAT(found(false), Contains(HasSubstr("joint 2 gets energy")));
}

TEST_F(DeviceJudge, SeesWhatMovesInAnErrorAndNotTheRamp) {
  fault("press", {"130 "});
  error(100);
  device(1, 5.0, 5.0);
  error(5000);
  flags_ = "unverified";
  clear("130 emergency stop");
  EXPECT_THAT(found(false), IsEmpty());
  fault("press", {"130 "});
  error(4900);
  device(1, 7.0, 7.0);
  error(100);
  clear("130 emergency stop");
  EXPECT_THAT(found(false), Contains(HasSubstr("joint 1 moves by 2.00 degrees until 4.899 s")));
}

TEST_F(DeviceJudge, SeesDrivesThatAreNotSwitchedOff) {
  fault("press", {"130 "});
  error(1400);
  clear("130 emergency stop");
  EXPECT_THAT(found(), IsEmpty()) << "there was no time";
  fault("press", {"130 "});
  error(1700);
  clear("130 emergency stop");
  EXPECT_THAT(found(), Contains(HasSubstr("the gripper has energy 1.500 s after the begin of an Error")));
}

TEST_F(DeviceJudge, LeavesTheEnergyToAnArmThatIsHeld) {
  call("StopAndHold", 0);
  error(3000);
  clear("133 the arm was stopped and is held");
  EXPECT_THAT(found(), IsEmpty());
}

TEST_F(DeviceJudge, SeesAnErrorThatEndsByItself) {
  fault("press", {"130 "});
  error(100);
  rest(100);
  EXPECT_THAT(found(), Contains(HasSubstr("nobody has cleared it")));
}

TEST_F(DeviceJudge, SeesWhatMovesAfterAClear) {
  fault("STO", {"121 "});
  energy(false);
  error(200);
  clear("121 STO");
  rest(50);
  energy(true);
  device(3, 0.0, 20.0);
  rest(50);
  drive(1, 401);
  EXPECT_THAT(found(), Contains(HasSubstr("joint 3 moves by 20.00 degrees within 0.051 s after a Clear")));
}

TEST_F(DeviceJudge, SeesASuccessThatDidNotHappen) {
  drive(1, 401, 0.5);
  EXPECT_THAT(found(), Contains(HasSubstr("joint 0 is -2.50 degrees from its end")));
  EXPECT_THAT(found(false), Contains(HasSubstr("joint 0 is -2.50 degrees from its end")));
}

TEST_F(DeviceJudge, SeesASuccessOfALimpArm) {
  energy(false);
  const int number = begin("Drive", 401);
  const double from_deg = base_deg_;
  move(1, sign_degrees(10, 401), [&](int) { device(0, base_deg_, base_deg_, false); });
  device(0, from_deg + sign_degrees(10, 401), from_deg + sign_degrees(10, 401), false);
  end(number, "ok");
  rest(200);
  EXPECT_THAT(found(), Contains(HasSubstr("without energy")));
}

TEST_F(DeviceJudge, SeesAFastMotionOfAnUnverifiedPosition) {
  flags_ = "unverified";
  rate_ = 0.1;
  drive(1, 401);
  EXPECT_THAT(found(false), IsEmpty());
  rate_ = 0.2;
  drive(2, 402);
  EXPECT_THAT(found(false),
              Contains(HasSubstr("runs at 0.200 of its speed while the position is unverified")));
}

TEST_F(DeviceJudge, SeesAPositionThatNothingMeasuresAndThatCountsAsVerified) {
  fault("press", {"130 "});
  error(4000);
  clear("130 emergency stop");
  EXPECT_THAT(found(false), Contains(HasSubstr("counts as verified")));
}

TEST_F(DeviceJudge, SeesAStopThatCutsTheSpeed) {
  call("StartDrive", 401, "ok", 1);
  for (int i = 1; i <= 200; ++i) {
    const double s = i / 401.0;
    base_deg_ = 5.0 * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
    row(1, "moving");
  }
  device(0, base_deg_, base_deg_);
  fault("press", {"130 "});
  error(300);
  clear("130 emergency stop");
  EXPECT_THAT(found(), Contains(HasSubstr("ended by '130 emergency stop': joint 0: acceleration")));
  clears_.back().cause = "121 the servo device is lost";
  troubles_.back().alarms = {"121 "};
  EXPECT_THAT(found(), IsEmpty()) << "no ramp is possible";
}

TEST_F(DeviceJudge, SeesAFaultThatIsNoErrorInTime) {
  fault("STO", {"121 "}, 0.5);
  rest(900);
  troubles_.back().end_ns = now_ns();
  rest(100);
  EXPECT_THAT(found(), Contains(HasSubstr("no Error within 0.50 s of 'STO', which lasted 0.90 s")));
}

TEST_F(DeviceJudge, LeavesADriveThatIsBeingEnabledItsTime) {
  device_ = "standby";
  rest(1);
  fault("ignoring drive", {"121 "}, 0.5);
  rest(900);
  troubles_.back().end_ns = now_ns();
  rest(100);
  EXPECT_THAT(found(), IsEmpty());
  fault("ignoring drive", {"121 "}, 0.5);
  rest(7000);
  troubles_.back().end_ns = now_ns();
  rest(100);
  EXPECT_THAT(found(), Contains(HasSubstr("no Error within 6.50 s of 'ignoring drive'")));
}

TEST_F(DeviceJudge, SeesACauseThatIsNotNamed) {
  fault("STO", {"121 "}, 0.5, "STO");
  energy(false);
  error(900);
  troubles_.back().end_ns = now_ns();
  error(10);
  clear("121 the servo device is lost: it does not answer");
  EXPECT_THAT(found(), Contains(HasSubstr("was cleared after 'STO', which is not named")));
}

TEST_F(DeviceJudge, SeesAClearThatNothingExplains) {
  error(10);
  clear("104 joint 1 is 20.000 degrees from its set-point");
  EXPECT_THAT(found(), Contains(HasSubstr("nothing that was broken explains it")));
}

TEST(DeviceLog, ReadsCountsAndPulses) {
  const ArmModel arm = load_profile(CORBOT_SHIPPED_PROFILE).arm;
  DeviceLog drives(DeviceLog::Kind::kCounts, arm);
  drives.read("time_ns,node,target,position,power");
  drives.read("5,2,1500,1000,1");
  drives.read("6,9,1500,1000,1");
  ASSERT_EQ(drives.size(), 1u);
  EXPECT_DOUBLE_EQ(drives.at(1, 5)->target_deg, 1.5);
  EXPECT_DOUBLE_EQ(drives.at(1, 5)->shaft_deg, 1.0);
  EXPECT_EQ(drives.at(1, 4), nullptr);
  DeviceLog pulses(DeviceLog::Kind::kPulses, arm);
  pulses.read("5,2,2000.00,2090.00");  // turns the other way, 2100 us at angle 0
  pulses.read("7,2,0.00,2090.00");
  EXPECT_DOUBLE_EQ(pulses.at(2, 6)->target_deg, 10.0);
  EXPECT_TRUE(pulses.at(2, 6)->has_energy);
  EXPECT_FALSE(pulses.at(2, 7)->has_energy);
  pulses.end_life(9);
  EXPECT_FALSE(pulses.at(2, 9)->has_energy);
}

TEST(Power, GoesInTimeAndComesBackByAClear) {
  constexpr std::int64_t kMs = 1'000'000;
  GpioEvents events;
  events.power = {{5 * kMs, true}, {1'050 * kMs, false}, {1'400 * kMs, true}};
  events.stops = {{100 * kMs, 200 * kMs}};
  events.clears = {1'350 * kMs};
  events.end_ns = 5'000 * kMs;
  EXPECT_THAT(judge_power(events, 1.0), IsEmpty());
  events.clears = {90 * kMs};
  EXPECT_THAT(judge_power(events, 1.0), ElementsAre(HasSubstr("that nobody has cleared")));
  events.clears = {1'350 * kMs};
  events.power[1].time_ns = 1'250 * kMs;
  EXPECT_THAT(judge_power(events, 1.0), ElementsAre(HasSubstr("have power 1.100 s after a stop")));
  events.power_gone = {{300 * kMs, 400 * kMs}};
  EXPECT_THAT(judge_power(events, 1.0), IsEmpty()) << "whose chip was away";
}

TEST(Episodes, AreTimesInError) {
  Track track;
  for (int i = 0; i < 10; ++i) {
    Tick tick;
    tick.time_ns = i;
    tick.is_error = i == 2 || i == 3 || i == 9;
    track.add(tick);
  }
  const std::vector<Episode> all = episodes(track);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].begin_ns, 2);
  EXPECT_EQ(all[0].end_ns, 3);
  EXPECT_FALSE(all[0].is_open);
  EXPECT_TRUE(all[1].is_open);
}

}  // namespace
}  // namespace corbot::soak
