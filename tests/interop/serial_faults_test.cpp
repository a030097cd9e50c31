// SPDX-License-Identifier: Apache-2.0
// Serial controllers that fall silent, lose their power or are misheard in the middle of a motion, and what
// their servos are given then, after the emulator's own record.
#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include <fmt/format.h>

#include "config/load_profile.h"
#include "contract/driver.h"
#include "rt/backends/registry.h"
#include "support/emulated_controller.h"
#include "support/paths.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr double kSpeed_us_per_s = 100.0;  // of the motion

struct Kind {
  std::string name;
  std::vector<std::string> emulator;  ///< arguments of corbot-sim
  std::string backend;                ///< kind in the profile
  std::string options;                ///< more keys of its table
  double period_s;                    ///< between two frames
};
void PrintTo(const Kind& kind, std::ostream* out) { *out << kind.name; }

/// Required by the driver of the contract's suite.
class NoFixture final : public DeviceFixture {
 public:
  void set_up() override {}
  [[nodiscard]] std::string backend_section() const override { return {}; }
  [[nodiscard]] DeviceFacts facts() const override { return {}; }
  void unplug() override {}
  void plug() override {}
  std::vector<Output> outputs() override { return {}; }
  std::vector<double> now() override { return {}; }
};

class SerialFaults : public ::testing::TestWithParam<Kind> {
 protected:
  void SetUp() override {
    directory_ = CORBOT_SCRATCH_DIR + ("/" + unique_name("faults"));
    fs::create_directory(directory_);
    controller_.emplace(std::string(CORBOT_BIN_DIR) + "/corbot-sim", GetParam().emulator, directory_);
    controller_->start();
    if (HasFatalFailure()) return;
    std::ifstream from(CORBOT_TEST_PROFILE);
    std::stringstream text;
    text << from.rdbuf();
    const std::string all = text.str();
    profile_ = parse_profile(all.substr(0, all.find("[backend]")) +
                                 fmt::format("[backend]\nkind = \"{0}\"\n[backend.{0}]\nport = \"{1}\"\n{2}",
                                             GetParam().backend, controller_->line(), GetParam().options),
                             "faults");
    backend_ = rt::make_backend(profile_, stop_);
    backend_->open(Driver::frame(profile_.arm, pose(1200.0)));
    driver_ = std::make_unique<Driver>(profile_.arm, *backend_, no_fixture_, pose(1200.0));
    driver_->start();
    ASSERT_TRUE(reaches(BackendHealth::kOpen));
    driver_->move(pose(1800.0), 600.0 / kSpeed_us_per_s);  // under way at every fault
    ASSERT_TRUE(wait_until(within(30), [&] { return driver_->wanted(false)[0] > 1230.0; }));
  }
  void TearDown() override {
    if (driver_) driver_->end();
    if (backend_) backend_->close();
    if (controller_) {
      EXPECT_EQ(controller_->stop(), 0);
    }
    fs::remove_all(directory_);
  }

  [[nodiscard]] Pose pose(double pulse_us) const {
    Pose result;
    for (std::size_t i = 0; i < profile_.arm.dof; ++i) {
      const ServoMap& map = profile_.arm.servos[i];
      result.position_q[i] = (pulse_us - map.zero_us) / (map.direction * map.us_per_q);
    }
    const GripperModel& gripper = profile_.arm.gripper;
    result.opening = (pulse_us - gripper.closed_us) / (gripper.open_us - gripper.closed_us);
    return result;
  }
  void command(const std::string& text) { controller_->command(text); }
  [[nodiscard]] bool reaches(BackendHealth health) {
    return wait_until(within(60), [&] { return backend_->health() == health; });
  }
  /// The whole log so far.
  const std::string& log() {
    for (std::string more; !(more = to_string(backend_->drain_log())).empty();) log_ += more + "\n";
    return log_;
  }
  [[nodiscard]] bool was_logged(const std::string& text) { return was_logged(text, text); }
  [[nodiscard]] bool was_logged(const std::string& text, const std::string& or_this) {
    return wait_until(within(60), [&] {
      return log().find(text) != std::string::npos || log().find(or_this) != std::string::npos;
    });
  }
  [[nodiscard]] std::vector<double> pulses() {
    std::vector<double> values;
    for (const auto& [channel, pulse_us] : controller_->values("pulses")) values.push_back(pulse_us);
    return values;
  }
  /// By which the emulator was late, at the most.
  [[nodiscard]] double late_s() {
    const std::string late_ns = controller_->answer("late");
    return late_ns.empty() ? 0.0 : 1e-9 * std::stod(late_ns);
  }
  [[nodiscard]] bool arrives() {
    return wait_until(within(60), [&] {
      const std::vector<double> wanted = driver_->wanted(false);
      const std::vector<double> found = pulses();
      if (driver_->moving() || found.size() != wanted.size()) return false;
      for (std::size_t i = 0; i < wanted.size(); ++i) {
        if (std::abs(found[i] - wanted[i]) > 1.0) return false;
      }
      return true;
    });
  }
  /// Returns how much further a pulse went than allowed, in us. It may go as far as two frames at 400 us/s,
  /// and as a motion that a busy machine has held up. The hold-up may be between two rows, in the backend's
  /// thread, or in the emulator, which then takes several frames at once. Rows are one servo frame apart, or
  /// nothing changed between them. The first pulse of a servo is no step: it may be anywhere, and no
  /// controller can know where.
  [[nodiscard]] double worst_jump() {
    std::map<std::uint32_t, DeviceRow> last;
    const double held_up_s = driver_->oldest_s() + late_s();
    double worst = -HUGE_VAL;
    for (const DeviceRow& row : controller_->rows()) {
      const auto before = last.find(row.channel);
      if (before != last.end() && before->second.has_power && row.has_power) {
        const double seconds = static_cast<double>(row.time_ns - before->second.time_ns) * 1e-9;
        const double allowed =
            400.0 * 2.0 * GetParam().period_s + 1.1 * kSpeed_us_per_s * (seconds + held_up_s) + 1.0;
        const double jump_us = std::abs(row.given - before->second.given) - allowed;
        if (jump_us > std::max(worst, 0.0)) {
          jump_ = fmt::format("channel {} from {} us at {} ns to {} us at {} ns", row.channel,
                              before->second.given, before->second.time_ns, row.given, row.time_ns);
        }
        worst = std::max(worst, jump_us);
      }
      last[row.channel] = row;
    }
    return worst;
  }

  std::string directory_;
  Profile profile_;
  EmergencyStop stop_;
  NoFixture no_fixture_;
  std::optional<EmulatedController> controller_;
  std::unique_ptr<Backend> backend_;
  std::unique_ptr<Driver> driver_;
  std::string log_;
  std::string jump_;  ///< the worst, after the record
};

TEST_P(SerialFaults, ASilentControllerIsDegradedThenLostAndComesBack) {
  command("silent on");
  ASSERT_TRUE(reaches(BackendHealth::kLost));
  EXPECT_TRUE(was_logged("lost:"));
  EXPECT_LT(log().find("degraded:"), log().find("lost:")) << log();
  ASSERT_TRUE(wait_until(within(20), [&] { return !driver_->moving(); }));
  driver_->move(pose(1700.0), 0.0);  // as after a bus that had stalled: the arm was to be further on
  command("silent off");
  ASSERT_TRUE(reaches(BackendHealth::kOpen));
  EXPECT_TRUE(arrives()) << log();
  EXPECT_LE(worst_jump(), 0.0) << jump_ << "\n" << log();
}

TEST_P(SerialFaults, ARestartIsNoticedAndTheWayBackIsSlow) {
  // The loss is short, and this thread may stand still with the machine: until it sees the loss.
  std::uint64_t frames = 0;
  ASSERT_TRUE(wait_until(within(60), [&] {
    frames = backend_->times().frames;
    command("reset");
    return wait_until(within(5), [&] { return backend_->health() == BackendHealth::kLost; });
  }));
  EXPECT_LE(backend_->times().frames, frames + 15) << "soon";
  // In the middle of a command, of which the controller takes the rest for an error.
  ASSERT_TRUE(was_logged("has restarted", "reports serial protocol")) << log();
  command("silent on");  // lost for as long as this thread needs
  ASSERT_TRUE(reaches(BackendHealth::kLost));
  ASSERT_TRUE(wait_until(within(20), [&] { return !driver_->moving(); }));
  driver_->move(pose(1700.0), 0.0);
  command("silent off");
  ASSERT_TRUE(reaches(BackendHealth::kOpen));
  EXPECT_TRUE(arrives()) << log();
  EXPECT_LE(worst_jump(), 0.0) << jump_ << "\n" << log();
}

TEST_P(SerialFaults, AShortLossOfPowerIsFollowedByNoPulseUntilClear) {
  // Power that is back within the time of one command on the line finds the rest of it there: no shorter
  // ones.
  const int shortest_ms = GetParam().period_s > 0.03 ? 100 : 20;
  for (const int ms : {shortest_ms, 33, 150, 270, 330}) {
    if (ms < shortest_ms) continue;
    driver_->leave();
    command(fmt::format("brownout {}", ms));
    const std::size_t before = controller_->rows().size();
    ASSERT_TRUE(reaches(BackendHealth::kStandby)) << ms << "\n" << log();
    ASSERT_TRUE(was_logged("has restarted", "no answer")) << log();
    std::map<std::uint32_t, double> last;
    const std::vector<DeviceRow> rows = controller_->rows();
    for (std::size_t i = before; i < rows.size(); ++i) {
      const auto [channel, is_new] = last.try_emplace(rows[i].channel, rows[i].given);
      EXPECT_FALSE(channel->second <= 0.0 && rows[i].given > 0.0) << ms << " ms, channel " << rows[i].channel;
      channel->second = rows[i].given;
    }
    for (const double pulse_us : pulses()) EXPECT_EQ(pulse_us, 0.0) << ms << " ms";
    driver_->clear();
    ASSERT_TRUE(reaches(BackendHealth::kOpen)) << ms << "\n" << log();
    ASSERT_TRUE(arrives()) << ms << "\n" << log();
  }
}

TEST_P(SerialFaults, AFewBytesThatAreLostOrGarbledMakeNoJump) {
  for (const char* fault : {"drop 1", "garble 1", "drop 7", "garble 3", "drop 2"}) {
    const std::uint64_t frames = backend_->times().frames;
    command(fault);
    ASSERT_TRUE(wait_until(within(60), [&] { return backend_->times().frames > frames + 10; })) << fault;
    ASSERT_TRUE(reaches(BackendHealth::kOpen)) << fault << "\n" << log();
  }
  ASSERT_TRUE(wait_until(within(30), [&] { return !driver_->moving(); }));
  driver_->move(pose(1500.0), std::abs(driver_->wanted(false)[0] - 1500.0) / kSpeed_us_per_s);
  EXPECT_TRUE(arrives()) << log();
  EXPECT_TRUE(reaches(BackendHealth::kOpen)) << log();
  EXPECT_LE(worst_jump(), 0.0) << jump_ << "\n" << log();
}

INSTANTIATE_TEST_SUITE_P(
    Controllers, SerialFaults,
    ::testing::Values(Kind{"ssc32", {"ssc32", "--model", "ssc32"}, "ssc32", "", 0.020},
                      Kind{"ssc32u", {"ssc32"}, "ssc32", "", 0.020},
                      Kind{"ssc32u_slow_line", {"ssc32", "--baud", "9600"}, "ssc32", "baud = 9600\n", 0.066},
                      Kind{"ssc32u_readback", {"ssc32"}, "ssc32", "readback = true\n", 0.020},
                      Kind{"maestro", {"maestro"}, "maestro", "", 0.020},
                      Kind{"maestro_readback", {"maestro"}, "maestro", "readback = true\n", 0.020}),
    [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace corbot::test
