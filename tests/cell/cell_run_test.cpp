// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <regex>
#include <sstream>
#include <tuple>
#include <vector>

#include "cell/running_cells.h"
#include "cell/store/database.h"
#include "cli/cell/cell_processes.h"
#include "java_robot.h"
#include "shm/descriptor.h"
#include "support/cases.h"
#include "support/paths.h"
#include "support/ports.h"
#include "support/process.h"
#include "support/running_seconds.h"

namespace corbot::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// A copy of the cell for tests with its own ports, name and directories.
class CellRun : public testing::Test {
 protected:
  CellRun() : ports_(free_ports(5)) {
    std::string path = (fs::temp_directory_path() / "corbot-cell-XXXXXX").string();
    directory_ = ::mkdtemp(path.data());
    for (const auto& entry : fs::directory_iterator(CORBOT_TEST_PROFILES "/cell"))
      fs::copy(entry.path(), directory_);
    if (on_orbit2()) {
      edit("from = \"pallet1\"", "orb = \"orbit2\", from = \"pallet1\"");
      edit("from = \"store1\"", "orb = \"orbit2\", from = \"store1\"");
    }
  }
  ~CellRun() override {
    if (HasFailure()) print_logs();
    for (const char* robot : {"robot1", "robot2"}) {
      EXPECT_FALSE(channel_exists(name_ + "-" + robot, directory_.string())) << robot;
    }
    fs::remove_all(directory_);
  }

  void edit(const std::string& from, const std::string& to, const char* file = "cell.toml") {
    std::ifstream in(directory_ / file);
    std::string text{std::istreambuf_iterator<char>(in), {}};
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    std::ofstream(directory_ / file) << text;
  }
  [[nodiscard]] std::vector<std::string> command(const std::vector<std::string>& more,
                                                 const char* verb = "run") const {
    std::vector<std::string> words{(programs_ / "corbot").string(),
                                   "cell",
                                   verb,
                                   (directory_ / "cell.toml").string(),
                                   "--name",
                                   name_,
                                   "--ports",
                                   std::to_string(ports_),
                                   "--state-dir",
                                   (directory_ / "state").string()};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  [[nodiscard]] std::vector<std::string> environment() const {
    return {"XDG_RUNTIME_DIR=" + directory_.string(), "CORBOT_ROBOT=", "CORBOT_LOSES_AT=" + loses_at_};
  }
  RunResult cell_run(const std::vector<std::string>& more, double seconds = 240) {
    return run(command(more), seconds, environment());
  }

  /// Starts a run, and returns when the arms move.
  Process begin_work(int pieces = 4) {
    Process cell(command({"--pieces", std::to_string(pieces), "--pictures", pictures()}), environment());
    if (!wait_event(cell, "picking")) throw std::runtime_error("no work began: " + cell.errors());
    return cell;
  }
  static bool wait_event(Process& cell, const std::string& event) {
    const Deadline deadline = within(120);
    while (const auto line = cell.wait_line("", deadline)) {
      if (line->find(event) != std::string::npos) return true;
    }
    return false;
  }
  [[nodiscard]] std::string left_running() const {
    return run({"/usr/bin/pgrep", "-a", "-f", directory_.string()}).output;
  }
  [[nodiscard]] std::string text_of(const std::string& file) const {
    std::ifstream in(directory_ / "state" / file);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  [[nodiscard]] std::string pictures() const { return (directory_ / "pictures" / "of the run").string(); }
  /// Expects that the cell's picture is whole.
  void expect_picture(Process& cell) const {
    EXPECT_THAT(cell.output(), HasSubstr("picture " + pictures() + "/cell.svg\n"));
    std::ifstream in(fs::path(pictures()) / "cell.svg");
    const std::string svg{std::istreambuf_iterator<char>(in), {}};
    EXPECT_THAT(svg, testing::EndsWith("</svg>\n"));
  }

  /// Puts the SCARA in the place of robot 2.
  void put_scara() {
    edit("name = \"robot2\", profile = \"arm.toml\", position_m = [0.48, 0, 0], yaw_deg = 225",
         "name = \"robot2\", profile = \"scara.toml\", position_m = [0.48, 0, 0], yaw_deg = 180");
  }
  /// Adds a second kind of pieces. The first row of pallet2 takes red ones, the others take blue ones.
  void mix_kinds() {
    edit("]\n\nstore = ",
         "  { name = \"blue\", hue_deg = [220, 250], label_m = 0.014, diameter_m = 0.018, height_m = 0.040, "
         "grasp_m = 0.028 } ]\n\nstore = ");
    edit("pitch_m = [0.045, 0.042]", "pitch_m = [0.045, 0.042], row_kinds = [\"red\", \"blue\", \"blue\"]");
  }
  /// Makes the red pieces square.
  void put_squares() {
    edit("label_m = 0.016, diameter_m = 0.020", "label_m = 0.014, side_m = 0.018");
    edit("pieces = 12", "pieces = 8");  // more do not fit
  }
  /// Starts the robot of examples/java in the place of robot 2. Returns "", or why it is not built.
  [[nodiscard]] std::string put_java_robot() {
    if (std::string why = build_java_robot(); !why.empty()) return why;
    java_port_ = free_port();
    start_java_robot();
    edit("name = \"robot2\", profile = \"arm.toml\"",
         fmt::format("name = \"robot2\", reference = \"{}\", scene_profile = \"arm.toml\"",
                     java_robot_reference(java_port_, "robot2")));
    return "";
  }
  void start_java_robot() {
    java_robot_.emplace(test::start_java_robot(directory_ / "state" / "robot2.servos", java_port_, "robot2"));
  }
  /// Checks that a cell has brought all pieces, and that its arms were 30 mm apart or more.
  static void expect_all_brought(const RunResult& result, int pieces) {
    EXPECT_EQ(result.code, 0) << result.output << result.errors;
    std::smatch found;
    const std::regex summary(
        fmt::format("{0} of {0} pieces on pallet2, each once; the camera sees {0} there, 0 elsewhere; arms "
                    "never nearer than (\\d+) mm, 0 touches, 0 fallen\n$",
                    pieces));
    ASSERT_TRUE(std::regex_search(result.output, found, summary)) << result.output << result.errors;
    EXPECT_GE(std::stoi(found[1]), 30);
  }

  /// Makes robot 1 the only robot, so that its pieces stay at the store.
  void leave_out_robot2() { edit("{ name = \"robot2\"", "# { name = \"robot2\""); }
  /// Makes the scene lose the first piece at this place once all pieces stand there.
  void lose_at(const std::string& place) {
    loses_at_ = place;
    programs_ = directory_ / "bin";
    fs::create_directory(programs_);
    for (const auto& entry : fs::directory_iterator(CORBOT_BIN_DIR)) {
      const fs::path name = entry.path().filename();
      if (name != "corbot" && name != "corbot-scene") fs::create_symlink(entry.path(), programs_ / name);
    }
    fs::create_symlink(CORBOT_TESTS_DIR "/losing_scene", programs_ / "corbot-scene");
    // A copy is necessary: a program finds its neighbours by its own file, and a symbolic link would lead
    // back.
    std::error_code refused;
    fs::create_hard_link(CORBOT_BIN_DIR "/corbot", programs_ / "corbot", refused);
    if (refused) fs::copy_file(CORBOT_BIN_DIR "/corbot", programs_ / "corbot");
  }
  /// Expects that the work ends by itself, early or with a failure.
  static void expect_end(Process& cell, const std::vector<std::string>& texts) {
    const auto status = cell.wait(within(240));
    ASSERT_TRUE(status) << cell.output();
    EXPECT_EQ(WEXITSTATUS(*status), 1) << cell.output() << cell.errors();
    for (const std::string& text : texts) EXPECT_THAT(cell.errors(), HasSubstr(text)) << cell.output();
  }

  std::string name_{fmt::format("t{}", ::getpid())};
  int ports_;
  fs::path directory_;
  fs::path programs_{CORBOT_BIN_DIR};
  std::string loses_at_;
  int java_port_{0};
  std::optional<Process> java_robot_;

 private:
  void print_logs() const {
    std::error_code none;
    for (const auto& entry : fs::directory_iterator(directory_ / "state", none)) {
      if (entry.path().extension() != ".log") continue;
      std::ifstream in(entry.path());
      const std::string text{std::istreambuf_iterator<char>(in), {}};
      fmt::print("--- {}\n{}\n", entry.path().filename().string(),
                 text.substr(text.size() - std::min<std::size_t>(text.size(), 3000)));
    }
  }
};

TEST_F(CellRun, BringsEveryPieceFromPalletToPalletOnce) {
  const fs::path pictures = this->pictures();
  const RunResult result = cell_run(
      {"--pieces", "4", "--seed", fmt::format("{}", test::drawn_seed()), "--pictures", pictures.string()});
  expect_all_brought(result, 4);
  std::ifstream file(pictures / "cell.svg");
  const std::string svg{std::istreambuf_iterator<char>(file), {}};
  EXPECT_THAT(svg, HasSubstr("2 arms bring 4 pieces"));
  EXPECT_THAT(svg, HasSubstr("id=\"p3\""));
  EXPECT_THAT(svg, testing::EndsWith("</svg>\n"));
  EXPECT_GT(fs::file_size(pictures / "gantt.svg"), 3000u);
  EXPECT_GT(fs::file_size(pictures / "camera.jpg"), 10000u);
  for (const char* line :
       {"\n1 of 4 pieces placed, \\d+ s\n", "\n4 of 4 pieces placed, \\d+ s\n",
        "\n  pieces +4, \\d+\\.\\d s a piece, in \\d+\\.\\d s\n", "\n  both arms moved +\\d+ %[^\n]*\n",
        "\n  zone of store1 +robot1 \\d+ %, robot2 \\d+ %, free \\d+ %\n",
        "\n  least distance +\\d+ mm between the arms\n",
        "\n  overruns +robot1 \\d+, robot2 \\d+, scene \\d+\n", "\npicture [^\n]*of the run/cell.svg\n",
        "\npicture [^\n]*of the run/gantt.svg\n", "\npicture [^\n]*of the run/camera.jpg\n"})
    EXPECT_TRUE(std::regex_search(result.output, std::regex(line))) << line << result.output;
  EXPECT_EQ(result.output.find('\x1b'), std::string::npos) << "no terminal";
}

TEST_F(CellRun, RobotsBringPiecesOnArcs) {
  edit("from = \"pallet1\"", "transit = \"arc\", from = \"pallet1\"");
  edit("from = \"store1\"", "transit = \"arc\", from = \"store1\"");
  const RunResult check = run(
      {CORBOT_BIN_DIR "/corbot", "cell", "check", (directory_ / "cell.toml").string()}, 60, environment());
  EXPECT_EQ(check.code, 0) << check.output << check.errors;
  const RunResult result = cell_run({"--pieces", "2"});
  expect_all_brought(result, 2);
  EXPECT_THAT(result.output, testing::Not(HasSubstr("arc was refused")));
  for (const char* robot : {"robot1", "robot2"}) {
    const std::string audit = text_of("robots/" + name_ + "-" + robot + ".audit");
    const std::regex arc("\"call\":\"MoveC[^\n]*\"outcome\":\"ok\"");
    EXPECT_EQ(std::distance(std::sregex_iterator(audit.begin(), audit.end(), arc), {}), 4) << audit;
  }
}

TEST_F(CellRun, AScaraTakesThePlaceOfRobot2) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  put_scara();
  const RunResult check = run(
      {CORBOT_BIN_DIR "/corbot", "cell", "check", (directory_ / "cell.toml").string()}, 60, environment());
  EXPECT_EQ(check.code, 0) << check.output << check.errors;
  expect_all_brought(cell_run({"--pieces", "4"}), 4);
  EXPECT_THAT(text_of("scene.record"), HasSubstr("[0.48,0.0,0.16]")) << "its links are above the table";
}

TEST_F(CellRun, OfTwoKindsEachComesToItsRows) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  mix_kinds();
  expect_all_brought(cell_run({"--pieces", "4"}), 4);
  edit("\"blue\", \"blue\"]", "\"red\", \"red\"]");
  const RunResult check = run(
      {CORBOT_BIN_DIR "/corbot", "cell", "check", (directory_ / "cell.toml").string()}, 60, environment());
  EXPECT_EQ(check.code, 2) << check.output;
  EXPECT_THAT(check.errors, HasSubstr("kind[1].name = \"blue\""));
}

TEST_F(CellRun, BringsSquarePiecesOfAnyYaw) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  put_squares();
  expect_all_brought(
      cell_run({"--pieces", "4", "--seed", fmt::format("{}", test::drawn_seed()), "--pictures", pictures()}),
      4);
  EXPECT_THAT(text_of("scene.record"), HasSubstr("\"yaw\":"));
  std::ifstream file(fs::path(pictures()) / "cell.svg");
  const std::string svg{std::istreambuf_iterator<char>(file), {}};
  EXPECT_THAT(svg, HasSubstr("<g transform=\"rotate("));
}

TEST_F(CellRun, ARobotThatKnowsRobotIdlAloneTakesThePlaceOfRobot2) {
  if (on_orbit2()) GTEST_SKIP() << "the key orb is of a robot that the cell starts";
  if (const std::string why = put_java_robot(); !why.empty()) GTEST_SKIP() << why;
  expect_all_brought(cell_run({"--pieces", "4"}), 4);
}

/// More pieces than the store has slots, with each of these as robot 2, and with each of these pieces.
class SixPieces : public CellRun, public testing::WithParamInterface<std::tuple<const char*, const char*>> {};

TEST_P(SixPieces, AreBrought) {
  const std::string robot2 = std::get<0>(GetParam());
  const std::string pieces = std::get<1>(GetParam());
  if (on_orbit2() && (robot2 != "Lynx5" || pieces != "Round"))
    GTEST_SKIP() << "the servants' ORB makes no difference";
  if (robot2 == "Scara") put_scara();
  if (robot2 == "Java") {
    if (const std::string why = put_java_robot(); !why.empty()) GTEST_SKIP() << why;
  }
  if (pieces != "Round") put_squares();
  if (pieces == "SquareAndRound") mix_kinds();
  expect_all_brought(cell_run({"--pieces", "6", "--seed", fmt::format("{}", test::drawn_seed())}), 6);
}
INSTANTIATE_TEST_SUITE_P(Robot2, SixPieces,
                         testing::Combine(testing::Values("Lynx5", "Scara", "Java"),
                                          testing::Values("Round", "Square", "SquareAndRound")),
                         [](const auto& test) {
                           return fmt::format("{}{}", std::get<0>(test.param), std::get<1>(test.param));
                         });

TEST_F(CellRun, WithoutZonesTheArmsTouchAndTheEndNamesIt) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  // Robot 2 stays at the far slot. Robot 1 passes this slot with its second piece.
  edit("columns = 1, rows = 4, pitch_m = [0.05, 0.05]",
       "yaw_deg = 180, columns = 1, rows = 4, pitch_m = [0.05, 0.04]");
  Process store({CORBOT_TESTS_DIR "/unguarded_store", (directory_ / "cell.toml").string(), "--name", name_,
                 "--ports", std::to_string(ports_), "--state-dir", (directory_ / "store").string()});
  ASSERT_TRUE(store.wait_line("ready", within(30))) << store.errors();
  edit("store = { ledger = \"ledger.db\" }",
       fmt::format("store = {{ reference = \"corbaloc::127.0.0.1:{}/Store\" }}", ports_));
  Process cell = begin_work(2);
  expect_end(cell, {"the arms touched"});
  EXPECT_THAT(cell.output(),
              HasSubstr("2 of 2 pieces on pallet2, each once; the camera sees 2 there, 0 elsewhere"));
}

TEST_F(CellRun, APanelsPortInUseIsNamedWithTheOptionForAnother) {
  Process store({(programs_ / "corbot-store").string(), (directory_ / "cell.toml").string(), "--name", name_,
                 "--ports", std::to_string(ports_), "--state-dir", (directory_ / "store").string()});
  ASSERT_TRUE(store.wait_line("ready", within(30))) << store.errors();
  const RunResult result = cell_run({"--panel", std::to_string(ports_)});
  EXPECT_EQ(result.code, 5);
  EXPECT_THAT(result.errors, HasSubstr("is in use by another program: let the panel take any free one"));
}

TEST_F(CellRun, APieceThatIsTakenAwayBeforeTheLastLookIsNamed) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  lose_at("pallet2");
  Process cell = begin_work(2);
  expect_end(cell, {"the camera sees 1 piece on pallet2, not 2", "the scene has 1 piece on pallet2, not 2"});
  EXPECT_THAT(cell.output(), HasSubstr("2 of 2 pieces on pallet2, each once"));
}

TEST_F(CellRun, APieceThatFallsOnTheWayIsUnclearAndAPersonIsCalled) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  lose_at("the way");
  Process cell(command({"--pieces", "2"}), environment());
  expect_end(cell, {"piece 1 is not seen at store1", "corbot cell resolve"});
  EXPECT_THAT(text_of("scene.out"), HasSubstr(" held=0 fallen=1 touches=0"));
}

TEST_F(CellRun, AnEmptyPalletIsNamed) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  lose_at("pallet1");
  Process cell(command({"--pieces", "1"}), environment());
  expect_end(cell, {"the ledger has 0 pieces on pallet2, not 1", "robot1: pallet1 is empty"});
}

TEST_F(CellRun, AFullStoreIsNamed) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  leave_out_robot2();
  edit("rows = 4", "rows = 1");
  Process cell = begin_work(2);
  expect_end(cell, {"the ledger has 1 piece on store1, not 2", "the scene has 1 piece on pallet1",
                    "robot1: store1 is full"});
}

TEST_F(CellRun, ARowTooManyInTheLedgerIsNamed) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  leave_out_robot2();
  Process cell = begin_work(1);
  cell::Database ledger(directory_ / "state" / "ledger.db");
  cell::execute(ledger,
                "INSERT INTO piece VALUES ($1, 9, 'red', 'stands', NULL, 'store1', 3, 0.24, 0.075, 0, 0, 0)",
                name_);
  expect_end(cell, {"the ledger has 2 pieces on store1, not 1",
                    "1 piece arrived on store1 by the ledger's events, not 2"});
}

TEST_F(CellRun, ACameraWithoutPicturesEndsTheWorkAndIsNamed) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  Process cell = begin_work(1);
  ASSERT_TRUE(fs::remove(directory_ / "state" / "picture.sock"));
  expect_end(cell, {"robot1: pick: no picture of pallet1, (", "picture.sock", "check camera in cell.toml"});
  expect_picture(cell);
}

TEST_F(CellRun, CtrlCStopsTheArmsAndEndsEverything) {
  Process cell = begin_work();
  cell.signal(SIGINT);
  const auto status = cell.wait(within(30));
  ASSERT_TRUE(status);
  EXPECT_EQ(WEXITSTATUS(*status), 4) << cell.errors();
  EXPECT_THAT(cell.errors(), HasSubstr("stopped: 0 of 4 pieces are done"));
  expect_picture(cell);
  for (const char* robot : {"robot1", "robot2"}) {
    EXPECT_THAT(cell.output(), HasSubstr(fmt::format("{} stopped", robot)));
    EXPECT_THAT(text_of(fmt::format("{}.log", robot)), HasSubstr("at rest, ended"));
  }
  EXPECT_EQ(left_running(), "");
}

TEST_F(CellRun, HasItsDirectoryForItselfAndBeginsAnewAfterAKill) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  Process first = begin_work();
  ports_ = free_ports(5);
  const RunResult second = cell_run({});
  EXPECT_EQ(second.code, 5);
  EXPECT_THAT(second.errors, HasSubstr("a cell runs in"));
  EXPECT_TRUE(fs::exists(directory_ / "state" / "ledger.db")) << "the second run has touched the first one's";
  first.signal(SIGKILL);
  ASSERT_TRUE(first.wait(within(30)));
  ASSERT_TRUE(wait_until(within(30), [&] { return left_running().empty(); })) << left_running();
  std::ofstream(directory_ / "state" / "hold") << "pause stop\n";  // a run starts the work
  const RunResult third = cell_run({"--pieces", "1"});
  EXPECT_EQ(third.code, 0) << third.output << third.errors;
  EXPECT_TRUE(fs::exists(directory_ / "state" / "previous" / "scene.record"));
  EXPECT_TRUE(fs::exists(directory_ / "state" / "previous" / "activity.jsonl"));
  EXPECT_EQ(text_of("activity.jsonl").find("\"piece\":2"), std::string::npos) << "a piece of the run before";
}

TEST_F(CellRun, AFrozenStoreEndsTheWorkAndIsNamed) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  Process cell = begin_work();
  const RunResult frozen = run({"/usr/bin/pkill", "-STOP", "-f", "corbot-store " + directory_.string()});
  ASSERT_EQ(frozen.code, 0);
  const auto status = cell.wait(within(60));
  ASSERT_TRUE(status);
  EXPECT_EQ(WEXITSTATUS(*status), 1) << cell.errors();
  EXPECT_THAT(cell.errors(), HasSubstr("store"));
  EXPECT_EQ(left_running(), "");
}

TEST_F(CellRun, AKilledSceneEndsTheWorkAndThePictureShowsItsRun) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  Process cell = begin_work();
  ASSERT_EQ(run({"/usr/bin/pkill", "-KILL", "-f", "corbot-scene " + directory_.string()}).code, 0);
  expect_end(cell, {"scene ended; "});
  EXPECT_EQ(cell.errors().find("coordinator ended"), std::string::npos) << cell.errors();
  expect_picture(cell);
  std::ifstream in(fs::path(pictures()) / "cell.svg");
  const std::string svg{std::istreambuf_iterator<char>(in), {}};
  EXPECT_EQ(svg.find("The run: 0 s"), std::string::npos);
  EXPECT_EQ(left_running(), "");
}

/// A cell that keeps running, and commands for it.
class CellUp : public CellRun {
 protected:
  RunResult cell(const char* verb, const std::vector<std::string>& more = {}) {
    return run(command(more, verb), 90, environment());
  }
  [[nodiscard]] std::string status() { return cell("status").output; }
  bool reaches(const std::string& text) {
    return wait_until(within(120), [&] {
      if (status().find(text) != std::string::npos) return true;
      std::this_thread::sleep_for(
          std::chrono::milliseconds(500));  // a command takes 0.05 s of processor time
      return false;
    });
  }
  [[nodiscard]] bool kills(const std::string& program) const {
    return run({"/usr/bin/pkill", "-KILL", "-f", program}).code == 0;
  }
  [[nodiscard]] std::string of_cell(const std::string& program) const {
    return "^[^ ]*" + program + " " + (directory_ / "cell.toml").string();
  }
  Process up(int pieces) {
    Process cell(command({"--pieces", std::to_string(pieces)}, "up"), environment());
    if (!wait_event(cell, "picking")) throw std::runtime_error("no work began: " + cell.errors());
    return cell;
  }
  /// Returns the number of the ledger's pieces at pallet2, and of all its rows.
  [[nodiscard]] std::pair<std::int64_t, std::int64_t> pieces_in_ledger() const {
    cell::Database ledger(directory_ / "state" / "ledger.db");
    cell::Statement row(
        ledger, "SELECT COALESCE(SUM(place = 'pallet2' AND state = 'stands'), 0), COUNT(*) FROM piece");
    row.next();
    return {row.integer(0), row.integer(1)};
  }
  [[nodiscard]] std::int64_t events(const char* sql) const {
    cell::Database ledger(directory_ / "state" / "ledger.db");
    cell::Statement row(ledger, sql);
    row.next();
    return row.integer(0);
  }
  /// Returns how often pieces were placed at pallet2.
  [[nodiscard]] std::int64_t placed_events() const {
    return events("SELECT COUNT(*) FROM event WHERE step = 'placed' AND place = 'pallet2'");
  }
  [[nodiscard]] std::int64_t all_events() const { return events("SELECT COUNT(*) FROM event"); }
  [[nodiscard]] bool has_claimed(const std::string& robot, pid_t coordinator) const {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    cell::Database ledger(directory_ / "state" / "ledger.db");
    cell::Statement row(ledger, "SELECT COUNT(*) FROM claim WHERE robot = $1 AND who LIKE $2", robot,
                        fmt::format("%/{}/%", coordinator));
    row.next();
    return row.integer(0) == 1;
  }
  [[nodiscard]] std::optional<pid_t> pid_of(const std::string& program) const {
    const RunResult found = run({"/usr/bin/pgrep", "-f", program});
    return found.code == 0 ? std::optional(static_cast<pid_t>(std::stoi(found.output))) : std::nullopt;
  }
  /// Ends the cell. Expects that each witness has all pieces on pallet2, once.
  void expect_down_with(Process& up, int pieces) {
    EXPECT_EQ(cell("down").code, 0);
    const auto end = up.wait(within(60));
    ASSERT_TRUE(end);
    EXPECT_EQ(WEXITSTATUS(*end), 0) << up.errors();
    EXPECT_EQ(pieces_in_ledger(), std::pair(std::int64_t{pieces}, std::int64_t{pieces}));
    EXPECT_EQ(placed_events(), pieces);
    EXPECT_THAT(text_of("scene.out"),
                testing::AllOf(HasSubstr(fmt::format("pallet2={} ", pieces)), HasSubstr(" held=0 "),
                               HasSubstr(" touches=0 "), HasSubstr(" fallen=0 ")));
    java_robot_.reset();  // the cell does not end it
    EXPECT_EQ(left_running(), "");
  }
  /// Returns the command line of one program of the cell.
  [[nodiscard]] std::vector<std::string> program(const std::string& name,
                                                 const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words = command(more);
    words.erase(words.begin(), words.begin() + 3);
    words.insert(words.begin(), (fs::path(CORBOT_BIN_DIR) / name).string());
    return words;
  }
  /// Starts a world that outlives the cell.
  [[nodiscard]] Process world(int pieces) const {
    Process made(program("corbot-scene", {"--pieces", std::to_string(pieces)}), environment());
    if (!made.wait_line("ready", within(60))) throw std::runtime_error("no world: " + made.errors());
    return made;
  }
  /// Returns the processes of this cell.
  [[nodiscard]] std::vector<pid_t> pids_but(pid_t world) const {
    const RunResult found =
        run({"/usr/bin/pgrep", "-f", fmt::format("{}|{}-robot", directory_.string(), name_)});
    std::istringstream stream(found.output);
    std::vector<pid_t> pids;
    for (pid_t pid = 0; stream >> pid;) {
      if (pid != world) pids.push_back(pid);
    }
    return pids;
  }
  /// Clears the robot's Error, as a person does after removing the cause.
  void clear(const std::string& robot) const {
    const int port = ports_ + (robot == "robot1" ? 3 : 4);
    const RunResult cleared = run(
        {CORBOT_BIN_DIR "/corbot", "--robot", fmt::format("127.0.0.1:{}/{}-{}", port, name_, robot), "clear"},
        60, environment());
    EXPECT_EQ(cleared.code, 0) << cleared.errors;
  }
  /// Starts a coordinator of the same robots, camera and store, with its own port and directory.
  Process second_coordinator() {
    std::ifstream file(directory_ / "state" / "cell.json");
    const nlohmann::json addresses = nlohmann::json::parse(file);
    const auto elsewhere = [&](const nlohmann::json& uri) {
      return fmt::format("reference = \"{}\"", uri.get<std::string>());
    };
    const fs::path first = directory_ / "first.toml";
    fs::copy_file(directory_ / "cell.toml", first);
    edit("store = { ledger = \"ledger.db\" }",
         fmt::format("store = {{ {} }}", elsewhere(addresses["store"])));
    edit("source = \"scene\", calibration = \"camera.toml\"", elsewhere(addresses["camera"]));
    for (const char* robot : {"robot1", "robot2"})
      edit("profile = \"arm.toml\"", elsewhere(addresses["robots"][robot]));
    fs::rename(directory_ / "cell.toml", directory_ / "second.toml");
    fs::rename(first, directory_ / "cell.toml");
    return Process({CORBOT_BIN_DIR "/corbot-coordinator", (directory_ / "second.toml").string(), "--name",
                    name_, "--ports", std::to_string(free_ports(5)), "--state-dir",
                    (directory_ / "second").string(), "--start"});
  }
  [[nodiscard]] std::string first_piece() const {
    cell::Database ledger(directory_ / "state" / "ledger.db");
    cell::Statement row(ledger, "SELECT MIN(number) FROM piece");
    row.next();
    return std::to_string(row.integer(0));
  }
};

TEST_F(CellUp, GoesOnAfterAnyProcessWasKilled) {
  Process cell = up(4);
  for (const std::string& program :
       {of_cell("corbot-coordinator"), of_cell("corbot-store"), of_cell("corbot-camera"),
        "corbot-rt.*" + name_ + "-robot1", "corbot up .*" + name_ + "-robot2"}) {
    ASSERT_TRUE(kills(program)) << program;
    EXPECT_TRUE(reaches(" works;")) << program << status();
    std::this_thread::sleep_for(
        std::chrono::seconds(1));  // during or after the resolution of the previous fault
  }
  ASSERT_TRUE(reaches("; 4 pieces on pallet2\n")) << status();
  EXPECT_THAT(status(), HasSubstr("no person is needed"));
  expect_down_with(cell, 4);
}

TEST_F(CellUp, EachKindComesToItsRowsAlsoAfterKillsOfTheCoordinator) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  mix_kinds();
  Process cell = up(4);
  ASSERT_TRUE(kills(of_cell("corbot-coordinator")));
  ASSERT_TRUE(wait_event(cell, "robot2 piece")) << cell.output();
  ASSERT_TRUE(kills(of_cell("corbot-coordinator")));
  ASSERT_TRUE(reaches("; 4 pieces on pallet2\n")) << status();
  EXPECT_THAT(status(), HasSubstr("no person is needed"));
  expect_down_with(cell, 4);
  const std::string at = "SELECT COUNT(*) FROM piece WHERE place = 'pallet2' AND state = 'stands' AND ";
  EXPECT_EQ(events((at + "kind = 'red' AND slot < 4").c_str()), 2);
  EXPECT_EQ(events((at + "kind = 'blue' AND slot >= 4").c_str()), 2);
}

/// A cell whose robot 2 is the robot of examples/java. A person starts that robot again.
class CellOfJavaRobot : public CellUp {
 protected:
  void SetUp() override {
    if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
    if (const std::string why = put_java_robot(); !why.empty()) GTEST_SKIP() << why;
  }
  /// Kills the robot at random instants of its work. The servos hold, so the cell asks for no piece. A person
  /// answers repeated faults.
  void expect_no_piece_lost(int pieces, int kills) {
    std::mt19937 random(static_cast<std::uint32_t>(test::drawn_seed()));
    std::uniform_real_distribution<double> instant_s(0.2, 5);
    const std::string all = fmt::format("; {} pieces on pallet2\n", pieces);
    Process cell = up(pieces);
    ASSERT_TRUE(wait_event(cell, "robot2 piece")) << cell.output();
    for (int i = 0; i < kills; ++i) {
      std::this_thread::sleep_for(std::chrono::duration<double>(instant_s(random)));
      java_robot_->signal(SIGKILL);
      ASSERT_TRUE(java_robot_->wait(within(10)));
      const std::string text = status();
      ASSERT_EQ(text.find(all), std::string::npos) << "the work has ended before kill " << i + 1;
      std::smatch robot2;
      std::regex_search(text, robot2, std::regex("robot2[^\n]*"));
      fmt::print("kill {}: {}\n", i + 1, robot2.str());
      start_java_robot();
    }
    EXPECT_TRUE(wait_until(within(240), [&] {
      const std::string text = status();
      if (text.find("'corbot cell start CELL' goes on") != std::string::npos) (void)this->cell("start");
      return text.find(all) != std::string::npos;
    })) << status();
    EXPECT_THAT(status(), HasSubstr("no person is needed"));
    expect_down_with(cell, pieces);
  }
};

TEST_F(CellOfJavaRobot, LosesNoPieceInThreeKillsAtRandomInstants) { expect_no_piece_lost(2, 3); }

TEST_F(CellOfJavaRobot, LosesNoPieceInTwentyKillsAtRandomInstants) { expect_no_piece_lost(10, 20); }

TEST_F(CellUp, StopHoldsTheArmsUntilStartAlsoForTheNextCoordinator) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  Process cell = up(2);
  EXPECT_EQ(this->cell("stop").code, 0);
  EXPECT_THAT(status(), HasSubstr(" stopped; 'corbot cell start' begins or goes on"));
  for (const char* verb : {"status", "start"}) {
    std::vector<std::string> words = command({}, verb);
    std::replace(words.begin(), words.end(), name_, std::string("other"));
    const RunResult wrong = run(words, 60, environment());
    EXPECT_EQ(wrong.code, 3) << wrong.output;
    EXPECT_THAT(wrong.errors, HasSubstr("is of cell '" + name_ + "', not of 'other'"));
  }
  ASSERT_TRUE(kills(of_cell("corbot-coordinator")));
  ASSERT_TRUE(reaches(" stopped; 'corbot cell start' begins or goes on"));
  const std::string before = text_of("activity.jsonl");
  std::this_thread::sleep_for(std::chrono::seconds(2));
  EXPECT_EQ(text_of("activity.jsonl"), before) << "a robot works";
  EXPECT_EQ(this->cell("pause").code, 0);
  EXPECT_EQ(this->cell("start").code, 0);
  EXPECT_TRUE(reaches("; 2 pieces on pallet2\n")) << status();
  EXPECT_EQ(this->cell("exchange", {"pallet2"}).code, 0);
  EXPECT_THAT(status(), HasSubstr("; 0 pieces on pallet2\n"));
  const std::string piece = first_piece();
  EXPECT_EQ(this->cell("resolve", {piece, "--gone"}).code, 0) << "it is gone already";
  const RunResult refused = this->cell("resolve", {piece, "pallet2", "0"});
  EXPECT_EQ(refused.code, 1);
  EXPECT_THAT(refused.errors, HasSubstr("piece " + piece + ": is not unclear: it is 'gone'"));
  EXPECT_EQ(this->cell("resolve", {piece}).code, 2);
  EXPECT_EQ(this->cell("down").code, 0);
  const auto end = cell.wait(within(30));
  ASSERT_TRUE(end);
  EXPECT_EQ(WEXITSTATUS(*end), 0) << cell.errors();
  EXPECT_EQ(this->cell("status").code, 3);
  EXPECT_EQ(this->cell("down").code, 3);
}

// The supervisor kills the frozen coordinator after ten seconds, and the next one would work on.
TEST_F(CellUp, StopHoldsTheArmsAlsoIfTheCoordinatorIsFrozen) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  Process cell = up(2);
  const auto frozen = pid_of(of_cell("corbot-coordinator"));
  ASSERT_TRUE(frozen);
  ASSERT_EQ(::kill(*frozen, SIGSTOP), 0);
  RunResult stopped;
  const Lasted stop = lasted([&] { stopped = this->cell("stop"); });
  EXPECT_THAT(stopped.errors, HasSubstr("has NOT confirmed the stop"));
  // The command tries for 15 s, and the machine may stand still for a part of them.
  if (stopped.code != 0 && stop.stood_still_s >= 1.0) stopped = this->cell("stop");
  EXPECT_EQ(stopped.code, 0) << stopped.errors;
  EXPECT_TRUE(reaches(" stopped; 'corbot cell start' begins or goes on")) << status();
  EXPECT_NE(pid_of(of_cell("corbot-coordinator")), frozen);
}

TEST_F(CellUp, StopHoldsTheArmsUntilStartAlsoBesideAStandBy) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  Process cell = up(2);
  Process second = second_coordinator();
  ASSERT_TRUE(wait_event(second, "robot1 stand-by")) << second.output();
  ASSERT_TRUE(wait_event(second, "robot2 stand-by")) << second.output();
  const RunResult stopped = this->cell("stop");
  ASSERT_EQ(stopped.code, 0) << stopped.errors;
  const std::int64_t events = all_events();
  ASSERT_TRUE(kills(of_cell("corbot-coordinator")));
  std::this_thread::sleep_for(std::chrono::seconds(8));  // control of the arms has ended
  for (const char* robot : {"robot1", "robot2"})
    EXPECT_FALSE(has_claimed(robot, second.pid())) << robot << second.output();
  EXPECT_EQ(all_events(), events) << second.output();
  EXPECT_THAT(second.output(), HasSubstr("has ended while robot1 waited for a person"));
  EXPECT_THAT(status(), HasSubstr(" stopped; 'corbot cell start' begins or goes on"));
  EXPECT_EQ(this->cell("start").code, 0);
  EXPECT_TRUE(reaches("; 2 pieces on pallet2\n")) << status();
  second.signal(SIGKILL);
  expect_down_with(cell, 2);
}

TEST_F(CellUp, OfTwoCoordinatorsOneWorksAndTheOtherTakesOver) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  Process cell = up(6);
  Process second = second_coordinator();
  ASSERT_TRUE(wait_event(second, "robot1 stand-by")) << second.output();
  // The coordinator's control of the arms ends after 5 s. The supervisor would kill the coordinator after 10
  // s.
  const auto first = pid_of(of_cell("corbot-coordinator"));
  ASSERT_TRUE(first);
  ASSERT_EQ(::kill(*first, SIGSTOP), 0);
  EXPECT_TRUE(wait_until(within(9), [&] { return has_claimed("robot1", second.pid()); })) << second.output();
  ASSERT_EQ(::kill(*first, SIGCONT), 0);
  EXPECT_TRUE(wait_event(second, " placed at pallet2 ")) << second.output();
  EXPECT_EQ(pid_of(of_cell("corbot-coordinator")), first) << "it was thawed too late";
  second.signal(SIGKILL);
  ASSERT_TRUE(reaches("; 6 pieces on pallet2\n")) << status();
  expect_down_with(cell, 6);
}

TEST_F(CellUp, GoesOnInTheSameWorldAfterAPowerCut) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  Process world = this->world(4);
  Process first = up(4);
  ASSERT_TRUE(wait_event(first, "robot1 piece")) << "one is in a gripper, or on its way";
  const std::vector<pid_t> all = pids_but(world.pid());
  EXPECT_GT(all.size(), 9U);
  std::vector<Descriptor> ends;
  for (const pid_t pid : all) ends.emplace_back(static_cast<int>(::syscall(SYS_pidfd_open, pid, 0)));
  for (const int signal : {SIGSTOP, SIGKILL})  // at one instant
    for (const pid_t pid : all) (void)::kill(pid, signal);
  ASSERT_TRUE(first.wait(within(30)));
  // A dying process loses its name before it closes its port, so pgrep does not find it.
  for (const Descriptor& process : ends) {
    pollfd end{process.get(), POLLIN, 0};
    EXPECT_EQ(::poll(&end, 1, 30'000), 1);
  }
  Process again(command({"--pieces", "4"}, "up"), environment());
  ASSERT_TRUE(wait_until(within(200),
                         [&] {
                           const std::string text = status();
                           for (const char* robot : {"robot1", "robot2"}) {
                             if (text.find(fmt::format("{} is in Error", robot)) != std::string::npos)
                               clear(robot);
                           }
                           return text.find("; 4 pieces on pallet2\n") != std::string::npos;
                         }))
      << status() << again.output() << again.errors();
  EXPECT_EQ(cell("down").code, 0);
  ASSERT_TRUE(again.wait(within(60)));
  EXPECT_EQ(pieces_in_ledger(), std::pair(std::int64_t{4}, std::int64_t{4}));
  EXPECT_EQ(placed_events(), 4);
  EXPECT_EQ(world.terminate(), 0);
  EXPECT_THAT(world.output(), testing::AllOf(HasSubstr("pallet2=4 "), HasSubstr(" held=0 "),
                                             HasSubstr(" touches=0 "), HasSubstr(" fallen=0 ")));

  Process next_world = this->world(1);
  Process next = up(1);
  EXPECT_TRUE(reaches("; 1 pieces on pallet2\n")) << "the ledger is of this world: " << status();
  next_world.signal(SIGKILL);
  const auto end = next.wait(within(60));
  ASSERT_TRUE(end);
  EXPECT_EQ(WEXITSTATUS(*end), 5);
  EXPECT_THAT(next.errors(), HasSubstr("the simulated world has ended"));
  EXPECT_EQ(left_running(), "");
}

TEST_F(CellUp, AFrozenStoreAndAFrozenCameraAreReplaced) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  Process cell = up(3);
  for (const char* program : {"corbot-store", "corbot-camera"}) {
    const auto frozen = pid_of(of_cell(program));
    ASSERT_TRUE(frozen) << program;
    ASSERT_EQ(::kill(*frozen, SIGSTOP), 0);
    EXPECT_TRUE(wait_until(within(60), [&] {
      const auto next = pid_of(of_cell(program));
      return next && next != frozen;
    })) << program;
  }
  ASSERT_TRUE(reaches("; 3 pieces on pallet2\n")) << status();
  EXPECT_THAT(status(), HasSubstr("no person is needed"));
  expect_down_with(cell, 3);
}

TEST_F(CellUp, ARobotInErrorWaitsForAPersonAndTheOtherGoesOn) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  edit("gap_fault_ms = 10000", "gap_fault_ms = 5000", "arm.toml");  // longer than a machine stands still
  edit("respond_s = 3.0", "respond_s = 20", "arm.toml");
  Process cell = up(3);
  ASSERT_TRUE(wait_event(cell, "placed at store1")) << "so robot2 has work";
  const auto task = pid_of("corbot-rt.*" + name_ + "-robot1");
  ASSERT_TRUE(task);
  ASSERT_EQ(::kill(*task, SIGSTOP), 0);
  std::this_thread::sleep_for(std::chrono::milliseconds(5700));
  ASSERT_EQ(::kill(*task, SIGCONT), 0);
  ASSERT_TRUE(reaches("robot1: robot1 is in Error: look at 'corbot status', put the cause right"))
      << status();
  EXPECT_TRUE(reaches("; 1 pieces on pallet2\n")) << "robot2 goes on: " << status();
  EXPECT_EQ(pid_of("corbot-rt.*" + name_ + "-robot1"), task) << "it was thawed too late";
  clear("robot1");
  ASSERT_TRUE(reaches("; 3 pieces on pallet2\n")) << status();
  EXPECT_THAT(status(), HasSubstr("no person is needed"));
  expect_down_with(cell, 3);
}

TEST_F(CellUp, AFullDiskHoldsTheArmsUntilThereIsRoom) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  Process cell = up(2);
  const auto store = pid_of(of_cell("corbot-store"));
  ASSERT_TRUE(store);
  rlimit before{};
  const rlimit full{1, RLIM_INFINITY};
  ASSERT_EQ(::prlimit(*store, RLIMIT_FSIZE, &full, &before), 0);
  ASSERT_TRUE(reaches("the ledger's database failed, nothing was changed")) << status();
  const std::int64_t events = all_events();
  std::this_thread::sleep_for(std::chrono::seconds(12));
  EXPECT_THAT(status(),
              testing::AllOf(HasSubstr("a person is needed"), HasSubstr("the ledger's database failed")));
  EXPECT_EQ(all_events(), events) << "no step is durable, so none is taken";
  EXPECT_EQ(pid_of(of_cell("corbot-store")), store) << "it lives";
  ASSERT_EQ(::prlimit(*store, RLIMIT_FSIZE, &before, nullptr), 0);
  ASSERT_TRUE(reaches("; 2 pieces on pallet2\n")) << status();
  EXPECT_THAT(status(), HasSubstr("no person is needed"));
  expect_down_with(cell, 2);
}

TEST_F(CellUp, AStoreThatCannotStartAgainIsGivenUpWithItsReason) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  Process cell = up(1);
  EXPECT_EQ(this->cell("stop").code, 0);
  const fs::path ledger = directory_ / "state" / "ledger.db";
  fs::remove(ledger);
  fs::create_directory(ledger);
  ASSERT_TRUE(kills(of_cell("corbot-store")));
  const auto end = cell.wait(within(120));
  ASSERT_TRUE(end);
  EXPECT_EQ(WEXITSTATUS(*end), 5);
  EXPECT_THAT(cell.errors(),
              testing::ContainsRegex("store died \\(exit code 5\\); 10 starts in a row failed, the limit of "
                                     "\\[supervisor\\] attempts: giving up\n"
                                     ".*store.log:\n(.*\n)*  corbot-store: .*ledger.db"));
  EXPECT_EQ(left_running(), "");
}

TEST_F(CellUp, IsNotStartedTwiceAndEndsWithItsWorld) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  Process cell = up(1);
  const RunResult second = this->cell("up");
  EXPECT_EQ(second.code, 5);
  EXPECT_THAT(second.errors,
              HasSubstr("state already: 'corbot cell status' shows it, 'corbot cell down' ends it"));
  ASSERT_TRUE(kills(of_cell("corbot-scene")));
  const auto end = cell.wait(within(60));
  ASSERT_TRUE(end);
  EXPECT_EQ(WEXITSTATUS(*end), 5);
  EXPECT_THAT(cell.errors(), HasSubstr("the simulated world has ended"));
  EXPECT_EQ(left_running(), "");
}

/// Programs that a person starts one by one. There is no coordinator: the camera drives robot1.
class CellDriven : public CellUp {
 protected:
  void begin(int pieces) {
    world_.emplace(world(pieces));
    cell::CellOverrides overrides;
    overrides.name = name_;
    overrides.ports = ports_;
    overrides.state_directory = state();
    const cell::CellConfig cell = cell::load_cell(directory_ / "cell.toml", overrides);
    cli::write_profiles(cell);
    cell::publish_addresses(cell, directory_ / "cell.toml");
    robot_.emplace(std::vector<std::string>{CORBOT_BIN_DIR "/corbot", "up",
                                            (state() / "robots" / "robot1.toml").string(), "--name", robot(),
                                            "--endpoint", fmt::format("127.0.0.1:{}", ports_ + 3)},
                   environment());
    ASSERT_TRUE(robot_->wait_line(robot() + " is up", within(60))) << robot_->errors();
  }
  [[nodiscard]] fs::path state() const { return directory_ / "state"; }
  [[nodiscard]] std::string robot() const { return name_ + "-robot1"; }
  [[nodiscard]] Process camera(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words{"--drive", "robot1"};
    words.insert(words.end(), more.begin(), more.end());
    return Process(program("corbot-camera", words), environment());
  }
  /// Expects that the program ends by itself and the arm is at rest.
  void expect_end_at_rest(Process& camera) const {
    camera.signal(SIGINT);
    const auto end = camera.wait(within(30));
    ASSERT_TRUE(end);
    EXPECT_EQ(WEXITSTATUS(*end), 0) << camera.errors();
    EXPECT_THAT(camera.output(), HasSubstr(" robot1 stopped\n"));
    const RunResult status = run(
        {CORBOT_BIN_DIR "/corbot", "--robot", fmt::format("127.0.0.1:{}/{}", ports_ + 3, robot()), "status"},
        60, environment());
    EXPECT_THAT(status.output, HasSubstr("Standby")) << status.errors;
  }
  /// Expects by the world's own count that the pieces stand at the store, once.
  void expect_stored(int pieces) {
    EXPECT_EQ(robot_->terminate(), 0) << robot_->errors();
    EXPECT_EQ(world_->terminate(), 0);
    EXPECT_THAT(world_->output(), testing::AllOf(HasSubstr(fmt::format(" store1={} ", pieces)),
                                                 HasSubstr(" held=0 fallen=0 touches=0 ")));
  }

  std::optional<Process> world_;
  std::optional<Process> robot_;
};

TEST_F(CellDriven, TheCameraDrivesARobotByTheLedgerAndGoesOnAfterItsEnd) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  begin(2);
  Process store(program("corbot-store"), environment());
  ASSERT_TRUE(store.wait_line("ready", within(60))) << store.errors();
  Process first = camera();
  ASSERT_TRUE(wait_event(first, "robot1 piece 1 picking at pallet1")) << first.output() << first.errors();
  Process second = second_coordinator();
  EXPECT_TRUE(wait_event(second, "robot1 stand-by: ")) << second.output();
  EXPECT_THAT(second.output(), HasSubstr("corbot-camera@"));
  second.signal(SIGKILL);
  expect_end_at_rest(first);
  Process next = camera();
  const auto placed = [&] {
    return events("SELECT COUNT(*) FROM event WHERE step = 'placed' AND place = 'store1'");
  };
  EXPECT_TRUE(wait_until(within(120), [&] { return placed() >= 2; })) << next.output() << next.errors();
  EXPECT_TRUE(reaches("pallet1 is empty")) << status();
  expect_end_at_rest(next);
  EXPECT_EQ(placed(), 2);
  EXPECT_EQ(events("SELECT COUNT(*) FROM piece WHERE state = 'stands' AND place = 'store1'"), 2);
  expect_stored(2);
}

TEST_F(CellDriven, WithoutAStoreTheCameraKeepsTheLedgerItself) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  begin(2);
  Process camera = this->camera({"--no-store"});
  for (int i = 0; i < 2; ++i)
    ASSERT_TRUE(wait_event(camera, " placed at store1 ")) << camera.output() << camera.errors();
  EXPECT_THAT(status(), HasSubstr("store1       2 of 4 slots have a piece, 0 reserved"));
  EXPECT_FALSE(fs::exists(state() / "ledger.db"));
  const RunResult store = run(program("corbot-store"), 60, environment());
  EXPECT_EQ(store.code, 5) << "the cell has one store";
  EXPECT_THAT(store.errors, HasSubstr("in use"));
  expect_end_at_rest(camera);
  expect_stored(2);
}

TEST_F(CellDriven, TheCameraBringsSixSquares) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  put_squares();
  edit("columns = 1, rows = 4", "columns = 2, rows = 3");
  begin(6);
  Process camera = this->camera({"--no-store"});
  for (int i = 0; i < 6; ++i)
    ASSERT_TRUE(wait_event(camera, " placed at store1 ")) << camera.output() << camera.errors();
  expect_end_at_rest(camera);
  expect_stored(6);
}

TEST_F(CellDriven, WithoutAStoreAPieceOfTheProcessBeforeNeedsAPerson) {
  if (on_orbit2()) GTEST_SKIP() << "the servants' ORB makes no difference";
  begin(2);
  {
    Process killed = camera({"--no-store"});
    ASSERT_TRUE(wait_event(killed, " placed at store1 ")) << killed.output() << killed.errors();
    killed.signal(SIGKILL);
    ASSERT_TRUE(killed.wait(within(30)));
  }
  Process next = camera({"--no-store"});
  EXPECT_TRUE(reaches("a piece that is not in the ledger stands at store1")) << status();
  expect_end_at_rest(next);
  EXPECT_EQ(robot_->terminate(), 0) << robot_->errors();
}

TEST_F(CellDriven, AWrongWordIsNamed) {
  const auto refusal = [&](const std::vector<std::string>& words) {
    const RunResult result = run(program("corbot-camera", words), 60, environment());
    EXPECT_EQ(result.code, 2);
    return result.errors;
  };
  EXPECT_THAT(
      refusal({"--drive", "robt1"}),
      HasSubstr("--drive: there is no robot 'robt1' in the cell; there are: robot1, robot2; did you mean "
                "'robot1'?"));
  EXPECT_THAT(refusal({"--no-store"}), HasSubstr("--no-store requires --drive"));
  edit("store = { ledger = \"ledger.db\" }", "store = { reference = \"corbaloc::127.0.0.1:1/Store\" }");
  EXPECT_THAT(refusal({"--drive", "robot1", "--no-store"}), HasSubstr("the cell's store runs elsewhere"));
  const RunResult other =
      run(program("corbot-coordinator", {"--robots", "robot1,robotx"}), 60, environment());
  EXPECT_EQ(other.code, 2);
  EXPECT_THAT(other.errors, HasSubstr("--robots: there is no robot 'robotx' in the cell"));
}

TEST_F(CellRun, APortInUseIsNamed) {
  const std::string script = fmt::format(
      "import socket,time\ns=socket.socket()\ns.setsockopt(socket.SOL_SOCKET,socket.SO_REUSEADDR,1)\n"
      "s.bind(('127.0.0.1',{}))\ns.listen()\nprint('listens',flush=True)\ntime.sleep(300)",
      ports_ + 1);
  Process holder({"/usr/bin/env", "python3", "-c", script});
  ASSERT_TRUE(holder.wait_line("listens", within(30)));
  const RunResult result = cell_run({});
  EXPECT_EQ(result.code, 5);
  EXPECT_THAT(result.errors, HasSubstr(fmt::format("{}", ports_ + 1)));
  EXPECT_THAT(result.errors, HasSubstr("--ports"));
}

TEST_F(CellRun, AWrongFileIsRefusedBeforeAnythingStarts) {
  edit("columns = 4", "columns = 0");
  const RunResult result = cell_run({});
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.errors, HasSubstr("place[2].columns (pallet2) = 0: must be a whole number from 1"));
  EXPECT_FALSE(fs::exists(directory_ / "state"));
}

TEST_F(CellRun, AWordThatIsNoPieceAndNoSlotIsNamed) {
  const auto refusal = [&](const std::vector<std::string>& words) {
    const RunResult result = run(command(words, "resolve"), 60, environment());
    EXPECT_EQ(result.code, 2);
    return result.errors;
  };
  EXPECT_THAT(refusal({"x", "--gone"}), HasSubstr("PIECE: 'x' is not a whole number from 1 to 2147483647"));
  EXPECT_THAT(refusal({"0", "--gone"}), HasSubstr("PIECE: '0' is not a whole number from 1 to"));
  EXPECT_THAT(refusal({"3", "pallet2", "1.5"}), HasSubstr("SLOT: '1.5' is not a whole number from 0 to"));
}

TEST_F(CellRun, ACheckNamesWhatIsOutOfReachAndWhoDoesNotReply) {
  if (on_orbit2()) GTEST_SKIP() << "a robot that the cell does not start has no `orb`";
  const auto check = [&] {
    return run({CORBOT_BIN_DIR "/corbot", "cell", "check", (directory_ / "cell.toml").string()}, 60,
               environment());
  };
  const RunResult shipped = check();
  EXPECT_EQ(shipped.code, 0) << shipped.errors;
  EXPECT_EQ(shipped.output, "robot1: all 27 points are reached\nrobot2: all 33 points are reached\n");
  edit("profile = \"arm.toml\"", "reference = \"corbaloc::127.0.0.1:1/robot1\"");
  const RunResult silent = check();
  EXPECT_EQ(silent.code, 3) << silent.errors;
  EXPECT_THAT(silent.output, HasSubstr("\nrobot2: all 33 points are reached\n"));
  edit("position_m = [0.48, 0, 0]", "position_m = [0.48, 0.08, 0]");
  const RunResult moved = check();
  EXPECT_EQ(moved.code, 1) << moved.errors;
  EXPECT_THAT(moved.output, testing::StartsWith("robot1: not checked: no servant at 127.0.0.1:1"));
  EXPECT_THAT(moved.output, testing::ContainsRegex("robot2: place.2. pallet2, slot 0, red: the motion above "
                                                   "the grasp to \\(.*\\) m in the robot's frame would be "
                                                   "refused: .* is too far"));
  EXPECT_THAT(moved.errors, HasSubstr("would be refused; nothing moved"));
  edit("kind = \"anthropomorphic\"", "kind = \"none\"", "arm.toml");
  const RunResult wrong = check();
  EXPECT_EQ(wrong.code, 2) << wrong.output;
  EXPECT_THAT(wrong.errors, HasSubstr("arm.toml"));
}

TEST_F(CellRun, ADirectoryForPicturesThatCannotBeMadeIsRefusedBeforeAnythingStarts) {
  const RunResult result = cell_run({"--pictures", (directory_ / "cell.toml" / "pictures").string()});
  EXPECT_EQ(result.code, 5);
  EXPECT_THAT(result.errors, HasSubstr("cell.toml/pictures cannot be made: Not a directory"));
  EXPECT_FALSE(fs::exists(directory_ / "state"));
}

TEST_F(CellRun, ARobotThatIsNotThereIsNamed) {
  if (on_orbit2()) GTEST_SKIP() << "a robot that the cell does not start has no `orb`";
  edit("profile = \"arm.toml\", position_m = [0, 0, 0]",
       fmt::format("reference = \"corbaloc::127.0.0.1:{}/nobody\", position_m = [0, 0, 0]", ports_ + 4));
  const RunResult result = cell_run({});
  EXPECT_EQ(result.code, 3);
  EXPECT_THAT(result.errors, HasSubstr("robot1 does not reply at corbaloc::127.0.0.1"));
}

}  // namespace
}  // namespace corbot::test
