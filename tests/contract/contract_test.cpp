// SPDX-License-Identifier: Apache-2.0
// What the arm may expect of every backend, whatever its device.
#include <gmock/gmock.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <random>
#include <sstream>
#include <utility>

#include "config/load_profile.h"
#include "contract/driver.h"
#include "contract/system_call_watch.h"
#include "support/process.h"

namespace corbot::test {

namespace {

namespace fs = std::filesystem;

std::uint64_t seed() {
  const char* text = std::getenv("CORBOT_SEED");
  const std::uint64_t value = text != nullptr ? std::strtoull(text, nullptr, 10) : std::random_device{}();
  std::cout << "CORBOT_SEED=" << value << std::endl;
  return value;
}

std::size_t entries(const std::string& directory) {
  const auto begin = fs::directory_iterator(directory);
  return static_cast<std::size_t>(std::distance(begin, fs::directory_iterator()));
}
std::string describe_files() {
  std::string all;
  for (const auto& entry : fs::directory_iterator("/proc/self/fd")) {
    std::error_code gone;
    all += entry.path().filename().string() + " " + fs::read_symlink(entry, gone).string() + ", ";
  }
  return all;
}

class Contract : public ::testing::TestWithParam<DeviceFixtureKind> {
 protected:
  void SetUp() override {
    directory_ = CORBOT_SCRATCH_DIR + ("/" + unique_name("contract"));
    fs::create_directory(directory_);
    profile_ = parse_profile(text_with("[backend]\nkind = \"loopback\"\n"), "lynx5");
    fixture_ = GetParam().make(profile_.arm, directory_);
    if (const std::string missing = fixture_->missing(); !missing.empty()) GTEST_SKIP() << missing;
    fixture_->set_up();
    profile_ = parse_profile(text_with(fixture_->backend_section()), "contract");
    facts_ = fixture_->facts();
    home_ = pose(1500.0);
    backend_ = fixture_->make(profile_, stop_);
    fixture_->attach(*backend_);
  }
  void TearDown() override {
    if (driver_) driver_->end();
    if (backend_) backend_->close();
    backend_.reset();
    fixture_.reset();
    fs::remove_all(directory_);
    EXPECT_EQ(first_system_call(), -1) << "number of a system call that the cycle's thread made";
  }

  static std::string text_with(const std::string& backend) {
    std::ifstream from(CORBOT_PROFILE);
    std::stringstream text;
    text << from.rdbuf();
    const std::string all = text.str();
    return all.substr(0, all.find("[backend]")) + backend;
  }
  /// All servos at this pulse: between 1100 and 1900 us, every joint of the Lynx 5 is within its range.
  [[nodiscard]] Pose pose(double pulse_us) const {
    return pose(std::vector<double>(profile_.arm.dof + 1, pulse_us));
  }
  [[nodiscard]] Pose pose(const std::vector<double>& pulse_us) const {
    Pose result;
    for (std::size_t i = 0; i < profile_.arm.dof; ++i) {
      const ServoMap& map = profile_.arm.servos[i];
      result.position_rad[i] = (pulse_us[i] - map.zero_us) / (map.direction * map.us_per_rad);
    }
    const GripperModel& gripper = profile_.arm.gripper;
    result.opening = (pulse_us.back() - gripper.closed_us) / (gripper.open_us - gripper.closed_us);
    return result;
  }
  void open() {
    backend_->open(Driver::frame(profile_.arm, home_));
    driver_ = std::make_unique<Driver>(profile_.arm, *backend_, *fixture_, home_);
    driver_->start();
  }
  [[nodiscard]] bool reaches(BackendHealth health) {
    return wait_until(within(60), [&] { return backend_->health() == health; });
  }
  /// How far the device's outputs are from what was written.
  [[nodiscard]] double off() {
    const std::vector<double> wanted = driver_->wanted(facts_.takes_joints);
    const std::vector<double> found = fixture_->now();
    double worst = 0.0;
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      if (i >= found.size() || std::isnan(found[i])) return HUGE_VAL;
      worst = std::max(worst, std::abs(found[i] - wanted[i]));
    }
    return worst;
  }
  /// And what is lost where the device's record is in hundredths.
  [[nodiscard]] double half_a_unit() const {
    return 0.5 * facts_.unit + (facts_.takes_joints ? 1e-9 : 0.006);
  }
  [[nodiscard]] bool arrives() {
    return wait_until(within(30), [&] { return !driver_->moving() && off() <= half_a_unit(); });
  }
  /// By how much an output went further than the speed of an approach allows; a first output is no step.
  /// Frames on either side of the time between two outputs, and their rounding, are allowed for. The record
  /// holds changes: what was put out before the plug was in its place again, at `since_ns`, stood until then.
  [[nodiscard]] double worst_jump(const std::vector<Output>& seen, std::size_t from,
                                  std::int64_t since_ns) const {
    std::vector<Output> last(kMaxServos, Output{0, 0, NAN});
    double worst = -HUGE_VAL;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const Output& output = seen[i];
      const Output before = std::exchange(last[output.servo], output);
      const bool is_first = std::isnan(before.value) || (before.value <= 0.0 && !facts_.takes_joints);
      if (i < from || is_first || (output.value <= 0.0 && !facts_.takes_joints)) continue;
      const std::int64_t passed_ns =
          std::max<std::int64_t>(output.time_ns - std::max(before.time_ns, since_ns), 0);
      const double seconds = static_cast<double>(passed_ns) * 1e-9 + 2.0 * facts_.period_s;
      const double allowed = facts_.approach_speed * seconds + facts_.unit;
      worst = std::max(worst, std::abs(output.value - before.value) - allowed);
    }
    return worst;
  }

  std::string directory_;
  Profile profile_;
  DeviceFacts facts_;
  Pose home_;
  EmergencyStop stop_;
  std::unique_ptr<DeviceFixture> fixture_;
  std::unique_ptr<Backend> backend_;
  std::unique_ptr<Driver> driver_;
};

TEST_P(Contract, TellsItsHealthAndItsName) {
  EXPECT_EQ(backend_->health(), BackendHealth::kClosed);
  EXPECT_EQ(backend_->name(), profile_.backend.kind);
  open();
  EXPECT_EQ(backend_->health(), BackendHealth::kOpen);
  EXPECT_EQ(backend_->cause(), DeviceCause::kNone);
  EXPECT_TRUE(arrives()) << off();
  driver_->end();
  backend_->close();
  backend_->close();
  EXPECT_EQ(backend_->health(), BackendHealth::kClosed);
}

TEST_P(Contract, HandsOverInOrderAndEndsOnTheNewest) {
  driver_.reset();
  home_ = pose(1300.0);
  open();
  ASSERT_TRUE(arrives()) << off();
  const std::size_t begin = fixture_->outputs().size();
  driver_->move(pose(1700.0), 1.5);
  ASSERT_TRUE(wait_until(within(30), [&] { return !driver_->moving(); }));
  ASSERT_TRUE(arrives()) << off();
  // A hold after the motion shows what was still under way.
  const std::uint64_t frames = backend_->times().frames;
  ASSERT_TRUE(wait_until(within(30), [&] { return backend_->times().frames > frames + 10; }));
  EXPECT_LE(off(), half_a_unit()) << "nothing old came after the newest";
  const std::vector<Output> seen = fixture_->outputs();
  std::vector<double> last(kMaxServos, -HUGE_VAL);
  std::vector<double> sign(kMaxServos, 1.0);
  for (std::size_t i = 0; facts_.takes_joints && i < profile_.arm.dof; ++i) {
    sign[i] = profile_.arm.servos[i].direction;
  }
  for (std::size_t i = begin; i < seen.size(); ++i) {
    const double value = seen[i].value * sign[seen[i].servo];
    EXPECT_GE(value + facts_.noise, last[seen[i].servo]) << "servo " << seen[i].servo;
    last[seen[i].servo] = std::max(last[seen[i].servo], value);
  }
}

TEST_P(Contract, FollowsAtItsRate) {
  constexpr double kSeconds = 1.5;
  constexpr double kWay_us = 400.0;
  const double unit_us = facts_.takes_joints ? facts_.unit * profile_.arm.servos[0].us_per_rad
                                             : facts_.unit + 2.0 * facts_.noise;
  // A machine that is busy delays frames; one in a while it is not.
  const double wanted = 0.5 * std::min({kSeconds / facts_.period_s, kWay_us / unit_us, 100.0});
  home_ = pose(1300.0);
  open();
  ASSERT_TRUE(arrives()) << off();
  double to_us = 1300.0 + kWay_us;
  std::ptrdiff_t found = 0;
  EXPECT_TRUE(wait_until(within(60),
                         [&] {
                           const std::size_t begin = fixture_->outputs().size();
                           driver_->move(pose(std::exchange(to_us, 3000.0 - to_us)), kSeconds);
                           if (!wait_until(within(30), [&] { return !driver_->moving(); }) || !arrives())
                             return false;
                           const std::vector<Output> seen = fixture_->outputs();
                           found =
                               std::count_if(seen.begin() + static_cast<std::ptrdiff_t>(begin), seen.end(),
                                             [](const Output& output) { return output.servo == 0; });
                           return static_cast<double>(found) >= wanted;
                         }))
      << found << " outputs of the first servo, " << wanted << " wanted";
}

TEST_P(Contract, KeepsItsRateAndTellsTheAge) {
  open();
  ASSERT_TRUE(wait_until(within(30), [&] { return backend_->times().frames > 0; })) << "those of the cycle";
  const std::uint64_t before = backend_->times().frames;
  const auto begin = std::chrono::steady_clock::now();
  const auto wanted = static_cast<std::uint64_t>(1.0 / facts_.period_s);
  ASSERT_TRUE(wait_until(within(30), [&] { return backend_->times().frames >= before + wanted; }));
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const double most = seconds / facts_.period_s * 1.02 + 3.0;
  EXPECT_LE(static_cast<double>(backend_->times().frames - before), most) << "more than the bus carries";
  const BackendTimes times = backend_->times();
  EXPECT_GE(times.age_ns, 0);
  EXPECT_GE(times.age_max_ns, times.age_ns);
}

TEST_P(Contract, IsWithinHalfAUnit) {
  open();
  std::mt19937_64 random(seed());
  for (int i = 0; i < 10; ++i) {
    std::vector<double> pulses;
    for (std::size_t servo = 0; servo <= profile_.arm.dof; ++servo) {
      pulses.push_back(std::uniform_real_distribution<double>(1100.0, 1900.0)(random));
    }
    driver_->move(pose(pulses), 0.3);
    EXPECT_TRUE(arrives()) << off() << " off, unit " << facts_.unit;
  }
}

TEST_P(Contract, ReadsBackWhereTheServosAre) {
  open();
  if (facts_.read_unit == 0.0) {
    EXPECT_FALSE(driver_->feedback().measured);
    return;
  }
  driver_->move(pose(1620.0), 0.3);
  ASSERT_TRUE(arrives()) << off();
  const auto off_measured = [&] {
    const ServoFeedback feedback = driver_->feedback();
    if (!feedback.measured || feedback.time_ns == 0) return HUGE_VAL;
    double worst = 0.0;
    for (std::size_t i = 0; i < profile_.arm.dof; ++i) {
      const double scale = facts_.takes_joints ? 1.0 : profile_.arm.servos[i].us_per_rad;
      worst = std::max(worst, scale * std::abs(feedback.position_rad[i] - driver_->pose().position_rad[i]));
    }
    return worst;
  };
  // Two roundings: what was put out, and what was read.
  const double bound = 0.5001 * (facts_.unit + facts_.read_unit);
  EXPECT_TRUE(wait_until(within(20), [&] { return off_measured() <= bound; })) << off_measured();
}

TEST_P(Contract, SurvivesPulledPlugs) {
  if (!facts_.pluggable) GTEST_SKIP() << "skipped: this plug cannot be pulled";
  open();
  ASSERT_TRUE(arrives());
  std::mt19937_64 random(seed());
  const char* times = std::getenv("CORBOT_PLUGS");
  const int rounds = times != nullptr ? std::atoi(times) : 3;
  const std::size_t files = entries("/proc/self/fd");
  const std::string files_before = describe_files();
  const std::size_t threads = entries("/proc/self/task");
  for (int i = 0; i < rounds; ++i) {
    driver_->move(pose(i % 2 == 0 ? 1800.0 : 1200.0), 1.0);
    const timespec pause{0, std::uniform_int_distribution<long>(0, 900'000'000)(random)};
    ::nanosleep(&pause, nullptr);
    fixture_->unplug();
    ASSERT_TRUE(reaches(BackendHealth::kLost)) << i;
    EXPECT_FALSE(backend_->drain_log().empty() && GetParam().name != "loopback")
        << "the operator reads of it";
    EXPECT_TRUE(wait_until(within(20), [&] { return !driver_->feedback().measured; })) << "nothing stale";
    ASSERT_TRUE(wait_until(within(20), [&] { return !driver_->moving(); }));
    // As after a bus that had stalled before it was lost: the arm was to be further on.
    Pose further = driver_->pose();
    further.position_rad[0] += 0.4;
    driver_->move(further, 0.0);
    const std::size_t from = fixture_->outputs().size();
    const std::int64_t plugged_ns = std::chrono::steady_clock::now().time_since_epoch().count();
    fixture_->plug();
    ASSERT_TRUE(reaches(BackendHealth::kOpen)) << i;
    ASSERT_TRUE(arrives()) << i << ": " << off();
    EXPECT_LE(worst_jump(fixture_->outputs(), from, plugged_ns), 0.0) << i;
  }
  // None is left of any round; on a busy machine the device may just be lost, and have one less.
  EXPECT_TRUE(wait_until(within(10), [&] { return entries("/proc/self/fd") <= files; }))
      << files_before << "\nnow " << describe_files();
  EXPECT_TRUE(wait_until(within(10), [&] { return entries("/proc/self/task") <= threads; }));
}

TEST_P(Contract, IsHaltedOnItsWayBackByAnEmergencyStop) {
  if (!facts_.pluggable) GTEST_SKIP() << "skipped: this plug cannot be pulled";
  open();
  ASSERT_TRUE(arrives());
  fixture_->unplug();
  ASSERT_TRUE(reaches(BackendHealth::kLost));
  Pose far = driver_->pose();
  far.position_rad[0] += 0.5;
  driver_->move(far, 0.0);
  const std::size_t before = fixture_->outputs().size();
  fixture_->plug();
  const auto base_moves = [&] {
    const std::vector<Output> seen = fixture_->outputs();
    return std::any_of(seen.begin() + static_cast<std::ptrdiff_t>(before), seen.end(),
                       [](const Output& output) { return output.servo == 0; });
  };
  ASSERT_TRUE(wait_until(within(60), base_moves));
  driver_->set_emergency_stop(true);
  const double at = fixture_->now().at(0);
  const std::uint64_t cycle = driver_->cycles();
  ASSERT_TRUE(wait_until(within(60), [&] { return driver_->cycles() > cycle + 500; }));
  const double allowed = facts_.approach_speed * 0.1 + 10.0 * facts_.unit;
  EXPECT_LE(std::abs(fixture_->now().at(0) - at), allowed) << "in 0.5 s";
  EXPECT_EQ(backend_->health(), BackendHealth::kLost);
  driver_->set_emergency_stop(false);
  ASSERT_TRUE(reaches(BackendHealth::kOpen));
  EXPECT_TRUE(arrives()) << off();
}

TEST_P(Contract, EndsWhileTheDeviceIsAway) {
  if (!facts_.pluggable) GTEST_SKIP() << "skipped: this plug cannot be pulled";
  open();
  fixture_->unplug();
  ASSERT_TRUE(reaches(BackendHealth::kLost));
  driver_->end();
  const auto begin = std::chrono::steady_clock::now();
  backend_->close();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20));
  EXPECT_EQ(backend_->health(), BackendHealth::kClosed);
}

TEST_P(Contract, HoldsOrRelaxesAtTheEnd) {
  open();
  driver_->move(pose(1400.0), 0.2);
  ASSERT_TRUE(arrives()) << off();
  driver_->end();
  backend_->close();
  const auto are_off = [&] {
    const std::vector<double> found = fixture_->now();
    return std::all_of(found.begin(), found.end(), [](double value) { return std::isnan(value); });
  };
  if (facts_.at_end == "relax") {
    EXPECT_TRUE(wait_until(within(20), are_off));
  } else {
    EXPECT_LE(off(), half_a_unit());
  }
}

INSTANTIATE_TEST_SUITE_P(Backends, Contract, ::testing::ValuesIn(all_fixtures()),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace corbot::test
