// SPDX-License-Identifier: Apache-2.0
// The program with a whole robot at its controller's socket: a program of motions brings a piece.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <fstream>

#include "cell/cell_config.h"
#include "cli/cli_rig.h"
#include "config/load_profile.h"
#include "support/paths.h"

namespace corbot::test {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;

class SceneProgramTest : public CliRig {
 protected:
  nlohmann::json piece() const {
    std::ifstream file(directory_ / "truth.json");
    return nlohmann::json::parse(file)["pieces"][0];
  }
};

TEST_F(SceneProgramTest, ARobotAtItsSocketBringsAPiece) {
  const std::string file = CORBOT_PROFILES "/cell/cell.toml";
  cell::CellOverrides overrides;
  overrides.state_directory = directory_ / "cell";
  const cell::CellConfig cell = cell::load_cell(file, overrides);
  Process scene({CORBOT_BIN_DIR "/corbot-scene", file, "--state-dir", cell.state_directory, "--pieces", "1",
                 "--truth", directory_ / "truth.json"});
  ASSERT_TRUE(scene.wait_line("ready", within(30))) << scene.errors();

  const cell::CellRobot& robot = cell.robots[0];
  std::string profile = read_profile_text(robot.profile);
  const std::string placeholder = "SCENE/NAME.servos";
  profile.replace(profile.find(placeholder), placeholder.size(), cell.servo_socket(robot).string());
  up({}, put("arm.toml", profile));

  const auto foot = piece()["foot_m"].get<std::vector<double>>();
  const double over_foot_m = cell.kinds[0].grasp_m;
  const auto at = [&](const Vector3d& foot_m) {
    const Vector3d local = robot.frame.to_local(foot_m + Vector3d(0, 0, over_foot_m));
    return fmt::format("{:.5f} {:.5f} {:.5f}", local.x(), local.y(), local.z());
  };
  const std::string source = at(Vector3d(foot.data()));
  const std::string target = at(cell.place("store1")->slot_position(0));
  const auto run_program = [&](const std::string& program) {
    const RunResult result = corbot({"run", put("program.corbot", program)}, 120);
    ASSERT_EQ(result.code, 0) << result.errors;
  };
  run_program(fmt::format(
      "open\nmove {0} --above 0.06\nmoves {0}\ndelay 0.1\nclose\nmoves {0} --above 0.06\n", source));
  EXPECT_EQ(piece()["state"], "held");
  EXPECT_EQ(piece()["robot"], "robot1");
  run_program(
      fmt::format("move {0} --above 0.06\nmoves {0}\ndelay 0.1\nopen\nmoves {0} --above 0.06\n", target));
  EXPECT_EQ(piece()["state"], "standing");
  EXPECT_EQ(piece()["place"], "store1");

  scene.signal(SIGTERM);
  EXPECT_THAT(
      scene.wait_line("end ", within(30)).value_or(""),
      HasSubstr("end pallet1=0 store1=1 pallet2=0 elsewhere=0 held=0 fallen=0 touches=0 nearest_mm="));
  EXPECT_EQ(scene.wait(within(30)), 0) << scene.errors();
}

}  // namespace
}  // namespace corbot::test
