// SPDX-License-Identifier: Apache-2.0
// Tests the scene of the demo cell in simulated time, and its loop and pictures in real time.
#include "cell/scene/scene.h"

#include <gmock/gmock.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fstream>
#include <numbers>
#include <set>
#include <thread>

#include "cell/cell_rules.h"
#include "cell/picture_wire.h"
#include "cell/scene/picture_server.h"
#include "cell/scene/scene_loop.h"
#include "cell/scene/scene_recorder.h"
#include "client/failure.h"
#include "config/load_profile.h"
#include "corbot/kinematics/tool_pose.h"
#include "rt/backends/serial/serial_port.h"
#include "sim/devices/control_input.h"
#include "support/paths.h"
#include "support/process.h"

namespace corbot::cell {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using rt::SerialPort;
using testing::HasSubstr;
using namespace std::chrono_literals;

class SceneTest : public testing::Test {
 protected:
  SceneTest() {
    std::string path = CORBOT_SCRATCH_DIR "/scene-XXXXXX";
    directory_ = ::mkdtemp(path.data());
  }
  ~SceneTest() override { fs::remove_all(directory_); }
  [[nodiscard]] CellConfig demo(int pieces = 12, std::uint64_t seed = 1) const {
    CellOverrides overrides;
    overrides.state_directory = directory_;
    overrides.pieces = pieces;
    overrides.seed = seed;
    return load_cell(CORBOT_PROFILES "/cell/cell.toml", overrides);
  }
  fs::path directory_;
};

/// A robot of a cell without a servant: the test sends pulses to its controller, in simulated time.
class Driver {
 public:
  Driver(const CellConfig& cell, Scene& scene, const char* robot = "robot1")
      : scene_(scene), robot_(*cell.robot(robot)) {
    std::string text = read_profile_text(robot_.profile);
    text.replace(text.find("SCENE/NAME"), 10, "/x");
    arm_ = parse_profile(text, robot_.profile.string()).arm;
    line_.open("unix:" + cell.servo_socket(robot_).string(), 115200);
    pass(0.1);
  }
  void pass(double time_s) {
    for (const std::int64_t end_ns = now_ns_ + std::llround(time_s * 1e9); now_ns_ < end_ns;) {
      now_ns_ += Scene::kTick_ns;
      scene_.tick(now_ns_);
      scene_.exchange(now_ns_);
    }
  }
  void move(const Vector3d& world) {
    const Vector3d p = robot_.frame.to_local(world);
    const Angles level{arm_.kind == ArmKind::kScara ? 0 : angle_of_pitch(arm_.kinematics, 0)};
    const auto solution = arm_.kinematics.inverse_at({p.x(), p.y(), p.z()}, level, 0, {});
    ASSERT_EQ(solution.status, IkStatus::kOk) << world.transpose();
    for (std::size_t i = 0; i < arm_.dof; ++i) {
      const ServoMap& servo = arm_.servos[i];
      pulse(servo.channel, servo.zero_us + servo.direction * servo.us_per_q * solution.joints_q[i]);
    }
    pass(2);
  }
  void grip(bool is_open) {
    pulse(arm_.gripper.channel, is_open ? arm_.gripper.open_us : arm_.gripper.closed_us);
    pass(1);
  }

 private:
  void pulse(std::size_t channel, double pulse_us) {
    const std::string text =
        "#" + std::to_string(channel) + "P" + std::to_string(std::lround(pulse_us)) + "T500\r";
    line_.write({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()},
                SerialPort::Clock::now() + 10s);
  }
  Scene& scene_;
  const CellRobot& robot_;
  ArmModel arm_;
  SerialPort line_;
  std::int64_t now_ns_{1'000'000'000};
};

TEST_F(SceneTest, AtPowerUpTheArmsAreApartAndThePiecesLieInTheArea) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Scene scene(demo(12, seed));
    scene.tick(1'000'000'000);
    EXPECT_THAT(scene.summary(),
                testing::StartsWith("pallet1=12 store1=0 pallet2=0 elsewhere=0 held=0 fallen=0 "
                                    "touches=0 nearest_mm="));
    EXPECT_THAT(scene.summary(), Not(HasSubstr("nearest_mm=-")));
  }
}

CellConfig with_squares(CellConfig cell) {
  cell.kinds[0].is_square = true;
  cell.kinds[0].width_m = 0.018;
  cell.kinds[0].label_m = 0.014;
  return cell;
}

/// Returns the angle between the first piece's sides and the robot's hand.
double square_turn_rad(const Scene& scene, std::string_view robot) {
  const auto arms = scene.cast().arms;
  const auto arm =
      std::find_if(arms.begin(), arms.end(), [&](const auto& each) { return each.name == robot; });
  const double across_rad = scene.sample().arms[static_cast<std::size_t>(arm - arms.begin())].across_rad;
  return std::remainder(scene.view().pieces[0].yaw_rad - across_rad, std::numbers::pi / 2);
}

/// Brings the only piece of the first place to a slot by the robot. A square then stands in line with the
/// hand, or turned by as much as before.
void bring(const CellConfig& cell, const char* robot, const Vector3d& slot) {
  Scene scene(cell);
  Driver driver(cell, scene, robot);
  const Vector3d up(0, 0, 0.06);
  const Vector3d grasp(0, 0, cell.kinds[0].grasp_m);
  const Vector3d piece = scene.view().pieces[0].foot_m;
  driver.grip(true);
  driver.move(piece + grasp + up);
  driver.move(piece + grasp);
  driver.grip(false);
  EXPECT_THAT(scene.summary(), HasSubstr("pallet1=0 store1=0 pallet2=0 elsewhere=0 held=1"));
  const double held_rad = square_turn_rad(scene, robot);
  EXPECT_EQ(scene.cast().arms[*scene.sample().pieces[0].hand].name, robot);
  driver.move(piece + grasp + up);
  EXPECT_NEAR(scene.view().pieces[0].foot_m.z(), up.z(), 0.003);
  driver.move(slot + grasp + up);
  driver.move(slot + grasp);
  driver.grip(true);
  EXPECT_THAT(scene.summary(), HasSubstr("pallet1=0 store1=1 pallet2=0 elsewhere=0 held=0 fallen=0"));
  EXPECT_THAT(scene.summary(), HasSubstr("touches=0"));
  if (cell.kinds[0].is_square) {
    EXPECT_NEAR(square_turn_rad(scene, robot), held_rad, 1e-9);
  }
  EXPECT_NEAR((scene.view().pieces[0].foot_m - slot).norm(), 0, 0.012) << "servos have a dead band";
}

TEST_F(SceneTest, ARobotBringsAPieceByItsControllersLine) {
  const CellConfig cell = demo(1);
  bring(cell, "robot1", cell.place("store1")->slot_position(1));
}

TEST_F(SceneTest, SquaresOfEveryYawAreBroughtByBothArms) {
  constexpr std::uint64_t kSeeds = CORBOT_SANITIZED ? 2 : 6;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    CellConfig cell = with_squares(demo(1, seed));
    bring(cell, "robot1", cell.place("store1")->slot_position(1));
    cell.robots[1].profile = CORBOT_CELL "/scara.toml";
    cell.robots[1].frame.yaw_rad = std::numbers::pi;
    std::swap(cell.places[0].frame, cell.places[2].frame);
    bring(cell, "robot2", cell.place("store1")->slot_position(1));
  }
}

TEST_F(SceneTest, EachSquareIsDrawnWithAYawOfItsOwn) {
  std::set<double> yaws;
  for (const sim::DrawnPiece& piece : Scene(with_squares(demo(6))).view().pieces) {
    EXPECT_TRUE(piece.is_square);
    yaws.insert(piece.yaw_rad);
  }
  EXPECT_EQ(yaws.size(), 6u);
  for (const sim::DrawnPiece& piece : Scene(demo(6)).view().pieces) {
    EXPECT_FALSE(piece.is_square);
    EXPECT_EQ(piece.yaw_rad, 0);
  }
}

TEST_F(SceneTest, AScaraTakesAPieceFromAbove) {
  CellConfig cell = demo(1);
  cell.robots[1].profile = CORBOT_CELL "/scara.toml";
  cell.robots[1].frame.yaw_rad = std::numbers::pi;
  std::swap(cell.places[0].frame, cell.places[2].frame);  // so that the piece is within reach
  bring(cell, "robot2", cell.place("store1")->slot_position(1));
}

TEST_F(SceneTest, AnArmThatRunsElsewhereIsThereByItsSceneProfile) {
  CellConfig cell = demo(1);
  std::swap(cell.robots[0].profile, cell.robots[0].scene_profile);
  Scene scene(cell);
  scene.tick(1'000'000'000);
  EXPECT_EQ(scene.cast().arms.size(), 2u);
  EXPECT_TRUE(fs::exists(cell.servo_socket(cell.robots[0])));
}

TEST_F(SceneTest, ASceneProfileWithAnotherPortIsRefused) {
  CellConfig cell = demo(1);
  cell.robots[0].profile.clear();
  cell.robots[0].scene_profile = CORBOT_SHIPPED_PROFILE;
  try {
    const Scene scene(cell);
    ADD_FAILURE() << "an arm without a controller in the scene";
  } catch (const client::Failure& failure) {
    EXPECT_EQ(failure.code(), client::ExitCode::kUsage);
    EXPECT_THAT(failure.what(),
                HasSubstr("robot[0].scene_profile: its backend must have port = \"unix:SCENE/"));
  }
}

TEST_F(SceneTest, APersonEmptiesAndRefillsAPlace) {
  Scene scene(demo(12));
  scene.tick(1'000'000'000);
  EXPECT_FALSE(scene.is_changed());
  EXPECT_EQ(scene.command("empty pallet1"), "ok 12 taken away");
  EXPECT_THAT(scene.command("count"), testing::StartsWith("ok pallet1=0 store1=0"));
  EXPECT_EQ(scene.command(" refill "), "ok 10 put down") << "none under the hand of an arm";
  for (int i = 0; i < 5; ++i) EXPECT_THAT(scene.command("refill"), testing::StartsWith("ok "));
  const double spacing_m = piece_room(demo(12))->spacing_m - 1e-12;
  const std::vector<sim::DrawnPiece> pieces = scene.view().pieces;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) EXPECT_GE((pieces[i].foot_m - pieces[k].foot_m).norm(), spacing_m);
  }
  EXPECT_TRUE(scene.is_changed());
  EXPECT_EQ(scene.command("empty nowhere"), "error: no place 'nowhere'");
  EXPECT_THAT(scene.command("fill"), testing::StartsWith("error: "));
}

TEST_F(SceneTest, RefillsUpToTheNumberAtTheStart) {
  Scene scene(demo(4));
  scene.tick(1'000'000'000);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(scene.command("refill"), "ok 0 put down");
  EXPECT_THAT(scene.command("count"), testing::StartsWith("ok pallet1=4 "));
}

TEST_F(SceneTest, WhatDoesNotFitIsRefused) {
  CellConfig too_many = demo();
  too_many.scene->pieces = 13;
  try {
    const Scene scene(too_many);
    ADD_FAILURE();
  } catch (const client::Failure& failure) {
    EXPECT_THAT(failure.what(), HasSubstr("at most 12 fit on pallet1"));
  }
  CellConfig without_scene = demo();
  without_scene.scene.reset();
  EXPECT_THROW((Scene(without_scene)), client::Failure);
}

TEST(LabelColour, IsInTheMiddleOfTheKindsHues) {
  const auto bgr = [](double from, double to) {
    Kind kind;
    kind.hue_deg = {from, to};
    return label_bgr(kind);
  };
  using Bgr = std::array<std::uint8_t, 3>;
  EXPECT_EQ(bgr(345, 15), (Bgr{33, 33, 217})) << "red, through 0";
  EXPECT_EQ(bgr(100, 140), (Bgr{33, 217, 33}));
  EXPECT_EQ(bgr(230, 250), (Bgr{217, 33, 33}));
  EXPECT_EQ(bgr(50, 70), (Bgr{33, 217, 217})) << "yellow";
}

TEST_F(SceneTest, TheLoopAnswersLooksAndGivesSamples) {
  Scene scene(demo());
  std::vector<SceneSample> samples;
  SceneLoop loop(scene, [&](SceneSample sample) { samples.push_back(std::move(sample)); });
  EXPECT_FALSE(loop.look(1ms)) << "it does not run yet";
  {
    std::jthread running([&](const std::stop_token& stop) { loop.run(stop); });
    const auto view = loop.look(10s);
    ASSERT_TRUE(view);
    EXPECT_EQ(view->pieces.size(), 12u);
    EXPECT_EQ(view->arms.size(), 8u);
    SerialPort line;
    line.open("unix:" + (directory_ / "robot2.servos").string(), 115200);
    const std::string query = "VER\r";
    line.write({reinterpret_cast<const std::uint8_t*>(query.data()), query.size()},
               SerialPort::Clock::now() + 10s);
    std::array<std::uint8_t, 5> answer{};
    line.read_exactly(answer, SerialPort::Clock::now() + 10s);
    EXPECT_EQ(std::string(answer.begin(), answer.end()), "SSC32");
  }
  ASSERT_FALSE(samples.empty());
  EXPECT_EQ(samples[0].time_s, 0);
  EXPECT_EQ(samples[0].pieces.size(), 12u);
  ASSERT_EQ(samples[0].arms.size(), 2u);
  EXPECT_EQ(samples[0].arms[0].points_m.size(), 5u);
  EXPECT_NEAR(samples[0].arms[1].points_m.front().x(), 0.48, 1e-6);
  for (std::size_t i = 1; i < samples.size(); ++i)
    ASSERT_NEAR(samples[i].time_s - samples[i - 1].time_s, 0.05, 1e-9) << "also after a delay";
}

TEST_F(SceneTest, TheRecordIsOnDiskWhileTheRunGoesOnAndWholeAtItsEnd) {
  Scene scene(demo());
  scene.tick(1'000'000'000);
  const fs::path file = scene_record_file(directory_);
  SceneRecorder recorder(file, scene.cast());
  const auto read = [&] {
    std::ifstream text(file);
    return read_scene_record(text);
  };
  std::jthread running([&](const std::stop_token& stop) { recorder.run(stop); });
  recorder.add(scene.sample());
  ASSERT_TRUE(test::wait_until(test::within(30), [&] {
    return fs::exists(file) && fs::file_size(file) > 0 && !read().samples.empty();
  }));
  SceneSample last = scene.sample();
  last.time_s = 3;
  last.pieces[5].hand = 1;
  recorder.add(last);
  running.request_stop();
  running.join();
  const SceneRecord record = read();
  EXPECT_EQ(record.cast.kinds, std::vector<std::string>(12, "red"));
  ASSERT_EQ(record.samples.size(), 2u);
  EXPECT_EQ(record.samples[1].pieces[5].hand, 1u);
}

TEST_F(SceneTest, ARecordThatCannotBeWrittenEndsOnlyItself) {
  SceneRecorder recorder(directory_ / "missing" / "scene.record", {});
  recorder.run({});
  recorder.add({});
}

TEST_F(SceneTest, ALookIsNotAnsweredByATickThatBeganBeforeIt) {
  Scene scene(demo());
  SceneLoop loop(scene);
  const std::jthread running([&](const std::stop_token& stop) { loop.run(stop); });
  for (int i = 0; i < 400; ++i) {
    std::this_thread::sleep_for(std::chrono::microseconds(i * 37 % 5000));  // any time between two ticks
    const std::int64_t asked_ns = sim::clock_ns();
    const auto view = loop.look(10s);
    ASSERT_TRUE(view);
    ASSERT_GE(view->time_ns, asked_ns) << "look " << i;
  }
}

/// A server whose pictures are one value, the number of the look.
class PictureServerTest : public SceneTest {
 protected:
  static constexpr std::array<int, 2> kSize{640, 480};
  static constexpr std::size_t kBytes = 640 * 480 * 3;
  PictureServerTest()
      : server_(
            directory_ / "picture.sock", kSize,
            [this]() -> std::optional<SceneView> {
              ++looks_;
              return SceneView{};
            },
            [this](const SceneView&) -> const std::vector<std::uint8_t>& {
              pixels_.assign(kBytes, static_cast<std::uint8_t>(looks_));
              return pixels_;
            }),
        running_([this](const std::stop_token& stop) { server_.run(stop); }) {}

  int connected() const {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::string path = directory_ / "picture.sock";
    path.copy(address.sun_path, sizeof(address.sun_path) - 1);
    const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const timeval patience{20, 0};
    ::setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
    EXPECT_EQ(::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
    return fd;
  }
  static void trigger(int client) { EXPECT_EQ(::send(client, "x", 1, MSG_NOSIGNAL), 1); }
  /// Returns the header's number and the pixels' value, or nothing if the picture is not whole.
  static std::optional<std::pair<std::uint64_t, int>> picture(int client) {
    PictureHeader header;
    std::vector<std::uint8_t> pixels(kBytes);
    if (::recv(client, &header, sizeof(header), MSG_WAITALL) != static_cast<ssize_t>(sizeof(header)) ||
        ::recv(client, pixels.data(), kBytes, MSG_WAITALL) != static_cast<ssize_t>(kBytes) ||
        header.magic != PictureHeader::kMagic || header.columns != 640 || header.rows != 480)
      return std::nullopt;
    return std::pair{header.number, static_cast<int>(pixels.back())};
  }

  std::atomic<int> looks_{0};
  std::vector<std::uint8_t> pixels_;
  PictureServer server_;
  std::jthread running_;
};

TEST_F(PictureServerTest, EveryTriggerGetsAPictureOfALookAfterIt) {
  const int first = connected();
  const int second = connected();
  EXPECT_EQ(looks_, 0) << "nothing is drawn that nobody asked for";
  using Shown = std::pair<std::uint64_t, int>;
  trigger(first);
  EXPECT_EQ(picture(first), Shown(1, 1));
  trigger(second);
  EXPECT_EQ(picture(second), Shown(2, 2));
  trigger(first);
  trigger(first);
  EXPECT_EQ(picture(first), Shown(3, 3));
  EXPECT_EQ(picture(first), Shown(4, 4));
  ::close(first);
  trigger(second);
  EXPECT_EQ(picture(second), Shown(5, 5)) << "after another client has gone";
  ::close(second);
}

TEST_F(PictureServerTest, AClientThatTakesNoPictureIsDroppedAndTheNextIsServed) {
  const int stalled = connected();
  for (int i = 0; i < 3; ++i) trigger(stalled);
  const int next = connected();
  trigger(next);
  EXPECT_TRUE(picture(next));
  std::vector<std::uint8_t> rest(16 * kBytes);
  std::size_t count = 0;
  for (ssize_t n = 0; (n = ::recv(stalled, rest.data(), rest.size(), 0)) > 0;)
    count += static_cast<std::size_t>(n);
  EXPECT_LT(count, 3 * kBytes) << "the socket's buffer";
  ::close(stalled);
  ::close(next);
}

TEST_F(PictureServerTest, TheLongestIdleClientGivesItsPlaceToTheNext) {
  std::vector<int> silent;
  for (int i = 0; i < 8; ++i) silent.push_back(connected());
  for (const int asks : {silent[7], silent[0]}) {  // after the last one's picture all have a place
    trigger(asks);
    EXPECT_TRUE(picture(asks));
  }
  const int next = connected();
  trigger(next);
  EXPECT_TRUE(picture(next)) << "it got no place";
  char byte = 0;
  EXPECT_EQ(::recv(silent[1], &byte, 1, 0), 0) << "the longest idle one is closed";
  for (const int stays : {silent[0], silent[2], silent[7]}) {
    trigger(stays);
    EXPECT_TRUE(picture(stays));
  }
  for (const int client : silent) ::close(client);
  ::close(next);
}

}  // namespace
}  // namespace corbot::cell
