// SPDX-License-Identifier: Apache-2.0
// [backend.socketcan]: what is read, and every way to get it wrong.
#include <gmock/gmock.h>

#include <fstream>
#include <iterator>
#include <numbers>

#include "config/load_profile.h"
#include "support/paths.h"

namespace corbot::can_profile_test {
namespace {

using testing::HasSubstr;

const std::string kFile = std::string(CORBOT_PROFILES) + "/lynx5-can.toml";

TEST(CanProfile, IsReadToTheLastValue) {
  const Profile profile = load_profile(kFile);
  EXPECT_EQ(profile.backend.kind, "socketcan");
  const SocketCanOptions& options = profile.backend.socketcan;
  EXPECT_EQ(options.interface, "unix:/tmp/can");
  EXPECT_EQ(options.bit_rate, 0);
  EXPECT_EQ(options.heartbeat_ms, 200);
  EXPECT_EQ(options.watch_ms, 0);
  EXPECT_TRUE(profile.backend.common.readback);
  EXPECT_FALSE(profile.backend.common.relax_at_end);
  ASSERT_EQ(options.drives.size(), 4u);
  EXPECT_EQ(options.drives[3].node, 4);
  EXPECT_DOUBLE_EQ(options.drives[3].counts_per_q, 1000.0 * 180.0 / std::numbers::pi);
  EXPECT_EQ(options.drives[3].direction, 1.0);
  EXPECT_EQ(options.gripper_node, 5);
  EXPECT_EQ(options.gripper_open_count, 40'000.0);
}

TEST(CanProfile, HasIdentitiesAndHoming) {
  std::ifstream file(kFile);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  const std::string from = "node = 1\n";
  text.replace(text.find(from), from.size(),
               from +
                   "vendor = 42\nserial = 4294967295\nreports_following = false\nhoming_method = 19\n"
                   "homing_speed_deg_s = 10\nhoming_offset = -500\n");
  const SocketCanOptions options = parse_profile(text, "can.toml").backend.socketcan;
  const CanDrive& drive = options.drives[0];
  EXPECT_EQ(drive.identity, (CanIdentity{42u, std::nullopt, std::nullopt, 4294967295u}));
  EXPECT_FALSE(drive.reports_following);
  EXPECT_EQ(drive.homing.method, 19);
  EXPECT_DOUBLE_EQ(drive.homing.speed_q_s, 10.0 * std::numbers::pi / 180.0);
  EXPECT_DOUBLE_EQ(drive.homing.creep_q_s, std::numbers::pi / 180.0);
  EXPECT_EQ(drive.homing.acceleration_q_s2, 0.0);
  EXPECT_EQ(drive.homing.offset, -500.0);
  EXPECT_TRUE(options.drives[1].reports_following);
  EXPECT_EQ(options.drives[1].homing.method, 0);
}

struct Wrong {
  std::string name;
  std::string from;
  std::string to;
  std::string key;
  std::string allowed;
};
void PrintTo(const Wrong& wrong, std::ostream* out) { *out << wrong.name; }

class CanRefused : public testing::TestWithParam<Wrong> {};

TEST_P(CanRefused, NamesKeyAndWhatIsAllowed) {
  std::ifstream file(kFile);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  const std::size_t at = text.find(GetParam().from);
  ASSERT_NE(at, text.npos);
  text.replace(at, GetParam().from.size(), GetParam().to);
  try {
    (void)parse_profile(text, "can.toml");
    FAIL() << "not refused";
  } catch (const ConfigError& error) {
    ASSERT_EQ(error.faults().size(), 1u) << error.what();
    EXPECT_EQ(error.faults()[0].key, "backend.socketcan" + GetParam().key);
    EXPECT_THAT(error.faults()[0].allowed, HasSubstr(GetParam().allowed));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Profile, CanRefused,
    testing::Values(
        Wrong{"NodeZero", "node = 1\n", "node = 0\n", ".drive[0].node", "1 to 127"},
        Wrong{"NodeHigh", "node = 5\n", "node = 128\n", ".gripper.node", "1 to 127"},
        Wrong{"NodeTwice", "node = 2\n", "node = 1\n", ".drive[1].node",
              "used by backend.socketcan.drive[0].node"},
        Wrong{"NodeOfTheGripper", "node = 5\n", "node = 4\n", ".gripper.node", "used by"},
        Wrong{"Scale", "counts_per_degree = 1000.0", "counts_per_degree = 0", ".drive[0].counts_per_degree",
              "above 0"},
        Wrong{"Serial", "node = 1\n", "node = 1\nserial = -1\n", ".drive[0].serial", "0 to 4294967295"},
        Wrong{"HomingMethod", "node = 1\n", "node = 1\nhoming_method = 0\n", ".drive[0].homing_method",
              "must not be 0"},
        Wrong{"HomingSpeed", "node = 1\n", "node = 1\nhoming_method = 37\nhoming_speed_deg_s = 91\n",
              ".drive[0].homing_speed_deg_s", "90 degrees a second"},
        Wrong{"HomingOfNoMethod", "node = 1\n", "node = 1\nhoming_offset = 3\n", ".drive[0].homing_offset",
              "needs homing_method"},
        Wrong{"Zero", "zero_count = 0", "zero_count = 1e10", ".drive[0].zero_count", "counts"},
        Wrong{"Direction", "direction = 1\n", "direction = 0\n", ".drive[0].direction", "1 or -1"},
        Wrong{"Interface", "\"unix:/tmp/can\"", "\"can 0\"", ".interface", "can0"},
        Wrong{"Socket", "\"unix:/tmp/can\"", "\"unix:can\"", ".interface", "unix:/path"},
        Wrong{"Heartbeat", "heartbeat_ms = 200", "heartbeat_ms = 1", ".heartbeat_ms", "10 to 5000 ms"},
        Wrong{"Watch", "readback = true", "watch_ms = 19", ".watch_ms", "0 (off), or 20 to 5000 ms"},
        Wrong{"WatchLong", "readback = true", "watch_ms = 5001", ".watch_ms", "0 to 5000 ms"},
        Wrong{"WatchNode",
              "readback = true\nat_end = \"hold\"\n\n[[backend.socketcan.drive]]  # base\nnode = 1\n",
              "watch_ms = 100\n[[backend.socketcan.drive]]\nnode = 127\n", ".watch_ms", "drive[0].node"},
        Wrong{"AtEnd", "\"hold\"", "\"fall\"", ".at_end", "\"hold\" or \"relax\""},
        Wrong{"BitRate", "readback = true", "bit_rate = 2000000", ".bit_rate", "0 to 1"},
        Wrong{"DriveTooMany", "[backend.socketcan.gripper]\nnode = 5\nclosed_count = 0\nopen_count = 40000",
              "[[backend.socketcan.drive]]\nnode = 5\ncounts_per_degree = 1", ".drive",
              "5 drives, but the arm has 4"},
        Wrong{"GripperStands", "open_count = 40000", "open_count = 0", ".gripper.open_count", "differ"},
        Wrong{"Unknown", "readback = true", "feedback = true", ".feedback", "unknown"}),
    [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace corbot::can_profile_test
