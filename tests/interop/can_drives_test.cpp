// SPDX-License-Identifier: Apache-2.0
// The whole chain down to emulated CiA 402 drives on a CAN bus: what a client commands arrives at the shafts,
// and a bus that is cut is survived.
#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <map>
#include <vector>

#include <fmt/core.h>

#include "config/load_profile.h"
#include "corbot/units.h"
#include "support/device_jobs.h"
#include "support/emulated_drives.h"
#include "support/paths.h"
#include "support/robot_rig.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr double kCountsPerDegree = 1000.0;
constexpr int kGripperClosed = 1000;
constexpr int kGripperOpen = 41'000;

class CanDrives : public RobotRig {
 protected:
  void SetUp() override {
    take_name("can");
    directory_ = fmt::format("{}/{}", CORBOT_SCRATCH_DIR, name_);
    fs::create_directory(directory_);
    drives_.emplace(std::string(CORBOT_BIN_DIR) + "/corbot-sim", directory_, 5);
    drives_->start();
    if (HasFatalFailure()) return;
    write_profile();
    start();
    if (HasFatalFailure()) return;
    ASSERT_TRUE(wait_for(Corbot::Standby)) << servant_->errors() << rt_->errors();
  }
  void TearDown() override {
    RobotRig::TearDown();
    EXPECT_EQ(drives_->stop(), 0);
    fs::remove_all(directory_);
  }
  void write_profile() {
    profile_ = directory_ + "/arm.toml";
    std::string backend = fmt::format(
        "[backend]\nkind = \"socketcan\"\n[backend.socketcan]\ninterface = \"{}\"\n", drives_->bus());
    for (int i = 0; i < 4; ++i) {
      backend += fmt::format(
          "[[backend.socketcan.drive]]\nnode = {}\ncounts_per_degree = {}\nzero_count = {}\ndirection = {}\n",
          i + 1, kCountsPerDegree, zero_of(i), direction_of(i));
    }
    backend += fmt::format("[backend.socketcan.gripper]\nnode = 5\nclosed_count = {}\nopen_count = {}\n",
                           kGripperClosed, kGripperOpen);
    write_lynx5_profile(profile_, backend);
  }
  static int zero_of(int joint) { return 500 * joint; }
  static int direction_of(int joint) { return joint == 2 ? -1 : 1; }
  /// The largest difference between a shaft and the joint that the arm reports as measured, in counts.
  double off_counts() {
    Corbot::JointCoord_var joints = arm_->ArtiCoord();
    const auto now = drives_->counts();
    double worst = 0.0;
    for (int i = 0; i < 4; ++i) {
      const double wanted =
          zero_of(i) + direction_of(i) * kCountsPerDegree * joints[static_cast<CORBA::ULong>(i)];
      const auto found = now.find(i + 1);
      worst = std::max(worst, found == now.end() ? HUGE_VAL : std::abs(found->second - wanted));
    }
    return worst;
  }
  bool arrives() {
    return wait_until(within(20),
                      [&] { return off_counts() <= 1.0 && drives_->counts() == drives_->counts("targets"); });
  }
  /// The most that any target may move in one cycle, catching up after a late one: twice the fastest joint's
  /// way in a period, or twice the gripper's.
  [[nodiscard]] std::int64_t largest_step() const {
    double fastest_q_s = 0.0;
    const ArmModel arm = load_profile(profile_).arm;
    for (const JointLimits& limits : arm.joints) {
      fastest_q_s = std::max(fastest_q_s, limits.speed_q_s);
    }
    const double joints = to_degrees(fastest_q_s) * kCountsPerDegree;
    const double gripper = (kGripperOpen - kGripperClosed) / 0.5;
    return std::lround(2.0 * std::max(joints, gripper) * static_cast<double>(arm.period_ns) * 1e-9) + 1;
  }

  std::string directory_;
  std::optional<EmulatedDrives> drives_;
};

TEST_F(CanDrives, CarryOutThePapersPickAndPlace) {
  EXPECT_TRUE(arrives()) << off_counts();
  const std::string raised = raised_by([&] {
    pick_and_place(
        arm_, [this] { EXPECT_TRUE(arrives()) << off_counts() << " counts off"; },
        [this] { EXPECT_EQ(drives_->counts("targets").at(5), kGripperClosed); });
  });
  EXPECT_EQ(raised, "") << rt_->errors();
  EXPECT_LE(drives_->largest_steps().first, largest_step());
}

TEST_F(CanDrives, TurnInTheDirectionOfTheProfile) {
  Corbot::JointCoord target;
  target.length(4);
  for (int i = 0; i < 4; ++i) target[static_cast<CORBA::ULong>(i)] = 10.0 + 5.0 * i;
  arm_->MoveJoints(target, 0.0);
  ASSERT_TRUE(arrives()) << off_counts();
  const auto now = drives_->counts();
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(now.at(i + 1), zero_of(i) + direction_of(i) * kCountsPerDegree * (10.0 + 5.0 * i), 1.0)
        << "joint " << i;
  }
}

TEST_F(CanDrives, ReportAnEmergencyInTheAlarms) {
  drives_->command("emcy 4310 3");
  EXPECT_TRUE(wait_for(Corbot::Error));
  ASSERT_FALSE(alarms().empty());
  EXPECT_THAT(std::string(alarms().back().text), HasSubstr("lost"));
  EXPECT_TRUE(wait_until(within(10), [&] {
    return rt_->errors().find("EMCY 0x4310 (drive too hot)") != std::string::npos;
  })) << rt_->errors();
  ASSERT_TRUE(wait_until(within(60), [&] { return raised_by([&] { arm_->Clear(); }).empty(); }))
      << rt_->errors();
  arm_->Move(0.20, 0.10, 0.10, 0.0, 0.0);
  EXPECT_TRUE(arrives()) << off_counts();
}

/// Without power since the time of a fault: a person has not said Clear, and nothing of what drives do
/// changes that.
class StoppedDrives : public CanDrives {
 protected:
  static std::int64_t now_ns() { return std::chrono::steady_clock::now().time_since_epoch().count(); }
  [[nodiscard]] bool stands_by() const {
    return wait_until(within(60), [&] {
      const Corbot::DeviceInfo_var device = arm_->Device();
      return device->health == Corbot::DeviceClosed;
    });
  }
  /// Returns the nodes that got power between two instants.
  [[nodiscard]] std::vector<std::uint32_t> energised(std::int64_t from_ns, std::int64_t to_ns) const {
    std::vector<std::uint32_t> nodes;
    std::map<std::uint32_t, bool> had_power;
    for (const DeviceRow& row : drives_->rows()) {
      if (row.has_power && !had_power[row.channel] && row.time_ns >= from_ns && row.time_ns <= to_ns)
        nodes.push_back(row.channel);
      had_power[row.channel] = row.has_power;
    }
    return nodes;
  }
  void clear() {
    ASSERT_TRUE(wait_until(within(60), [&] { return raised_by([&] { arm_->Clear(); }).empty(); }))
        << rt_->errors();
    ASSERT_TRUE(wait_for(Corbot::Standby)) << rt_->errors();
  }
  void works_again() {
    EXPECT_EQ(raised_by([&] { arm_->Move(0.20, 0.10, 0.10, 0.0, 0.0); }), "") << rt_->errors();
    EXPECT_TRUE(arrives()) << off_counts();
  }
  bool has_alarm(CORBA::Long code) {
    Corbot::AlarmList_var list = arm_->Alarms();
    for (CORBA::ULong i = 0; i < list->length(); ++i) {
      if (list[i].code == code) return true;
    }
    return false;
  }
};

/// A person may have pressed it to reach into the arm.
TEST_F(StoppedDrives, CannotBeClearedWhileSafeTorqueOffIsOn) {
  const auto is_refused_until_it_is_released = [&] {
    EXPECT_FALSE(wait_until(within(2), [&] { return raised_by([&] { arm_->Clear(); }).empty(); }));
    const Corbot::DeviceInfo_var device = arm_->Device();
    EXPECT_EQ(device->health, Corbot::DeviceLost);
    EXPECT_THAT(std::string(device->causeText), HasSubstr("safe torque off"));
    const std::int64_t released_ns = now_ns();
    drives_->command("sto off 1");
    ASSERT_TRUE(stands_by()) << rt_->errors();
    EXPECT_THAT(energised(released_ns, now_ns()), ::testing::IsEmpty());
  };
  drives_->command("sto on 1");
  ASSERT_TRUE(wait_for(Corbot::Error));
  is_refused_until_it_is_released();
  // While they stand by already.
  drives_->command("sto on 1");
  ASSERT_TRUE(wait_until(within(20), [&] {
    const Corbot::DeviceInfo_var device = arm_->Device();
    return device->health == Corbot::DeviceLost;
  }));
  is_refused_until_it_is_released();
  clear();
  works_again();
}

TEST_F(StoppedDrives, AreNotEnergisedWhenSafeTorqueOffIsReleased) {
  arm_->Move(0.20, 0.10, 0.10, 0.0, 0.0);
  ASSERT_TRUE(arrives()) << off_counts();
  drives_->command("sto on 1");
  ASSERT_TRUE(wait_for(Corbot::Error));
  const std::int64_t off_ns = now_ns();
  const auto turned = drives_->counts().at(1) + 20'000;
  drives_->command(fmt::format("turn {} 1", turned));
  drives_->command("sto off 1");
  ASSERT_TRUE(stands_by()) << rt_->errors();
  const auto before = drives_->counts();
  // The arm that it reports is the one that was turned by hand.
  EXPECT_TRUE(wait_until(within(20), [&] { return off_counts() <= 1.0; })) << off_counts();
  EXPECT_EQ(drives_->counts(), before);
  EXPECT_THAT(energised(off_ns, now_ns()), ::testing::IsEmpty());
  clear();
  const auto after = drives_->counts();
  for (const auto& [node, count] : before) EXPECT_NEAR(after.at(node), count, 2) << "node " << node;
  works_again();
}

/// A set-point begins within the range: whatever is further out would be driven back.
TEST_F(StoppedDrives, TurnedBeyondTheirRangeAreNotDrivenBackByAClearNorByAStart) {
  const auto turn_to = [&](double deg) {
    const int there = zero_of(1) + static_cast<int>(kCountsPerDegree * deg);
    drives_->command(fmt::format("turn {} 2", there - drives_->counts().at(2)));
  };
  drives_->command("sto on 2");
  ASSERT_TRUE(wait_for(Corbot::Error));
  const std::int64_t off_ns = now_ns();
  turn_to(140.0);
  drives_->command("sto off 2");
  ASSERT_TRUE(wait_until(within(20), [&] {
    Corbot::JointCoord_var joints = arm_->ArtiCoord();
    return std::abs(joints[1] - 140.0) < 0.01;
  }));
  const auto turned = drives_->counts();
  std::string reason;
  ASSERT_TRUE(wait_until(within(60), [&] {
    try {
      arm_->Clear();
    } catch (const Corbot::NotReady& refusal) {
      reason = refusal.reason;
    }
    return reason.find("joint 1 is at 140.0 degrees, outside its range of -30.0 to 130.0") !=
           std::string::npos;
  })) << reason;
  EXPECT_THAT(reason, HasSubstr("turn it back by hand"));
  EXPECT_TRUE(has_alarm(106));
  EXPECT_EQ(drives_->counts(), turned);
  EXPECT_EQ(rt_->terminate(), 0);
  rt_ = std::make_unique<Process>(
      std::vector<std::string>{std::string(CORBOT_BIN_DIR) + "/corbot-rt", profile_, "--name", name_});
  EXPECT_NE(rt_->wait(within(60)).value_or(0), 0) << "not started either";
  EXPECT_THAT(rt_->errors(), HasSubstr("is measured at 140.0 degrees, outside its range of -30.0 to 130.0"));
  rt_.reset();
  EXPECT_EQ(drives_->counts(), turned);
  EXPECT_THAT(energised(off_ns, now_ns()), ::testing::IsEmpty());
  turn_to(120.0);
  start_rt();
  if (HasFatalFailure()) return;
  clear();
  works_again();
}

/// After a Clear, and before the turn of its drive to get its energy.
TEST_F(StoppedDrives, TurnedBeforeTheirEnergyCameAreHeldWhereTheyStand) {
  constexpr std::uint32_t kLast = 4;
  bool was_in_time = false;
  for (int i = 0; i < 10 && !was_in_time; ++i) {  // on a machine that stands still the energy may be first
    drives_->command("sto on 1");
    ASSERT_TRUE(wait_for(Corbot::Error));
    drives_->command("sto off 1");
    ASSERT_TRUE(stands_by()) << rt_->errors();
    const std::int64_t off_ns = now_ns();
    const int turned = drives_->counts().at(kLast) + (i % 2 == 0 ? 20'000 : -20'000);
    ASSERT_TRUE(wait_until(within(60), [&] { return raised_by([&] { arm_->Clear(); }).empty(); }));
    drives_->command(fmt::format("turn {} {}", i % 2 == 0 ? 20'000 : -20'000, kLast));
    was_in_time = energised(off_ns, now_ns()).empty();
    // A turn between two looks at a drive that is being enabled is a leap, and the drive is lost.
    ASSERT_TRUE(wait_until(within(30), [&] {
      const auto state = arm_->Status();
      return state == Corbot::Standby || state == Corbot::Error;
    })) << rt_->errors();
    was_in_time = was_in_time && arm_->Status() == Corbot::Standby;
    if (was_in_time) {
      EXPECT_NEAR(drives_->counts().at(kLast), turned, 50);
    }
  }
  ASSERT_TRUE(was_in_time);
  works_again();
}

/// The person who turned the arm may still have their hands there.
TEST_F(StoppedDrives, TurnedWhileNoTaskRanAreNotEnergisedAndNotDrivenBackBeforeAClear) {
  arm_->Move(0.20, 0.10, 0.10, 0.0, 0.0);
  ASSERT_TRUE(arrives()) << off_counts();
  rt_->signal(SIGKILL);
  ASSERT_TRUE(rt_->wait(within(10)));
  drives_->command("sto on 2");
  drives_->command(fmt::format("turn {} 2", static_cast<int>(10.0 * kCountsPerDegree)));
  drives_->command("sto off 2");
  const std::int64_t off_ns = now_ns();
  const auto turned = drives_->counts();
  start_rt();
  ASSERT_TRUE(wait_until(within(60), [&] { return has_alarm(131); })) << rt_->errors();
  ASSERT_TRUE(stands_by()) << rt_->errors();
  EXPECT_TRUE(wait_until(within(20), [&] { return off_counts() <= 1.0; })) << off_counts();
  EXPECT_EQ(arm_->Status(), Corbot::Error);
  EXPECT_EQ(drives_->counts(), turned);
  EXPECT_THAT(energised(off_ns, now_ns()), ::testing::Not(::testing::Contains(2u)));
  clear();
  const auto after = drives_->counts();
  for (const auto& [node, count] : turned) EXPECT_NEAR(after.at(node), count, 2) << "node " << node;
  works_again();
}

TEST_F(StoppedDrives, AreNotEnergisedAgainWhileOneOfThemIsBlocked) {
  drives_->command("block on 1");
  EXPECT_NE(raised_by([&] { arm_->Drive(0, 60.0, 100.0); }), "");
  // The drive's own following error, or corbot's: which of them is first, the drive decides.
  EXPECT_TRUE(has_alarm(104) || has_alarm(121)) << alarms().back().text;
  ASSERT_TRUE(stands_by()) << rt_->errors();
  const std::int64_t off_ns = now_ns();
  drives_->command("block off 1");
  const auto before = drives_->counts();
  EXPECT_EQ(drives_->counts(), before);
  EXPECT_THAT(energised(off_ns, now_ns()), ::testing::IsEmpty());
  clear();
  works_again();
}

TEST_F(StoppedDrives, ThatIgnoreTheirTargetsEndNoMotionAsDone) {
  drives_->command("ignore on 2");
  EXPECT_NE(raised_by([&] { arm_->Drive(1, 30.0, 50.0); }), "");
  ASSERT_TRUE(wait_for(Corbot::Error));
  ASSERT_TRUE(stands_by()) << rt_->errors();
  drives_->command("ignore off 2");
  clear();
  works_again();
}

}  // namespace
}  // namespace corbot::test
