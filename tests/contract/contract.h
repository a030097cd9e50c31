// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <utility>

#include "config/load_profile.h"
#include "contract/driver.h"
#include "contract/system_call_watch.h"
#include "corbot/units.h"
#include "rt/backends/bus/device_error.h"
#include "support/paths.h"
#include "support/process.h"
#include "support/scratch.h"

namespace corbot::test {

namespace fs = std::filesystem;

/// A device at its place, its backend, and what stands in for the cycle.
class Contract : public ::testing::TestWithParam<DeviceFixtureKind> {
 protected:
  void SetUp() override {
    directory_ = scratch_directory(CORBOT_SCRATCH_DIR) + "/" + unique_name("contract");
    fs::create_directory(directory_);
    profile_ = parse_profile(text_with("[backend]\nkind = \"loopback\"\n"), "simulated");
    fixture_ = GetParam().make(profile_.arm, directory_);
    if (const std::string missing = fixture_->missing(); !missing.empty()) GTEST_SKIP() << missing;
    fixture_->set_up();
    profile_ = parse_profile(text_with(fixture_->backend_section()), "contract");
    facts_ = fixture_->facts();
    home_ = pose(1500.0);
    make_backend();
  }
  void TearDown() override {
    if (driver_) driver_->end();
    if (backend_) backend_->close();
    backend_.reset();
    fixture_.reset();
    fs::remove_all(directory_);
    EXPECT_EQ(first_system_call(), -1) << "number of a system call that the cycle's thread made";
  }

  [[nodiscard]] static std::string text_with(const std::string& backend) {
    std::ifstream from(GetParam().profile);
    std::stringstream text;
    text << from.rdbuf();
    const std::string all = text.str();
    return all.substr(0, all.find("[backend]")) + backend;
  }
  /// All servos at this pulse: between 1100 and 1900 us, every joint of the arms here is within its range.
  [[nodiscard]] Pose pose(double pulse_us) const {
    return pose(std::vector<double>(profile_.arm.dof + 1, pulse_us));
  }
  [[nodiscard]] Pose pose(const std::vector<double>& pulse_us) const {
    Pose result;
    for (std::size_t i = 0; i < profile_.arm.dof; ++i) {
      const ServoMap& map = profile_.arm.servos[i];
      result.position_q[i] = (pulse_us[i] - map.zero_us) / (map.direction * map.us_per_q);
    }
    const GripperModel& gripper = profile_.arm.gripper;
    result.opening = (pulse_us.back() - gripper.closed_us) / (gripper.open_us - gripper.closed_us);
    return result;
  }
  /// Makes a backend for the device.
  void make_backend() {
    backend_ = fixture_->make(profile_, stop_);
    fixture_->attach(*backend_);
  }
  /// Opens the backend. An emulator on a busy machine can answer late. Another backend then opens the device,
  /// as after a supervisor's restart.
  void open() {
    constexpr int kMostTries = 5;
    for (int tries = 1;; ++tries) {
      try {
        backend_->open(Driver::frame(profile_.arm, home_));
        break;
      } catch (const rt::DeviceError& error) {
        if (error.cause() != DeviceCause::kNoAnswer || tries == kMostTries) throw;
        backend_->close();
        make_backend();
      }
    }
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
  /// The cycle has gone on for so long.
  [[nodiscard]] bool runs(std::uint64_t cycles) {
    const std::uint64_t begin = driver_->cycles();
    return wait_until(within(60), [&] { return driver_->cycles() > begin + cycles; });
  }
  /// As far on the first servo as that angle is on one of 10 us a degree.
  [[nodiscard]] double as_far_q(double angle_rad) const {
    return angle_rad * 10.0 / kRadiansPerDegree / profile_.arm.servos[0].us_per_q;
  }
  /// Loses the device and has it back, in Error, with the arm held elsewhere by that of the first joint.
  void lose_and_find(double further_rad = 0.0) {
    driver_->leave();
    fixture_->unplug();
    ASSERT_TRUE(reaches(BackendHealth::kLost));
    Pose further = driver_->pose();
    further.position_q[0] += as_far_q(further_rad);
    driver_->move(further, 0.0);
    fixture_->plug();
    ASSERT_TRUE(reaches(BackendHealth::kStandby));
  }
  /// Whether all outputs are the same in the end, NaN included.
  [[nodiscard]] bool rests(std::uint64_t cycles) {
    const std::vector<double> before = fixture_->now();
    if (!runs(cycles)) return false;
    const std::vector<double> after = fixture_->now();
    return std::equal(before.begin(), before.end(), after.begin(), after.end(), [&](double a, double b) {
      return std::abs(a - b) <= 2.0 * facts_.noise || (std::isnan(a) && std::isnan(b));
    });
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

}  // namespace corbot::test
