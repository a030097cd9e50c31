// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <stdexcept>

#include "contract/device_fixture.h"
#include "corbot/units.h"
#include "support/emulated_drives.h"
#include "support/paths.h"

namespace corbot::test {
namespace {

constexpr double kCountsPerDegree = 1000.0;
constexpr double kRadPerCount = kRadiansPerDegree / kCountsPerDegree;

/// CiA 402 drives that corbot-sim emulates, one a joint and one for the gripper. Their output is the target
/// that a drive was given. On an interface of the kernel the plug is the interface, which goes down.
class CanFixture final : public DeviceFixture {
 public:
  CanFixture(const ArmModel& arm, const std::string& directory)
      : arm_(arm),
        drives_(std::string(CORBOT_BIN_DIR) + "/corbot-sim", directory, static_cast<int>(arm.dof) + 1) {}
  ~CanFixture() override {
    if (!is_plugged_) set_plugged(true);
    (void)drives_.stop();
  }
  void set_up() override { drives_.start(); }
  [[nodiscard]] std::string backend_section() const override {
    std::string text = fmt::format(
        "[backend]\nkind = \"socketcan\"\n[backend.socketcan]\ninterface = \"{}\"\n", drives_.bus());
    for (std::uint32_t i = 0; i < arm_.dof; ++i) {
      text += fmt::format(
          "[[backend.socketcan.drive]]\nnode = {}\ncounts_per_degree = {}\nzero_count = {}\ndirection = {}\n",
          i + 1, kCountsPerDegree, zero_of(i), direction_of(i));
    }
    return text +
           fmt::format("[backend.socketcan.gripper]\nnode = {}\nclosed_count = 1000\nopen_count = 41000\n",
                       arm_.dof + 1);
  }
  [[nodiscard]] DeviceFacts facts() const override {
    DeviceFacts facts;
    facts.takes_joints = true;
    facts.unit = kRadPerCount;
    facts.period_s = static_cast<double>(arm_.period_ns) * 1e-9;
    facts.approach_speed = 0.5;
    facts.read_unit = kRadPerCount;
    facts.has_encoders = true;
    facts.takes_power_off = true;
    facts.goes_off_unplugged = false;
    facts.at_end = "hold";
    return facts;
  }
  void unplug() override { set_plugged(false); }
  void plug() override { set_plugged(true); }
  std::vector<Output> outputs() override {
    std::vector<Output> seen;
    for (const DeviceRow& row : drives_.rows()) {
      if (row.channel < 1 || row.channel > arm_.dof) continue;
      seen.push_back({row.time_ns, row.channel - 1, joint_of(row.channel - 1, row.given)});
    }
    return seen;
  }
  std::vector<double> now() override {
    std::vector<double> values(arm_.dof, std::numeric_limits<double>::quiet_NaN());
    for (const auto& [node, target] : drives_.counts("targets")) {
      const auto joint = static_cast<std::uint32_t>(node - 1);
      if (joint < arm_.dof) values[joint] = joint_of(joint, target);
    }
    return values;
  }
  bool is_energised() override {
    std::map<std::uint32_t, bool> powers;
    for (const DeviceRow& row : drives_.rows()) powers[row.channel] = row.has_power;
    return std::any_of(powers.begin(), powers.end(), [](const auto& power) { return power.second; });
  }

 private:
  static int zero_of(std::uint32_t joint) { return 500 * static_cast<int>(joint); }
  static int direction_of(std::uint32_t joint) { return joint == 2 ? -1 : 1; }
  static double joint_of(std::uint32_t joint, double count) {
    return (count - zero_of(joint)) * direction_of(joint) * kRadPerCount;
  }
  void set_plugged(bool plugged) {
    is_plugged_ = plugged;
    if (drives_.bus().starts_with("unix:")) return drives_.command(plugged ? "plug" : "unplug");
    const RunResult done = run({"ip", "link", "set", drives_.bus(), plugged ? "up" : "down"});
    if (done.code != 0) throw std::runtime_error(done.errors);
  }

  const ArmModel arm_;
  EmulatedDrives drives_;
  bool is_plugged_{true};
};

}  // namespace

std::vector<DeviceFixtureKind> can_fixtures() {
  return {
      {"socketcan", [](const ArmModel& arm, const std::string& directory) -> std::unique_ptr<DeviceFixture> {
         return std::make_unique<CanFixture>(arm, directory);
       }}};
}

}  // namespace corbot::test
