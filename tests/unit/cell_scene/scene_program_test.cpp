// SPDX-License-Identifier: Apache-2.0
// Tests the program with a whole robot at its controller's socket: a program of motions brings a piece.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cstddef>
#include <fstream>
#include <string_view>
#include <thread>

#include "cell/cell_config.h"
#include "cell/scene_record.h"
#include "cli/cli_rig.h"
#include "config/load_profile.h"
#include "shm/descriptor.h"
#include "support/paths.h"

namespace corbot::test {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;

class SceneProgramTest : public CliRig {
 protected:
  /// Returns the piece as recorded. The scene writes the record a little after the end of the motion.
  [[nodiscard]] cell::RecordedPiece piece() const {
    std::ifstream file(cell::scene_record_file(directory_ / "cell"));
    const cell::SceneRecord record = cell::read_scene_record(file);
    return record.samples.at(record.samples.size() - 1).pieces[0];
  }
  template <class F>
  static bool soon(F&& is_so) {
    return wait_until(within(30), [&] {
      try {
        return is_so();
      } catch (const std::exception&) {
        return false;  // the record does not have the line yet
      }
    });
  }
};

TEST_F(SceneProgramTest, ARobotAtItsSocketBringsAPiece) {
  const std::string file = CORBOT_TEST_PROFILES "/cell/cell.toml";
  cell::CellOverrides overrides;
  overrides.state_directory = directory_ / "cell";
  const cell::CellConfig cell = cell::load_cell(file, overrides);
  Process scene({CORBOT_BIN_DIR "/corbot-scene", file, "--state-dir", cell.state_directory, "--pieces", "1"});
  ASSERT_TRUE(scene.wait_line("ready", within(30))) << scene.errors();

  const cell::CellRobot& robot = cell.robots[0];
  std::string profile = read_profile_text(robot.profile);
  const std::string placeholder = "SCENE/NAME.servos";
  profile.replace(profile.find(placeholder), placeholder.size(), cell.servo_socket(robot).string());
  up({}, put("arm.toml", profile));

  Vector3d foot_m;
  ASSERT_TRUE(soon([&] {
    foot_m = piece().foot_m;
    return true;
  }));
  const double over_foot_m = cell.kinds[0].grasp_m;
  const auto at = [&](const Vector3d& foot) {
    const Vector3d local = robot.frame.to_local(foot + Vector3d(0, 0, over_foot_m));
    return fmt::format("{:.5f} {:.5f} {:.5f}", local.x(), local.y(), local.z());
  };
  const std::string source = at(foot_m);
  const std::string target = at(cell.place("store1")->slot_position(0));
  const auto run_program = [&](const std::string& program) {
    const RunResult result = corbot({"run", put("program.corbot", program)}, 120);
    ASSERT_EQ(result.code, 0) << result.errors;
  };
  run_program(fmt::format(
      "open\nmove {0} --above 0.06\nmoves {0}\ndelay 0.1\nclose\nmoves {0} --above 0.06\n", source));
  EXPECT_TRUE(soon([&] { return piece().hand == 0u; }));
  run_program(
      fmt::format("move {0} --above 0.06\nmoves {0}\ndelay 0.1\nopen\nmoves {0} --above 0.06\n", target));
  EXPECT_TRUE(soon([&] { return !piece().hand && !piece().is_fallen; }));
  EXPECT_TRUE(cell.place("store1")->covers(piece().foot_m));

  scene.signal(SIGTERM);
  EXPECT_THAT(
      scene.wait_line("end ", within(30)).value_or(""),
      HasSubstr("end pallet1=0 store1=1 pallet2=0 elsewhere=0 held=0 fallen=0 touches=0 nearest_mm="));
  EXPECT_EQ(scene.wait(within(30)), 0) << scene.errors();
}

TEST_F(SceneProgramTest, GoesOnAfterAHangUpUnderNohup) {
  Process scene({"/bin/sh", "-c", "trap '' HUP; exec \"$@\"", "sh", CORBOT_BIN_DIR "/corbot-scene",
                 CORBOT_TEST_PROFILES "/cell/cell.toml", "--state-dir", directory_ / "cell"});
  ASSERT_TRUE(scene.wait_line("ready", within(30))) << scene.errors();
  scene.signal(SIGHUP);
  std::this_thread::sleep_for(std::chrono::milliseconds(600));  // it looks every 200 ms
  EXPECT_TRUE(scene.running());
  scene.signal(SIGTERM);
  EXPECT_EQ(scene.wait(within(30)), 0) << scene.errors();
}

TEST_F(SceneProgramTest, IsReportedReadyOnceTheSupervisorReads) {
  const std::string name = "@" + unique_name("supervisor");
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  name.copy(address.sun_path + 1, name.size() - 1, 1);
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
  const auto* const to = reinterpret_cast<const sockaddr*>(&address);
  const Descriptor supervisor(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const Descriptor other(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  ASSERT_EQ(::bind(supervisor.get(), to, size), 0);
  while (::sendto(other.get(), "full", 4, 0, to, size) == 4) continue;
  Process scene({CORBOT_BIN_DIR "/corbot-scene", CORBOT_TEST_PROFILES "/cell/cell.toml", "--state-dir",
                 directory_ / "cell"},
                {"NOTIFY_SOCKET=" + name});
  ASSERT_TRUE(scene.wait_line("ready", within(30))) << scene.errors();
  EXPECT_TRUE(wait_until(within(10), [&] {
    char text[64];
    const ssize_t count = ::recv(supervisor.get(), text, sizeof(text), 0);
    return count > 0 && std::string_view(text, static_cast<std::size_t>(count)) == "READY=1";
  }));
}

}  // namespace
}  // namespace corbot::test
