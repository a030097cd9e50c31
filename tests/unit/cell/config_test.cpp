// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "cell/cell_config.h"
#include "support/paths.h"

namespace corbot::cell {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// A copy of the shipped cell in a directory of its own, whose files a test edits.
class CellFiles {
 public:
  CellFiles() {
    std::string path = (fs::temp_directory_path() / "corbot-cell-XXXXXX").string();
    if (::mkdtemp(path.data()) == nullptr) throw std::runtime_error(path);
    directory_ = path;
    for (const auto& entry : fs::directory_iterator(CORBOT_CELL)) fs::copy(entry.path(), directory_);
    fs::copy(directory_ / "camera.toml", directory_ / "turned.toml");
    edit("turned.toml", "[0.24, 0, 0.85]", "[2.24, 0, 0.85]");
  }
  CellFiles(const CellFiles&) = delete;
  CellFiles& operator=(const CellFiles&) = delete;
  ~CellFiles() { fs::remove_all(directory_); }

  /// Line of the edit, from 1.
  std::uint32_t edit(const std::string& file, const std::string& from, const std::string& to) {
    std::ifstream in(directory_ / file);
    std::string text{std::istreambuf_iterator<char>(in), {}};
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << file << " no longer holds " << from;
    text.replace(at, from.size(), to);
    std::ofstream(directory_ / file) << text;
    return static_cast<std::uint32_t>(1 +
                                      std::count(text.begin(), text.begin() + static_cast<long>(at), '\n'));
  }
  [[nodiscard]] CellConfig load(CellOverrides overrides = {}) const {
    if (overrides.state_directory.empty()) overrides.state_directory = "/tmp/cell-state";
    return load_cell(directory_ / "cell.toml", overrides);
  }
  [[nodiscard]] std::vector<ConfigFault> faults(const CellOverrides& overrides = {}) const {
    try {
      (void)load(overrides);
    } catch (const ConfigError& error) {
      return error.faults();
    }
    return {};
  }

 private:
  fs::path directory_;
};

TEST(CellConfigTest, TheShippedCellIsUnderstood) {
  const CellConfig cell = CellFiles().load();
  ASSERT_EQ(cell.robots.size(), 2U);
  EXPECT_EQ(cell.robot_uri(cell.robots[1]), "corbaloc::127.0.0.1:12824/demo-robot2");
  EXPECT_EQ(cell.store_uri(), "corbaloc::127.0.0.1:12820/Store");
  EXPECT_TRUE(cell.is_last(*cell.place("pallet2")));
  EXPECT_FALSE(cell.is_last(*cell.place("store1")));
  EXPECT_EQ(cell.place("nothing"), nullptr);
  ASSERT_TRUE(cell.scene);
  EXPECT_EQ(cell.scene->pieces, 12);
  // Slots count along x, then y, about the middle.
  const Place& pallet2 = *cell.place("pallet2");
  EXPECT_TRUE(pallet2.slot_position(0).isApprox(Eigen::Vector3d(0.395 - 0.0675, -0.239 - 0.042, 0), 1e-12));
  EXPECT_TRUE(pallet2.slot_position(5).isApprox(Eigen::Vector3d(0.395 - 0.0225, -0.239, 0), 1e-12));
  EXPECT_TRUE(pallet2.covers(pallet2.slot_position(11)));
  EXPECT_FALSE(pallet2.covers({0.395, 0, 0}));
}

TEST(CellConfigTest, TheCommandLineReplacesWhatTheFileSays) {
  CellOverrides overrides;
  overrides.name = "class3";
  overrides.ports = 20000;
  overrides.pieces = 4;
  overrides.seed = 9;
  const CellConfig cell = CellFiles().load(overrides);
  EXPECT_EQ(cell.robot_uri(cell.robots[0]), "corbaloc::127.0.0.1:20003/class3-robot1");
  EXPECT_EQ(cell.scene->pieces, 4);
  EXPECT_EQ(cell.scene->seed, 9U);
}

/// One edit of a file of the cell, and the fault that it must give: its key and a part of what is allowed.
struct Case {
  std::string name;
  std::string from;
  std::string to;
  std::string key;
  std::string allowed;
  std::string file{"cell.toml"};
};
void PrintTo(const Case& test, std::ostream* out) { *out << test.name; }

class CellRefused : public testing::TestWithParam<Case> {};

TEST_P(CellRefused, WithFileLineKeyValueAndWhatIsAllowed) {
  const Case& test = GetParam();
  CellFiles files;
  const std::uint32_t line = files.edit(test.file, test.from, test.to);
  const auto faults = files.faults();
  ASSERT_EQ(faults.size(), 1U) << (faults.empty() ? "accepted" : faults[0].text() + "\n" + faults[1].text());
  EXPECT_EQ(faults[0].key, test.key);
  EXPECT_THAT(faults[0].allowed, HasSubstr(test.allowed));
  EXPECT_THAT(faults[0].file, HasSubstr(test.file));
  EXPECT_EQ(faults[0].line, line) << faults[0].text();
}

const std::string kAnotherPlace = "  { position_m = [0.24, 1, 0], size_m = [0.05, 0.05], name = ";
const std::string kAnotherKind =
    "{ name = \"pink\", label_m = 0.016, diameter_m = 0.020, height_m = 0.045, grasp_m = 0.030, hue_deg = ";

const Case kCases[] = {
    {"cell_name", "name = \"demo\"", "name = \"a b\"", "cell.name", "1 to 32 ASCII letters"},
    {"port_not_a_number", "ports = 12820", "ports = \"x\"", "cell.ports", "a whole number from 1024"},
    {"ports_beyond", "ports = 12820", "ports = 65532", "cell.ports", "5 ports in a row"},
    {"unknown_key", "host = \"127.0.0.1\"", "hosts = \"127.0.0.1\"", "cell.hosts", "did you mean host"},
    {"same_names", "name = \"robot2\"", "name = \"robot1\"", "robot[1].name", "give each table its own name"},
    {"both", "size_m = [0.165, 0.110]", "size_m = [0.165, 0.110], rows = 2", "place[0].size_m",
     "either size_m"},
    {"neither", ", size_m = [0.165, 0.110]", "", "place[0].name", "either size_m"},
    {"pitch", "pitch_m = [0.045, 0.042]", "pitch_m = [0.045, 0.03]", "place[2].pitch_m[1]", "0.04 to 1 m"},
    {"row_kinds_count", "pitch_m = [0.045, 0.042]", "pitch_m = [0.045, 0.042], row_kinds = [\"red\"]",
     "place[2].row_kinds", "one for each of the 3 rows"},
    {"row_kinds_unknown", "pitch_m = [0.045, 0.042]",
     "pitch_m = [0.045, 0.042], row_kinds = [\"red\", \"red\", \"green\"]", "place[2].row_kinds",
     "green is none"},
    {"row_kinds_of_an_area", "size_m = [0.165, 0.110]", "size_m = [0.165, 0.110], row_kinds = [\"red\"]",
     "place[0].row_kinds", "unknown"},
    {"zone_missing", "from = \"store1\"", "from = \"pallet1\"", "robot[1].from", "shared = true"},
    {"from_unknown", "from = \"pallet1\"", "from = \"palet1\"", "robot[0].from", "pallet1, store1, pallet2"},
    {"from_is_to", "from = \"store1\"", "from = \"pallet2\"", "robot[1].to", "another place than from"},
    {"to_an_area", "from = \"pallet1\", to = \"store1\"", "from = \"store1\", to = \"pallet1\"",
     "robot[0].to", "a place with slots"},
    {"no_robot", "profile = \"arm.toml\", position_m = [0, 0, 0]", "position_m = [0, 0, 0]", "robot[0].name",
     "either profile"},
    {"no_profile", "profile = \"arm.toml\", position_m = [0, 0, 0]",
     "profile = \"no.toml\", position_m = [0, 0, 0]", "robot[0].profile", "no such file"},
    {"orb", "from = \"pallet1\"", "orb = \"tao\", from = \"pallet1\"", "robot[0].orb", "\"orbit2\""},
    {"transit", "from = \"pallet1\"", "transit = \"line\", from = \"pallet1\"", "robot[0].transit",
     "\"free\" or \"arc\""},
    {"wait_in_zone", "[0.153, 0.129, 0.09]", "[0.19, 0.05, 0.09]", "robot[0].wait_m", "0.05 m or more"},
    {"wait_over_a_place", "[0.153, 0.129, 0.09]", "[0.1, 0.22, 0.09]", "robot[0].wait_m",
     "not be over a place"},
    {"above", "wait_m = [0.153", "above_m = 0.05, wait_m = [0.153", "robot[0].above_m", "the tallest piece"},
    {"opening", "wait_m = [0.153", "opening_m = 0.02, wait_m = [0.153", "robot[0].opening_m", "widest piece"},
    {"speed", "wait_m = [0.153", "speed_percent = 101, wait_m = [0.153", "robot[0].speed_percent",
     "at most 100"},
    {"long_name", "name = \"robot1\"", "name = \"robot1robot1robot1robot1robot1r\"", "robot[0].name", "32"},
    {"hue", "hue_deg = [345, 15]", "hue_deg = [345, 361]", "kind[0].hue_deg[1]", "0 to 360"},
    {"no_width", "diameter_m = 0.020, ", "", "kind[0].name", "either diameter_m"},
    {"two_widths", "diameter_m = 0.020", "diameter_m = 0.020, side_m = 0.020", "kind[0].side_m",
     "either diameter_m"},
    {"square_label", "label_m = 0.016, diameter_m = 0.020", "label_m = 0.019, side_m = 0.018",
     "kind[0].label_m", "at most side_m"},
    {"side", "diameter_m = 0.020", "side_m = \"wide\"", "kind[0].side_m", "a number"},
    {"label", "label_m = 0.016", "label_m = 0.021", "kind[0].label_m", "at most diameter_m"},
    {"grasp", "grasp_m = 0.030", "grasp_m = 0.041", "kind[0].grasp_m", "0.005 m or more below height_m"},
    {"places_overlap", "position_m = [0.395, -0.239, 0]", "position_m = [0.1, 0.32, 0], yaw_deg = 10",
     "place[2].position_m", "lies over pallet1"},
    {"source", "source = \"scene\"", "source = \"/dev/video0\"", "camera.source", "\"scene\""},
    {"calibration", "calibration = \"camera.toml\"", "calibration = \"camera.tom\"", "camera.calibration",
     "no such file"},
    {"seed", "seed = 1", "seed = -1", "scene.seed", "0 to 4294967295"},
    {"timing", "attempts = 3", "attempts = 0", "timing.attempts", "1 to 100"},
    {"quaternion", "[0, 0.7071067811865476, ", "[0, 0.6, ", "quaternion_wxyz", "unit quaternion",
     "camera.toml"},
    {"fallen", "  { name = \"store1\"", kAnotherPlace + "\"fallen\" },\n  { name = \"store1\"",
     "place[1].name", "has another meaning"},
    {"touches", "  { name = \"store1\"", kAnotherPlace + "\"touches\" },\n  { name = \"store1\"",
     "place[1].name", "has another meaning"},
    {"held", "  { name = \"store1\"", kAnotherPlace + "\"held\" },\n  { name = \"store1\"", "place[1].name",
     "has another meaning"},
    {"elsewhere", "  { name = \"store1\"", kAnotherPlace + "\"elsewhere\" },\n  { name = \"store1\"",
     "place[1].name", "has another meaning"},
    {"overruns", "  { name = \"store1\"", kAnotherPlace + "\"overruns\" },\n  { name = \"store1\"",
     "place[1].name", "has another meaning"},
    {"nearest_mm", "  { name = \"store1\"", kAnotherPlace + "\"nearest_mm\" },\n  { name = \"store1\"",
     "place[1].name", "has another meaning"},
    {"hues_overlap", "]\n\nstore = ", kAnotherKind + "[10, 40] }]\n\nstore = ", "kind[1].hue_deg",
     "overlap those of red"},
    {"hues_overlap_at_0", "]\n\nstore = ", kAnotherKind + "[360, 360] }]\n\nstore = ", "kind[1].hue_deg",
     "overlap those of red"},
    {"no_scene_profile", "profile = \"arm.toml\", position_m = [0, 0, 0]",
     "reference = \"corbaloc::127.0.0.1:1/r\", scene_profile = \"no.toml\", position_m = [0, 0, 0]",
     "robot[0].scene_profile", "no such file"},
    {"scene_profile_of_an_arm_that_the_cell_starts", "profile = \"arm.toml\", position_m = [0, 0, 0]",
     "profile = \"arm.toml\", scene_profile = \"arm.toml\", position_m = [0, 0, 0]", "robot[0].scene_profile",
     "unknown"},
    {"robot_reference", "profile = \"arm.toml\", position_m = [0, 0, 0]",
     "reference = \"demo-robot1\", position_m = [0, 0, 0]", "robot[0].reference", "corbaloc:"},
    {"store_reference", "ledger = \"ledger.db\"", "reference = \"127.0.0.1:12820/Store\"", "store.reference",
     "corbaloc:"},
    {"camera_reference", "source = \"scene\", calibration = \"camera.toml\"", "reference = \"Camera\"",
     "camera.reference", "corbaloc:"},
    {"coordinator_reference", "timing = {", "coordinator = { reference = \"\" }\ntiming = {",
     "coordinator.reference", "corbaloc:"},
    {"ledger_in_another_directory", "ledger = \"ledger.db\"", "ledger = \"../ledger.db\"", "store.ledger",
     "plain file name"},
    {"ledger_somewhere", "ledger = \"ledger.db\"", "ledger = \"/tmp/ledger.db\"", "store.ledger",
     "plain file name"},
    {"ledger_no_file", "ledger = \"ledger.db\"", "ledger = \"..\"", "store.ledger", "plain file name"},
    {"size_not_whole", "[1280, 720]", "[1280.5, 720]", "size_px", "whole numbers", "camera.toml"},
    {"more_pieces_than_fit", "pieces = 12", "pieces = 13", "scene.pieces", "at most 12 fit on pallet1"},
    {"place_out_of_sight", "calibration = \"camera.toml\"", "calibration = \"turned.toml\"",
     "camera.calibration", "show the whole of each place: pallet1, store1, pallet2"},
    {"not_toml", "name = \"demo\"", "name = demo", "", "not TOML"},
};
INSTANTIATE_TEST_SUITE_P(All, CellRefused, testing::ValuesIn(kCases),
                         [](const auto& each) { return each.param.name; });

TEST(CellConfigTest, AFaultHasTheNameOfItsTable) {
  CellFiles files;
  files.edit("cell.toml", "size_m = [0.165, 0.110]", "size_m = [0.165, 11]");
  EXPECT_THAT(files.faults()[0].text(), HasSubstr(": place[0].size_m[1] (pallet1) = 11: must be"));
  files.edit("cell.toml", "size_m = [0.165, 11]", "size_m = [0.165, 0.110]");
  files.edit("cell.toml", "name = \"store1\"", "name = \"held\"");
  EXPECT_THAT(files.faults()[0].text(), HasSubstr(": place[1].name = \"held\": has another meaning"));
  files.edit("cell.toml", "name = \"held\"", "name = \"store 1\"");
  EXPECT_EQ(files.faults()[0].name, "") << "the name is no name";
}

TEST(CellConfigTest, ASquareKindHasASideAndItsDiagonalMustFitBetweenTheFingers) {
  CellFiles files;
  files.edit("cell.toml", "diameter_m = 0.020", "side_m = 0.018");
  EXPECT_THAT(files.faults()[0].allowed, HasSubstr("at most 8 fit on pallet1"));
  files.edit("cell.toml", "pieces = 12", "pieces = 4");
  const CellConfig cell = files.load();
  EXPECT_TRUE(cell.kinds[0].is_square);
  EXPECT_EQ(cell.kinds[0].width_m, 0.018);
  EXPECT_FALSE(CellFiles().load().kinds[0].is_square);
  for (const char* from : {"from = \"pallet1\"", "from = \"store1\""})
    files.edit("cell.toml", from, std::string("opening_m = 0.029, ") + from);
  const auto faults = files.faults();
  ASSERT_EQ(faults.size(), 2U);
  for (const std::size_t i : {0U, 1U}) {
    EXPECT_EQ(faults[i].key, "robot[" + std::to_string(i) + "].opening_m");
    EXPECT_THAT(faults[i].allowed,
                HasSubstr("at least 0.0294558 m, 0.004 m more than the widest piece's diameter, or a "
                          "square's diagonal"));
  }
}

TEST(CellConfigTest, SlotsLeaveRoomForAFingerBetweenPiecesOfAnyYaw) {
  CellFiles files;
  files.edit("cell.toml", "pieces = 12", "pieces = 1");
  files.edit("cell.toml", "diameter_m = 0.020", "side_m = 0.018");
  EXPECT_TRUE(files.faults().empty());
  files.edit("cell.toml", "side_m = 0.018", "side_m = 0.019");
  const auto faults = files.faults();
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].key, "place[2].pitch_m");
  EXPECT_THAT(faults[0].allowed,
              HasSubstr("at least 0.0428701 m, 0.016 m more than the widest piece's diameter, or a square's "
                        "diagonal"));
}

TEST(CellConfigTest, ARowTakesItsKindAndAKindWithoutARowIsRefused) {
  CellFiles files;
  const std::uint32_t line =
      files.edit("cell.toml", "]\n\nstore = ", kAnotherKind + "[290, 320] }]\n\nstore = ");
  files.edit("cell.toml", "0.042]", "0.042], row_kinds = [\"red\", \"pink\", \"red\"]");
  const CellConfig cell = files.load();
  const Place& pallet2 = *cell.place("pallet2");
  std::vector<int> slots;
  for (int slot = 0; slot < pallet2.slots->count(); ++slot) {
    if (pallet2.slot_takes(slot, "pink")) slots.push_back(slot);
    for (const char* kind : {"red", "pink"})
      EXPECT_EQ(pallet2.takes_at(pallet2.slot_position(slot) + Eigen::Vector3d(0.015, -0.015, 0), kind),
                pallet2.slot_takes(slot, kind))
          << slot;
  }
  EXPECT_THAT(slots, testing::ElementsAre(4, 5, 6, 7));
  EXPECT_TRUE(cell.place("store1")->takes("pink")) << "without row_kinds";
  EXPECT_FALSE(pallet2.takes("green"));

  files.edit("cell.toml", "\"pink\", \"red\"]", "\"red\", \"red\"]");
  const auto faults = files.faults();
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].key, "kind[1].name");
  EXPECT_EQ(faults[0].value, "\"pink\"");
  EXPECT_EQ(faults[0].line, line);
  EXPECT_THAT(faults[0].allowed, HasSubstr("no robot brings this kind from store1 on"));
}

TEST(CellConfigTest, AllFaultsAreReportedTogether) {
  CellFiles files;
  files.edit("cell.toml", "from = \"pallet1\"", "from = \"x\"");
  files.edit("cell.toml", "seed = 1", "seed = -1");
  files.edit("camera.toml", "0.85", "85");
  EXPECT_EQ(files.faults().size(), 3U);
}

TEST(CellConfigTest, ARobotsProfileIsNamedAsOne) {
  try {
    (void)load_cell(CORBOT_CELL "/arm.toml");
    ADD_FAILURE() << "accepted";
  } catch (const ConfigError& error) {
    ASSERT_EQ(error.faults().size(), 1U) << error.what();
    EXPECT_THAT(error.what(), HasSubstr("a robot's profile, not a cell file"));
  }
}

/// 0.05 m and 0.01 m are more than 0.06 m in binary.
TEST(CellConfigTest, TheLeastHeightOfApproachIsTakenAsItIsWritten) {
  CellFiles files;
  files.edit("cell.toml", "height_m = 0.045", "height_m = 0.050");
  files.edit("cell.toml", "wait_m = [0.153", "above_m = 0.06, wait_m = [0.153");
  EXPECT_TRUE(files.faults().empty());
}

TEST(CellConfigTest, APathThatASocketCannotHaveIsRefused) {
  CellOverrides overrides;
  overrides.state_directory = "/tmp/" + std::string(100, 'd');
  const auto faults = CellFiles().faults(overrides);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].key, "--state-dir");
  EXPECT_THAT(faults[0].allowed, HasSubstr("107"));
  // The picture's socket counts as well where the robots' names are shorter.
  CellFiles files;
  files.edit("cell.toml", "\"robot1\"", "\"a\"");
  files.edit("cell.toml", "\"robot2\"", "\"b\"");
  overrides.state_directory = "/tmp/" + std::string(107 - 5 - 13, 'd');
  EXPECT_TRUE(files.faults(overrides).empty());
  overrides.state_directory += "d";
  const auto picture = files.faults(overrides);
  ASSERT_EQ(picture.size(), 1U);
  EXPECT_THAT(picture[0].value, HasSubstr("/picture.sock"));
}

TEST(CellConfigTest, AStateDirectoryThatTomlCannotQuoteIsRefused) {
  for (const char* name : {"a\"b", "a\\b", "a$b", "a\nb", "a\x7f"}) {
    CellOverrides overrides;
    overrides.state_directory = std::filesystem::path("/tmp/cell-state") / name;
    const auto faults = CellFiles().faults(overrides);
    ASSERT_EQ(faults.size(), 1U) << name;
    EXPECT_EQ(faults[0].key, "--state-dir");
    EXPECT_EQ(faults[0].value.find('\n'), std::string::npos) << "it is printed";
  }
}

TEST(CellConfigTest, AFaultOfAnOptionShowsTheOption) {
  CellOverrides overrides;
  overrides.name = "a b";
  const auto name = CellFiles().faults(overrides);
  ASSERT_EQ(name.size(), 1U);
  EXPECT_EQ(name[0].key, "--name");
  EXPECT_EQ(name[0].value, "\"a b\"");
  EXPECT_EQ(name[0].line, 0U);
  overrides = {};
  overrides.ports = 65535;
  const auto ports = CellFiles().faults(overrides);
  ASSERT_EQ(ports.size(), 1U);
  EXPECT_EQ(ports[0].key, "--ports");
  EXPECT_EQ(ports[0].line, 0U);
  overrides = {};
  overrides.pieces = 13;
  const auto pieces = CellFiles().faults(overrides);
  ASSERT_EQ(pieces.size(), 1U);
  EXPECT_EQ(pieces[0].key, "--pieces");
  EXPECT_EQ(pieces[0].value, "13");
  EXPECT_EQ(pieces[0].line, 0U);
  EXPECT_THAT(pieces[0].allowed, HasSubstr("with 0.036 m between their axes"));
}

TEST(CellConfigTest, TheLensHasThePictureOfTheCalibration) {
  CellFiles files;
  files.edit("lens.toml", "[1280, 720]", "[1280, 800]");
  const auto faults = files.faults();
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].key, "scene.lens");
  EXPECT_THAT(faults[0].allowed, HasSubstr("1280 x 800 pixels, the calibration has 1280 x 720"));
}

}  // namespace
}  // namespace corbot::cell
